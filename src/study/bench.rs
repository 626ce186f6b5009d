//! The serial and the parallel loop on the same frames, in interleaved blocks.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, Ordering};

use sha2::{Digest, Sha256};

use super::overlap::{Overlap, SerialFrame};
use super::records::{self, FrameRow, Mode, Pass as PassRecord, Ratio};
use super::stage::Stage;
use crate::error::{Error, Result};
use crate::frame::FrameTimes;
use crate::frame::plan::Pass;
use crate::frame::render::Renderer;
use crate::gpu::shader::hex;
use crate::measure::bootstrap::{Bootstrap, Interval};
use crate::measure::clock::ClockQuality;
use crate::measure::lows::Lows;
use crate::measure::stats::{Summary, median};
use crate::model::scene::{Simulate, Threading};

/// How long and how often.
#[derive(Debug, Clone)]
pub struct BenchPlan {
    pub modes: Vec<Threading>,
    /// Timed frames of a block.
    pub n_frames: u32,
    /// Untimed frames at the start of every block.
    pub n_warm_up: u32,
    /// Blocks of each mode.
    pub n_blocks: u32,
    /// Read back and hash every frame, which adds to the next one's time.
    pub hash_frames: bool,
}

/// One frame of one block.
#[derive(Debug, Clone)]
pub struct Sample {
    pub threading: Threading,
    /// Counts over the whole run.
    pub i_block: u32,
    pub warm_up: bool,
    pub times: FrameTimes,
    pub image_hash: Option<String>,
}

/// What a bench came to. Kept whole also when it was interrupted.
#[derive(Debug, Clone)]
pub struct Outcome {
    pub samples: Vec<Sample>,
    /// SHA-256 of the last frame of each mode, as it lies in the target.
    pub image_hashes: BTreeMap<&'static str, String>,
    pub interrupted: bool,
}

pub fn name_of(threading: Threading) -> &'static str {
    match threading {
        Threading::Serial => "serial",
        Threading::Parallel => "parallel",
    }
}

/// Blocks in the order A B, B A, A B, …: whatever drifts over the run (heat, neighbours) falls on both alike.
pub fn block_order(modes: &[Threading], n_blocks: u32) -> Vec<Threading> {
    let of_block = |i: u32| {
        let mut order = modes.to_vec();
        if i % 2 == 1 {
            order.reverse();
        }
        order
    };
    (0..n_blocks).flat_map(of_block).collect()
}

/// Runs the plan; `tick` is called after every frame, for progress. Ends early, and cleanly, once `stop` is set.
pub fn run(stage: &mut Stage, plan: &BenchPlan, stop: &AtomicBool, tick: &mut dyn FnMut()) -> Result<Outcome> {
    let mut outcome = Outcome { samples: vec![], image_hashes: BTreeMap::new(), interrupted: false };
    let n_total = plan
        .n_warm_up
        .checked_add(plan.n_frames)
        .ok_or_else(|| Error::usage("--frames and --warmup together exceed 32 bits"))?;
    for (i_block, threading) in (0..).zip(block_order(&plan.modes, plan.n_blocks)) {
        let samples = &mut outcome.samples;
        let on_frame = &mut |times: FrameTimes, renderer: &mut Renderer| {
            let image_hash = if plan.hash_frames { Some(image_hash(renderer)?) } else { None };
            samples.push(Sample { threading, i_block, warm_up: times.i_frame < plan.n_warm_up, times, image_hash });
            tick();
            Ok(!stop.load(Ordering::Relaxed))
        };
        stage.run(threading, n_total, on_frame)?;
        if stop.load(Ordering::Relaxed) {
            outcome.interrupted = true;
            break;
        }
        outcome.image_hashes.insert(name_of(threading), image_hash(&mut stage.renderer)?);
    }
    Ok(outcome)
}

/// SHA-256 of the last frame, as it lies in the target.
fn image_hash(renderer: &mut Renderer) -> Result<String> {
    Ok(hex(&Sha256::digest(renderer.image_bytes()?)))
}

impl FrameTimes {
    /// Sum of the passes; `None` without timestamps.
    pub fn gpu_ms(&self) -> Option<f64> {
        (!self.passes.is_empty()).then(|| self.passes.iter().map(|p| p.ms()).sum())
    }

    fn pass_ms(&self, name: &str) -> Option<f64> {
        self.passes.iter().find(|p| p.name == name).map(|p| p.ms())
    }
}

impl Outcome {
    /// Timed frames of one mode.
    pub fn timed(&self, threading: Threading) -> Vec<&FrameTimes> {
        self.samples.iter().filter(|s| s.threading == threading && !s.warm_up).map(|s| &s.times).collect()
    }

    /// Ratio of the median frame times, parallel over serial, with its bootstrap 95 % interval. Neighbouring frames are
    /// alike, so whole runs of frames are drawn, not single ones: √n frames each.
    pub fn ratio(&self) -> Option<Interval> {
        let (parallel, serial) = (self.frame_ms(Threading::Parallel), self.frame_ms(Threading::Serial));
        Bootstrap::of_neighbours(serial.len().min(parallel.len())).ratio_of_medians(&parallel, &serial)
    }

    fn frame_ms(&self, threading: Threading) -> Vec<f64> {
        self.timed(threading).iter().map(|t| t.frame_ms).collect()
    }

    /// What overlap could gain, and how much of it the parallel loop gained. None without the serial loop.
    pub fn overlap(&self) -> Option<Overlap> {
        let row = |t: &&FrameTimes| SerialFrame {
            frame_ms: t.frame_ms,
            game_ms: t.game_ms,
            render_ms: t.record_ms + t.submit_wait_ms,
        };
        let serial: Vec<SerialFrame> = self.timed(Threading::Serial).iter().map(row).collect();
        Overlap::of(&serial, &self.frame_ms(Threading::Parallel))
    }

    /// The loop of every block that was begun, in order.
    pub fn block_order(&self) -> Vec<String> {
        let blocks: BTreeMap<u32, Threading> = self.samples.iter().map(|s| (s.i_block, s.threading)).collect();
        blocks.into_values().map(|threading| name_of(threading).to_owned()).collect()
    }

    /// The record of one mode.
    pub fn mode(&self, threading: Threading, simulate: Simulate, plan: &BenchPlan) -> Mode {
        let timed = self.timed(threading);
        let summary = |f: &dyn Fn(&FrameTimes) -> Option<f64>| {
            Summary::of(&timed.iter().filter_map(|t| f(t)).collect::<Vec<f64>>())
        };
        let blocks: BTreeSet<u32> =
            self.samples.iter().filter(|s| s.threading == threading).map(|s| s.i_block).collect();
        Mode {
            threading: name_of(threading).into(),
            simulate: if simulate == Simulate::Cpu { "cpu" } else { "gpu" }.into(),
            frames: timed.len(),
            warm_up: plan.n_warm_up as usize,
            blocks: blocks.len(),
            frame_ms: summary(&|t| Some(t.frame_ms)),
            frame_lows: Lows::of(&self.frame_ms(threading)),
            game_ms: summary(&|t| Some(t.game_ms)),
            record_ms: summary(&|t| Some(t.record_ms)),
            render_ms: summary(&|t| Some(t.record_ms + t.submit_wait_ms)),
            gpu_ms: summary(&|t| t.gpu_ms()),
            latency_ms: summary(&|t| Some(t.latency_ms)),
            passes: pass_records(&timed),
            image_hash: self.image_hashes.get(name_of(threading)).cloned(),
        }
    }

    pub fn ratio_record(&self) -> Option<Ratio> {
        self.ratio().map(Ratio::from)
    }

    /// The rows of frames.csv, passes in the order of [`pass_names`].
    pub fn rows(&self) -> Vec<FrameRow> {
        let names = pass_names();
        let row = |s: &Sample| FrameRow {
            threading: name_of(s.threading).into(),
            block: s.i_block as usize,
            frame: s.times.i_frame,
            time_s: s.times.time_s,
            warm_up: s.warm_up,
            frame_ms: s.times.frame_ms,
            game_ms: s.times.game_ms,
            record_ms: s.times.record_ms,
            submit_wait_ms: s.times.submit_wait_ms,
            gpu_ms: s.times.gpu_ms(),
            latency_ms: s.times.latency_ms,
            queue_depth: s.times.queue_depth as usize,
            pass_ms: names.iter().map(|n| s.times.pass_ms(n)).collect(),
            image_hash: s.image_hash.clone(),
        };
        self.samples.iter().map(row).collect()
    }
}

/// Timer scopes of a frame.
pub fn pass_names() -> Vec<String> {
    Pass::ALL.iter().map(|p| p.name().to_owned()).collect()
}

fn pass_records(timed: &[&FrameTimes]) -> Vec<PassRecord> {
    let total: f64 = timed.iter().filter_map(|t| t.gpu_ms()).sum();
    let record = |pass: Pass| {
        let ms: Vec<f64> = timed.iter().filter_map(|t| t.pass_ms(pass.name())).collect();
        let skipped: Vec<&&FrameTimes> = timed.iter().filter(|t| !t.plan.runs(pass)).collect();
        PassRecord {
            name: pass.name().to_owned(),
            p50_ms: median(&ms),
            share: (total > 0.0).then(|| ms.iter().sum::<f64>() / total),
            n_run: timed.len() - skipped.len(),
            n_skipped: skipped.len(),
            reason: skipped.last().map(|t| t.plan.decision(pass).reason.to_string()),
            saved_ms: None,
        }
    };
    Pass::ALL.into_iter().map(record).collect()
}

/// The device as results name it.
pub fn device_record(info: &crate::gpu::DeviceInfo) -> records::Device {
    let (major, minor, patch) = info.api_version;
    records::Device {
        name: info.name.clone(),
        driver: info.driver.clone(),
        api: format!("{major}.{minor}.{patch}"),
        kind: info.kind.into(),
        uuid: info.uuid.clone(),
    }
}

/// The host's clock and the device's.
pub fn clocks_record(info: &crate::gpu::DeviceInfo) -> records::Clocks {
    let has_timestamps = info.limits.timestamp_valid_bits > 0;
    records::Clocks::of(&ClockQuality::measure(), has_timestamps.then_some(info.limits.timestamp_period_ns))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_alternate_their_order() {
        use Threading::{Parallel as P, Serial as S};
        assert_eq!(block_order(&[S, P], 3), [S, P, P, S, S, P]);
        assert_eq!(block_order(&[S, P], 4), [S, P, P, S, S, P, P, S]);
    }
}
