//! Names of files that are not there, and the names that were probably meant.

use std::fs;
use std::path::Path;

use super::atomic::folder_of;
use super::document::suggest::{nearest, shown};

/// Message about a file that is not there.
pub const MISSING: &str = "no such file";
/// Most names of a folder that are compared.
const MOST_NAMES: usize = 4096;

/// Returns [`MISSING`], with the nearest name of the same kind in the folder, if there is one.
pub fn missing(path: &Path) -> String {
    match near(path) {
        Some(name) => format!("{MISSING}; did you mean `{}`?", shown(&name)),
        None => MISSING.to_owned(),
    }
}

/// Returns the name of a file in the folder of `path` with the same stem and the nearest end, or
/// else with the same end and the nearest stem.
fn near(path: &Path) -> Option<String> {
    let stem_and_end = |path: &Path| {
        let end = path.extension().unwrap_or_default().to_str()?.to_lowercase();
        Some((path.file_stem()?.to_str()?.to_owned(), end))
    };
    let (stem, end) = stem_and_end(path)?;
    let entries = fs::read_dir(folder_of(path)).ok()?.take(MOST_NAMES).flatten();
    let mut names: Vec<String> = entries
        .filter(|entry| entry.path().is_file())
        .filter_map(|entry| entry.file_name().into_string().ok())
        .collect();
    names.sort();
    let of = |name: &String| stem_and_end(Path::new(name));
    let same_stem = names.iter().filter_map(|name| Some((of(name)?, name)));
    let same_stem = same_stem.filter(|((of, _), _)| *of == stem);
    // A name without an end is most likely that of a scene.
    let meant_end = if end.is_empty() { "toml" } else { &end };
    let distance = |end: &str| strsim::osa_distance(meant_end, end);
    if let Some((_, same)) = same_stem.min_by_key(|((_, end), _)| distance(end)) {
        return Some(same.clone());
    }
    let alike: Vec<(String, &String)> = names
        .iter()
        .filter_map(|name| of(name).filter(|(_, of_end)| *of_end == end).map(|(of, _)| (of, name)))
        .collect();
    let stems: Vec<&str> = alike.iter().map(|(stem, _)| stem.as_str()).collect();
    let found = nearest(&stem, &stems)?;
    alike.iter().find(|(stem, _)| stem == found).map(|(_, name)| (*name).clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_near_name_of_the_same_kind_is_found() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["hello.toml", "hello.dat", "hell.csv", "static.toml"] {
            fs::write(dir.path().join(name), "").unwrap();
        }
        for (typed, found) in [
            ("helo.toml", Some("hello.toml")),
            ("hello.tml", Some("hello.toml")),
            ("hello", Some("hello.toml")),
            ("hell", Some("hell.csv")),
            ("statik.toml", Some("static.toml")),
            ("statik.csv", None),
            ("other.toml", None),
        ] {
            assert_eq!(near(&dir.path().join(typed)).as_deref(), found, "{typed}");
        }
        assert_eq!(missing(Path::new("/nowhere/of/nimbus.nc")), MISSING);
    }
}
