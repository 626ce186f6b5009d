//! The work of shards of a sweep: `nimbus bench --part`, in a process of its own, and all parts as
//! one bench.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::child;
use super::plan::{Plan, Shard};
use super::store::{Manifest, Workplace};
use crate::error::{Error, Result};
use crate::frame::DeviceChoice;
use crate::timing::attachments::{Attachments, picture_file};
use crate::timing::frame_rows::FRAMES_FILE;
use crate::timing::json;
use crate::timing::machine::Device;
use crate::timing::parts::{Part, differences, join, numbers};
use crate::timing::records::{Case, Run};
use crate::timing::results::{RUN_FILE, prepare_out_dir, write_results};

/// Files that the part of `shard` has.
pub fn files(shard: &Shard) -> Vec<String> {
    let mut names: Vec<String> = (0..numbers(&range(shard)).len()).map(picture_file).collect();
    names.extend([FRAMES_FILE, RUN_FILE].map(str::to_owned));
    names.sort();
    names
}

fn range(shard: &Shard) -> std::ops::Range<usize> {
    shard.first as usize..(shard.first + shard.n) as usize
}

/// Times the cases of `shard`; on which device.
pub fn measure(
    (plan, shard, arguments): (&Plan, &Shard, &[String]),
    choice: &DeviceChoice,
    workplace: &mut Workplace,
    stop: &AtomicBool,
) -> Result<Device> {
    let part = workplace.folder("part");
    child::run("bench", (plan, shard, arguments), choice, &part, stop)?;
    let run: Run = json::read(&part)?;
    workplace.take(&part)?;
    Ok(run.device)
}

/// All parts, in the order of their shards, as one bench in `out`, whose cases are called `names`;
/// how many. Refuses, with a list of the differences, where times cannot be compared.
pub fn merge(
    plan: &Plan,
    names: &[String],
    parts: &[(PathBuf, Manifest)],
    out: &Path,
    force: bool,
) -> Result<usize> {
    let read = |((folder, manifest), shard): (&(PathBuf, Manifest), &Shard)| {
        let name = format!("shard {} on {}", manifest.index, manifest.node);
        Part::read(folder, name, manifest.node.clone(), range(shard))
    };
    let all: Vec<Part> = parts.iter().zip(&plan.shards).map(read).collect::<Result<_>>()?;
    child::check_comparable(differences(&all), parts)?;
    let Some(joined) = join(&all) else { return Err(Error::usage("a plan without shards")) };
    let found: Vec<String> = joined.run.cases.iter().map(Case::name).collect();
    if found != names {
        let what = format!(
            "the parts' cases ({}) are not the plan's ({})",
            found.join("; "),
            names.join("; ")
        );
        return Err(Error::Check { what });
    }
    prepare_out_dir(out, force)?;
    let copies = joined
        .pictures
        .iter()
        .map(|moved| (moved.to.clone(), parts[moved.i_part].0.join(&moved.from)));
    let beside = Attachments { copies: copies.collect(), ..Attachments::default() };
    write_results(out, &joined.run, &joined.table, &beside)?;
    Ok(joined.run.cases.len())
}
