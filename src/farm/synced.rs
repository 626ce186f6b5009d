//! Files that outlast a power cut: written under a name that nobody else has, brought to the disk,
//! renamed, and the new name brought to the disk.

use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use super::failing::of_io;
use crate::error::{Error, Result};

/// Writes `path`, or nothing under that name.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let temporary = temporary(path)?;
    let written = write_once(&temporary, bytes).and_then(|()| fs::rename(&temporary, path));
    settle(path, &temporary, written)
}

/// The same where nothing is there.
pub fn write_new(path: &Path, bytes: &[u8]) -> Result<()> {
    let temporary = temporary(path)?;
    // A rename would replace what came meanwhile, a second name for a file does not.
    let written = write_once(&temporary, bytes).and_then(|()| fs::hard_link(&temporary, path));
    settle(path, &temporary, written)
}

fn settle(path: &Path, temporary: &Path, written: std::io::Result<()>) -> Result<()> {
    // Gone already where it was renamed; else it is no result, and nobody looks for it.
    let _ = fs::remove_file(temporary);
    written.map_err(|cause| of_io(path, &cause))?;
    let parent = path.parent().filter(|parent| *parent != Path::new("")).unwrap_or(Path::new("."));
    folder(parent)
}

/// Nobody else's, on no node.
fn temporary(path: &Path) -> Result<PathBuf> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let name = path
        .file_name()
        .ok_or_else(|| Error::io(path, "expected a file's name"))?
        .to_string_lossy();
    let (node, pid, count) =
        (super::attempts::node(), std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
    Ok(path.with_file_name(format!(".{name}.{node}.{pid}.{count}.part")))
}

fn write_once(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// Adds a line, by one call, so that lines of several processes of one machine do not mix.
pub fn append(path: &Path, line: &str) -> Result<()> {
    let open = || OpenOptions::new().create(true).append(true).open(path);
    let write = |mut file: File| {
        file.write_all(format!("{line}\n").as_bytes()).and_then(|()| file.sync_data())
    };
    open().and_then(write).map_err(|cause| of_io(path, &cause))
}

/// The names in a folder; or a file's content.
pub fn folder(path: &Path) -> Result<()> {
    File::open(path).and_then(|file| file.sync_all()).map_err(|cause| of_io(path, &cause))
}

/// Makes a folder and those above it.
pub fn make_folder(path: &Path) -> Result<()> {
    fs::create_dir_all(path).map_err(|cause| of_io(path, &cause))
}
