//! Places that one run of nimbus writes to at a time.
//!
//! A run locks the file `.NAME.claim` beside the place that it is going to write, from before its
//! work until its results are there. The system releases the lock when the process ends, however it
//! ends, so a claim that a killed run left behind keeps nobody out. A lock holds on one machine and
//! on file servers that share locks (NFS does since version 4). A file system without locks takes
//! no claims.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::atomic::{self, Temporary};
use super::process_info::{command_line, host_name};
use crate::error::{Error, Result};

/// End of the name of every claim.
const SUFFIX: &str = ".claim";
/// A time far longer than [`refuse_taken`] looks at a claim.
const LOOK: Duration = Duration::from_millis(20);
/// Most characters of a claim that a message shows.
const N_SHOWN: usize = 300;
/// Most bytes that are read of a claim: the shown characters, of at most 4 bytes each.
const OWNER_BYTES: u64 = 4 * N_SHOWN as u64;

/// A place that this run alone may write to, until the claim is dropped.
#[derive(Debug)]
pub struct Claim {
    /// The locked file. It is removed before it is closed, so that no other run locks it between.
    _temporary: Temporary,
    _file: File,
}

impl Claim {
    /// Claims a file or folder that need not exist yet. Its parent folder must exist. Returns none
    /// where the file system has no locks.
    ///
    /// # Errors
    /// [`Error::Transient`] when another run has claimed the place, and [`Error::Io`] when nothing
    /// can be written there.
    pub fn take(place: &Path) -> Result<Option<Claim>> {
        let failed = |cause: io::Error| Error::io(place, format!("cannot be written: {cause}"));
        let path = path_of(place).map_err(failed)?;
        loop {
            // Made and registered at once, so that Ctrl-C between does not leave it behind.
            let mut registered = atomic::in_progress();
            let (mut file, path) = match open(&path) {
                // The folder may be writable though its parent is not.
                Err(_) if place.is_dir() => {
                    let inside = place.join(format!(".nimbus{SUFFIX}"));
                    (open(&inside).map_err(failed)?, inside)
                }
                opened => (opened.map_err(failed)?, path.clone()),
            };
            let mut locked = file.try_lock();
            if matches!(locked, Err(TryLockError::WouldBlock)) {
                // It may be locked for an instant only, by a run that looks at it.
                std::thread::sleep(LOOK);
                locked = file.try_lock();
            }
            match locked {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Err(taken(place, &mut file)),
                Err(TryLockError::Error(_)) => {
                    let _ = fs::remove_file(&path);
                    return Ok(None);
                }
            }
            // The run that held the lock may have removed the file before this one locked it.
            if !is_at(&file, &path) {
                continue;
            }
            let temporary = Temporary::registered(path, &mut registered);
            drop(registered);
            // The text only serves the message of another run.
            let _ = file.set_len(0).and_then(|()| file.write_all(owner().as_bytes()));
            return Ok(Some(Claim { _temporary: temporary, _file: file }));
        }
    }
}

/// Refuses to replace a file or folder unless `force` is set. For a place that this run has not
/// claimed yet; [`refuse_any`] is for one that it has.
///
/// # Errors
/// Fails if `path` exists and `force` is not set: [`Error::Transient`] if another run writes there.
pub fn refuse_existing(path: &Path, force: bool) -> Result<()> {
    if !force && path.symlink_metadata().is_ok() {
        refuse_taken(path)?;
    }
    refuse_any(path, force)
}

/// Refuses to replace a file or folder unless `force` is set, whoever writes there. An empty folder
/// has nothing to replace.
///
/// # Errors
/// Fails if `path` exists and `force` is not set.
pub fn refuse_any(path: &Path, force: bool) -> Result<()> {
    let is_empty = || path.read_dir().is_ok_and(|mut entries| entries.next().is_none());
    if !force && path.symlink_metadata().is_ok() && !is_empty() {
        return Err(Error::io(path, "exists; --force replaces it"));
    }
    Ok(())
}

/// Refuses a place that another run has claimed, or a folder in which one has.
///
/// # Errors
/// [`Error::Transient`] when another run has claimed it.
fn refuse_taken(place: &Path) -> Result<()> {
    let inside = fs::read_dir(place).into_iter().flatten().flatten().map(|entry| entry.path());
    let is_claim = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().as_encoded_bytes();
        name.starts_with(b".") && name.ends_with(SUFFIX.as_bytes())
    };
    let claims = path_of(place).into_iter().chain(inside.filter(is_claim));
    // Opening a pipe would wait for its other end.
    let claims = claims.filter(|path| path.is_file());
    for mut file in claims.filter_map(|path| File::open(path).ok()) {
        // A shared lock, so that two runs that look at once do not see each other.
        if matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)) {
            return Err(taken(place, &mut file));
        }
    }
    Ok(())
}

/// Opens a claim, and makes it if need be. Another user's claim can be locked without writing it.
fn open(path: &Path) -> io::Result<File> {
    let opened = OpenOptions::new().create(true).truncate(false).read(true).write(true).open(path);
    opened.or_else(|cause| File::open(path).map_err(|_| cause))
}

/// Returns the path of the claim of a place; different spellings of a place have one claim.
fn path_of(place: &Path) -> io::Result<PathBuf> {
    let place = match fs::canonicalize(place) {
        Ok(whole) => whole,
        Err(_) => {
            let name = place.file_name().ok_or(ErrorKind::InvalidInput)?;
            fs::canonicalize(atomic::folder_of(place))?.join(name)
        }
    };
    let mut name = std::ffi::OsString::from(".");
    name.push(place.file_name().ok_or(ErrorKind::InvalidInput)?);
    name.push(SUFFIX);
    Ok(place.with_file_name(name))
}

/// Returns whether `path` still names the open file.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let id = |about: fs::Metadata| (about.dev(), about.ino());
    let (open, named) = (file.metadata().map(id), fs::metadata(path).map(id));
    open.is_ok_and(|open| named.is_ok_and(|named| named == open))
}

#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

/// Returns the text of this run's claim.
fn owner() -> String {
    let host = host_name().map_or(String::new(), |host| format!(" on {host}"));
    format!("process {}{host}: {}\n", std::process::id(), command_line().join(" "))
}

/// Returns the error of a place that another run has claimed.
fn taken(place: &Path, claim: &mut File) -> Error {
    let mut text = String::new();
    let _ = claim.rewind().and_then(|()| claim.take(OWNER_BYTES).read_to_string(&mut text));
    let shown: String = text.trim().replace('\n', " ").chars().take(N_SHOWN).collect();
    let by = if shown.is_empty() { String::new() } else { format!(" ({shown})") };
    let what = "another run of nimbus writes there";
    let expected = "wait until it has ended, or name another place";
    Error::Transient { what: format!("{}: {what}{by}; {expected}", place.display()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_has_one_claim_by_every_spelling_until_it_is_dropped() {
        let dir = tempfile::tempdir().unwrap();
        let place = dir.path().join("run");
        let claim = Claim::take(&place).unwrap();
        assert!(claim.is_some());
        fs::create_dir(&place).unwrap();
        let spellings = [place.clone(), place.join("."), dir.path().join("./run/../run")];
        for spelling in &spellings {
            let error = Claim::take(spelling).unwrap_err();
            assert_eq!(error.exit_code(), 75);
            let id = format!("process {}", std::process::id());
            assert!(error.to_string().contains(&id), "{error}");
        }
        std::os::unix::fs::symlink(&place, dir.path().join("link")).unwrap();
        assert!(Claim::take(&dir.path().join("link")).is_err());
        assert_eq!(refuse_taken(&place).unwrap_err().exit_code(), 75);
        assert_eq!(refuse_taken(dir.path()).unwrap_err().exit_code(), 75);
        drop(claim);
        assert_eq!(refuse_taken(&place), Ok(()));
        assert!(Claim::take(&place).is_ok());
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2, "no claim is left");
    }

    #[test]
    fn the_claim_of_a_process_that_was_killed_keeps_nobody_out() {
        let dir = tempfile::tempdir().unwrap();
        let place = dir.path().join("cloud.png");
        fs::write(dir.path().join(".cloud.png.claim"), "process 1: nimbus").unwrap();
        assert!(Claim::take(&place).unwrap().is_some());
        assert!(Claim::take(&dir.path().join("gone/cloud.png")).is_err());
    }
}
