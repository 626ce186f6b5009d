//! Files that are replaced in one step.
//!
//! A file is written under a temporary name in its own folder and renamed into its place, so that a
//! reader, a crash or Ctrl-C finds the old file or the new one, whole. Ctrl-C must call
//! [`abandon_and_exit`] for that. The functions whose names end in `_synced` also wait until the
//! content and the name are on the disk, so that the file outlasts a power cut.

use std::fmt::Display;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::Builder;

use crate::error::{Error, Result};

/// Paths of the temporary files and folders that exist. They are made, renamed and removed while
/// its lock is held.
static IN_PROGRESS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Locks the list of temporaries; [`abandon_and_exit`] waits until the lock is free.
pub(super) fn in_progress() -> MutexGuard<'static, Vec<PathBuf>> {
    // A panic elsewhere cannot leave a list of paths half changed.
    IN_PROGRESS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes every temporary and ends the process. Until then no thread can begin or finish another
/// file. Exit handlers are not run: other threads may still use the driver, whose handlers would
/// free what they use.
pub fn abandon_and_exit(code: u8) -> ! {
    let paths = in_progress();
    paths.iter().for_each(|path| remove(path));
    std::mem::forget(paths);
    unsafe extern "C" {
        fn _exit(code: std::ffi::c_int) -> !;
    }
    // SAFETY: ends the process; nothing after it runs.
    unsafe { _exit(i32::from(code)) }
}

/// Removes a file, or a folder with all that it holds. One that cannot be removed stays.
fn remove(path: &Path) {
    let is_folder = fs::symlink_metadata(path).is_ok_and(|about| about.is_dir());
    let _ = if is_folder { fs::remove_dir_all(path) } else { fs::remove_file(path) };
}

/// Replaces the file at `path` with what `write` writes. When `write` fails or panics, the old file
/// stays and nothing else is left behind.
///
/// # Errors
/// When the place cannot hold a file, `write` fails, or the rename fails.
pub fn write_atomic<E: Display>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> std::result::Result<(), E>,
) -> Result<()> {
    let (temporary, file) = beside(path)?;
    let mut writer = BufWriter::new(file);
    write(&mut writer).map_err(|e| Error::io(path, e))?;
    writer.flush().map_err(|e| Error::io(path, e))?;
    drop(writer);
    let _lock = in_progress();
    fs::rename(&temporary.path, path).map_err(|e| Error::io(path, e))
}

/// Checks that [`write_atomic`] could write `path`, before there is anything to write.
///
/// # Errors
/// When the folder is missing or not writable, or `path` is not a regular file.
pub fn check_place(path: &Path) -> Result<()> {
    beside(path).map(drop)
}

/// Replaces the file at `path` with `bytes` and waits until the disk has them.
///
/// # Errors
/// When the file cannot be written; [`Error::Transient`] when another try may succeed.
pub fn write_synced(path: &Path, bytes: &[u8]) -> Result<()> {
    put_synced(path, bytes, |temporary| fs::rename(temporary, path))
}

/// Writes `bytes` to `path`, where no file may be yet, and waits until the disk has them.
///
/// # Errors
/// As [`write_synced`], and when the file exists.
pub fn write_new_synced(path: &Path, bytes: &[u8]) -> Result<()> {
    // A rename would replace a file that came meanwhile; a second name for a file cannot.
    put_synced(path, bytes, |temporary| fs::hard_link(temporary, path))
}

fn put_synced(path: &Path, bytes: &[u8], put: impl FnOnce(&Path) -> io::Result<()>) -> Result<()> {
    let written = || {
        let (temporary, mut file) = Temporary::file(path)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        let _lock = in_progress();
        put(&temporary.path)
    };
    written().map_err(|cause| Error::of_io(path, &cause))?;
    sync(folder_of(path))
}

/// Appends a line and waits until the disk has it. One call writes the line, so that lines of
/// several processes on one machine do not mix.
///
/// # Errors
/// As [`write_synced`].
pub fn append_synced(path: &Path, line: &str) -> Result<()> {
    let append = |mut file: File| {
        file.write_all(format!("{line}\n").as_bytes()).and_then(|()| file.sync_data())
    };
    if fs::metadata(path).is_ok_and(|about| !about.is_file()) {
        // Opening a pipe waits for its reader.
        return Err(Error::io(path, "exists and is not a regular file"));
    }
    let file = OpenOptions::new().create(true).append(true).open(path);
    file.and_then(append).map_err(|cause| Error::of_io(path, &cause))
}

/// Waits until the disk has a file's content or the names in a folder.
///
/// # Errors
/// As [`write_synced`].
pub fn sync(path: &Path) -> Result<()> {
    // Windows has no such wait for a folder, and flushes a file only if it is open for writing.
    if cfg!(windows) && path.is_dir() {
        return Ok(());
    }
    let file = OpenOptions::new().read(true).write(cfg!(windows)).open(path);
    let synced = file.and_then(|file| file.sync_all());
    synced.map_err(|cause| Error::of_io(path, &cause))
}

/// Lets every user run the file at `path`. Windows has no such permission.
///
/// # Errors
/// As [`write_synced`].
pub fn make_executable(path: &Path) -> Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        fs::set_permissions(path, fs::Permissions::from_mode(0o755))
            .map_err(|cause| Error::of_io(path, &cause))?;
    }
    #[cfg(not(unix))]
    let _ = path;
    Ok(())
}

/// Makes a folder and those above it.
///
/// # Errors
/// As [`write_synced`].
pub fn make_folder(path: &Path) -> Result<()> {
    fs::create_dir_all(path).map_err(|cause| Error::of_io(path, &cause))
}

/// The folder that `path` lies in.
pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."))
}

/// Checks that the folder exists that `path` lies in.
///
/// # Errors
/// When it does not.
pub fn check_folder_of(path: &Path) -> Result<()> {
    let folder = folder_of(path);
    if folder.is_dir() {
        return Ok(());
    }
    let what = format!(
        "the folder {} does not exist; make it first, or choose another place",
        folder.display()
    );
    Err(Error::io(path, what))
}

fn beside(path: &Path) -> Result<(Temporary, File)> {
    if path.file_name().is_none() {
        return Err(Error::io(path, "expected a file name"));
    }
    check_folder_of(path)?;
    // Renaming over a device such as /dev/null would replace it.
    if fs::metadata(path).is_ok_and(|about| !about.is_file()) {
        return Err(Error::io(path, "exists and is not a regular file"));
    }
    Temporary::file(path).map_err(|e| Error::io(path, format!("cannot be written: {e}")))
}

/// A temporary file or folder. Dropping it, or [`abandon_and_exit`], removes what its path names
/// then: after a rename, nothing.
#[derive(Debug)]
pub struct Temporary {
    pub(super) path: PathBuf,
}

/// Makes an empty folder for intermediate files in the system's folder for such.
///
/// # Errors
/// When it cannot be made.
pub fn temporary_folder(name: &str) -> Result<Temporary> {
    let parent = std::env::temp_dir();
    Temporary::folder(&parent, name).map_err(|cause| Error::io(&parent, cause))
}

impl Temporary {
    /// Makes an empty file beside `path`, with a hidden name that no other process has.
    fn file(path: &Path) -> io::Result<(Temporary, File)> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let prefix = format!(".{name}.");
        let mut builder = Builder::new();
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // As any other new file; `tempfile` alone would keep it from other users.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        builder.prefix(&prefix).suffix(".tmp");
        Temporary::register(|| Ok(builder.tempfile_in(folder_of(path))?.keep()?))
            .map(|(file, temporary)| (temporary, file))
    }

    /// Makes an empty folder in `parent`, which is to become the folder `name`. Its name is not
    /// hidden, because a process that is killed may leave results in it that it has just replaced.
    pub(super) fn folder(parent: &Path, name: &str) -> io::Result<Temporary> {
        let prefix = format!("{name}.");
        let mut builder = Builder::new();
        builder.prefix(&prefix).suffix(".nimbus.tmp");
        Temporary::register(|| Ok(((), builder.tempdir_in(parent)?.keep())))
            .map(|((), temporary)| temporary)
    }

    /// Returns the path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn register<T>(make: impl FnOnce() -> io::Result<(T, PathBuf)>) -> io::Result<(T, Temporary)> {
        let mut paths = in_progress();
        let (made, path) = make()?;
        paths.push(path.clone());
        Ok((made, Temporary { path }))
    }

    /// Takes over a file that exists already, to be removed with the temporaries. `paths` is the
    /// locked list of [`in_progress`].
    pub(super) fn registered(path: PathBuf, paths: &mut Vec<PathBuf>) -> Temporary {
        paths.push(path.clone());
        Temporary { path }
    }

    /// Keeps what lies at the path now. `paths` is the locked list of [`in_progress`].
    pub(super) fn keep(self, paths: &mut Vec<PathBuf>) {
        paths.retain(|path| *path != self.path);
        std::mem::forget(self);
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let mut paths = in_progress();
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
        assert!(refuse(&missing.join("a.txt")).ends_with(&format!(
            "the folder {} does not exist; make it first, or choose another place",
            missing.display()
        )));
        assert!(refuse(dir.path()).ends_with("exists and is not a regular file"));
        assert!(refuse(Path::new("/")).ends_with("expected a file name"));
        assert_eq!(names(dir.path()).len(), 0);
    }

    #[test]
    fn synced_files_replace_or_refuse_the_file_that_is_there() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.json");
        write_new_synced(&path, b"first").unwrap();
        assert_eq!(write_new_synced(&path, b"second").unwrap_err().exit_code(), 2);
        assert_eq!(fs::read(&path).unwrap(), b"first");
        write_synced(&path, b"third").unwrap();
        append_synced(&path, " line").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"third line\n");
        assert_eq!(names(dir.path()), ["a.json"]);
        assert!(write_synced(&dir.path().join("gone/a.json"), b"").is_err());
    }
}
