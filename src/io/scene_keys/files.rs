//! Files that a scene names: where they are read from.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::error::{Error, Result};
use crate::io::mapped_file::MappedFile;
use crate::io::text_file::{DATA_LIMIT, check_text, plain, read_text};
use crate::io::weather::wrf::{self, WeatherFile};

/// Source of the files that a scene names.
pub trait Files {
    /// Reads a text file. `first` says in words what such a file begins with.
    ///
    /// # Errors
    /// When the file cannot be read or is no text.
    fn text(&self, path: &Path, first: &str) -> Result<String>;

    /// Opens a particle list as text, which may have any size.
    ///
    /// # Errors
    /// When the file cannot be read.
    fn list(&self, path: &Path, first: &str) -> Result<ListText> {
        self.text(path, first).map(ListText::Read)
    }

    /// Maps a file into memory.
    ///
    /// # Errors
    /// When the file cannot be read, or the source has text alone.
    fn mapped(&self, path: &Path) -> Result<MappedFile> {
        Err(Error::io(path, "binary files are read from the disk alone"))
    }

    /// Opens a weather file.
    ///
    /// # Errors
    /// When the file is no readable WRF file, or the source has none.
    fn weather(&self, path: &Path) -> Result<WeatherFile> {
        Err(Error::io(path, "weather files are read from the disk alone"))
    }
}

/// The text of a particle list.
pub enum ListText {
    /// Text that was read.
    Read(String),
    /// A file that is read where it lies.
    Mapped(MappedFile),
}

impl ListText {
    /// Returns the text without a byte-order mark; `path` and `first` are for messages.
    ///
    /// # Errors
    /// With line and column when it is empty or no text.
    pub fn text(&self, path: &Path, first: &str) -> Result<&str> {
        match self {
            ListText::Read(text) => Ok(text),
            ListText::Mapped(file) => check_text(file.bytes(), path, first),
        }
    }
}

impl<F: Fn(&Path, &str) -> Result<String>> Files for F {
    fn text(&self, path: &Path, first: &str) -> Result<String> {
        self(path, first)
    }
}

/// Files of the file system.
pub struct OnDisk;

impl Files for OnDisk {
    fn text(&self, path: &Path, first: &str) -> Result<String> {
        read_text(path, DATA_LIMIT, first)
    }

    fn list(&self, path: &Path, _: &str) -> Result<ListText> {
        self.mapped(path).map(ListText::Mapped)
    }

    fn mapped(&self, path: &Path) -> Result<MappedFile> {
        MappedFile::open(path).map_err(|e| Error::io(path, plain(&e, path)))
    }

    fn weather(&self, path: &Path) -> Result<WeatherFile> {
        wrf::open(path)
    }
}

/// Files of the file system, with a list of those that were asked for, each once.
pub struct Listed(Mutex<Vec<PathBuf>>);

impl Listed {
    /// Starts the list with one file.
    pub fn new(first: &Path) -> Listed {
        Listed(Mutex::new(vec![first.to_owned()]))
    }

    /// Returns the list.
    pub fn into_paths(self) -> Vec<PathBuf> {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    fn add(&self, path: &Path) {
        let mut paths = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if !paths.iter().any(|listed| listed == path) {
            paths.push(path.to_owned());
        }
    }
}

impl Files for Listed {
    fn text(&self, path: &Path, first: &str) -> Result<String> {
        self.add(path);
        OnDisk.text(path, first)
    }

    fn list(&self, path: &Path, first: &str) -> Result<ListText> {
        self.add(path);
        OnDisk.list(path, first)
    }

    fn mapped(&self, path: &Path) -> Result<MappedFile> {
        self.add(path);
        OnDisk.mapped(path)
    }

    fn weather(&self, path: &Path) -> Result<WeatherFile> {
        self.add(path);
        OnDisk.weather(path)
    }
}
