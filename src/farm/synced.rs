//! Files that outlast a power cut: written under another name, brought to the disk, renamed, and the name brought to the disk.

use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::Path;

use super::failing::of_io;
use crate::error::Result;

/// Writes `path`, or nothing under that name.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let temporary = path.with_extension("part");
    let written = write_once(&temporary, bytes).and_then(|()| fs::rename(&temporary, path));
    if let Err(cause) = written {
        // It is no result, and nobody looks for it.
        let _ = fs::remove_file(&temporary);
        return Err(of_io(path, &cause));
    }
    Ok(())
}

fn write_once(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// Adds a line. Nobody else writes this file.
pub fn append(path: &Path, line: &str) -> Result<()> {
    let open = || OpenOptions::new().create(true).append(true).open(path);
    let write = |mut file: File| file.write_all(format!("{line}\n").as_bytes()).and_then(|()| file.sync_data());
    open().and_then(write).map_err(|cause| of_io(path, &cause))
}

/// The names in a folder.
pub fn folder(path: &Path) -> Result<()> {
    File::open(path).and_then(|file| file.sync_all()).map_err(|cause| of_io(path, &cause))
}

/// Makes a folder and those above it.
pub fn make_folder(path: &Path) -> Result<()> {
    fs::create_dir_all(path).map_err(|cause| of_io(path, &cause))
}
