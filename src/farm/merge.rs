//! All shards' results in one folder, as one machine would have made them. Everything is verified
//! before, and every copy after.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::bench;
use super::failing::of_io;
use super::plan::{Plan, Work, is_output};
use super::status::ranges;
use super::store::{FileRecord, Manifest, Standing, Store};
use super::synced;
use super::{reference, study};
use crate::error::{Error, Result};
use crate::io::folder::replace_files;

/// Puts the results of the plan in `folder` into `out`, frames all at once; how many. Refuses where
/// a shard is not done. With `force` frames of an earlier merge are replaced, and go.
pub fn merge(folder: &Path, plan: &Plan, out: &Path, force: bool, mixed: bool) -> Result<usize> {
    if !force && out.symlink_metadata().is_ok() {
        return Err(Error::io(out, "exists; --force replaces it"));
    }
    let store = Store::open(folder);
    let parts = verified(plan, &store)?;
    if let Work::Error { .. } = plan.work {
        return study::merge(&parts, out, force);
    }
    if let Work::Bench { cases, .. } = &plan.work {
        return bench::merge(plan, cases, &parts, out, force);
    }
    check_devices(&parts, mixed)?;
    if let Work::Reference(cut) = &plan.work {
        return reference::merge(plan, cut, &parts, out);
    }
    let parts: Vec<_> =
        parts.into_iter().map(|(place, manifest)| (place, manifest.files)).collect();
    let names: Vec<&str> =
        parts.iter().flat_map(|(_, files)| files).map(|file| file.name.as_str()).collect();
    let earlier = earlier(out);
    let gone = earlier.iter().map(String::as_str).filter(|name| !names.contains(name));
    let files: Vec<&str> = gone.chain(names.iter().copied()).collect();
    replace_files(out, &files, |staged| copy_all(&parts, staged))?;
    Ok(names.len())
}

/// Refuses frames of several devices or drivers, unless they are meant to be `mixed`: they differ
/// in their last bits.
fn check_devices(parts: &[(PathBuf, Manifest)], mixed: bool) -> Result<()> {
    let mut by_device: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (_, Manifest { device, index, .. }) in parts {
        by_device.entry(device.class()).or_default().push(*index);
    }
    if mixed || by_device.len() < 2 {
        return Ok(());
    }
    let list: String = by_device
        .iter()
        .map(|(name, indices)| format!("\n  {name}: shards {}", ranges(indices)))
        .collect();
    let what = "pictures of several devices are no single machine's";
    Err(Error::Check { what: format!("{what}, --mixed merges them all the same:{list}") })
}

/// Frames that lie in `out`.
fn earlier(out: &Path) -> Vec<String> {
    let entries = fs::read_dir(out).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    names.filter(|name| is_output(name)).collect()
}

/// Every shard's folder and what is in it, in the plan's order.
fn verified(plan: &Plan, store: &Store) -> Result<Vec<(PathBuf, Manifest)>> {
    let (mut parts, mut missing, mut broken) = (Vec::new(), Vec::new(), String::new());
    for shard in &plan.shards {
        match store.standing(plan, shard) {
            Standing::Verified(manifest) => {
                parts.push((store.place(&shard.key), *manifest));
                continue;
            }
            Standing::Unreadable(error) => return Err(error),
            Standing::Broken(what) if broken.is_empty() => {
                broken = format!(" (shard {}: {what})", shard.index)
            }
            Standing::Missing | Standing::Broken(_) => {}
        }
        missing.push(shard.index);
    }
    if missing.is_empty() {
        return Ok(parts);
    }
    let (n_done, n, to_do) = (parts.len(), plan.shards.len(), ranges(&missing));
    Err(Error::Check {
        what: format!(
            "{n_done} of {n} shards are done, nothing was merged; to do: {to_do}{broken}"
        ),
    })
}

fn copy_all(parts: &[(PathBuf, Vec<FileRecord>)], to: &Path) -> Result<()> {
    for (from, files) in parts {
        for file in files {
            let (source, copy) = (from.join(&file.name), to.join(&file.name));
            fs::copy(&source, &copy).map_err(|cause| of_io(&copy, &cause))?;
            file.check(to).map_err(|wrong| wrong.error(to))?;
            synced::folder(&copy)?;
        }
    }
    synced::folder(to)
}
