//! The cases of a bench: a scene in each of its phases, and the loops that it is timed in.

use std::sync::Arc;

use super::names::{Setting, case_name, loop_name, sweep_text};
use crate::error::Result;
use crate::frame::is_still;
use crate::io::scene_file::{LoadedScene, Phase};
use crate::model::scene::{Scene, Threading};

/// A way of running frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Loop {
    /// Whether the game and the render step run one after the other or on two threads.
    pub threading: Threading,
    /// Whether frames skip the passes whose output is still valid.
    pub skip: bool,
}

impl Loop {
    /// Returns "serial", "parallel", "serial no-skip" or "parallel no-skip".
    pub fn name(self) -> String {
        loop_name(self.threading.name(), self.skip)
    }
}

/// The loops that the cases of a bench are timed in.
#[derive(Debug, Clone, Copy)]
pub struct LoopChoice<'a> {
    /// A case that sets `threads.mode` itself is timed in that mode only.
    pub modes: &'a [Threading],
    /// Whether frames skip passes.
    pub skip: bool,
    /// Whether a loop without skipping is timed as well, to measure what skipping saves.
    pub saved: bool,
}

impl LoopChoice<'_> {
    fn of(self, scene: &Scene, sets_mode: bool) -> Vec<Loop> {
        let modes = if sets_mode { &[scene.threads.mode] } else { self.modes };
        let with = |&threading: &Threading| Loop { threading, skip: self.skip };
        let mut loops: Vec<Loop> = modes.iter().map(with).collect();
        if self.skip && self.saved {
            // With the threading of the first loop, so that the two differ in skipping alone.
            loops.push(Loop { skip: false, ..loops[0] });
        }
        loops
    }
}

/// A scene in one of its phases, at one point of a sweep.
#[derive(Debug, Clone)]
pub struct Case {
    /// Name of the phase.
    pub phase: Option<String>,
    /// The point of the sweep.
    pub sweep: Vec<Setting>,
    /// The scene in this phase.
    pub scene: Arc<Scene>,
    /// SHA-256 of the scene at this point of the sweep, with all its phases and files.
    pub scene_hash: String,
    /// First timed frame. The frames of the phases follow each other without a gap.
    pub i_first: u32,
    /// Timed frames of a block.
    pub n_frames: u32,
    /// Loops, in the order of the first round.
    pub loops: Vec<Loop>,
}

impl Case {
    /// Adds a loop without skipping if nothing moves and there is none: otherwise every time would
    /// be that of a frame in which nothing is drawn.
    ///
    /// # Errors
    /// Fails if the scene has no state at the time of a frame.
    pub fn with_figure(mut self) -> Result<Case> {
        let frames = self.i_first..self.i_first.saturating_add(self.n_frames);
        if self.loops.iter().all(|of| of.skip) && is_still(&self.scene, frames)? {
            self.loops.push(Loop { skip: false, ..self.loops[0] });
        }
        Ok(self)
    }

    /// Returns the phase and the point of the sweep in words; empty if there is neither.
    pub fn name(&self) -> String {
        case_name(self.phase.as_deref().unwrap_or_default(), &sweep_text(&self.sweep))
    }
}

/// Returns a case for each phase of `loaded`, the scene at the point `sweep`.
///
/// `n_frames` replaces the numbers of frames that the scene and its phases have.
pub fn cases(
    loaded: LoadedScene,
    sweep: &[Setting],
    n_frames: Option<u32>,
    loops: LoopChoice<'_>,
) -> Vec<Case> {
    let is_mode_swept = sweep.iter().any(|s| s.key == "threads.mode");
    let scene_hash = loaded.hash().to_owned();
    let LoadedScene { scene, phases, .. } = loaded;
    let case = |phase, scene: Scene, sets_mode: bool, i_first, own_frames| Case {
        phase,
        sweep: sweep.to_vec(),
        loops: loops.of(&scene, is_mode_swept || sets_mode),
        scene: scene.into(),
        scene_hash: scene_hash.clone(),
        i_first,
        n_frames: n_frames.unwrap_or(own_frames),
    };
    if phases.is_empty() {
        let n_frames = scene.time.n_frames;
        return vec![case(None, scene, false, 0, n_frames)];
    }
    let mut i_first = 0u32;
    let of_phase = |Phase { name, scene, sets_mode, n_frames, .. }: Phase| {
        let case = case(Some(name), scene, sets_mode, i_first, n_frames);
        // The loader has checked that the frames of all phases together fit.
        i_first = i_first.saturating_add(n_frames);
        case
    };
    phases.into_iter().map(of_phase).collect()
}
