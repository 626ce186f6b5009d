//! Results are written beside their place and moved into it, so that a reader, a crash or Ctrl-C
//! meets either the old file or the new one whole; [`abandon`] is what Ctrl-C has to call for that.

use std::fmt::Display;
use std::fs::{self, File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::error::{Error, Result};

/// The temporaries that exist. Files are made, renamed and removed under its lock.
static IN_PROGRESS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

pub(super) fn in_progress() -> MutexGuard<'static, Vec<PathBuf>> {
    // A list of paths is whole at every moment, so a panic beside it leaves nothing to mistrust.
    IN_PROGRESS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes what is half written, and lets no thread begin or finish a file any more: the process is
/// to end at once.
pub fn abandon() {
    let paths = in_progress();
    paths.iter().for_each(|path| remove(path));
    std::mem::forget(paths);
}

/// A file, or a folder and all in it. What cannot be removed stays: nobody is left to be told.
fn remove(path: &Path) {
    let is_folder = fs::symlink_metadata(path).is_ok_and(|about| about.is_dir());
    let _ = if is_folder { fs::remove_dir_all(path) } else { fs::remove_file(path) };
}

/// Writes `path` with `write`. When that fails or panics the old file stays, and nothing else is
/// left behind.
pub fn write_atomic<E: Display>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> std::result::Result<(), E>,
) -> Result<()> {
    let (temporary, file) = Temporary::beside(path)?;
    let mut writer = BufWriter::new(file);
    write(&mut writer).map_err(|e| Error::io(path, e))?;
    writer.flush().map_err(|e| Error::io(path, e))?;
    drop(writer);
    let _lock = in_progress();
    fs::rename(&temporary.path, path).map_err(|e| Error::io(path, e))
}

/// An error where `path` could not be written, known before there is anything to write.
pub fn check_place(path: &Path) -> Result<()> {
    Temporary::beside(path).map(drop)
}

/// Removes its file or folder when dropped; after the rename there is none.
pub(super) struct Temporary {
    pub path: PathBuf,
}

impl Temporary {
    fn beside(path: &Path) -> Result<(Temporary, File)> {
        let Some(name) = path.file_name() else {
            return Err(Error::io(path, "expected a file name"));
        };
        let folder = match path.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        if !folder.is_dir() {
            return Err(Error::io(path, format!("the folder {} does not exist", folder.display())));
        }
        // Renaming over a device such as /dev/null would replace it.
        if fs::metadata(path).is_ok_and(|about| !about.is_file()) {
            return Err(Error::io(path, "exists and is not a regular file"));
        }
        let name = format!(".{}.{}.tmp", name.to_string_lossy(), unique());
        let create = |path: &Path| OpenOptions::new().write(true).create_new(true).open(path);
        Temporary::create(folder.join(name), create)
            .map_err(|e| Error::io(path, format!("cannot be written: {e}")))
    }

    /// An empty folder in `parent` for what is to become, or stand in, the folder `name`. Unlike a
    /// file's its name is not hidden: what a killed process leaves may hold results that were just
    /// replaced.
    pub(super) fn folder(parent: &Path, name: &str) -> std::io::Result<Temporary> {
        let path = parent.join(format!("{name}.{}.nimbus.tmp", unique()));
        Temporary::create(path, |path| fs::create_dir(path)).map(|(temporary, ())| temporary)
    }

    fn create<T>(
        path: PathBuf,
        create: impl FnOnce(&Path) -> std::io::Result<T>,
    ) -> std::io::Result<(Temporary, T)> {
        let mut paths = in_progress();
        // Nothing is removed that was there before.
        let made = create(&path)?;
        paths.push(path.clone());
        Ok((Temporary { path }, made))
    }

    /// Leaves alone what lies there now; `paths` is the list, locked.
    pub(super) fn let_go(self, paths: &mut Vec<PathBuf>) {
        paths.retain(|path| *path != self.path);
        std::mem::forget(self);
    }
}

/// Two threads of one process may write files of one name.
fn unique() -> String {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    format!("{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed))
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let mut paths = in_progress();
        // Gone already when all went well; otherwise the error that led here is the one to report.
        remove(&self.path);
        paths.retain(|path| *path != self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect()
    }

    #[test]
    fn a_failure_leaves_the_old_file_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        write_atomic(&path, |w| w.write_all(b"old")).unwrap();
        let error = write_atomic(&path, |w| {
            w.write_all(b"half").and(Err(std::io::Error::other("no more")))
        })
        .unwrap_err();
        assert_eq!(error, Error::io(&path, "no more"));
        let panic =
            std::panic::catch_unwind(|| write_atomic::<String>(&path, |_| panic!("midway")));
        assert!(panic.is_err());
        assert_eq!(
            (fs::read(&path).unwrap(), names(dir.path())),
            (b"old".to_vec(), vec!["a.txt".to_owned()])
        );
        write_atomic(&path, |w| w.write_all(b"new")).unwrap();
        assert_eq!(
            (fs::read(&path).unwrap(), names(dir.path())),
            (b"new".to_vec(), vec!["a.txt".to_owned()])
        );
    }

    #[test]
    fn places_that_cannot_hold_a_file_are_refused_before_writing() {
        let dir = tempfile::tempdir().unwrap();
        let refuse = |path: &Path| {
            write_atomic::<String>(path, |_| panic!("must not be called")).unwrap_err().to_string()
        };
        let missing = dir.path().join("gone");
        assert!(
            refuse(&missing.join("a.txt"))
                .ends_with(&format!("the folder {} does not exist", missing.display()))
        );
        assert!(refuse(dir.path()).ends_with("exists and is not a regular file"));
        assert!(refuse(Path::new("/")).ends_with("expected a file name"));
        assert_eq!(names(dir.path()).len(), 0);
    }
}
