//! Files that are read where they lie: mapped into memory.

use std::io;
use std::path::Path;

use memmap2::Mmap;

use super::input_file;

/// A file that is mapped into memory.
pub struct MappedFile(Mmap);

impl MappedFile {
    /// Maps a regular file of any size.
    ///
    /// # Errors
    /// As [`input_file::open`], and when the system cannot map it.
    pub fn open(path: &Path) -> io::Result<MappedFile> {
        let file = input_file::open(path, u64::MAX)?;
        // SAFETY: the map is read alone, and what is read of it is checked where it is used. A
        // program that shortens the file meanwhile ends this process by a signal.
        Ok(MappedFile(unsafe { Mmap::map(&file) }?))
    }

    /// Returns the bytes of the file.
    pub fn bytes(&self) -> &[u8] {
        &self.0
    }
}
