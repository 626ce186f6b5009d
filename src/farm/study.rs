//! The work of shards of an error study: `nimbus error --part`, in a process of its own, and all parts as one study.

use std::fs;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::failing::of_io;
use super::plan::{Plan, Shard};
use super::pool::ask_to_end;
use super::store::{Manifest, Workplace};
use crate::error::{Error, Result};
use crate::frame::stage::DeviceChoice;
use crate::io::atomic::write_atomic;
use crate::study::machine::Device;
use crate::study::plot::{self, Plot};
use crate::study::records::prepare_out_dir;
use crate::study::tradeoff::files::{self, CONFIGURATIONS_FILE};
use crate::study::tradeoff::parts::{Part, differences, join};
use crate::study::tradeoff::records::{STUDY_FILE, TIMES_FILE};

/// Files that every part has; pictures come on top.
pub const FILES: [&str; 3] = [CONFIGURATIONS_FILE, STUDY_FILE, TIMES_FILE];
/// Said by job scripts of whole nodes, and by a pool of one process: nobody else's work is in the times.
pub const EXCLUSIVE: &str = "NIMBUS_EXCLUSIVE";

/// How often a child is looked at.
const LOOK: Duration = Duration::from_millis(20);

/// Measures the configurations of `shard`; on which device.
pub fn measure(
    (plan, shard, arguments): (&Plan, &Shard, &[String]),
    choice: &DeviceChoice,
    workplace: &mut Workplace,
    stop: &AtomicBool,
) -> Result<Device> {
    let part = workplace.folder("part");
    let mut command = Command::new(program()?);
    command.arg("error").arg(&plan.scene.file).args(arguments);
    command.arg(format!("--part={}..{}", shard.first, shard.first + shard.n)).arg("--out").arg(&part).arg("--quiet");
    command.args(plan.scene.set.iter().flat_map(|set| ["--set", set]));
    command.args(plan.scene.seed.iter().map(|seed| format!("--seed={seed}")));
    command.args(choice.shaders.iter().map(|shaders| format!("--shaders={}", shaders.display())));
    command.args(choice.device.iter().map(|device| format!("--device={device}")));
    command.args(choice.validation.then_some("--validation"));
    // A terminal's Ctrl-C would reach it twice, and twice means at once.
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).process_group(0);
    let child = command.spawn().map_err(|cause| Error::io(Path::new("nimbus"), cause))?;
    ended(child, stop)?;
    let study = files::read_study(&part)?;
    workplace.take(&part)?;
    Ok(study.made.device)
}

fn program() -> Result<PathBuf> {
    std::env::current_exe().map_err(|cause| Error::io(Path::new("nimbus"), cause))
}

/// Waits for it; its error as one of ours.
fn ended(mut child: Child, stop: &AtomicBool) -> Result<()> {
    let failed = |cause| Error::io(Path::new("nimbus error"), cause);
    let mut is_asked = false;
    while child.try_wait().map_err(failed)?.is_none() {
        if stop.load(Ordering::Relaxed) && !is_asked {
            is_asked = true;
            ask_to_end(&child);
        }
        std::thread::sleep(LOOK);
    }
    let output = child.wait_with_output().map_err(failed)?;
    let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
    match output.status.code() {
        Some(0) => Ok(()),
        _ if is_asked => Err(Error::Interrupted),
        // A device, a signal.
        Some(3 | 130) | None => Err(Error::Transient { what: said }),
        Some(_) if said.contains("No space left") => Err(Error::Transient { what: said }),
        Some(code) => Err(Error::usage(format!("nimbus error ended with exit code {code}: {said}"))),
    }
}

/// All parts, in the order of their shards, as one study in `out`; the number of its configurations. Refuses, with a list of the
/// differences, where times cannot be compared.
pub fn merge(parts: &[(PathBuf, Manifest)], out: &Path, force: bool) -> Result<usize> {
    let read = |(folder, manifest): &(PathBuf, Manifest)| {
        let (study, found) = files::read_found(folder)?;
        Ok(Part { name: format!("shard {} on {}", manifest.index, manifest.node), study, found })
    };
    let all: Vec<Part> = parts.iter().map(read).collect::<Result<_>>()?;
    let mut differ = differences(&all);
    let shared = parts.iter().filter(|(_, manifest)| !manifest.exclusive).map(|(_, m)| m.index.to_string());
    let shared: Vec<String> = shared.collect();
    if !shared.is_empty() {
        let what = "not known to have had a node for themselves";
        differ.push(format!("{what} ({EXCLUSIVE}=1 says so): shards {}", shared.join(", ")));
    }
    if !differ.is_empty() {
        let list = differ.iter().map(|what| format!("\n  {what}")).collect::<String>();
        return Err(Error::Check { what: format!("times that cannot be compared are not merged:{list}") });
    }
    let Some((study, found, moved)) = join(&all) else { return Err(Error::usage("a plan without shards")) };
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
    let chart = plot::tradeoff::chart(&study);
    let svg = chart.svg(chart.size())?;
    write_atomic(&out.join("front.svg"), |file| std::io::Write::write_all(file, svg.as_bytes()))?;
    Ok(study.configurations.len())
}
