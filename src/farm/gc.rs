//! Clears away what attempts left.

use std::fs;
use std::io::ErrorKind::{DirectoryNotEmpty, NotFound};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::failing::of_io;
use super::plan::Plan;
use super::store::{Other, Standing, Store};
use crate::error::Result;

/// What was, or would be, removed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Removed {
    pub path: PathBuf,
    pub bytes: u64,
}

/// Removes unfinished folders: of shards that are done, and those in which nothing has happened for
/// `idle`. With `all` also what was put aside. With `dry` it only says so.
pub fn gc(
    folder: &Path,
    plan: &Plan,
    idle: Duration,
    all: bool,
    dry: bool,
) -> Result<Vec<Removed>> {
    let store = Store::open(folder);
    let (others, mut removed) = (store.others(), Vec::new());
    for shard in &plan.shards {
        let unfinished = others.of(&shard.key, Other::Unfinished);
        let is_done =
            !unfinished.is_empty() && matches!(store.standing(plan, shard), Standing::Verified(_));
        let mut paths: Vec<PathBuf> =
            unfinished.iter().filter(|path| is_done || is_idle(path, idle)).cloned().collect();
        if all {
            paths.extend(
                [Other::Bad, Other::Differing]
                    .iter()
                    .flat_map(|kind| others.of(&shard.key, *kind).iter().cloned()),
            );
        }
        for path in paths {
            let bytes = bytes_of(&path);
            if !dry {
                // What was put aside need not have been a folder.
                let is_folder = fs::symlink_metadata(&path).is_ok_and(|about| about.is_dir());
                let gone =
                    if is_folder { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
                match gone {
                    Ok(()) => {}
                    // A run has cleared it away, or still works in it: the next time.
                    Err(cause) if [NotFound, DirectoryNotEmpty].contains(&cause.kind()) => continue,
                    Err(cause) => return Err(of_io(&path, &cause)),
                }
            }
            removed.push(Removed { path, bytes });
        }
    }
    Ok(removed)
}

/// A folder's time is that of the last file that was made in it.
fn is_idle(path: &Path, idle: Duration) -> bool {
    let changed = fs::symlink_metadata(path).and_then(|about| about.modified());
    // A clock that is ahead of ours makes it young.
    changed.is_ok_and(|at| SystemTime::now().duration_since(at).is_ok_and(|since| since >= idle))
}

fn bytes_of(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter_map(|entry| entry.metadata().ok()).map(|about| about.len()).sum()
}
