//! `shard.json`: the files of a finished shard with their hashes, and the machine that made them.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::transient::io_error;
use crate::error::Error;
use crate::io::input_file;
use crate::timing::machine::{Cpu, Device};

/// The manifest's name in a shard's folder.
pub const MANIFEST_FILE: &str = "shard.json";
/// The schema that is written, and the only one that is read.
pub const SCHEMA_VERSION: u32 = 1;

/// The description of a finished shard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// [`SCHEMA_VERSION`].
    pub schema: u32,
    /// The shard's key.
    pub key: String,
    /// The shard's number in its plan.
    pub index: usize,
    /// All files, by name.
    pub files: Vec<FileRecord>,
    /// The machine that finished the shard.
    pub node: String,
    /// The process that finished it.
    pub pid: u32,
    /// The device that made its files.
    pub device: Device,
    /// The processor of the machine.
    pub cpu: Cpu,
    /// The environment variables that affect times.
    pub environment: BTreeMap<String, String>,
    /// Start of the attempt that finished the shard: UTC, ISO 8601.
    pub begun: String,
    /// Duration of that attempt up to its last file, s.
    pub seconds: f64,
    /// The number of files that earlier attempts had finished.
    pub n_resumed: usize,
    /// Whether the run had its node to itself, so that its times are undisturbed.
    pub exclusive: bool,
}

impl Manifest {
    /// Returns the class of hardware that made the shard.
    pub fn class(&self) -> Class {
        Class::new(&self.device, &self.cpu)
    }
}

/// A class of devices and processors that are taken to need equal times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Class {
    /// [`Device::class`]
    pub device: String,
    /// [`Cpu::class`]
    pub cpu: String,
}

impl Class {
    /// Returns the class of a device and a processor.
    pub fn new(device: &Device, cpu: &Cpu) -> Class {
        Class { device: device.class(), cpu: cpu.class() }
    }
}

/// Length and hash of a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileRecord {
    /// Its name in the shard's folder.
    pub name: String,
    /// Its length.
    pub bytes: u64,
    /// The SHA-256 of its content, in hexadecimal digits.
    pub sha256: String,
}

impl FileRecord {
    /// Describes a file of this content.
    pub fn new(name: &str, content: &[u8]) -> FileRecord {
        let sha256 = format!("{:x}", Sha256::digest(content));
        FileRecord { name: name.to_owned(), bytes: content.len() as u64, sha256 }
    }

    /// Reads the file of this name in `folder` and compares it with the record.
    ///
    /// # Errors
    /// When the file differs, is missing, or cannot be read.
    pub fn check(&self, folder: &Path) -> Result<(), Defect> {
        let FileRecord { name, bytes, sha256 } = self;
        let path = folder.join(name);
        // The length comes first, so that a truncated file need not be read.
        let about = fs::symlink_metadata(&path).map_err(|cause| Defect::new(&path, cause))?;
        if !about.is_file() || about.len() != *bytes {
            let what = format!("{name} has {} bytes, {MANIFEST_FILE} says {bytes}", about.len());
            return Err(Defect::Broken(what));
        }
        let content = input_file::read(&path, *bytes).map_err(|cause| Defect::new(&path, cause))?;
        if FileRecord::new(name, &content) != *self {
            let begin: String = sha256.chars().take(8).collect();
            return Err(Defect::Broken(format!(
                "{name} has other content than {MANIFEST_FILE} says: its SHA-256 does not begin \
                 with {begin}"
            )));
        }
        Ok(())
    }
}

/// The reason why a file or folder is not a valid result.
#[derive(Debug, Clone, PartialEq)]
pub enum Defect {
    /// It differs from its description, or a part of it is missing.
    Broken(String),
    /// It could not be read, so that it may be valid.
    Unreadable(Error),
}

impl Defect {
    /// Classifies a failure to read `path`.
    pub fn new(path: &Path, cause: io::Error) -> Defect {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        match cause.kind() {
            io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => {
                Defect::Broken(format!("{name}: {cause}"))
            }
            _ => Defect::Unreadable(io_error(path)(cause)),
        }
    }

    /// Returns the error for a caller that needs the file in `folder`.
    pub fn into_error(self, folder: &Path) -> Error {
        match self {
            Defect::Broken(what) => {
                Error::Transient { what: format!("{}: {what}", folder.display()) }
            }
            Defect::Unreadable(error) => error,
        }
    }
}
