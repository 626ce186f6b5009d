//! The results of all shards in one folder, as one machine would have made them.

use std::collections::BTreeMap;
use std::path::Path;

use super::plan::Plan;
use super::ranges::ranges;
use super::store::{ResultState, Store};
use super::work::{Merge, Merged, ShardResult};
use crate::error::{Error, Result};
use crate::io::atomic::check_folder_of;
use crate::io::claim::refuse_existing;
use crate::io::result_folder::Existing;

/// The place of a merged result, and what is allowed there.
#[derive(Debug, Clone, Copy)]
pub struct MergeOptions<'a> {
    /// The folder that gets the merged result.
    pub out: &'a Path,
    /// Whether results in that folder are replaced.
    pub force: bool,
    /// Whether pictures of several classes of devices are merged.
    pub mixed: bool,
}

/// Verifies all results of the plan in `folder` and merges them.
///
/// # Errors
/// When a shard is not done, results do not fit together, or the folder exists and is not to be
/// replaced. Nothing is written then.
pub fn merge(folder: &Path, plan: &Plan, options: &MergeOptions<'_>) -> Result<Merged> {
    let MergeOptions { out, force, mixed } = *options;
    check_folder_of(out)?;
    refuse_existing(out, force)?;
    let results = verified(folder, plan)?;
    if plan.work.is_exact() && !mixed {
        check_devices(&results)?;
    }
    plan.work.merge(&Merge {
        results: &results,
        out,
        existing: Existing::new(force),
        scene: &plan.scene,
        build: [&plan.nimbus, &plan.revision, &plan.code],
        load: &|| plan.scene_as_planned(),
    })
}

/// Refuses results of several classes of devices: their pictures differ in the last bits.
fn check_devices(results: &[ShardResult]) -> Result<()> {
    let mut by_device: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for ShardResult { manifest, .. } in results {
        by_device.entry(manifest.device.class()).or_default().push(manifest.index);
    }
    if by_device.len() < 2 {
        return Ok(());
    }
    let line =
        |(name, indices): (&String, &Vec<usize>)| format!("\n  {name}: shards {}", ranges(indices));
    let list: String = by_device.iter().map(line).collect();
    let what = "results of several devices differ in their last bits";
    Err(Error::Check { what: format!("{what}, --mixed merges them all the same:{list}") })
}

/// Returns the results of all shards in the plan's order.
fn verified(folder: &Path, plan: &Plan) -> Result<Vec<ShardResult>> {
    let store = Store::new(folder, plan);
    let (mut results, mut missing, mut broken) = (Vec::new(), Vec::new(), String::new());
    for shard in &plan.shards {
        match store.state(shard) {
            ResultState::Verified(manifest) => {
                let (folder, items) = (store.place(shard), shard.items());
                results.push(ShardResult { folder, items, manifest: *manifest });
                continue;
            }
            ResultState::Unreadable(error) => return Err(error),
            ResultState::Broken(what) if broken.is_empty() => {
                broken = format!(" (shard {}: {what})", shard.index)
            }
            ResultState::Missing | ResultState::Broken(_) => {}
        }
        missing.push(shard.index);
    }
    if missing.is_empty() {
        return Ok(results);
    }
    let (n_done, n, to_do) = (results.len(), plan.shards.len(), ranges(&missing));
    let what =
        format!("{n_done} of {n} shards are done, nothing was merged; to do: {to_do}{broken}");
    Err(Error::Check { what })
}
