//! Runs the frames of a bench, block by block.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use sha2::{Digest, Sha256};

use super::attachments::CasePicture;
use super::blocks::{BenchPlan, Block, Outcome, PixelsOf, Sample, lock, n_rounds_at_least};
use super::cases::Case;
use super::check::DevicePicture;
use super::invocations::{self, NO_COUNTERS};
use super::limits::{MOST_BLOCKS, MOST_FRAMES};
use super::precision::{Limit, Precision, Reached, look, n_segments};
use super::schedule::{self, PlannedBlock, Rounds, n_frames_of};
use super::state::FrameMark;
use crate::error::{Error, Result};
use crate::frame::{Amounts, Counts, DrawnFrame, FrameTimes, Renderer, Stage, light_notes, unseen};
use crate::gpu::hex;
use crate::io::image::display_bytes;
use crate::model::backdrop::Backdrop;
use crate::model::film::Film;
use crate::model::scene::{Draw, Lighting, LightingMode, Scene};

/// What a bench tells while it runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// A frame has ended.
    Frame,
    /// This many frames are to be run that were not known before.
    More(u64),
}

/// A bench that has ended.
pub struct Finished {
    /// Stage of the last case; none if creating it failed.
    pub stage: Option<Stage>,
    /// The error that ended the bench early.
    pub failure: Option<Error>,
}

/// Runs the plan on `stage`, which holds the first case.
///
/// Every sample is put into `outcome` as soon as its frame has ended, where other threads find it.
/// `on` is called after every frame, and when further rounds are decided. The run ends early, and
/// keeps its samples, once `stop` is set or a block fails.
pub fn run(
    stage: Stage,
    cases: &[Case],
    plan: &BenchPlan,
    stop: &AtomicBool,
    outcome: &Mutex<Outcome>,
    on: &mut dyn FnMut(Event),
) -> Finished {
    let mut bench = Bench {
        stage: Some(stage),
        staged: 0,
        outcome,
        cases,
        plan,
        stop,
        on,
        drawing: vec![None; cases.len()],
        open: vec![true; cases.len()],
        next_look: vec![0; cases.len()],
        begin: Instant::now(),
    };
    let failure = bench.run().err();
    Finished { stage: bench.stage, failure }
}

/// The state of a bench between blocks.
struct Bench<'a> {
    /// None after creating a stage has failed.
    stage: Option<Stage>,
    /// The case that the stage holds.
    staged: usize,
    outcome: &'a Mutex<Outcome>,
    cases: &'a [Case],
    plan: &'a BenchPlan,
    stop: &'a AtomicBool,
    on: &'a mut dyn FnMut(Event),
    /// The settings that "auto" chose in each case's first block, which hold for all its blocks.
    drawing: Vec<Option<(Draw, Lighting)>>,
    /// The cases that have further rounds.
    open: Vec<bool>,
    /// The round at which the intervals of each case are looked at next.
    next_look: Vec<u32>,
    begin: Instant,
}

impl Bench<'_> {
    fn run(&mut self) -> Result<()> {
        let mut i_block = 0;
        for i_round in 0.. {
            let blocks = schedule::round(self.cases, self.plan.rounds, i_round, &self.open);
            if blocks.is_empty() {
                break;
            }
            for block in blocks {
                self.block(&block, i_block, i_round).map_err(|error| {
                    let name = self.cases[block.i_case].name();
                    if self.cases.len() > 1 { error.within(&name) } else { error }
                })?;
                i_block += 1;
                if self.stop.load(Ordering::Relaxed) {
                    lock(self.outcome).interrupted = true;
                    return Ok(());
                }
            }
        }
        Ok(())
    }

    fn block(&mut self, block: &PlannedBlock, i_block: u32, i_round: u32) -> Result<()> {
        let (i_case, case) = (block.i_case, &self.cases[block.i_case]);
        let what = "the stage before this block has failed";
        let stage = self.stage.take().ok_or_else(|| Error::usage(what))?;
        let is_same = self.staged == i_case;
        let stage = if is_same {
            stage
        } else {
            stage.again(with_drawing(&case.scene, self.drawing[i_case]), block.of.skip)?
        };
        self.staged = i_case;
        let stage = self.stage.insert(stage);
        self.drawing[i_case] = Some((stage.scene.draw, stage.scene.lighting));
        // A new stage, or the first one, knows nothing of cold caches.
        let is_new = !is_same || i_block == 0;
        if let Some(bytes) = self.plan.cold_bytes.filter(|_| is_new) {
            stage.set_cold(bytes)?;
        }
        let named = |note: &String| named(self.cases, i_case, note);
        lock(self.outcome).chosen.extend(stage.take_chosen().iter().map(named));
        let is_stopped = || self.stop.load(Ordering::Relaxed);
        run_frames(stage, self.outcome, (block, i_block), (case, self.plan), &mut || {
            (self.on)(Event::Frame);
            !is_stopped()
        })?;
        // The last frame of a block that was cut short is another one.
        let is_whole = !is_stopped() && block.frames.end == case.n_frames;
        let image_hash = if is_whole { Some(image_hash(&mut stage.renderer)?) } else { None };
        if let Some((pixels, hash)) = self.plan.checked.zip(image_hash.as_ref()) {
            keep_drawn(stage, self.outcome, block, (pixels, hash))?;
        }
        lock(self.outcome).blocks.push(Block { i_case, of: block.of, image_hash });
        if block.is_last_in_round && self.has_ended(i_case, i_round + 1) {
            self.open[i_case] = false;
            self.end_case(i_case)?;
        }
        Ok(())
    }

    /// Returns whether a case needs no round after the first `n_rounds`.
    fn has_ended(&mut self, i_case: usize, n_rounds: u32) -> bool {
        match self.plan.rounds {
            Rounds::Fixed(n) => n_rounds >= n,
            Rounds::Until(precision) => self.is_precise(precision, i_case, n_rounds),
        }
    }

    /// Returns whether the intervals of a case are narrow enough, or a limit ends it.
    fn is_precise(&mut self, wanted: Precision, i_case: usize, n_rounds: u32) -> bool {
        let case = &self.cases[i_case];
        let n_segments = n_segments(case.n_frames);
        if !n_rounds.is_multiple_of(n_segments) {
            return false;
        }
        let of_cycle = |n: u32| {
            n_frames_of(std::slice::from_ref(case), self.plan.rounds, n, self.plan.n_warm_up)
        };
        let elapsed = self.begin.elapsed();
        let floor = n_rounds_at_least(self.plan.rounds);
        let (n_samples, n_blocks) = {
            let outcome = lock(self.outcome);
            (outcome.samples.len() as u64, outcome.blocks.len() as u64)
        };
        let n_more = n_segments * case.loops.len() as u32;
        let ended_by = if elapsed + elapsed / n_rounds * n_segments > wanted.limit {
            Some(Limit::Time)
        } else if n_samples + of_cycle(n_segments) > MOST_FRAMES
            || n_blocks + u64::from(n_more) > MOST_BLOCKS
        {
            Some(Limit::Memory)
        } else {
            None
        };
        let ended_by = ended_by.filter(|_| n_rounds >= floor);
        if n_rounds < self.next_look[i_case] && ended_by.is_none() {
            return false;
        }
        {
            // Frames that are left out of the results must be left out of the intervals.
            let mut outcome = lock(self.outcome);
            if outcome.judging.as_ref().is_some_and(|judging| judging.discard) {
                outcome.judge();
            }
        }
        let intervals = |widening: f64| lock(self.outcome).intervals(i_case, case, widening);
        let look = look(wanted.wanted, n_rounds, n_segments, intervals);
        let ended_by = ended_by.filter(|_| look.next.is_some());
        if let (Some(next), None) = (look.next, ended_by) {
            self.next_look[i_case] = next;
            (self.on)(Event::More(of_cycle(next - n_rounds.max(floor.min(next)))));
            return false;
        }
        let reached = Reached { reach: look.widest, rounds: n_rounds, ended_by };
        lock(self.outcome).reached.insert(i_case, reached);
        true
    }

    /// Keeps what is told of the last frame of a case.
    fn end_case(&mut self, i_case: usize) -> Result<()> {
        let Some(stage) = &mut self.stage else { return Ok(()) };
        let named = |note: &String| named(self.cases, i_case, note);
        let last = lock(self.outcome)
            .samples
            .last()
            .map(|s| DrawnFrame { time_s: s.times.time_s, n_shown: s.times.n_kept });
        let rgba = stage.renderer.image()?;
        let unseen = last.map(|frame| unseen(&stage.scene, frame, &rgba));
        let unseen = unseen.transpose()?.flatten();
        let mut notes = light_notes(stage)?;
        notes.extend(stage.device.take_over_limit());
        lock(self.outcome).notes.extend(unseen.iter().chain(&notes).map(named));
        let counts = Counts::new(&mut stage.renderer, &stage.device, &stage.scene)?;
        lock(self.outcome).counts.insert(i_case, counts);
        let scene = stage.scene.clone();
        let amounts = Amounts::measured(&mut stage.renderer, &stage.device, &scene)?;
        lock(self.outcome).amounts.extend(amounts.map(|amounts| (i_case, amounts)));
        let is_stopped = self.stop.load(Ordering::Relaxed);
        if let Some(frame) = last.filter(|_| self.plan.counts_invocations && !is_stopped) {
            let counted = invocations::count(stage, frame.time_s)?;
            let mut outcome = lock(self.outcome);
            if counted.is_none() && !outcome.notes.iter().any(|n| n == NO_COUNTERS) {
                outcome.notes.push(NO_COUNTERS.to_owned());
            }
            outcome.invocations.extend(counted.map(|of| (i_case, of)));
        }
        if self.plan.pictures && !is_stopped {
            let time_s = last.map_or(scene.time.start_s, |frame| frame.time_s);
            let (Film { width, height, .. }, backdrop) = (scene.film, Backdrop::of(&scene, time_s));
            let rgb = display_bytes(&backdrop, width, height, &rgba);
            lock(self.outcome).pictures.push(CasePicture { i_case, width, height, rgb });
        }
        Ok(())
    }
}

/// Returns a note with the name of its case, if there are several.
fn named(cases: &[Case], i_case: usize, note: &str) -> String {
    match cases {
        [_] => note.to_owned(),
        _ => format!("{}: {note}", cases[i_case].name()),
    }
}

/// Keeps the numbers of a block's last frame that are checked, unless a block of the case had the
/// same bytes.
fn keep_drawn(
    stage: &mut Stage,
    outcome: &Mutex<Outcome>,
    &PlannedBlock { i_case, of, .. }: &PlannedBlock,
    (pixels, hash): (PixelsOf, &str),
) -> Result<()> {
    let (times, is_known) = {
        let outcome = lock(outcome);
        let is_known = outcome.drawn.iter().any(|d| d.i_case == i_case && d.hash == hash);
        (outcome.samples.last().map(|s| (s.times.i_frame, s.times.time_s)), is_known)
    };
    let Some((i_frame, time_s)) = times.filter(|_| !is_known) else { return Ok(()) };
    let film = stage.scene.film;
    let pixels = pixels(film.width, film.height);
    let rgba = stage.renderer.image()?;
    let at = |&[i, j]: &[u32; 2]| {
        let pixel = &rgba[4 * (j as usize * film.width as usize + i as usize)..][..4];
        [0, 1, 2, 3].map(|k| f64::from(pixel[k]))
    };
    let rgba = pixels.iter().map(at).collect();
    let light = match stage.scene.lighting.mode {
        LightingMode::None => vec![],
        _ => stage.renderer.facets(&stage.device)?.1.iter().map(|l| [l.first, l.second]).collect(),
    };
    let slopes = stage.renderer.slopes(&stage.device)?.iter().map(|s| s.read()).collect();
    let (scene, loop_name, hash) = (stage.scene.clone(), of.name(), hash.to_owned());
    let picture = DevicePicture {
        i_case,
        loop_name,
        hash,
        scene,
        i_frame,
        time_s,
        rgba,
        light,
        hazed: stage.renderer.hazed(&stage.device)?.iter().map(|l| l.first).collect(),
        slopes,
    };
    lock(outcome).drawn.push(picture);
    Ok(())
}

/// Returns the scene with the settings that "auto" chose, if they are known.
fn with_drawing(scene: &Arc<Scene>, chosen: Option<(Draw, Lighting)>) -> Arc<Scene> {
    match chosen {
        Some((draw, lighting)) if (draw, lighting) != (scene.draw, scene.lighting) => {
            Arc::new(Scene { draw, lighting, ..Scene::clone(scene) })
        }
        _ => scene.clone(),
    }
}

/// Runs the frames of a block; `tick` says whether to go on.
fn run_frames(
    stage: &mut Stage,
    outcome: &Mutex<Outcome>,
    (block, i_block): (&PlannedBlock, u32),
    (case, plan): (&Case, &BenchPlan),
    tick: &mut dyn FnMut() -> bool,
) -> Result<()> {
    // A frame's number has 32 bits, and so has the warm-up's.
    if case.i_first.checked_add(case.n_frames).is_none() {
        let what = "the frames of a block, counted from the scene's first, exceed 32 bits";
        return Err(Error::usage(what));
    }
    let PlannedBlock { i_case, of, .. } = *block;
    stage.set_skip(of.skip);
    let n_before = lock(outcome).samples.len();
    let watch = lock(outcome).watch.clone();
    if plan.n_warm_up == 0 {
        watch.begin(i_block);
    }
    let on_frame = &mut |times: FrameTimes, renderer: &mut Renderer| {
        let image_hash = if plan.hash_frames { Some(image_hash(renderer)?) } else { None };
        {
            let samples = &mut lock(outcome).samples;
            let warm_up = samples.len() - n_before < plan.n_warm_up as usize;
            let mark = FrameMark::default();
            samples.push(Sample { i_case, of, i_block, warm_up, times, image_hash, mark });
            if warm_up && samples.len() - n_before == plan.n_warm_up as usize {
                watch.begin(i_block);
            }
        }
        // Without the lock: stderr may hold the tick up, and Ctrl-C needs the samples.
        Ok(tick())
    };
    let ended = stage.run(of.threading, frames_of(case, block, plan.n_warm_up), on_frame);
    watch.end(i_block);
    ended
}

/// Returns the frames of a block: the warm-up, which leads up to the timed frames, and these.
///
/// If fewer frames precede the timed ones, time runs backwards first: n, n − 1, …, 1, 0, 1, …, so
/// that every warm-up frame does the work of an ordinary frame.
fn frames_of(
    case: &Case,
    block: &PlannedBlock,
    n_warm_up: u32,
) -> impl Iterator<Item = u32> + Send + use<> {
    let at = |i: u32| i64::from(case.i_first) + i64::from(i);
    let (first, end) = (at(block.frames.start) - i64::from(n_warm_up), at(block.frames.end));
    // `run_frames` has checked that the numbers fit in 32 bits.
    (first..end).map(|i| u32::try_from(i.unsigned_abs()).unwrap_or(u32::MAX))
}

/// Returns the SHA-256 of the last frame, as stored in the render target.
fn image_hash(renderer: &mut Renderer) -> Result<String> {
    Ok(hex(&Sha256::digest(renderer.image_bytes()?)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::scene::Threading;
    use crate::timing::cases::{Loop, LoopChoice, cases};

    #[test]
    fn warm_up_leads_to_the_timed_frames() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml");
        let loaded = crate::io::scene_file::load(&path, &[], None).unwrap();
        let serial = LoopChoice { modes: &[Threading::Serial], skip: true, saved: false };
        let mut case = cases(loaded, &[], Some(3), serial).remove(0);
        let block = |frames| PlannedBlock {
            i_case: 0,
            of: Loop { threading: Threading::Serial, skip: true },
            frames,
            is_last_in_round: true,
        };
        let part =
            |case: &Case, frames, n| frames_of(case, &block(frames), n).collect::<Vec<u32>>();
        let frames = |case: &Case, n| part(case, 0..3, n);
        assert_eq!(frames(&case, 0), [0, 1, 2]);
        assert_eq!(frames(&case, 2), [2, 1, 0, 1, 2]);
        case.i_first = 5;
        assert_eq!(frames(&case, 2), [3, 4, 5, 6, 7]);
        assert_eq!(frames(&case, 7), [2, 1, 0, 1, 2, 3, 4, 5, 6, 7]);
        assert_eq!(part(&case, 1..3, 2), [4, 5, 6, 7]);
    }
}
