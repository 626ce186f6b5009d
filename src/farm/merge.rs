//! All shards' results in one folder, as one machine would have made them. Everything is verified before, and every copy after.

use std::fs;
use std::path::{Path, PathBuf};

use super::failing::of_io;
use super::plan::{Plan, is_output};
use super::status::Status;
use super::store::{FileRecord, Standing, Store};
use super::synced;
use crate::error::{Error, Result};
use crate::io::folder::replace_files;

/// Puts the frames of the plan in `folder` into `out`, which appears whole; their number. Refuses where a shard is not done. With
/// `force` frames of an earlier merge are replaced, and go.
pub fn merge(folder: &Path, plan: &Plan, out: &Path, force: bool) -> Result<usize> {
    if !force && out.symlink_metadata().is_ok() {
        return Err(Error::io(out, "exists; --force replaces it"));
    }
    let store = Store::open(folder);
    let parts = verified(folder, plan, &store)?;
    let names: Vec<&str> = parts.iter().flat_map(|(_, files)| files).map(|file| file.name.as_str()).collect();
    let earlier = earlier(out);
    let gone = earlier.iter().map(String::as_str).filter(|name| !names.contains(name));
    let files: Vec<&str> = gone.chain(names.iter().copied()).collect();
    replace_files(out, &files, |staged| copy_all(&parts, staged))?;
    Ok(names.len())
}

/// Frames that lie in `out`.
fn earlier(out: &Path) -> Vec<String> {
    let entries = fs::read_dir(out).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    names.filter(|name| is_output(name)).collect()
}

/// Every shard's folder and files, in the plan's order.
fn verified(folder: &Path, plan: &Plan, store: &Store) -> Result<Vec<(PathBuf, Vec<FileRecord>)>> {
    let mut parts = Vec::new();
    for shard in &plan.shards {
        if let Standing::Verified(manifest) = store.standing(plan, shard) {
            parts.push((store.place(&shard.key), manifest.files));
        }
    }
    if parts.len() == plan.shards.len() {
        return Ok(parts);
    }
    let status: Status = super::status::status(folder, plan)?;
    let (n_done, n) = (status.n_done, plan.shards.len());
    let broken = status.shards.iter().find(|s| s.state == super::status::State::Broken);
    let broken = broken.map_or(String::new(), |s| format!(" (shard {}: {})", s.index, s.what.as_deref().unwrap_or("")));
    Err(Error::Check {
        what: format!("{n_done} of {n} shards are done, nothing was merged; to do: {}{broken}", status.missing()),
    })
}

fn copy_all(parts: &[(PathBuf, Vec<FileRecord>)], to: &Path) -> Result<()> {
    for (from, files) in parts {
        for file in files {
            let (source, copy) = (from.join(&file.name), to.join(&file.name));
            fs::copy(&source, &copy).map_err(|cause| of_io(&copy, &cause))?;
            file.check(to).map_err(|what| Error::Transient { what: format!("{}: {what}", to.display()) })?;
            synced::folder(&copy)?;
        }
    }
    synced::folder(to)
}
