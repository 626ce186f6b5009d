//! The results of a farm: a folder `shards/KEY` for each finished shard.
//!
//! A result appears under its key as a whole, by renaming the folder `KEY.tmp.NODE.PID` in which it
//! was made. The manifest in it tells the hash of every file.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::manifest::{Defect, MANIFEST_FILE, Manifest, SCHEMA_VERSION};
use super::plan::{Plan, Shard};
use super::transient::io_error;
use super::workplace::Workplace;
use crate::error::{Error, Result};
use crate::io::text_file::TABLE_LIMIT;
use crate::io::{atomic, input_file};

/// The state of a shard's result.
#[derive(Debug, Clone, PartialEq)]
pub enum ResultState {
    /// There is none.
    Missing,
    /// Every file is there and has the hash that the manifest says.
    Verified(Box<Manifest>),
    /// It differs from its manifest, as described.
    Broken(String),
    /// It could not be read, so that its state is unknown.
    Unreadable(Error),
}

/// The outcome of putting a result into its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Placement {
    /// There was no result.
    First,
    /// An equal result was there already.
    Same,
}

/// The results of the plan in a folder.
#[derive(Debug, Clone)]
pub struct Store<'a> {
    plan: &'a Plan,
    folder: PathBuf,
}

impl<'a> Store<'a> {
    /// Returns the store of the plan in `folder`.
    pub fn new(folder: &Path, plan: &'a Plan) -> Store<'a> {
        Store { plan, folder: folder.join("shards") }
    }

    /// Returns the folder of a shard's result.
    pub fn place(&self, shard: &Shard) -> PathBuf {
        self.folder.join(&shard.key)
    }

    /// Verifies a shard's result, which reads every byte of it.
    pub fn state(&self, shard: &Shard) -> ResultState {
        let place = self.place(shard);
        match fs::symlink_metadata(&place) {
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => ResultState::Missing,
            Err(cause) => ResultState::Unreadable(io_error(&place)(cause)),
            Ok(_) => match self.verify(&place, shard) {
                Ok(manifest) => ResultState::Verified(Box::new(manifest)),
                Err(Defect::Broken(what)) => ResultState::Broken(what),
                Err(Defect::Unreadable(error)) => ResultState::Unreadable(error),
            },
        }
    }

    /// Returns the manifest of a folder if it holds a whole result of the shard.
    fn verify(&self, folder: &Path, shard: &Shard) -> std::result::Result<Manifest, Defect> {
        let path = folder.join(MANIFEST_FILE);
        let broken = |what: String| Err(Defect::Broken(format!("{MANIFEST_FILE}{what}")));
        let text =
            input_file::read(&path, TABLE_LIMIT).map_err(|cause| Defect::new(&path, cause))?;
        let manifest: Manifest = match serde_json::from_slice(&text) {
            Ok(manifest) => manifest,
            Err(cause) => return broken(format!(": {cause}")),
        };
        let Manifest { schema, key, index, files, .. } = &manifest;
        if *schema != SCHEMA_VERSION {
            return broken(format!(" is of schema {schema}, expected {SCHEMA_VERSION}"));
        }
        if (key, *index) != (&shard.key, shard.index) {
            return broken(format!(" is of shard {index}, key {key}"));
        }
        let (outputs, work) = (self.plan.work.outputs(shard.items()), &self.plan.work);
        let names: Vec<&String> = files.iter().map(|file| &file.name).collect();
        let has_all = outputs.iter().all(|name| names.contains(&name));
        // Shards that are measured may have more files.
        if !has_all || (work.is_exact() && names.len() != outputs.len()) {
            return broken(" names other files than the plan".to_owned());
        }
        files.iter().try_for_each(|file| file.check(folder))?;
        Ok(manifest)
    }

    /// Lists all folders beside the results. A listing takes as long as there are results, so it is
    /// made once for all shards.
    pub fn leftovers(&self) -> Leftovers {
        let mut found = Leftovers::default();
        for entry in fs::read_dir(&self.folder).into_iter().flatten().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let mut words = name.split('.');
            let (Some(key), Some(word)) = (words.next(), words.next()) else { continue };
            if let Some(kind) = Leftover::ALL.into_iter().find(|kind| kind.name() == word) {
                found.0.entry((key.to_owned(), kind)).or_default().push(entry.path());
            }
        }
        found.0.values_mut().for_each(|paths| paths.sort());
        found
    }

    /// Returns an unused path beside the results.
    fn unused(&self, shard: &Shard, kind: Leftover, attempt: &str) -> PathBuf {
        let base = format!("{}.{}.{attempt}", shard.key, kind.name());
        let numbered = (1..).map(|k| self.folder.join(format!("{base}.{k}")));
        let mut paths = std::iter::once(self.folder.join(&base)).chain(numbered);
        let unused = paths.find(|path| path.symlink_metadata().is_err());
        unused.unwrap_or_else(|| self.folder.join(base))
    }

    /// Makes a folder in which the attempt named `attempt` makes a shard.
    ///
    /// # Errors
    /// When the folder cannot be made.
    pub fn begin(&self, shard: &Shard, attempt: &str) -> Result<Workplace> {
        atomic::make_folder(&self.folder)?;
        let earlier = self.leftovers().of(shard, Leftover::Unfinished).to_vec();
        loop {
            let path = self.unused(shard, Leftover::Unfinished, attempt);
            match fs::create_dir(&path) {
                Ok(()) => {
                    let outputs = self.plan.work.outputs(shard.items());
                    return Ok(Workplace::new(path, outputs, earlier));
                }
                // Made since by a process of the same name, in another container.
                Err(cause) if cause.kind() == io::ErrorKind::AlreadyExists => {}
                Err(cause) => return Err(io_error(&path)(cause)),
            }
        }
    }

    /// Moves a broken result aside, for inspection, and returns its new path. Returns none where
    /// the result is gone, or another process has replaced it by a whole one.
    ///
    /// # Errors
    /// When the result cannot be moved.
    pub fn put_aside(&self, shard: &Shard, attempt: &str) -> Result<Option<PathBuf>> {
        let (place, to) = (self.place(shard), self.unused(shard, Leftover::Bad, attempt));
        match fs::rename(&place, &to) {
            Ok(()) => {}
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(cause) => return Err(io_error(&place)(cause)),
        }
        // A whole one is moved back. If its place has been taken meanwhile, it stays aside.
        let is_back = self.verify(&to, shard).is_ok() && fs::rename(&to, &place).is_ok();
        Ok((!is_back).then_some(to))
    }

    /// Moves a finished workplace to the place of the shard's result. A whole result that is there
    /// already stays.
    ///
    /// # Errors
    /// [`Error::Conflict`] when that result differs; the new one is kept beside it. Otherwise when
    /// the folder cannot be moved.
    pub fn put(&self, workplace: &Workplace, shard: &Shard, attempt: &str) -> Result<Placement> {
        /// Each run that puts a broken result aside makes room for one more try.
        const TRIES: usize = 16;
        let place = self.place(shard);
        for _ in 0..TRIES {
            match fs::rename(workplace.path(), &place) {
                Ok(()) => {
                    Workplace::tidy(&place);
                    atomic::sync(&self.folder)?;
                    return Ok(Placement::First);
                }
                Err(cause) if is_taken(&cause) => {}
                Err(cause) => return Err(io_error(&place)(cause)),
            }
            match self.state(shard) {
                ResultState::Missing => {}
                ResultState::Unreadable(error) => return Err(error),
                ResultState::Broken(_) => drop(self.put_aside(shard, attempt)?),
                ResultState::Verified(theirs)
                    if !self.plan.work.is_exact() || theirs.files == workplace.records() =>
                {
                    let _ = fs::remove_dir_all(workplace.path());
                    return Ok(Placement::Same);
                }
                ResultState::Verified(theirs) => {
                    return Err(self.conflict(workplace, &theirs, shard, attempt));
                }
            }
        }
        let what = format!("{}: others keep putting results there", place.display());
        Err(Error::Transient { what })
    }

    fn conflict(&self, ours: &Workplace, theirs: &Manifest, shard: &Shard, attempt: &str) -> Error {
        let kept = self.unused(shard, Leftover::Differing, attempt);
        let is_moved = fs::rename(ours.path(), &kept).is_ok();
        let kept = if is_moved { &kept } else { ours.path() };
        let ours = ours.records();
        let pairs = ours.iter().zip(&theirs.files).filter(|(a, b)| a != b);
        let names: Vec<&str> = pairs.map(|(a, _)| a.name.as_str()).collect();
        let Manifest { node, device, pid, .. } = theirs;
        Error::Conflict {
            what: format!(
                "shard {}: {node} made another result before (on {}, process {pid}): {} of {} \
                 files differ, {} the first; this result is kept in {}. Different devices or \
                 drivers in one farm cause that: `nimbus farm status --json` names them",
                shard.index,
                device.name,
                names.len(),
                ours.len(),
                names.first().unwrap_or(&"none"),
                kept.display()
            ),
        }
    }
}

/// Whether a rename failed because its target exists, as a folder or as anything else.
fn is_taken(cause: &io::Error) -> bool {
    use io::ErrorKind::{AlreadyExists, DirectoryNotEmpty, NotADirectory};
    matches!(cause.kind(), AlreadyExists | DirectoryNotEmpty | NotADirectory)
}

/// The folders beside the results.
#[derive(Debug, Clone, Default)]
pub struct Leftovers(BTreeMap<(String, Leftover), Vec<PathBuf>>);

impl Leftovers {
    /// Returns the folders of a kind that belong to a shard, in the order of their names.
    pub fn of(&self, shard: &Shard, kind: Leftover) -> &[PathBuf] {
        self.0.get(&(shard.key.clone(), kind)).map_or(&[], Vec::as_slice)
    }
}

/// A kind of folder beside the results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Leftover {
    /// The workplace of an attempt that is running or was ended.
    Unfinished,
    /// A broken result that was put aside.
    Bad,
    /// A whole result that differs from the one in its place.
    Differing,
}

impl Leftover {
    const ALL: [Leftover; 3] = [Leftover::Unfinished, Leftover::Bad, Leftover::Differing];

    fn name(self) -> &'static str {
        match self {
            Leftover::Unfinished => "tmp",
            Leftover::Bad => "bad",
            Leftover::Differing => "differs",
        }
    }
}
