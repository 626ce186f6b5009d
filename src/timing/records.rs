//! The types of `run.json`, which docs/reference/schemas/run.schema.json describes.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::check::{Check, Stages};
use super::invocations::PassInvocations;
use super::json::ResultFile;
use super::machine::{Clocks, Cpu, Device};
use super::names::{Setting, case_name, loop_name, mode_name, sweep_text};
use super::overlap::Overlap;
use super::precision::{PrecisionRecord, Reached};
use super::roofs::Ceilings;
use super::state::{CaseState, RunState};
use crate::frame::Counts;
use crate::measure::lows::Lows;
use crate::measure::stats::Summary;

/// The whole of `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Schema version, [`ResultFile::SCHEMA`].
    pub schema: u32,
    /// Version of nimbus.
    pub nimbus: String,
    /// Git revision that was built, with "-dirty" if sources were modified; "unknown" outside a
    /// checkout.
    pub revision: String,
    /// Name and version of the program that drew; absent if nimbus did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool: Option<String>,
    /// Start of the run, UTC, ISO 8601.
    pub date: String,
    /// The command line.
    pub command: Vec<String>,
    /// SHA-256 of the resolved scene, in hex.
    pub scene_hash: String,
    /// The scene with every default filled in.
    pub scene: serde_json::Value,
    /// Vulkan device.
    pub device: Device,
    /// Processor.
    pub cpu: Cpu,
    /// Environment variables that change what drivers do.
    pub environment: BTreeMap<String, String>,
    /// Clocks of host and device.
    pub clocks: Clocks,
    /// Every block in the order in which they ran: A B, B A, and so on, so that a drift affects all
    /// alike.
    pub block_order: Vec<Block>,
    /// One case for each phase and point of the sweep, in order; a scene with neither has one.
    pub cases: Vec<Case>,
    /// The stages of pictures on this device; null if they were not checked.
    #[serde(default)]
    pub stages: Option<Stages>,
    /// The settings that "auto" chose in each case, with the times and errors that decided.
    #[serde(default)]
    pub chosen: Vec<String>,
    /// The parts that nodes of a farm timed; empty if one process ran all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<PartRecord>,
    /// Whether Ctrl-C or an error came before the end; the record then holds what was finished.
    pub interrupted: bool,
    /// The precision that was asked for, which decided the number of blocks; null if blocks were
    /// counted.
    #[serde(default)]
    pub precision: Option<PrecisionRecord>,
    /// The state of the machine during the run. Null if it was not read, and where nodes of a farm
    /// timed the cases: `parts` then has that of each node.
    #[serde(default)]
    pub state: Option<RunState>,
    /// The roofs that the shares of passes are of; null if the device's were not measured.
    #[serde(default)]
    pub ceilings: Option<Ceilings>,
    /// Bytes that the device wrote before each pass, so that caches were cold; null if they were
    /// left as they were. The times of frames then contain these writes.
    #[serde(default)]
    pub cold_bytes: Option<u64>,
}

impl Run {
    /// Returns the number of starts of the program that ran blocks.
    pub fn n_starts(&self) -> usize {
        self.block_order.iter().map(|block| block.start).collect::<BTreeSet<u32>>().len()
    }

    /// Returns the name and version of the program that drew.
    pub fn program(&self) -> String {
        let ours = || format!("nimbus {} {}", self.nimbus, self.revision);
        self.tool.clone().unwrap_or_else(ours)
    }

    /// Returns every loop with its case, in order.
    pub fn modes(&self) -> impl Iterator<Item = (&Case, &Mode)> {
        self.cases.iter().flat_map(|case| case.modes.iter().map(move |mode| (case, mode)))
    }
}

impl ResultFile for Run {
    const FILE: &'static str = "run.json";
    const SCHEMA: u32 = 3;
}

/// Consecutive frames of one case in one loop.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Block {
    /// Number of the case.
    pub case: usize,
    /// "serial" or "parallel".
    pub threading: String,
    /// Whether frames skip passes.
    pub skip: bool,
    /// Number of the start of the program that ran it, from 0.
    #[serde(default)]
    pub start: u32,
}

/// The scene in one of its phases, at one point of the sweep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Case {
    /// Name of the phase.
    pub phase: Option<String>,
    /// The point of the sweep.
    pub sweep: Vec<Setting>,
    /// SHA-256 of the resolved scene at this point of the sweep, with its files and phases.
    pub scene_hash: String,
    /// Particles of the scene.
    pub particles: u64,
    /// Width of the film in pixels.
    pub width: u32,
    /// Height of the film in pixels.
    pub height: u32,
    /// One record a loop.
    pub modes: Vec<Mode>,
    /// Parallel by serial frame time, if both ran; below 1 the parallel loop is faster.
    pub ratio: Option<Ratio>,
    /// Gain that overlap could bring and brought; null if the serial loop did not run.
    pub overlap: Option<Overlap>,
    /// Device time that skipping saved; null if the loop without skipping was not timed.
    pub skipping: Option<Skipping>,
    /// Counts of odd values in its last frame; null if the case did not run to its end.
    #[serde(default)]
    pub counts: Option<Counts>,
    /// Name of the loop whose times are the figure of the case: the first loop, or, if nothing
    /// moves, the one without skipping. Null if that loop has no timed frame.
    #[serde(default)]
    pub figure: Option<String>,
    /// The check of its pictures. Null in results of versions that did not check them.
    #[serde(default)]
    pub check: Option<Check>,
    /// How narrow its intervals are; null if blocks were counted.
    #[serde(default)]
    pub precision: Option<Reached>,
    /// The state of the machine while its timed frames ran; null if it was not read.
    #[serde(default)]
    pub state: Option<CaseState>,
    /// What each pass invoked in one more frame, in which every pass ran that the scene needs. Null
    /// without `--invocations`, and on devices without counters.
    #[serde(default)]
    pub invocations: Option<Vec<PassInvocations>>,
}

impl Case {
    /// Returns phase and sweep in words; empty if there is neither.
    pub fn name(&self) -> String {
        case_name(self.phase.as_deref().unwrap_or_default(), &sweep_text(&self.sweep))
    }

    /// Returns whether nothing moves: at least half of the timed frames of a loop that skips drew
    /// nothing, so that the loop's median is the time of an empty frame.
    pub fn is_still(&self) -> bool {
        self.modes.iter().any(Mode::is_mostly_empty)
    }

    /// Returns the loop whose times are the figure of the case, as `figure` names it. Results of
    /// earlier versions do not name one.
    pub fn figure_mode(&self) -> Option<&Mode> {
        let is_still = self.is_still();
        self.modes.iter().find(|m| m.frames > 0 && !(is_still && m.skip))
    }

    /// Returns the loops, the one with the figure first.
    pub fn figure_first(&self) -> impl Iterator<Item = &Mode> {
        let figure = self.figure_mode();
        let is_figure = move |m: &&Mode| figure.is_some_and(|figure| std::ptr::eq(figure, *m));
        figure.into_iter().chain(self.modes.iter().filter(move |m| !is_figure(m)))
    }

    /// Returns whether nothing moves and a loop skips: its times are those of frames that draw
    /// nothing.
    pub fn draws_nothing(&self, mode: &Mode) -> bool {
        mode.skip && self.is_still()
    }

    /// Returns whether a loop draws nothing while another one has the figure of the case. Charts
    /// and comparisons leave such loops out.
    pub fn is_left_out(&self, mode: &Mode) -> bool {
        self.draws_nothing(mode) && self.figure_mode().is_some()
    }
}

/// Mean device time of a frame, in ms, with and without skipping; the difference is saved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Skipping {
    /// With skipping.
    pub gpu_ms: f64,
    /// Without skipping.
    pub gpu_no_skip_ms: f64,
    /// Whether the last frames have the same bytes; null if one of them was not reached.
    pub same_bytes: Option<bool>,
}

/// Statistics of a list of times, and the 95 % bootstrap interval of its median.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Statistics, in ms.
    #[serde(flatten)]
    pub of: Summary,
    /// Lower end of the interval; null if there are too few frames for one.
    pub p50_low: Option<f64>,
    /// Upper end of the interval.
    pub p50_high: Option<f64>,
}

/// One loop of a case. Warm-up frames enter no statistic; a statistic is null if no finite time was
/// measured.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Mode {
    /// "serial" or "parallel".
    pub threading: String,
    /// False if every pass ran in every frame.
    pub skip: bool,
    /// "gpu" or "cpu": which of them moves the particles.
    pub simulate: String,
    /// Timed frames.
    pub frames: usize,
    /// Warm-up frames of a block.
    pub warm_up: usize,
    /// Blocks.
    pub blocks: usize,
    /// From the end of one frame to the end of the next.
    pub frame_ms: Option<Measured>,
    /// "1 % low" frame rates of `frame_ms`, by three definitions.
    pub frame_lows: Option<Lows>,
    /// Game step.
    pub game_ms: Option<Measured>,
    /// Uploading, planning and recording.
    pub record_ms: Option<Measured>,
    /// Submission to the driver.
    pub submit_ms: Option<Measured>,
    /// Wait for the device.
    pub wait_ms: Option<Measured>,
    /// Recording, submission and the wait for the device.
    pub render_ms: Option<Measured>,
    /// Device time of all passes.
    pub gpu_ms: Option<Measured>,
    /// From the start of a frame's game step to the end of its render step.
    pub latency_ms: Option<Measured>,
    /// Mean number of frames that the device still had when it was handed one.
    pub queue_depth: Option<f64>,
    /// Least, mean and greatest number of particles drawn in a frame.
    pub drawn: Option<[f64; 3]>,
    /// Timed frames that skipped every pass, so that the picture of an earlier frame was shown
    /// again. Null in results of versions that did not count them.
    #[serde(default)]
    pub empty_frames: Option<usize>,
    /// Frames that showed distant particles from the impostors of an earlier frame.
    pub impostors_reused: usize,
    /// One record a pass.
    pub passes: Vec<Pass>,
    /// SHA-256 of the last frame's pixels, if it was computed.
    pub image_hash: Option<String>,
    /// Greatest median frame time of a block divided by the least, which shows how steady the
    /// machine was; null for one block.
    pub block_spread: Option<f64>,
}

impl Mode {
    /// Returns the name of the loop.
    pub fn name(&self) -> String {
        loop_name(&self.threading, self.skip)
    }

    /// Returns the number of timed frames that drew nothing. Results of versions that did not count
    /// them only tell whether all did.
    pub fn n_empty(&self) -> usize {
        let none_ran = || !self.passes.is_empty() && self.passes.iter().all(|p| p.n_run == 0);
        self.empty_frames.unwrap_or_else(|| if none_ran() { self.frames } else { 0 })
    }

    /// Returns whether at least half of the timed frames drew nothing.
    pub fn is_mostly_empty(&self) -> bool {
        self.skip && self.frames > 0 && 2 * self.n_empty() >= self.frames
    }

    /// Returns "case: loop"; the loop alone for a case without a name.
    pub fn name_in(&self, case: &Case) -> String {
        mode_name(&case.name(), &self.threading, self.skip)
    }
}

/// A pass in one loop of a case.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Pass {
    /// Name of the pass.
    pub name: String,
    /// Median over the frames that it ran in; null if it never ran or was not timed.
    pub p50_ms: Option<f64>,
    /// Share of the device time of all passes.
    pub share: Option<f64>,
    /// Frames that it ran in.
    pub n_run: usize,
    /// Frames that skipped it.
    pub n_skipped: usize,
    /// Reason of the last skip.
    pub reason: Option<String>,
    /// Every reason for which it was skipped, the most frequent first.
    pub reasons: Vec<Reason>,
    /// Device time a frame that skipping this pass saved: its median time in the loop without
    /// skipping, times the share of frames that skipped it. Null if that loop was not timed.
    pub saved_ms: Option<f64>,
    /// Least bytes that the pass moves in the case's last frame; null if they are not known.
    #[serde(default)]
    pub bytes: Option<f64>,
    /// Least operations on 32-bit floats of the pass in that frame.
    #[serde(default)]
    pub operations: Option<f64>,
    /// Share of the roof that its median time reaches: the least time for these bytes, or for these
    /// operations if that is longer, divided by the median. Null if the roof is not known.
    #[serde(default)]
    pub roof_share: Option<f64>,
}

impl Pass {
    /// Returns whether skipping left work of this pass out, as far as the loop without skipping
    /// tells. A pass that the scene does not need has no work.
    pub fn lacks_work(&self) -> bool {
        self.n_skipped > 0 && self.saved_ms.is_some_and(|saved| saved > 0.0)
    }
}

/// Why a pass was skipped, and in how many frames.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reason {
    /// The reason in words.
    pub reason: String,
    /// Frames.
    pub n: usize,
}

/// Median parallel frame time divided by the median serial frame time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Ratio {
    /// The ratio.
    pub parallel_by_serial: f64,
    /// Lower end of its 95 % bootstrap interval; null if there are too few frames for one.
    pub low: Option<f64>,
    /// Upper end of the interval.
    pub high: Option<f64>,
}

/// A part of a bench that one process timed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PartRecord {
    /// First of its cases, as a place in `cases`. The first case of all was timed with them.
    pub first: usize,
    /// End of its cases, exclusive.
    pub end: usize,
    /// Name of the node.
    pub node: String,
    /// Start, UTC, ISO 8601.
    pub date: String,
    /// Clocks of the node.
    pub clocks: Clocks,
    /// The first case of all as this node timed it, one record a loop; shows how far nodes differ.
    pub base: Vec<BaseTime>,
    /// The state of the node while it timed its cases; null if it was not read.
    #[serde(default)]
    pub state: Option<RunState>,
}

/// The time that a node took for the first case, in one loop.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BaseTime {
    /// "serial" or "parallel".
    pub threading: String,
    /// Whether frames skip passes.
    pub skip: bool,
    /// Median frame time in ms; null if no finite time was measured.
    pub p50_ms: Option<f64>,
}

impl BaseTime {
    /// Returns the name of the loop.
    pub fn name(&self) -> String {
        loop_name(&self.threading, self.skip)
    }
}
