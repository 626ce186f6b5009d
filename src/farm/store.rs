//! What is done: `shards/KEY`, a folder with a shard's files and `shard.json`, which says what is
//! in them. A folder appears under its key at once and whole, by a rename; until then it is
//! `KEY.tmp.NODE.PID`, where whoever tries next finds the files that were finished.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::failing::of_io;
use super::plan::{Plan, Shard};
use super::synced;
use crate::error::{Error, Result};
use crate::timing::machine::{Cpu, Device};

pub const MANIFEST_FILE: &str = "shard.json";
/// In a folder that is not finished: a [`FileRecord`] a line, of each file that is.
const DONE_FILE: &str = "done.jsonl";
/// And the device that made them.
const DEVICE_FILE: &str = "device.json";
pub const SCHEMA_VERSION: u32 = 1;

/// `shard.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    pub schema: u32,
    pub key: String,
    pub index: usize,
    /// In the order of the plan.
    pub files: Vec<FileRecord>,
    pub node: String,
    pub pid: u32,
    pub device: Device,
    pub cpu: Cpu,
    pub environment: BTreeMap<String, String>,
    /// UTC, ISO 8601, of the attempt that finished it.
    pub begun: String,
    /// That attempt's, from its beginning to its last file.
    pub seconds: f64,
    /// Files that attempts before it had finished.
    pub n_resumed: usize,
    /// The node is said to have been this run's alone, so that its times are nobody else's as well.
    pub exclusive: bool,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileRecord {
    pub name: String,
    pub bytes: u64,
    /// Hex.
    pub sha256: String,
}

impl FileRecord {
    fn of(name: &str, bytes: &[u8]) -> FileRecord {
        FileRecord {
            name: name.to_owned(),
            bytes: bytes.len() as u64,
            sha256: format!("{:x}", Sha256::digest(bytes)),
        }
    }

    /// What is wrong with the file of this name in `folder`.
    pub fn check(&self, folder: &Path) -> std::result::Result<(), Wrong> {
        let FileRecord { name, bytes, sha256 } = self;
        let path = folder.join(name);
        // The length first: what was cut off need not be read.
        let about = fs::symlink_metadata(&path).map_err(|cause| Wrong::of(&path, &cause))?;
        if !about.is_file() || about.len() != *bytes {
            let what = format!("{name} has {} bytes, {MANIFEST_FILE} says {bytes}", about.len());
            return Err(Wrong::Broken(what));
        }
        let content = fs::read(&path).map_err(|cause| Wrong::of(&path, &cause))?;
        if FileRecord::of(name, &content) != *self {
            let begin: String = sha256.chars().take(8).collect();
            let what = format!(
                "{name} is not what {MANIFEST_FILE} says: its SHA-256 does not begin with {begin}"
            );
            return Err(Wrong::Broken(what));
        }
        Ok(())
    }
}

/// Why something is no result.
#[derive(Debug, Clone, PartialEq)]
pub enum Wrong {
    /// It was read, and is not what it says; or a part of it is not there.
    Broken(String),
    /// It may be one: it could not be read.
    Unreadable(Error),
}

impl Wrong {
    fn of(path: &Path, cause: &io::Error) -> Wrong {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        match cause.kind() {
            io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => {
                Wrong::Broken(format!("{name}: {cause}"))
            }
            _ => Wrong::Unreadable(of_io(path, cause)),
        }
    }

    /// As the error of whoever needs it.
    pub fn error(self, folder: &Path) -> Error {
        match self {
            Wrong::Broken(what) => {
                Error::Transient { what: format!("{}: {what}", folder.display()) }
            }
            Wrong::Unreadable(error) => error,
        }
    }
}

/// What lies under a shard's key.
#[derive(Debug, Clone, PartialEq)]
pub enum Standing {
    Missing,
    /// Every file is there, and is what was written.
    Verified(Box<Manifest>),
    /// What is wrong with it.
    Broken(String),
    /// Nobody knows: it could not be read.
    Unreadable(Error),
}

/// How a result found its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Placed {
    First,
    /// The same was there already.
    Same,
}

#[derive(Debug, Clone)]
pub struct Store {
    folder: PathBuf,
}

impl Store {
    /// Of the plan in `folder`.
    pub fn open(folder: &Path) -> Store {
        Store { folder: folder.join("shards") }
    }

    pub fn place(&self, key: &str) -> PathBuf {
        self.folder.join(key)
    }

    /// Reads every byte of it.
    pub fn standing(&self, plan: &Plan, shard: &Shard) -> Standing {
        let place = self.place(&shard.key);
        match fs::symlink_metadata(&place) {
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Standing::Missing,
            Err(cause) => return Standing::Unreadable(of_io(&place, &cause)),
            Ok(_) => {}
        }
        match verify(&place, plan, shard) {
            Ok(manifest) => Standing::Verified(Box::new(manifest)),
            Err(Wrong::Broken(what)) => Standing::Broken(what),
            Err(Wrong::Unreadable(error)) => Standing::Unreadable(error),
        }
    }

    /// Unfinished folders, and those that were put aside, by key: read at once, since a listing
    /// takes as long as there are results.
    pub fn others(&self) -> Others {
        let mut others = Others::default();
        for entry in fs::read_dir(&self.folder).into_iter().flatten().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let mut words = name.split('.');
            let (Some(key), Some(word)) = (words.next(), words.next()) else { continue };
            if let Some(kind) = Other::ALL.into_iter().find(|kind| kind.name() == word) {
                others.0.entry((key.to_owned(), kind)).or_default().push(entry.path());
            }
        }
        others.0.values_mut().for_each(|paths| paths.sort());
        others
    }

    /// Puts what lies under a key aside, to be looked at; where to, unless it was gone, or whole:
    /// somebody may have mended it since it was looked at.
    pub fn put_aside(&self, plan: &Plan, shard: &Shard, who: &str) -> Result<Option<PathBuf>> {
        let key = &shard.key;
        let (place, to) = (self.place(key), self.free(key, Other::Bad, who));
        match fs::rename(&place, &to) {
            Ok(()) => {}
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(cause) => return Err(of_io(&place, &cause)),
        }
        // Taken meanwhile by somebody else's, it stays aside.
        let is_back = verify(&to, plan, shard).is_ok() && fs::rename(&to, &place).is_ok();
        Ok((!is_back).then_some(to))
    }

    /// A name that nobody has.
    fn free(&self, key: &str, kind: Other, who: &str) -> PathBuf {
        let base = format!("{key}.{}.{who}", kind.name());
        let numbered = (1..).map(|k| self.folder.join(format!("{base}.{k}")));
        let mut names = std::iter::once(self.folder.join(&base)).chain(numbered);
        names
            .find(|path| path.symlink_metadata().is_err())
            .unwrap_or_else(|| self.folder.join(base))
    }

    /// A folder to work in.
    pub fn begin(&self, shard: &Shard, who: &str) -> Result<Workplace> {
        synced::make_folder(&self.folder)?;
        loop {
            let path = self.free(&shard.key, Other::Unfinished, who);
            match fs::create_dir(&path) {
                Ok(()) => return Ok(Workplace { path, files: BTreeMap::new(), n_resumed: 0 }),
                // Somebody of the same name, in another container.
                Err(cause) if cause.kind() == io::ErrorKind::AlreadyExists => {}
                Err(cause) => return Err(of_io(&path, &cause)),
            }
        }
    }

    /// Takes over what attempts at `shard` before have finished on a device like `device`: another
    /// one's pictures differ.
    pub fn resume(
        &self,
        workplace: &mut Workplace,
        plan: &Plan,
        shard: &Shard,
        device: &Device,
    ) -> Result<()> {
        let outputs = plan.outputs(shard);
        let mark = serde_json::to_string(&device.class())
            .map_err(|cause| Error::io(&workplace.path, cause))?;
        for other in self.others().of(&shard.key, Other::Unfinished) {
            if fs::read_to_string(other.join(DEVICE_FILE)).is_ok_and(|of| of == mark) {
                let adopted = workplace.adopt(other, &outputs);
                // Also where it fails: what was taken over is not what this attempt made.
                workplace.n_resumed = workplace.files.len();
                adopted?;
            }
        }
        synced::write(&workplace.path.join(DEVICE_FILE), mark.as_bytes())
    }

    /// Moves a finished folder under its key. What is there already stays, if it is whole: the same
    /// is as good, and another is a contradiction (exit code 70), which is kept beside it.
    pub fn put(
        &self,
        workplace: Workplace,
        plan: &Plan,
        shard: &Shard,
        who: &str,
    ) -> Result<Placed> {
        // Whoever puts something broken aside makes room for one more try; a few of them may meet.
        const TRIES: usize = 16;
        let place = self.place(&shard.key);
        for _ in 0..TRIES {
            match fs::rename(&workplace.path, &place) {
                Ok(()) => {
                    // They are no part of a result, and do no harm.
                    let _ = [DONE_FILE, DEVICE_FILE].map(|name| fs::remove_file(place.join(name)));
                    synced::folder(&self.folder)?;
                    return Ok(Placed::First);
                }
                Err(cause) if is_taken(&cause) => {}
                Err(cause) => return Err(of_io(&place, &cause)),
            }
            match self.standing(plan, shard) {
                Standing::Missing => {}
                Standing::Unreadable(error) => return Err(error),
                Standing::Broken(_) => {
                    self.put_aside(plan, shard, who)?;
                }
                Standing::Verified(theirs)
                    if !plan.is_exact() || theirs.files == workplace.records() =>
                {
                    let _ = fs::remove_dir_all(&workplace.path);
                    return Ok(Placed::Same);
                }
                Standing::Verified(theirs) => {
                    return Err(self.contradiction(workplace, &theirs, shard, who));
                }
            }
        }
        Err(Error::Transient {
            what: format!("{}: others keep putting results there", place.display()),
        })
    }

    fn contradiction(&self, ours: Workplace, theirs: &Manifest, shard: &Shard, who: &str) -> Error {
        let kept = self.free(&shard.key, Other::Differing, who);
        let kept = if fs::rename(&ours.path, &kept).is_ok() { kept } else { ours.path.clone() };
        let ours = ours.records();
        let differing: Vec<&str> = ours
            .iter()
            .zip(&theirs.files)
            .filter(|(a, b)| a != b)
            .map(|(a, _)| a.name.as_str())
            .collect();
        Error::Conflict {
            what: format!(
                "shard {}: {} made another result before (on {}, process {}): {} of {} files \
                 differ, {} the first; \
                 what was made here is kept in {}. Two devices or drivers in one farm do that: \
                 `nimbus farm status --json` names them",
                shard.index,
                theirs.node,
                theirs.device.name,
                theirs.pid,
                differing.len(),
                ours.len(),
                differing.first().unwrap_or(&"none"),
                kept.display()
            ),
        }
    }
}

/// What lies beside the results.
#[derive(Debug, Clone, Default)]
pub struct Others(BTreeMap<(String, Other), Vec<PathBuf>>);

impl Others {
    pub fn of(&self, key: &str, kind: Other) -> &[PathBuf] {
        self.0.get(&(key.to_owned(), kind)).map_or(&[], Vec::as_slice)
    }
}

/// Folders beside the results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Other {
    /// An attempt's that goes on, or was ended.
    Unfinished,
    /// Under the right name, with the wrong content.
    Bad,
    /// Whole, and not what somebody else made.
    Differing,
}

impl Other {
    pub const ALL: [Other; 3] = [Other::Unfinished, Other::Bad, Other::Differing];

    pub fn name(self) -> &'static str {
        match self {
            Other::Unfinished => "tmp",
            Other::Bad => "bad",
            Other::Differing => "differs",
        }
    }
}

/// EEXIST, ENOTEMPTY, and ENOTDIR where something else lies there.
fn is_taken(cause: &io::Error) -> bool {
    use io::ErrorKind::{AlreadyExists, DirectoryNotEmpty, NotADirectory};
    matches!(cause.kind(), AlreadyExists | DirectoryNotEmpty | NotADirectory)
}

/// That `folder` is a whole result of `shard`; else what is wrong.
fn verify(folder: &Path, plan: &Plan, shard: &Shard) -> std::result::Result<Manifest, Wrong> {
    let path = folder.join(MANIFEST_FILE);
    let broken = |what: String| Err(Wrong::Broken(what));
    let text = fs::read(&path).map_err(|cause| Wrong::of(&path, &cause))?;
    let read = serde_json::from_slice(&text);
    let manifest: Manifest =
        read.map_err(|cause| Wrong::Broken(format!("{MANIFEST_FILE}: {cause}")))?;
    if manifest.schema != SCHEMA_VERSION {
        return broken(format!(
            "{MANIFEST_FILE} is of schema {}, expected {SCHEMA_VERSION}",
            manifest.schema
        ));
    }
    if (&manifest.key, manifest.index) != (&shard.key, shard.index) {
        return broken(format!(
            "{MANIFEST_FILE} is of shard {}, key {}",
            manifest.index, manifest.key
        ));
    }
    let names: Vec<&str> = manifest.files.iter().map(|file| file.name.as_str()).collect();
    if !plan.are_outputs(shard, &names) {
        return broken(format!("{MANIFEST_FILE} names other files than the plan"));
    }
    manifest.files.iter().try_for_each(|file| file.check(folder))?;
    Ok(manifest)
}

/// Where an attempt works.
#[derive(Debug)]
pub struct Workplace {
    path: PathBuf,
    /// What is finished, by name.
    files: BTreeMap<String, FileRecord>,
    pub n_resumed: usize,
}

impl Workplace {
    pub fn has(&self, name: &str) -> bool {
        self.files.contains_key(name)
    }

    /// Files that this attempt finished itself.
    pub fn n_new(&self) -> usize {
        self.files.len() - self.n_resumed
    }

    /// Writes a file, for good: who goes on after us takes it over.
    pub fn add(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        synced::write(&self.path.join(name), bytes)?;
        self.record(FileRecord::of(name, bytes))
    }

    /// What is in it is not to be gone on with.
    pub fn disown(&self) {
        let _ = fs::remove_file(self.path.join(DONE_FILE));
    }

    fn record(&mut self, record: FileRecord) -> Result<()> {
        let line = serde_json::to_string(&record).map_err(|cause| Error::io(&self.path, cause))?;
        synced::append(&self.path.join(DONE_FILE), &line)?;
        self.files.insert(record.name.clone(), record);
        Ok(())
    }

    /// Takes over what another attempt finished: it may go on itself, what it has finished it does
    /// not change.
    fn adopt(&mut self, other: &Path, outputs: &[String]) -> Result<()> {
        // None, or one that is moved away meanwhile.
        let Ok(text) = fs::read(other.join(DONE_FILE)) else { return Ok(()) };
        for line in String::from_utf8_lossy(&text).lines() {
            let Ok(record) = serde_json::from_str::<FileRecord>(line) else { continue };
            if !outputs.contains(&record.name)
                || self.has(&record.name)
                || record.check(other).is_err()
            {
                continue;
            }
            let (from, to) = (other.join(&record.name), self.path.join(&record.name));
            // Nobody writes into a finished file, so that one file may be in both; a copy where
            // that cannot be.
            let copy = || {
                fs::copy(&from, &to).is_ok()
                    && record.check(&self.path).is_ok()
                    && synced::folder(&to).is_ok()
            };
            if fs::hard_link(&from, &to).is_ok() || copy() {
                self.record(record)?;
            }
        }
        Ok(())
    }

    /// By name, which is the order of the plan.
    fn records(&self) -> Vec<FileRecord> {
        self.files.values().cloned().collect()
    }

    /// Where something else is made that [`take`](Workplace::take) takes over.
    pub fn folder(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Takes over all files of a folder in it.
    pub fn take(&mut self, folder: &Path) -> Result<()> {
        let failed = |cause: io::Error| of_io(folder, &cause);
        for entry in fs::read_dir(folder).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let name = entry.file_name().to_string_lossy().into_owned();
            self.add(&name, &fs::read(entry.path()).map_err(failed)?)?;
        }
        fs::remove_dir_all(folder).map_err(failed)
    }

    /// Writes `shard.json`: all files are there.
    pub fn finish(&self, manifest: Manifest) -> Result<()> {
        let manifest = Manifest { files: self.records(), ..manifest };
        let path = self.path.join(MANIFEST_FILE);
        let text =
            serde_json::to_string_pretty(&manifest).map_err(|cause| Error::io(&path, cause))?;
        synced::write(&path, format!("{text}\n").as_bytes())?;
        synced::folder(&self.path)
    }
}
