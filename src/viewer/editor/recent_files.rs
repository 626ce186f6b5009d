//! The list of recently opened box files: JSON in the user's configuration folder.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::io::atomic::write_atomic;
use crate::io::text_file::{RECORD_LIMIT, read_result};

/// Largest number of files in the list: few enough to read at a glance.
pub const MAX_FILES: usize = 10;

/// Paths of recently opened files, newest first, each once.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RecentFiles {
    paths: Vec<PathBuf>,
}

/// Returns the path of the list: `$XDG_CONFIG_HOME/nimbus/recent.json`, else
/// `~/.config/nimbus/recent.json`; on Windows `%APPDATA%\nimbus\recent.json`.
pub fn default_path() -> Option<PathBuf> {
    place(&|name| std::env::var_os(name))
}

fn place(variable: &dyn Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    // The XDG specification ignores relative paths.
    let folder = |name: &str| variable(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let base = folder("XDG_CONFIG_HOME")
        .or_else(|| folder("APPDATA"))
        .or_else(|| folder("HOME").map(|home| home.join(".config")))?;
    Some(base.join("nimbus").join("recent.json"))
}

impl RecentFiles {
    /// Reads the list at `place` and drops files that no longer exist. The list is empty where the
    /// file is missing or not valid.
    pub fn load(place: &Path) -> RecentFiles {
        let text = read_result(place, RECORD_LIMIT).unwrap_or_default();
        let names: Vec<String> = serde_json::from_str(&text).unwrap_or_default();
        let mut paths: Vec<PathBuf> = Vec::new();
        for path in names.into_iter().map(PathBuf::from) {
            if paths.len() < MAX_FILES && !paths.contains(&path) && path.is_file() {
                paths.push(path);
            }
        }
        RecentFiles { paths }
    }

    /// Returns the paths, newest first.
    pub fn paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// Puts `path` first, as an absolute path.
    pub fn push(&mut self, path: &Path) {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        self.paths.retain(|other| *other != path);
        self.paths.insert(0, path);
        self.paths.truncate(MAX_FILES);
    }

    /// Writes the list to `place`, without paths that are not Unicode.
    ///
    /// # Errors
    /// The folder cannot be created, or the file cannot be written.
    pub fn save(&self, place: &Path) -> Result<()> {
        let names: Vec<&str> = self.paths.iter().filter_map(|path| path.to_str()).collect();
        if let Some(folder) = place.parent() {
            std::fs::create_dir_all(folder).map_err(|cause| Error::io(folder, cause))?;
        }
        write_atomic(place, |file| serde_json::to_writer_pretty(file, &names))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_file_is_first_and_ten_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let files: Vec<PathBuf> = (0..12).map(|i| folder.path().join(format!("{i}.dat"))).collect();
        files.iter().for_each(|file| std::fs::write(file, "0\n0\n").unwrap());
        let mut recent = RecentFiles::default();
        files.iter().for_each(|file| recent.push(file));
        recent.push(&files[5]);
        let expected: Vec<PathBuf> =
            [5, 11, 10, 9, 8, 7, 6, 4, 3, 2].map(|i| files[i].clone()).to_vec();
        assert_eq!(recent.paths(), expected);
        let place = folder.path().join("new").join("recent.json");
        recent.save(&place).unwrap();
        assert_eq!(RecentFiles::load(&place), recent);
        std::fs::remove_file(&files[10]).unwrap();
        let left: Vec<PathBuf> = expected.into_iter().filter(|path| *path != files[10]).collect();
        assert_eq!(RecentFiles::load(&place).paths(), left);
    }

    #[test]
    fn an_invalid_list_is_empty() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("recent.json");
        assert_eq!(RecentFiles::load(&place), RecentFiles::default());
        for text in ["", "{", "[1, 2]", "{\"a\": 1}", "\0\u{fffd}", "[\"\", \".\", \"/\"]"] {
            std::fs::write(&place, text).unwrap();
            assert_eq!(RecentFiles::load(&place), RecentFiles::default(), "{text}");
        }
        std::fs::write(&place, [0xff, 0xfe]).unwrap();
        assert_eq!(RecentFiles::load(&place), RecentFiles::default());
        // A list written by hand may be long, and name a file twice.
        let own = place.display();
        std::fs::write(&place, format!("[\"{own}\", \"{own}\"]")).unwrap();
        assert_eq!(RecentFiles::load(&place).paths().len(), 1);
    }

    #[test]
    #[cfg(unix)]
    fn the_list_is_in_the_configuration_folder() {
        let of = |set: &[(&str, &str)]| {
            place(&|name| {
                set.iter().find(|(n, _)| *n == name).map(|(_, value)| OsString::from(value))
            })
        };
        let at = |path: &str| Some(PathBuf::from(path));
        assert_eq!(of(&[("HOME", "/h")]), at("/h/.config/nimbus/recent.json"));
        assert_eq!(of(&[("HOME", "/h"), ("XDG_CONFIG_HOME", "/x")]), at("/x/nimbus/recent.json"));
        assert_eq!(
            of(&[("HOME", "/h"), ("XDG_CONFIG_HOME", "x")]),
            at("/h/.config/nimbus/recent.json")
        );
        assert_eq!(of(&[]), None);
    }
}
