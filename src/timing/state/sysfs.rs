//! Short files of Linux that hold a number or a word.

use std::fs;
use std::path::{Path, PathBuf};

/// Returns the text of a file without its end of line; None if it cannot be read now, as happens
/// to sensors of a device that sleeps.
pub fn text(path: &Path) -> Option<String> {
    let text = fs::read_to_string(path).ok()?;
    Some(text.trim().to_owned()).filter(|text| !text.is_empty())
}

/// Returns the number in a file.
pub fn number(path: &Path) -> Option<f64> {
    text(path)?.parse().ok().filter(|number: &f64| number.is_finite())
}

/// Returns the whole number in a file.
pub fn count(path: &Path) -> Option<u64> {
    text(path)?.parse().ok()
}

/// Returns the entries of a folder whose names begin with `prefix`, sorted by name; none if there
/// is no such folder.
pub fn entries(folder: &Path, prefix: &str) -> Vec<PathBuf> {
    let is_one = |path: &PathBuf| {
        path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(prefix))
    };
    let all = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut found: Vec<PathBuf> = all.filter(is_one).collect();
    found.sort();
    found
}

/// Returns the folder of a device's sensors whose file `name` holds `driver`. A card can have
/// several, of its parts.
pub fn sensors(device: &Path, driver: &str) -> Option<PathBuf> {
    let all = entries(&device.join("hwmon"), "hwmon").into_iter();
    all.into_iter().find(|folder| text(&folder.join("name")).as_deref() == Some(driver))
}
