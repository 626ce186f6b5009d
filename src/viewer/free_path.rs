//! Files that the windows save under names of their own, without replacing any file.

use std::fs::{self, File};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Number of names that are tried, so that the search ends: more files than a user saves by hand.
const MAX_NAMES: u32 = 100_000;

/// Writes a new file under the first of `name(1)`, `name(2)`, … that no file has. `write` gets the
/// path of an empty file and replaces it. Returns the path.
///
/// # Errors
/// No file can be made under these names, or `write` fails; then the empty file is removed.
pub fn write_free(
    name: impl Fn(u32) -> PathBuf,
    write: impl FnOnce(&Path) -> Result<()>,
) -> Result<PathBuf> {
    let mut claimed = claim(name)?;
    write(&claimed.0)?;
    Ok(std::mem::take(&mut claimed.0))
}

/// An empty file that holds its name until the content is there.
struct Claimed(PathBuf);

impl Drop for Claimed {
    fn drop(&mut self) {
        // A write may fail after the content is in place; that content stays.
        if fs::symlink_metadata(&self.0).is_ok_and(|about| about.is_file() && about.len() == 0) {
            let _ = fs::remove_file(&self.0);
        }
    }
}

/// Makes the empty file. Only one of several processes that claim the same name gets it, on file
/// systems without links, too.
fn claim(name: impl Fn(u32) -> PathBuf) -> Result<Claimed> {
    for n in 1..=MAX_NAMES {
        let path = name(n);
        match File::create_new(&path) {
            Ok(_) => return Ok(Claimed(path)),
            Err(cause) if cause.kind() == ErrorKind::AlreadyExists => {}
            Err(cause) => return Err(Error::of_io(&path, &cause)),
        }
    }
    let last = name(MAX_NAMES);
    let what = format!("all names up to {} are taken; move the files elsewhere", last.display());
    Err(Error::io(&name(1), what))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::atomic::write_synced;

    #[test]
    fn a_failed_write_leaves_no_file_and_a_written_one_stays() {
        let dir = tempfile::tempdir().unwrap();
        let name = |n: u32| dir.path().join(format!("{n}.txt"));
        fs::write(name(1), "mine").unwrap();
        let refused = || Error::usage("no content");
        assert_eq!(write_free(name, |_| Err(refused())).unwrap_err(), refused());
        let panic = std::panic::catch_unwind(|| write_free(name, |_| panic!("on purpose")));
        assert!(panic.is_err() && !name(2).exists());
        // The content was complete before the failure.
        let late = |path: &Path| write_synced(path, b"late").and(Err(refused()));
        assert!(write_free(name, late).is_err());
        assert_eq!(write_free(name, |path| write_synced(path, b"")).unwrap(), name(3));
        let all = [1, 2, 3].map(|n| fs::read_to_string(name(n)).unwrap());
        assert_eq!(all, ["mine", "late", ""]);
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 3);
        let gone = dir.path().join("gone");
        let error = write_free(|n| gone.join(n.to_string()), |_| Ok(())).unwrap_err();
        assert!(error.to_string().contains("gone/1"), "{error}");
    }
}
