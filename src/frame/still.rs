//! Scenes in which nothing moves, found by the plan before any frame is drawn.

use std::ops::Range;
use std::sync::Arc;

use super::features::{SceneFeatures, Tensors};
use super::game::Game;
use super::plan::{Plan, Skipping, plan};
use crate::error::Result;
use crate::model::scene::Scene;

/// Returns the passes that frame `i_frame` of a run runs after its neighbour; none if they depend
/// on values that the host reads back while frames are drawn.
///
/// # Errors
/// Fails if the scene has no state at the time of a frame.
pub fn plan_of_frame(scene: &Scene, i_frame: u32) -> Result<Option<Plan>> {
    if scene.is_animated() {
        return Ok(None);
    }
    let scene = Arc::new(scene.exact().into_owned());
    let features = SceneFeatures::new(&scene, Tensors::Needless);
    let mut game = Game::new(scene, None);
    plan_after_neighbour(&mut game, &features, i_frame).map(Some)
}

fn plan_after_neighbour(game: &mut Game, features: &SceneFeatures, i_frame: u32) -> Result<Plan> {
    let i_last = i_frame.max(1) - 1;
    let (last, next) = (game.step(i_last)?, game.step(i_last + 1)?);
    Ok(plan(features, Skipping::new(true), Some(&last), &next))
}

/// Returns whether at least half of `frames` skip every pass, so that their median time is that of
/// a frame in which nothing is drawn. Up to 16 frames, evenly spaced, stand for all.
///
/// # Errors
/// Fails if the scene has no state at the time of a frame.
pub fn is_still(scene: &Scene, frames: Range<u32>) -> Result<bool> {
    const N_LOOKED_AT: u32 = 16;
    if scene.is_animated() {
        return Ok(false);
    }
    let scene = Arc::new(scene.exact().into_owned());
    let features = SceneFeatures::new(&scene, Tensors::Needless);
    let mut game = Game::new(scene, None);
    let step = frames.len().div_ceil(N_LOOKED_AT as usize).max(1);
    let (mut n_looked_at, mut n_still) = (0, 0);
    for i_frame in frames.step_by(step) {
        let plan = plan_after_neighbour(&mut game, &features, i_frame)?;
        n_looked_at += 1;
        n_still += usize::from(plan.runs_nothing());
    }
    Ok(2 * n_still >= n_looked_at)
}
