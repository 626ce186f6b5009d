//! The folder that one run writes its results to.
//!
//! Results of one kind are a *record* (`run.json`; merged frames have none), files beside it, and a
//! *list* (`run.sha256`) of all of them with their SHA-256, which `sha256sum -c` checks. The list
//! tells the files of nimbus from those of the user: no file that is missing in the list, or has
//! changed since, is replaced or removed. Results that are there already stay until the new ones
//! are finished; until then the new ones are kept in a folder beside them, `NAME.partial`.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::atomic::{Temporary, folder_of, write_atomic};
use super::claim::{Claim, refuse_any, refuse_existing};
use super::folder::{check_writable, replace_files};
use super::text_file::{RECORD_LIMIT, TABLE_LIMIT, read_result};
use crate::error::{Error, Result};

/// SHA-256 in hex by file name.
type Sums = BTreeMap<String, String>;

/// The rule for results that are there already.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// The folder must not exist.
    Refuse,
    /// Results of the same kind are replaced once the new ones are finished.
    Replace,
    /// Results of the same kind are continued.
    Extend,
}

impl Existing {
    /// Returns the rule of a command that continues no results.
    pub fn new(is_forced: bool) -> Existing {
        if is_forced { Existing::Replace } else { Existing::Refuse }
    }
}

/// A folder that this run alone writes results to.
#[derive(Debug)]
pub struct ResultFolder {
    place: PathBuf,
    kind: &'static str,
    /// The folder that has the files until they are finished: `place`, or one beside it that is
    /// made with its first file.
    at: Option<PathBuf>,
    /// Whether this run has made `place`.
    is_made: bool,
    /// The files of this run in `at`, and of the run that it extends.
    sums: Sums,
    _claim: Option<Claim>,
}

impl ResultFolder {
    /// Claims the folder `place` for results of a kind: "run" has the record `run.json`. `planned`
    /// names the files that the run may write.
    ///
    /// # Errors
    /// Fails if results are there and `existing` refuses them, if a planned file is there that
    /// nimbus has not written, if another run writes there, or if no file can be written.
    pub fn open(
        place: &Path,
        kind: &'static str,
        existing: Existing,
        planned: &[String],
    ) -> Result<ResultFolder> {
        let is_forced = existing != Existing::Refuse;
        let check_place = || match place.symlink_metadata() {
            Ok(_) if !place.is_dir() => Err(Error::io(place, "is not a folder; results need one")),
            Ok(_) => check_writable(place),
            Err(_) => Ok(()),
        };
        refuse_existing(place, is_forced)?;
        check_place()?;
        let failed = |cause| Error::io(place, cause);
        fs::create_dir_all(folder_of(place)).map_err(failed)?;
        let claim = Claim::take(place)?;
        // A run that has ended meanwhile may have left results.
        refuse_any(place, is_forced)?;
        check_place()?;
        let is_made = !place.is_dir();
        if is_made {
            fs::create_dir_all(place).map_err(failed)?;
        }
        let mut folder = ResultFolder {
            place: place.to_owned(),
            kind,
            at: Some(place.to_owned()),
            is_made,
            sums: Sums::new(),
            _claim: claim,
        };
        let ours = folder.check(planned, existing)?;
        let list = read_list(&place.join(folder.list()))?;
        if existing == Existing::Extend {
            // Results of a version that kept no list.
            let sum = |name: &String| Some((name.clone(), sum_of(&place.join(name)).ok()?));
            folder.sums = list.unwrap_or_else(|| ours.iter().filter_map(sum).collect());
        } else if list.is_some() || place.join(folder.record()).exists() {
            // Results stay until others are finished.
            folder.at = None;
        }
        Ok(folder)
    }

    fn list(&self) -> String {
        format!("{}.sha256", self.kind)
    }

    fn record(&self) -> String {
        format!("{}.json", self.kind)
    }

    /// Returns the number of files that this run has written, with their list, and its name.
    pub fn n_files(&self) -> (usize, String) {
        (self.sums.len() + 1, self.list())
    }

    /// Returns the folder that finished results go to.
    pub fn place(&self) -> &Path {
        &self.place
    }

    /// Returns the folder that holds results of this run, if it has written any.
    pub fn unfinished_at(&self) -> Option<&Path> {
        self.at.as_deref().filter(|at| !self.sums.is_empty() && at.join(self.list()).exists())
    }

    /// Returns the folder in which unfinished results are kept apart from finished ones, if there
    /// is one.
    pub fn apart(&self) -> Option<&Path> {
        self.at.as_deref().filter(|at| *at != self.place)
    }

    /// Adds a file, which `write` makes at the path that it is given.
    ///
    /// # Errors
    /// Fails if the file cannot be written.
    pub fn add(&mut self, name: &str, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
        let at = self.unfinished()?;
        let failed = |cause| Error::io(&at.join(name), cause);
        let staged = Temporary::folder(folder_of(&at), "results")
            .or_else(|_| Temporary::folder(&at, "results"))
            .map_err(failed)?;
        let path = staged.path.join(name);
        write(&path)?;
        let mut sums = self.sums.clone();
        sums.insert(name.to_owned(), sum_of(&path).map_err(failed)?);
        // The list comes first: a file that it lacks would be the user's.
        write_list(&at.join(self.list()), &sums)?;
        fs::rename(&path, at.join(name)).map_err(failed)?;
        self.sums = sums;
        Ok(())
    }

    /// Replaces the files `names` of unfinished results together. The last of them is the record,
    /// and `write` must make it; `write` may be called twice.
    ///
    /// # Errors
    /// Fails if a file cannot be written; the earlier files then stay.
    pub fn replace(&mut self, names: &[&str], write: impl Fn(&Path) -> Result<()>) -> Result<()> {
        let at = self.unfinished()?;
        self.put(&at, &[], names, &write)
    }

    /// Writes the last files of a run: as [`ResultFolder::finish`] if its results are finished,
    /// else as [`ResultFolder::replace`].
    ///
    /// # Errors
    /// Fails as these.
    pub fn write_last(
        &mut self,
        is_finished: bool,
        names: &[&str],
        write: impl Fn(&Path) -> Result<()>,
    ) -> Result<()> {
        if is_finished { self.finish(names, write) } else { self.replace(names, write) }
    }

    /// Writes the last files of finished results, and puts all files of this run into the place
    /// together. Earlier results of the same kind are removed.
    ///
    /// # Errors
    /// Fails if a file cannot be written, or one is in the way that nimbus has not written. The
    /// error then says where the new results are, if they could be kept.
    pub fn finish(&mut self, names: &[&str], write: impl Fn(&Path) -> Result<()>) -> Result<()> {
        if self.at.as_ref() == Some(&self.place) {
            return self.replace(names, write);
        }
        self.publish(names, &write).map_err(|error| match self.replace(names, &write) {
            Ok(()) => {
                let at = self.apart().unwrap_or(&self.place).display();
                error.with_note(&format!("the new results are in {at}"))
            }
            Err(_) => error,
        })
    }

    /// Puts all files of this run into the place.
    fn publish(&mut self, names: &[&str], write: &dyn Fn(&Path) -> Result<()>) -> Result<()> {
        let added: Vec<String> = self.sums.keys().cloned().collect();
        let wanted: Vec<String> =
            names.iter().map(|name| (*name).to_owned()).chain(added.iter().cloned()).collect();
        let ours = self.check(&wanted, Existing::Replace)?;
        let at = self.at.clone();
        // Each name once: the second move of a file would find none and remove the first.
        let others = ours.iter().chain(&added).map(String::as_str);
        let others: BTreeSet<&str> = others.filter(|name| !names.contains(name)).collect();
        let others: Vec<&str> = others.into_iter().collect();
        self.put(&self.place.clone(), &others, names, &|staged| {
            for (name, at) in added.iter().zip(at.iter().cycle()) {
                let (from, to) = (at.join(name), staged.join(name));
                fs::hard_link(&from, &to)
                    .or_else(|_| fs::copy(&from, &to).map(drop))
                    .map_err(|cause| Error::io(&to, cause))?;
            }
            write(staged)
        })?;
        if let Some(at) = at {
            added.iter().for_each(|name| drop(fs::remove_file(at.join(name))));
            let _ = [self.record(), self.list()].map(|name| fs::remove_file(at.join(name)));
            // Removes the tables of the last round; the place has the finished ones.
            names.iter().for_each(|name| drop(fs::remove_file(at.join(name))));
            let _ = fs::remove_dir(at);
        }
        self.at = Some(self.place.clone());
        Ok(())
    }

    /// Replaces `names` and the list in a folder, and the `others` by what `write` makes of them.
    fn put(
        &mut self,
        folder: &Path,
        others: &[&str],
        names: &[&str],
        write: &dyn Fn(&Path) -> Result<()>,
    ) -> Result<()> {
        let list = self.list();
        let (before, record) = names.split_at(names.len().saturating_sub(1));
        let all = [others, before, &[&list], record].concat();
        let sums = RefCell::new(Sums::new());
        replace_files(folder, &all, |staged| {
            write(staged)?;
            let mut listed = self.sums.clone();
            for name in names {
                let path = staged.join(name);
                match sum_of(&path) {
                    Ok(sum) => drop(listed.insert((*name).to_owned(), sum)),
                    Err(cause) if cause.kind() == ErrorKind::NotFound => drop(listed.remove(*name)),
                    Err(cause) => return Err(Error::io(&path, cause)),
                }
            }
            write_list(&staged.join(&list), &listed)?;
            sums.replace(listed);
            Ok(())
        })?;
        self.sums = sums.into_inner();
        Ok(())
    }

    /// Returns the folder for unfinished files, and makes it if it is one of its own.
    fn unfinished(&mut self) -> Result<PathBuf> {
        if let Some(at) = &self.at {
            return Ok(at.clone());
        }
        let made = partial(&self.place).map_err(|cause| Error::io(&self.place, cause))?;
        Ok(self.at.insert(made).clone())
    }

    /// Checks that nimbus may write `names` in the place, and returns the names of its own files
    /// there. Results that are continued may have changed since they were written.
    fn check(&self, names: &[String], existing: Existing) -> Result<Vec<String>> {
        let at = |name: &str| self.place.join(name);
        let ours: Vec<String> = match read_list(&at(&self.list()))? {
            Some(list) => {
                let is_ours = |(name, sum): &(String, String)| {
                    existing == Existing::Extend
                        || sum_of(&at(name)).is_ok_and(|found| found == *sum)
                };
                list.into_iter().filter(is_ours).map(|(name, _)| name).collect()
            }
            // Results of a version that kept no list.
            None if is_record(&at(&self.record())) => names.to_vec(),
            None => Vec::new(),
        };
        let is_foreign =
            |name: &&String| !ours.contains(name) && at(name).symlink_metadata().is_ok();
        let foreign: Vec<&str> = names.iter().filter(is_foreign).map(String::as_str).collect();
        match foreign[..] {
            [] => Ok(ours),
            [name, ..] => {
                let others = match foreign.len() - 1 {
                    0 => String::new(),
                    n => format!(" and {n} more"),
                };
                let what = "was not written by nimbus, or has changed since";
                let expected = "move it away, or name another folder";
                Err(Error::io(&at(name), format!("{what}{others}; {expected}")))
            }
        }
    }
}

impl Drop for ResultFolder {
    fn drop(&mut self) {
        // An empty folder would only be refused by the next run; others are not removed.
        if self.is_made {
            let _ = fs::remove_dir(&self.place);
        }
        let _ = self.apart().map(fs::remove_dir);
    }
}

/// Makes the folder `NAME.partial` beside `place`, or else in it. Folders of earlier runs that have
/// this name stay.
fn partial(place: &Path) -> io::Result<PathBuf> {
    let place = fs::canonicalize(place)?;
    let name = place.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let made = |folder: &Path, name: &str| -> io::Result<PathBuf> {
        let numbered = (2..).map(|k| format!("{name}.partial-{k}"));
        for name in std::iter::once(format!("{name}.partial")).chain(numbered) {
            match fs::create_dir(folder.join(&name)) {
                Err(cause) if cause.kind() == ErrorKind::AlreadyExists => {}
                made => return made.map(|()| folder.join(name)),
            }
        }
        Err(ErrorKind::AlreadyExists.into())
    };
    made(folder_of(&place), &name).or_else(|_| made(&place, "results"))
}

fn sum_of(path: &Path) -> io::Result<String> {
    if !fs::symlink_metadata(path)?.is_file() {
        return Err(ErrorKind::InvalidData.into());
    }
    let mut hasher = Sha256::new();
    io::copy(&mut fs::File::open(path)?, &mut hasher)?;
    Ok(format!("{:x}", hasher.finalize()))
}

fn write_list(path: &Path, sums: &Sums) -> Result<()> {
    let line = |(name, sum): (&String, &String)| format!("{sum}  {name}\n");
    let text: String = sums.iter().map(line).collect();
    write_atomic(path, |file| file.write_all(text.as_bytes()))
}

/// Reads a list; none if there is no such file.
fn read_list(path: &Path) -> Result<Option<Sums>> {
    if path.symlink_metadata().is_err() {
        return Ok(None);
    }
    // A merge of a million frames has a line for each.
    let text = read_result(path, TABLE_LIMIT)?;
    let parsed = |line: &str| {
        let (sum, name) = line.split_once("  ")?;
        let is_sum = sum.len() == 64 && sum.bytes().all(|b| b.is_ascii_hexdigit());
        // A name that leads out of the folder is not one that nimbus wrote.
        let is_name = Path::new(name).file_name().is_some_and(|file| file == name);
        (is_sum && is_name).then(|| (name.to_owned(), sum.to_owned()))
    };
    let sums: Option<Sums> = text.lines().map(parsed).collect();
    sums.map(Some).ok_or_else(|| {
        let what = "is not a list of results that nimbus wrote";
        Error::io(path, format!("{what}; move it away, or name another folder"))
    })
}

/// Returns whether the file is a record of nimbus.
fn is_record(path: &Path) -> bool {
    let Ok(text) = read_result(path, RECORD_LIMIT) else { return false };
    let record: Option<serde_json::Value> = serde_json::from_str(&text).ok();
    record.is_some_and(|record| record["schema"].is_u64() && record["nimbus"].is_string())
}

#[cfg(test)]
mod tests;
