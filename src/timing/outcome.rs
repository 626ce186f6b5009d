//! What a bench's frames say: the records of a run, from its samples.

use std::collections::{BTreeMap, BTreeSet};

use crate::frame::FrameTimes;
use crate::frame::plan::{Pass, Reason as PlanReason};
use crate::measure::bootstrap::Bootstrap;
use crate::measure::lows::Lows;
use crate::measure::stats::{Summary, mean, median};
use crate::model::scene::{Impostors, Simulate, Threading};
use crate::timing::bench::{BenchPlan, Outcome, Sample};
use crate::timing::cases::{Case, Loop, sweep_text};
use crate::timing::compare::{N_FRAMES_NEEDED, spread_of_blocks};
use crate::timing::overlap::{Overlap, SerialFrame};
use crate::timing::records::{
    self, FrameRow, Measured, Mode, Pass as PassRecord, Ratio, Reason, Skipping,
};

impl FrameTimes {
    /// Sum of the passes; 0 where none had to run, `None` without timestamps.
    pub fn gpu_ms(&self) -> Option<f64> {
        let timed = !self.passes.is_empty() || !Pass::ALL.into_iter().any(|p| self.plan.runs(p));
        // A sum of nothing is -0.
        timed.then(|| self.passes.iter().map(|p| p.ms()).sum::<f64>() + 0.0)
    }

    fn pass_ms(&self, name: &str) -> Option<f64> {
        self.passes.iter().find(|p| p.name == name).map(|p| p.ms())
    }
}

/// Timed frames of one case in one loop.
struct Timed<'a>(Vec<&'a FrameTimes>);

impl Timed<'_> {
    fn column(&self, of: impl Fn(&FrameTimes) -> Option<f64>) -> Vec<f64> {
        self.0.iter().filter_map(|t| of(t)).collect()
    }

    fn frame_ms(&self) -> Vec<f64> {
        self.column(|t| Some(t.frame_ms))
    }

    fn measured(&self, of: impl Fn(&FrameTimes) -> Option<f64>) -> Option<Measured> {
        let values = self.column(of);
        let bootstrap = Bootstrap::of_neighbours(values.len());
        let interval =
            if values.len() < N_FRAMES_NEEDED { None } else { bootstrap.median(&values) };
        // The widened interval may reach below what a time can be.
        let (p50_low, p50_high) = interval.map(|i| (i.low.max(0.0), i.high)).unzip();
        Summary::of(&values).map(|of| Measured { of, p50_low, p50_high })
    }
}

impl Outcome {
    fn timed(&self, i_case: usize, of: Loop) -> Timed<'_> {
        let is_one = |s: &&Sample| s.i_case == i_case && s.of == of && !s.warm_up;
        Timed(self.samples.iter().filter(is_one).map(|s| &s.times).collect())
    }

    /// The records of every case, in order.
    pub fn cases(&self, cases: &[Case], plan: &BenchPlan) -> Vec<records::Case> {
        cases.iter().enumerate().map(|(i, case)| self.case(i, case, plan)).collect()
    }

    fn case(&self, i: usize, case: &Case, plan: &BenchPlan) -> records::Case {
        // With --no-skip no loop skips; else the one that does not is there to measure skipping by.
        let skip = case.loops.iter().any(|of| of.skip);
        let find =
            |threading| case.loops.iter().copied().find(|of| *of == Loop { threading, skip });
        let (serial, parallel) = (find(Threading::Serial), find(Threading::Parallel));
        let pair = serial.zip(parallel);
        let unskipped = case.loops.iter().copied().find(|of| skip && !of.skip);
        let modes = case.loops.iter().map(|of| self.mode(i, case, *of, unskipped, plan)).collect();
        records::Case {
            phase: case.phase.clone(),
            sweep: case.sweep.clone(),
            scene_hash: case.scene_hash.clone(),
            particles: case.scene.n_particles(),
            width: case.scene.film.width,
            height: case.scene.film.height,
            modes,
            ratio: pair.and_then(|(serial, parallel)| self.ratio(i, serial, parallel)),
            overlap: serial.and_then(|serial| self.overlap(i, serial, pair.map(|p| p.1))),
            counts: self.counts.get(&i).copied(),
            skipping: unskipped.and_then(|unskipped| {
                self.skipping(i, case, [Loop { skip: true, ..unskipped }, unskipped])
            }),
        }
    }

    /// Ratio of the median frame times with its bootstrap 95 % interval. Neighbouring frames are
    /// alike, so whole runs of frames are drawn, not single ones: √n frames each.
    fn ratio(&self, i: usize, serial: Loop, parallel: Loop) -> Option<Ratio> {
        let (serial, parallel) =
            (self.timed(i, serial).frame_ms(), self.timed(i, parallel).frame_ms());
        let n = serial.len().min(parallel.len());
        let bootstrap = Bootstrap::of_neighbours(n);
        let interval =
            if n < N_FRAMES_NEEDED { None } else { bootstrap.ratio_of_medians(&parallel, &serial) };
        let (low, high) = interval.map(|i| (i.low, i.high)).unzip();
        let parallel_by_serial = median(&parallel)? / median(&serial).filter(|ms| *ms > 0.0)?;
        Some(Ratio { parallel_by_serial, low, high })
    }

    /// What overlap could gain, and how much of it the parallel loop gained.
    fn overlap(&self, i: usize, serial: Loop, parallel: Option<Loop>) -> Option<Overlap> {
        let row = |t: &&FrameTimes| SerialFrame {
            frame_ms: t.frame_ms,
            game_ms: t.game_ms,
            render_ms: t.render_ms(),
        };
        let serial: Vec<SerialFrame> = self.timed(i, serial).0.iter().map(row).collect();
        Overlap::of(&serial, &parallel.map_or(vec![], |of| self.timed(i, of).frame_ms()))
    }

    fn skipping(&self, i: usize, case: &Case, [skipped, unskipped]: [Loop; 2]) -> Option<Skipping> {
        let [gpu, all] = [skipped, unskipped].map(|of| self.timed(i, of).column(|t| t.gpu_ms()));
        if gpu.is_empty() || all.is_empty() {
            return None;
        }
        // Without skipping no impostor is used.
        let exact = case.scene.draw.impostors == Impostors::Off;
        let hashes = [skipped, unskipped].map(|of| self.image_hash(i, of).filter(|_| exact));
        let same_bytes = if let [Some(a), Some(b)] = hashes { Some(a == b) } else { None };
        Some(Skipping { gpu_ms: mean(&gpu), gpu_no_skip_ms: mean(&all), same_bytes })
    }

    /// Of the last frame of one case in one loop, where one was reached.
    fn image_hash(&self, i_case: usize, of: Loop) -> Option<&str> {
        let mut blocks = self.blocks.iter().filter(|b| b.i_case == i_case && b.of == of);
        blocks.find_map(|b| b.image_hash.as_deref())
    }

    /// Whether the last frames of all blocks of a case are the same, to the byte; none of fewer
    /// than two. With impostors of those that skip: without skipping there are none.
    pub fn is_same_picture(&self, i_case: usize, case: &Case) -> Option<bool> {
        let exact = case.scene.draw.impostors == Impostors::Off;
        let blocks = self.blocks.iter().filter(|b| b.i_case == i_case && (exact || b.of.skip));
        let hashes: Vec<&str> = blocks.filter_map(|b| b.image_hash.as_deref()).collect();
        (hashes.len() > 1).then(|| hashes.windows(2).all(|w| w[0] == w[1]))
    }

    /// Every block that was begun, in order.
    pub fn block_order(&self) -> Vec<records::Block> {
        let of = |b: &crate::timing::bench::Block| records::Block {
            case: b.i_case,
            threading: b.of.threading.name().to_owned(),
            skip: b.of.skip,
        };
        self.blocks.iter().map(of).collect()
    }

    fn mode(
        &self,
        i: usize,
        case: &Case,
        of: Loop,
        unskipped: Option<Loop>,
        plan: &BenchPlan,
    ) -> Mode {
        let timed = self.timed(i, of);
        let blocks: BTreeSet<u32> = self
            .samples
            .iter()
            .filter(|s| s.i_case == i && s.of == of)
            .map(|s| s.i_block)
            .collect();
        let depths = timed.column(|t| Some(f64::from(t.queue_depth)));
        let against = unskipped.filter(|u| *u != of).map(|u| self.timed(i, u));
        Mode {
            threading: of.threading.name().into(),
            skip: of.skip,
            simulate: if case.scene.threads.simulate == Simulate::Cpu { "cpu" } else { "gpu" }
                .into(),
            frames: timed.0.len(),
            warm_up: plan.n_warm_up as usize,
            blocks: blocks.len(),
            frame_ms: timed.measured(|t| Some(t.frame_ms)),
            frame_lows: Lows::of(&timed.frame_ms()),
            game_ms: timed.measured(|t| Some(t.game_ms)),
            record_ms: timed.measured(|t| Some(t.record_ms)),
            submit_ms: timed.measured(|t| Some(t.submit_ms)),
            wait_ms: timed.measured(|t| Some(t.wait_ms)),
            render_ms: timed.measured(|t| Some(t.render_ms())),
            gpu_ms: timed.measured(FrameTimes::gpu_ms),
            latency_ms: timed.measured(|t| Some(t.latency_ms)),
            queue_depth: (!depths.is_empty()).then(|| mean(&depths)),
            drawn: Summary::of(&timed.column(|t| Some(f64::from(t.n_shown()))))
                .map(|s| [s.min, s.mean, s.max]),
            impostors_reused: timed.0.iter().filter(|t| is_reused(t)).count(),
            passes: pass_records(&timed, against.as_ref()),
            image_hash: self.image_hash(i, of).map(str::to_owned),
            block_spread: self.block_spread(i, of),
        }
    }

    /// Greatest median frame time of a block by the least.
    fn block_spread(&self, i: usize, of: Loop) -> Option<f64> {
        let mut blocks: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
        for s in self.samples.iter().filter(|s| s.i_case == i && s.of == of && !s.warm_up) {
            blocks.entry(s.i_block).or_default().push(s.times.frame_ms);
        }
        spread_of_blocks(blocks.values().map(Vec::as_slice))
    }

    /// The rows of frames.csv, passes in the order of [`pass_names`].
    pub fn rows(&self, cases: &[Case]) -> Vec<FrameRow> {
        let names = pass_names();
        let row = |s: &Sample| FrameRow {
            phase: cases[s.i_case].phase.clone().unwrap_or_default(),
            sweep: sweep_text(&cases[s.i_case].sweep),
            threading: s.of.threading.name().into(),
            skip: s.of.skip,
            block: s.i_block as usize,
            frame: s.times.i_frame,
            time_s: s.times.time_s,
            warm_up: s.warm_up,
            frame_ms: s.times.frame_ms,
            game_ms: s.times.game_ms,
            record_ms: s.times.record_ms,
            submit_ms: s.times.submit_ms,
            wait_ms: s.times.wait_ms,
            gpu_ms: s.times.gpu_ms(),
            latency_ms: s.times.latency_ms,
            queue_depth: s.times.queue_depth as usize,
            n_drawn: s.times.n_shown(),
            ran: ran(&s.times),
            pass_ms: names.iter().map(|n| s.times.pass_ms(n)).collect(),
            image_hash: s.image_hash.clone(),
        };
        self.samples.iter().map(row).collect()
    }
}

/// Whether what is far was shown from a picture that an earlier frame made.
fn is_reused(times: &FrameTimes) -> bool {
    matches!(times.plan.decision(Pass::Impostors).reason, PlanReason::Reused { .. })
}

/// "sort+sprites".
fn ran(times: &FrameTimes) -> String {
    Pass::ALL
        .into_iter()
        .filter(|p| times.plan.runs(*p))
        .map(Pass::name)
        .collect::<Vec<_>>()
        .join("+")
}

/// Each once, the most frequent first.
fn reasons(all: impl Iterator<Item = String>) -> Vec<Reason> {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for reason in all {
        *counts.entry(reason).or_default() += 1;
    }
    let mut reasons: Vec<Reason> =
        counts.into_iter().map(|(reason, n)| Reason { reason, n }).collect();
    reasons.sort_by_key(|r| std::cmp::Reverse(r.n));
    reasons
}

/// Timer scopes of a frame.
pub fn pass_names() -> Vec<String> {
    Pass::ALL.iter().map(|p| p.name().to_owned()).collect()
}

/// `against`: frames of the same case that skip nothing.
fn pass_records(timed: &Timed<'_>, against: Option<&Timed<'_>>) -> Vec<PassRecord> {
    let total: f64 = timed.column(FrameTimes::gpu_ms).iter().sum();
    let n = timed.0.len();
    let record = |pass: Pass| {
        let ms = timed.column(|t| t.pass_ms(pass.name()));
        let skipped: Vec<&&FrameTimes> = timed.0.iter().filter(|t| !t.plan.runs(pass)).collect();
        let whole = against.and_then(|a| median(&a.column(|t| t.pass_ms(pass.name()))));
        PassRecord {
            name: pass.name().to_owned(),
            p50_ms: median(&ms),
            share: (total > 0.0).then(|| ms.iter().sum::<f64>() / total),
            n_run: n - skipped.len(),
            n_skipped: skipped.len(),
            reason: skipped.last().map(|t| t.plan.decision(pass).reason.to_string()),
            reasons: reasons(skipped.iter().map(|t| t.plan.decision(pass).reason.to_string())),
            saved_ms: whole
                .filter(|_| !skipped.is_empty())
                .map(|ms| ms * (skipped.len() as f64 / n as f64)),
        }
    };
    Pass::ALL.into_iter().map(record).collect()
}
