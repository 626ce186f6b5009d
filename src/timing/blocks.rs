//! Runs the frames of a bench, in interleaved blocks: each case in each of its loops.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use sha2::{Digest, Sha256};

use super::attachments::CasePicture;
use super::cases::{Case, Loop};
use super::check::{Check, DevicePicture, Stages};
use super::invocations::{self, NO_COUNTERS, PassInvocations};
use crate::error::{Error, Result};
use crate::frame::{Counts, DrawnFrame, FrameTimes, Renderer, Stage, light_notes, unseen};
use crate::gpu::hex;
use crate::io::image::display_bytes;
use crate::model::scene::{Draw, LightingMode, Scene};

/// How many frames a bench runs, and what it keeps of them.
#[derive(Debug, Clone, Copy)]
pub struct BenchPlan {
    /// Warm-up frames at the start of every block.
    pub n_warm_up: u32,
    /// Blocks of each case in each of its loops.
    pub n_rounds: u32,
    /// Whether every frame is read back and hashed, which adds to the time of the next one.
    pub hash_frames: bool,
    /// Whether the last frame of every case is read back, after all its blocks.
    pub pictures: bool,
    /// Returns the pixels [column, row] of a film whose numbers are kept of the last frame of every
    /// block, to be checked; none without a check.
    pub checked: Option<PixelsOf>,
    /// Whether one more frame of every case, after its blocks, counts what its passes invoke.
    pub counts_invocations: bool,
}

/// Returns pixels of a film of some width and height.
pub type PixelsOf = fn(u32, u32) -> Vec<[u32; 2]>;

/// One frame of one block.
#[derive(Debug, Clone)]
pub struct Sample {
    /// Number of the case.
    pub i_case: usize,
    /// Loop that the frame ran in.
    pub of: Loop,
    /// Number of the block over the whole run.
    pub i_block: u32,
    /// Whether the frame belongs to the warm-up.
    pub warm_up: bool,
    /// Measured times.
    pub times: FrameTimes,
    /// SHA-256 of the image, if it was asked for.
    pub image_hash: Option<String>,
}

/// Consecutive frames of one case in one loop.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Number of the case.
    pub i_case: usize,
    /// Loop of its frames.
    pub of: Loop,
    /// SHA-256 of its last frame, as stored in the render target; none if Ctrl-C came first.
    pub image_hash: Option<String>,
}

/// The samples of a bench, complete or up to the point where it was interrupted or failed.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// All frames, in the order in which they ran.
    pub samples: Vec<Sample>,
    /// All blocks, in the order in which they ran.
    pub blocks: Vec<Block>,
    /// Warnings about the last frame of a case: its light, and whether anything can be seen.
    pub notes: Vec<String>,
    /// The settings that "auto" chose for drawing, with the reasons.
    pub chosen: Vec<String>,
    /// The last frames of the cases that ran to their end, if they were asked for.
    pub pictures: Vec<CasePicture>,
    /// Counts of odd values in the last frame of each case that ran to its end.
    pub counts: BTreeMap<usize, Counts>,
    /// The last frames of the blocks, to be checked; one of several with the same bytes.
    pub drawn: Vec<DevicePicture>,
    /// The check of the device's stages, if it was asked for.
    pub stages: Option<Stages>,
    /// The checks of pictures, by case.
    pub checks: BTreeMap<usize, Check>,
    /// What the passes of each case invoked in a frame of their own, where that was counted.
    pub invocations: BTreeMap<usize, Vec<PassInvocations>>,
    /// Whether Ctrl-C came before the end.
    pub interrupted: bool,
}

/// A bench that has ended.
pub struct Finished {
    /// Stage of the last case; none if creating it failed.
    pub stage: Option<Stage>,
    /// The error that ended the bench early.
    pub failure: Option<Error>,
}

/// Returns the case and loop of every block, in the order A B, B A, A B, …, so that a drift over
/// the run (heat, other processes) affects all alike.
pub fn block_order(cases: &[Case], n_rounds: u32) -> Vec<(usize, Loop)> {
    let of_case =
        |(i, case): (usize, &Case)| case.loops.iter().map(move |of| (i, *of)).collect::<Vec<_>>();
    let forward: Vec<(usize, Loop)> = cases.iter().enumerate().flat_map(of_case).collect();
    let backward: Vec<(usize, Loop)> = forward.iter().rev().copied().collect();
    (0..n_rounds)
        .flat_map(|i| if i % 2 == 0 { forward.clone() } else { backward.clone() })
        .collect()
}

/// Returns the number of frames of all blocks, warm-up included.
pub fn n_frames_total(cases: &[Case], plan: &BenchPlan) -> u64 {
    let of = |c: &Case| c.loops.len() as u64 * (u64::from(c.n_frames) + u64::from(plan.n_warm_up));
    u64::from(plan.n_rounds) * cases.iter().map(of).sum::<u64>()
}

/// Runs the plan on `stage`, which holds the first case.
///
/// Every sample is put into `outcome` as soon as its frame has ended, where other threads find it.
/// `tick` is called after every frame. The run ends early, and keeps its samples, once `stop` is
/// set or a block fails.
pub fn run(
    stage: Stage,
    cases: &[Case],
    plan: &BenchPlan,
    stop: &AtomicBool,
    outcome: &Mutex<Outcome>,
    tick: &mut dyn FnMut(),
) -> Finished {
    let mut bench = Bench {
        stage: Some(stage),
        outcome,
        cases,
        plan,
        stop,
        tick,
        drawing: vec![None; cases.len()],
    };
    let order = block_order(cases, plan.n_rounds);
    let mut failure = None;
    for (i_block, &(i_case, of)) in order.iter().enumerate() {
        let is_staged = i_block.checked_sub(1).map_or(0, |i| order[i].0) == i_case;
        let is_last = order[i_block + 1..].iter().all(|(i, _)| *i != i_case);
        let block = NextBlock { i_case, i_block: i_block as u32, of, is_staged, is_last };
        if let Err(error) = bench.run(&block) {
            let name = cases[i_case].name();
            failure = Some(if cases.len() > 1 { error.within(&name) } else { error });
            break;
        }
        if stop.load(Ordering::Relaxed) {
            lock(outcome).interrupted = true;
            break;
        }
    }
    Finished { stage: bench.stage, failure }
}

/// Locks an outcome. A panic elsewhere leaves whole samples in it.
pub fn lock(outcome: &Mutex<Outcome>) -> MutexGuard<'_, Outcome> {
    outcome.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A block that is about to run.
struct NextBlock {
    i_case: usize,
    i_block: u32,
    of: Loop,
    /// Whether the block before was of the same case.
    is_staged: bool,
    /// Whether no later block is of this case.
    is_last: bool,
}

/// The state of a bench between blocks.
struct Bench<'a> {
    /// None after creating a stage has failed.
    stage: Option<Stage>,
    outcome: &'a Mutex<Outcome>,
    cases: &'a [Case],
    plan: &'a BenchPlan,
    stop: &'a AtomicBool,
    tick: &'a mut dyn FnMut(),
    /// The settings that "auto" chose in each case's first block, which hold for all its blocks.
    drawing: Vec<Option<Draw>>,
}

impl Bench<'_> {
    fn run(&mut self, block: &NextBlock) -> Result<()> {
        let case = &self.cases[block.i_case];
        let what = "the stage before this block has failed";
        let stage = self.stage.take().ok_or_else(|| Error::usage(what))?;
        let stage = if block.is_staged {
            stage
        } else {
            stage.again(with_drawing(&case.scene, self.drawing[block.i_case]), block.of.skip)?
        };
        let stage = self.stage.insert(stage);
        self.drawing[block.i_case] = Some(stage.scene.draw);
        let has_several = self.cases.len() > 1;
        let named = |note: &String| {
            if has_several { format!("{}: {note}", case.name()) } else { note.clone() }
        };
        lock(self.outcome).chosen.extend(stage.take_chosen().iter().map(named));
        let is_stopped = || self.stop.load(Ordering::Relaxed);
        run_frames(stage, self.outcome, block, (case, self.plan), &mut || {
            (self.tick)();
            !is_stopped()
        })?;
        // The last frame of a block that was cut short is another one.
        let image_hash = if is_stopped() { None } else { Some(image_hash(&mut stage.renderer)?) };
        if let Some((pixels, hash)) = self.plan.checked.zip(image_hash.as_ref()) {
            keep_drawn(stage, self.outcome, block, (pixels, hash))?;
        }
        lock(self.outcome).blocks.push(Block { i_case: block.i_case, of: block.of, image_hash });
        if block.is_last {
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
            lock(self.outcome).counts.insert(block.i_case, counts);
            if self.plan.pictures && !is_stopped() {
                let film = case.scene.film;
                let (width, height) = (film.width, film.height);
                let rgb = display_bytes(&film, width, height, &rgba);
                let picture = CasePicture { i_case: block.i_case, width, height, rgb };
                lock(self.outcome).pictures.push(picture);
            }
            if let Some(frame) = last.filter(|_| self.plan.counts_invocations && !is_stopped()) {
                let counted = invocations::count(stage, frame.time_s)?;
                let mut outcome = lock(self.outcome);
                if counted.is_none() && !outcome.notes.iter().any(|n| n == NO_COUNTERS) {
                    outcome.notes.push(NO_COUNTERS.to_owned());
                }
                outcome.invocations.extend(counted.map(|of| (block.i_case, of)));
            }
        }
        Ok(())
    }
}

/// Keeps the numbers of a block's last frame that are checked, unless a block of the case had the
/// same bytes.
fn keep_drawn(
    stage: &mut Stage,
    outcome: &Mutex<Outcome>,
    &NextBlock { i_case, of, .. }: &NextBlock,
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
    let (scene, loop_name, hash) = (stage.scene.clone(), of.name(), hash.to_owned());
    let picture = DevicePicture { i_case, loop_name, hash, scene, i_frame, time_s, rgba, light };
    lock(outcome).drawn.push(picture);
    Ok(())
}

/// Returns the scene with the settings that "auto" chose, if they are known.
fn with_drawing(scene: &Arc<Scene>, chosen: Option<Draw>) -> Arc<Scene> {
    match chosen {
        Some(draw) if draw != scene.draw => Arc::new(Scene { draw, ..Scene::clone(scene) }),
        _ => scene.clone(),
    }
}

/// Runs the frames of a block; `tick` says whether to go on.
fn run_frames(
    stage: &mut Stage,
    outcome: &Mutex<Outcome>,
    &NextBlock { i_case, i_block, of, .. }: &NextBlock,
    (case, plan): (&Case, &BenchPlan),
    tick: &mut dyn FnMut() -> bool,
) -> Result<()> {
    // A frame's number has 32 bits, and so has the warm-up's.
    if case.i_first.checked_add(case.n_frames).is_none() {
        let what = "the frames of a block, counted from the scene's first, exceed 32 bits";
        return Err(Error::usage(what));
    }
    stage.set_skip(of.skip);
    let n_before = lock(outcome).samples.len();
    let on_frame = &mut |times: FrameTimes, renderer: &mut Renderer| {
        let image_hash = if plan.hash_frames { Some(image_hash(renderer)?) } else { None };
        {
            let samples = &mut lock(outcome).samples;
            let warm_up = samples.len() - n_before < plan.n_warm_up as usize;
            samples.push(Sample { i_case, of, i_block, warm_up, times, image_hash });
        }
        // Without the lock: stderr may hold the tick up, and Ctrl-C needs the samples.
        Ok(tick())
    };
    stage.run(of.threading, frames_of(case, plan.n_warm_up), on_frame)
}

/// Returns the frames of a block: the warm-up, which leads up to the timed frames, and these.
///
/// If fewer frames precede the timed ones, time runs backwards first: n, n − 1, …, 1, 0, 1, …, so
/// that every warm-up frame does the work of an ordinary frame.
fn frames_of(case: &Case, n_warm_up: u32) -> impl Iterator<Item = u32> + Send + use<> {
    let first = i64::from(case.i_first) - i64::from(n_warm_up);
    let end = i64::from(case.i_first) + i64::from(case.n_frames);
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
    use crate::model::scene::Threading::{self, Parallel, Serial};
    use crate::timing::cases::{LoopChoice, cases};

    fn choice(modes: &[Threading], saved: bool) -> LoopChoice<'_> {
        LoopChoice { modes, skip: true, saved }
    }

    #[test]
    fn warm_up_leads_to_the_timed_frames() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml");
        let loaded = crate::io::scene_file::load(&path, &[], None).unwrap();
        let mut case = cases(loaded, &[], Some(3), choice(&[Serial], false)).remove(0);
        let frames = |case: &Case, n| frames_of(case, n).collect::<Vec<u32>>();
        assert_eq!(frames(&case, 0), [0, 1, 2]);
        assert_eq!(frames(&case, 2), [2, 1, 0, 1, 2]);
        case.i_first = 5;
        assert_eq!(frames(&case, 2), [3, 4, 5, 6, 7]);
        assert_eq!(frames(&case, 7), [2, 1, 0, 1, 2, 3, 4, 5, 6, 7]);
    }

    #[test]
    fn rounds_alternate_their_order() {
        let loaded = |n: u32| {
            let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml");
            let loaded = crate::io::scene_file::load(&path, &[], None).unwrap();
            cases(loaded, &[], Some(n), choice(&[Serial, Parallel], n > 5))
        };
        let names = |cases: &[Case], n| -> String {
            let of = |(i, of): (usize, Loop)| format!("{i}{} ", of.name());
            block_order(cases, n).into_iter().map(of).collect()
        };
        assert_eq!(names(&loaded(5), 3), "0serial 0parallel 0parallel 0serial 0serial 0parallel ");
        let two = [loaded(6), loaded(5)].concat();
        let there = ["0serial", "0parallel", "0serial no-skip", "1serial", "1parallel"];
        let back = there.iter().rev();
        assert_eq!(
            names(&two, 2).trim_end(),
            there.iter().chain(back).copied().collect::<Vec<_>>().join(" ")
        );
        let plan = BenchPlan {
            n_warm_up: 2,
            n_rounds: 2,
            hash_frames: false,
            pictures: false,
            checked: None,
            counts_invocations: false,
        };
        assert_eq!(n_frames_total(&two, &plan), 2 * (3 * 8 + 2 * 7));
    }
}
