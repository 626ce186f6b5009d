//! The folder in which one attempt makes the files of a shard.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::journal;
use super::manifest::{FileRecord, MANIFEST_FILE, Manifest};
use super::transient::io_error;
use crate::error::{Error, Result};
use crate::io::text_file::{RECORD_LIMIT, TABLE_LIMIT};
use crate::io::{atomic, input_file};
use crate::timing::machine::Device;

/// A [`FileRecord`] a line, for each file that is finished.
const DONE_FILE: &str = "done.jsonl";
/// The class of the device that makes the files.
const DEVICE_FILE: &str = "device.json";

/// An attempt's folder. Every file in it is synced to disk and listed before the next one is made,
/// so that a later attempt can take the finished files over.
#[derive(Debug)]
pub struct Workplace {
    path: PathBuf,
    /// Names of the files that the shard consists of.
    outputs: Vec<String>,
    /// Folders of earlier attempts at the same shard.
    earlier: Vec<PathBuf>,
    /// The finished files, by name.
    files: BTreeMap<String, FileRecord>,
    n_resumed: usize,
}

impl Workplace {
    /// Uses the empty folder `path` for a shard of these files. [`Workplace::resume`] takes files
    /// over from the folders `earlier`.
    pub fn new(path: PathBuf, outputs: Vec<String>, earlier: Vec<PathBuf>) -> Workplace {
        Workplace { path, outputs, earlier, files: BTreeMap::new(), n_resumed: 0 }
    }

    /// Returns the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the number of files that earlier attempts had finished.
    pub fn n_resumed(&self) -> usize {
        self.n_resumed
    }

    /// Returns the number of files that this attempt finished itself.
    pub fn n_new(&self) -> usize {
        self.files.len() - self.n_resumed
    }

    /// Returns whether a file is finished.
    pub fn has(&self, name: &str) -> bool {
        self.files.contains_key(name)
    }

    /// Returns the records of all finished files, by name.
    pub fn records(&self) -> Vec<FileRecord> {
        self.files.values().cloned().collect()
    }

    /// Takes over the files that earlier attempts finished on a device of the same class. Other
    /// classes draw other pictures.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn resume(&mut self, device: &Device) -> Result<()> {
        let class =
            serde_json::to_string(&device.class()).map_err(|cause| Error::io(&self.path, cause))?;
        for other in std::mem::take(&mut self.earlier) {
            if input_file::read_string(&other.join(DEVICE_FILE), RECORD_LIMIT)
                .is_ok_and(|found| found == class)
            {
                let adopted = self.adopt(&other);
                // Counted after a failure too: this attempt has not made those files.
                self.n_resumed = self.files.len();
                adopted?;
            }
        }
        atomic::write_synced(&self.path.join(DEVICE_FILE), class.as_bytes())
    }

    /// Takes over the finished files of another attempt. That attempt may still be running: it does
    /// not change files that it has listed.
    fn adopt(&mut self, other: &Path) -> Result<()> {
        // The list is missing, or its folder has just been moved away.
        let Ok(records) = journal::read::<FileRecord>(&other.join(DONE_FILE)) else {
            return Ok(());
        };
        for record in records {
            let name = &record.name;
            if !self.outputs.contains(name) || self.has(name) || record.check(other).is_err() {
                continue;
            }
            let (from, to) = (other.join(name), self.path.join(name));
            // A file system without hard links gets a copy.
            let copy = || {
                fs::copy(&from, &to).is_ok()
                    && record.check(&self.path).is_ok()
                    && atomic::sync(&to).is_ok()
            };
            if fs::hard_link(&from, &to).is_ok() || copy() {
                self.list(record)?;
            }
        }
        Ok(())
    }

    /// Writes a file, syncs it to disk and lists it as finished.
    ///
    /// # Errors
    /// When the file cannot be written; transient where another try may succeed.
    pub fn add(&mut self, name: &str, content: &[u8]) -> Result<()> {
        atomic::write_synced(&self.path.join(name), content)?;
        self.list(FileRecord::new(name, content))
    }

    fn list(&mut self, record: FileRecord) -> Result<()> {
        journal::append(&self.path.join(DONE_FILE), &record)?;
        self.files.insert(record.name.clone(), record);
        Ok(())
    }

    /// Keeps later attempts from taking over any file of this one.
    pub fn disown(&self) {
        let _ = fs::remove_file(self.path.join(DONE_FILE));
    }

    /// Adds all files of a folder within this one and removes that folder.
    ///
    /// # Errors
    /// When a file cannot be read or written.
    pub fn take(&mut self, folder: &Path) -> Result<()> {
        let failed = io_error(folder);
        for entry in fs::read_dir(folder).map_err(&failed)? {
            let entry = entry.map_err(&failed)?;
            let name = entry.file_name().to_string_lossy().into_owned();
            self.add(&name, &input_file::read(&entry.path(), TABLE_LIMIT).map_err(&failed)?)?;
        }
        fs::remove_dir_all(folder).map_err(failed)
    }

    /// Writes the manifest, with the records of all files.
    ///
    /// # Errors
    /// When the manifest cannot be written.
    pub fn finish(&self, manifest: Manifest) -> Result<()> {
        let manifest = Manifest { files: self.records(), ..manifest };
        journal::write(&self.path.join(MANIFEST_FILE), &manifest)
    }

    /// Removes the files that only attempts need, from a result in its final place.
    pub fn tidy(place: &Path) {
        let _ = [DONE_FILE, DEVICE_FILE].map(|name| fs::remove_file(place.join(name)));
    }
}
