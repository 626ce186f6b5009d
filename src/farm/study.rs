//! The work of shards of an error study: `nimbus error --part`, in a process of its own, and all
//! parts as one study.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::child;
use super::failing::of_io;
use super::plan::{Plan, Shard};
use super::store::{Manifest, Workplace};
use crate::error::{Error, Result};
use crate::frame::DeviceChoice;
use crate::io::atomic::write_atomic;
use crate::report::charts::{self, Chart};
use crate::studies::error::files::{self, CONFIGURATIONS_FILE};
use crate::studies::error::parts::{Part, differences, join};
use crate::studies::error::records::{STUDY_FILE, Study, TIMES_FILE};
use crate::timing::json;
use crate::timing::machine::Device;
use crate::timing::results::prepare_out_dir;

/// Files that every part has; pictures come on top.
pub const FILES: [&str; 3] = [CONFIGURATIONS_FILE, STUDY_FILE, TIMES_FILE];

/// Measures the configurations of `shard`; on which device.
pub fn measure(
    (plan, shard, arguments): (&Plan, &Shard, &[String]),
    choice: &DeviceChoice,
    workplace: &mut Workplace,
    stop: &AtomicBool,
) -> Result<Device> {
    let part = workplace.folder("part");
    child::run("error", (plan, shard, arguments), choice, &part, stop)?;
    let study: Study = json::read(&part)?;
    workplace.take(&part)?;
    Ok(study.made.device)
}

/// All parts, in the order of their shards, as one study in `out`; the number of its
/// configurations. Refuses, with a list of the differences, where times cannot be compared.
pub fn merge(parts: &[(PathBuf, Manifest)], out: &Path, force: bool) -> Result<usize> {
    let read = |(folder, manifest): &(PathBuf, Manifest)| {
        let (study, found) = files::read_found(folder)?;
        Ok(Part { name: format!("shard {} on {}", manifest.index, manifest.node), study, found })
    };
    let all: Vec<Part> = parts.iter().map(read).collect::<Result<_>>()?;
    child::check_comparable(differences(&all), parts)?;
    let Some((study, found, moved)) = join(&all) else {
        return Err(Error::usage("a plan without shards"));
    };
    prepare_out_dir(out, force)?;
    files::remove_earlier(out)?;
    for picture in &moved {
        let (from, to) = (parts[picture.i_part].0.join(&picture.from), out.join(&picture.to));
        fs::copy(&from, &to).map_err(|cause| of_io(&to, &cause))?;
    }
    if let Some((folder, _)) = parts.first() {
        let (from, to) = (folder.join("reference.png"), out.join("reference.png"));
        fs::copy(&from, &to).map_err(|cause| of_io(&to, &cause))?;
    }
    files::write(out, &study, &found)?;
    let chart = charts::error::chart(&study);
    let svg = chart.svg(chart.size())?;
    write_atomic(&out.join("front.svg"), |file| std::io::Write::write_all(file, svg.as_bytes()))?;
    Ok(study.configurations.len())
}
