//! Frames of a scene, timed: each case in each of its loops, in interleaved blocks.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use sha2::{Digest, Sha256};

use crate::error::{Error, Result};
use crate::frame::FrameTimes;
use crate::frame::counts::Counts;
use crate::frame::light_notes::light_notes;
use crate::frame::render::Renderer;
use crate::frame::stage::Stage;
use crate::gpu::shader::hex;
use crate::io::image::display_bytes;
use crate::model::scene::{Draw, Scene};
use crate::timing::cases::{Case, Loop};

/// How long and how often.
#[derive(Debug, Clone, Copy)]
pub struct BenchPlan {
    /// Untimed frames at the start of every block.
    pub n_warm_up: u32,
    /// Blocks of each case in each of its loops.
    pub n_rounds: u32,
    /// Read back and hash every frame, which adds to the next one's time.
    pub hash_frames: bool,
    /// Keep the last frame of every case, read back once all its blocks are timed.
    pub pictures: bool,
}

/// A frame as it is shown: 8-bit sRGB, three bytes a pixel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shown {
    pub i_case: usize,
    pub width: u32,
    pub height: u32,
    pub rgb: Vec<u8>,
}

/// One frame of one block.
#[derive(Debug, Clone)]
pub struct Sample {
    pub i_case: usize,
    pub of: Loop,
    /// Counts over the whole run.
    pub i_block: u32,
    pub warm_up: bool,
    pub times: FrameTimes,
    pub image_hash: Option<String>,
}

/// A run of frames of one case in one loop.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    pub i_case: usize,
    pub of: Loop,
    /// SHA-256 of its last frame, as it lies in the target; none where Ctrl-C came before it.
    pub image_hash: Option<String>,
}

/// What a bench came to. Kept whole also when it was interrupted, or a case failed.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    pub samples: Vec<Sample>,
    /// In the order they ran.
    pub blocks: Vec<Block>,
    /// What is odd about the light of a case's last frame.
    pub notes: Vec<String>,
    /// What every "auto" of what draws came to, and why.
    pub chosen: Vec<String>,
    /// The last frames, where they were asked for, of the cases that ran to their end.
    pub pictures: Vec<Shown>,
    /// What of the last frame of each case that ran to its end is odd.
    pub counts: BTreeMap<usize, Counts>,
    pub interrupted: bool,
}

/// A bench that has ended.
pub struct Ran {
    /// Of the last case; none where making it failed.
    pub stage: Option<Stage>,
    pub outcome: Outcome,
    /// Why it ended before its end, other than by being asked to.
    pub failure: Option<Error>,
}

/// Cases and loops in the order A B, B A, A B, …: whatever drifts over the run (heat, neighbours)
/// falls on all alike.
pub fn block_order(cases: &[Case], n_rounds: u32) -> Vec<(usize, Loop)> {
    let in_order: Vec<(usize, Loop)> = cases
        .iter()
        .enumerate()
        .flat_map(|(i, c)| c.loops.iter().map(move |of| (i, *of)))
        .collect();
    let of_round = |i: u32| {
        let mut order = in_order.clone();
        if i % 2 == 1 {
            order.reverse();
        }
        order
    };
    (0..n_rounds).flat_map(of_round).collect()
}

/// Frames of all blocks together, warm-up included.
pub fn n_frames_total(cases: &[Case], plan: &BenchPlan) -> u64 {
    let of = |c: &Case| c.loops.len() as u64 * (u64::from(c.n_frames) + u64::from(plan.n_warm_up));
    u64::from(plan.n_rounds) * cases.iter().map(of).sum::<u64>()
}

/// Runs the plan on `stage`, which holds the first case; `tick` is called after every frame, for
/// progress. Ends early, and cleanly, once `stop` is set.
pub fn run(
    stage: Stage,
    cases: &[Case],
    plan: &BenchPlan,
    stop: &AtomicBool,
    tick: &mut dyn FnMut(),
) -> Ran {
    let mut ran = Ran { stage: Some(stage), outcome: Outcome::default(), failure: None };
    let order = block_order(cases, plan.n_rounds);
    let mut i_staged = 0;
    // What "auto" came to at a case's first block holds for all of them.
    let mut taken: Vec<Option<Draw>> = vec![None; cases.len()];
    for (i_block, (i_case, of)) in (0u32..).zip(order.iter().copied()) {
        let case = &cases[i_case];
        let is_staged = std::mem::replace(&mut i_staged, i_case) == i_case;
        let is_last = !order[i_block as usize + 1..].iter().any(|(i, _)| *i == i_case);
        let mut block = || -> Result<()> {
            let stage = ran
                .stage
                .take()
                .ok_or_else(|| Error::usage("the stage before this block has failed"))?;
            let stage = if is_staged {
                stage
            } else {
                stage.again(with_taken(&case.scene, taken[i_case]), of.skip)?
            };
            let stage = ran.stage.insert(stage);
            taken[i_case] = Some(stage.scene.draw);
            ran.outcome
                .chosen
                .extend(stage.take_chosen().iter().map(|text| named(cases, case, text)));
            run_block(
                stage,
                &mut ran.outcome,
                [i_case, i_block as usize],
                (case, of),
                plan,
                stop,
                tick,
            )?;
            if is_last {
                ran.outcome
                    .notes
                    .extend(light_notes(stage)?.iter().map(|note| named(cases, case, note)));
                ran.outcome
                    .counts
                    .insert(i_case, Counts::of(&mut stage.renderer, &stage.device, &stage.scene)?);
                // Of a block that was cut short the last frame is another one.
                if plan.pictures && !stop.load(Ordering::Relaxed) {
                    ran.outcome.pictures.push(shown(i_case, case, &mut stage.renderer)?);
                }
            }
            Ok(())
        };
        if let Err(error) = block() {
            ran.failure = Some(if cases.len() > 1 { error.within(&case.name()) } else { error });
            break;
        }
        if stop.load(Ordering::Relaxed) {
            ran.outcome.interrupted = true;
            break;
        }
    }
    ran
}

/// A note, with its case's name where there are several.
fn named(cases: &[Case], case: &Case, note: &str) -> String {
    if cases.len() > 1 { format!("{}: {note}", case.name()) } else { note.to_owned() }
}

/// The scene with what "auto" took where that is known.
fn with_taken(scene: &Arc<Scene>, taken: Option<Draw>) -> Arc<Scene> {
    match taken {
        Some(draw) if draw != scene.draw => Arc::new(Scene { draw, ..Scene::clone(scene) }),
        _ => scene.clone(),
    }
}

fn run_block(
    stage: &mut Stage,
    outcome: &mut Outcome,
    [i_case, i_block]: [usize; 2],
    (case, of): (&Case, Loop),
    plan: &BenchPlan,
    stop: &AtomicBool,
    tick: &mut dyn FnMut(),
) -> Result<()> {
    // A frame's number has 32 bits, and so has the warm-up's.
    if case.i_first.checked_add(case.n_frames).is_none() {
        return Err(Error::usage(
            "the frames of a block, counted from the scene's first, exceed 32 bits",
        ));
    }
    stage.set_skip(of.skip);
    let samples = &mut outcome.samples;
    let n_before = samples.len();
    let on_frame = &mut |times: FrameTimes, renderer: &mut Renderer| {
        let image_hash = if plan.hash_frames { Some(image_hash(renderer)?) } else { None };
        let warm_up = samples.len() - n_before < plan.n_warm_up as usize;
        samples.push(Sample { i_case, of, i_block: i_block as u32, warm_up, times, image_hash });
        tick();
        Ok(!stop.load(Ordering::Relaxed))
    };
    stage.run(of.threading, frames_of(case, plan.n_warm_up), on_frame)?;
    // Of a block that was cut short the last frame is another one.
    let image_hash =
        if stop.load(Ordering::Relaxed) { None } else { Some(image_hash(&mut stage.renderer)?) };
    outcome.blocks.push(Block { i_case, of, image_hash });
    Ok(())
}

/// The frames of a block: those that are timed, and before them those that lead up to them. Where
/// there are none time runs backwards first: n, n − 1, …, 1, 0, 1, …, so that what is done in a
/// frame is what is done in any.
fn frames_of(case: &Case, n_warm_up: u32) -> impl Iterator<Item = u32> + Send + use<> {
    let first = i64::from(case.i_first) - i64::from(n_warm_up);
    let end = i64::from(case.i_first) + i64::from(case.n_frames);
    // Within u32: see `run_block`.
    (first..end).map(|i| u32::try_from(i.unsigned_abs()).unwrap_or(u32::MAX))
}

/// The last frame over the background, tone-mapped.
fn shown(i_case: usize, case: &Case, renderer: &mut Renderer) -> Result<Shown> {
    let film = case.scene.film;
    let rgb = display_bytes(&film, film.width, film.height, &renderer.image()?);
    Ok(Shown { i_case, width: film.width, height: film.height, rgb })
}

/// SHA-256 of the last frame, as it lies in the target.
fn image_hash(renderer: &mut Renderer) -> Result<String> {
    Ok(hex(&Sha256::digest(renderer.image_bytes()?)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::scene::Threading::{Parallel, Serial};
    use crate::timing::cases::cases;

    #[test]
    fn warm_up_leads_to_the_timed_frames() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml");
        let loaded = crate::io::scene_file::load(&path, &[], None).unwrap();
        let mut case = cases(loaded, &[], &[Serial], Some(3), [true, false]).remove(0);
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
            cases(loaded, &[], &[Serial, Parallel], Some(n), [true, n > 5])
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
        let plan = BenchPlan { n_warm_up: 2, n_rounds: 2, hash_frames: false, pictures: false };
        assert_eq!(n_frames_total(&two, &plan), 2 * (3 * 8 + 2 * 7));
    }
}
