//! Removal of what attempts have left behind.

use std::fs;
use std::io::ErrorKind::{DirectoryNotEmpty, NotFound};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::plan::Plan;
use super::store::{Leftover, ResultState, Store};
use super::transient::io_error;
use crate::error::Result;

/// A choice of what is removed.
#[derive(Debug, Clone, Copy)]
pub struct GcOptions {
    /// Unfinished folders of open shards are removed after this time without a change.
    pub idle: Duration,
    /// Whether results that were put aside are removed, too.
    pub all: bool,
    /// Whether everything stays and is only listed.
    pub dry_run: bool,
}

/// A folder that was removed, or would be in a dry run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Removed {
    /// Its path.
    pub path: PathBuf,
    /// The length of its files together.
    pub bytes: u64,
}

/// Removes the unfinished folders of shards that are done, those that are idle, and on request
/// results that were put aside.
///
/// # Errors
/// When a folder cannot be removed.
pub fn gc(folder: &Path, plan: &Plan, options: &GcOptions) -> Result<Vec<Removed>> {
    let store = Store::new(folder, plan);
    let (leftovers, mut removed) = (store.leftovers(), Vec::new());
    for shard in &plan.shards {
        let unfinished = leftovers.of(shard, Leftover::Unfinished);
        let is_done =
            !unfinished.is_empty() && matches!(store.state(shard), ResultState::Verified(_));
        let gone = unfinished.iter().filter(|path| is_done || is_idle(path, options.idle));
        let kinds = [Leftover::Bad, Leftover::Differing];
        let aside = kinds.iter().flat_map(|kind| leftovers.of(shard, *kind));
        for path in gone.chain(aside.filter(|_| options.all)) {
            let bytes = bytes_of(path);
            if options.dry_run || remove(path)? {
                removed.push(Removed { path: path.clone(), bytes });
            }
        }
    }
    Ok(removed)
}

/// Removes a folder, or the file that someone put in its place. Returns false where a run has
/// removed it already or still works in it.
fn remove(path: &Path) -> Result<bool> {
    let is_folder = fs::symlink_metadata(path).is_ok_and(|about| about.is_dir());
    match if is_folder { fs::remove_dir_all(path) } else { fs::remove_file(path) } {
        Ok(()) => Ok(true),
        Err(cause) if [NotFound, DirectoryNotEmpty].contains(&cause.kind()) => Ok(false),
        Err(cause) => Err(io_error(path)(cause)),
    }
}

/// A folder's time is that of the last file that was made in it. A time in the future, by another
/// machine's clock, counts as now.
fn is_idle(path: &Path, idle: Duration) -> bool {
    let changed = fs::symlink_metadata(path).and_then(|about| about.modified());
    changed.is_ok_and(|at| SystemTime::now().duration_since(at).is_ok_and(|since| since >= idle))
}

fn bytes_of(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter_map(|entry| entry.metadata().ok()).map(|about| about.len()).sum()
}
