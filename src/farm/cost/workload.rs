//! The amounts of work in scenes, counted before any frame is drawn. Passes that a frame skips are
//! not counted.

use std::ops::Range;
use std::sync::Arc;

use super::amounts::Amounts;
use super::cell_visits::CellVisits;
use super::layers::Layers;
use crate::error::Result;
use crate::frame::plan::Pass;
use crate::frame::plan_of_frame;
use crate::io::scene_file::LoadedScene;
use crate::model::scene::{LightingMode, Scene};
use crate::reference::picture::FrameReference;
use crate::studies::error::blocks::BETWEEN;
use crate::studies::error::device_runner::n_frames_drawn;
use crate::timing::cases::{Case, Loop};

/// The amounts of work that is cut into shards.
#[derive(Debug, Clone, PartialEq)]
pub struct Workload {
    /// Amounts of each item.
    pub items: Vec<Amounts>,
    /// Amounts that every shard has, besides those of its items.
    pub per_shard: Amounts,
}

impl Workload {
    /// Returns the amounts of a shard of all items.
    pub fn total(&self) -> Amounts {
        self.per_shard + self.items.iter().copied().sum()
    }
}

/// Amounts of a frame in which every pass runs, part by part.
struct Parts {
    n_particles: f64,
    visits: CellVisits,
    facet_pairs: f64,
    n_pixels: f64,
    n_layers: f64,
}

impl Parts {
    fn new(scene: &Scene, time_s: f64) -> Result<Parts> {
        let (truth, n_facets) = (FrameReference::unlit(scene, time_s)?, scene.n_facets() as f64);
        let is_second = scene.lighting.mode == LightingMode::TwoReflection;
        // Each pair is an exchange, and a test of every rectangle that may occlude it.
        let n_tests = 1.0 + scene.surfaces.len() as f64;
        let n_pixels = f64::from(scene.film.width) * f64::from(scene.film.height);
        Ok(Parts {
            n_particles: scene.n_particles() as f64,
            visits: CellVisits::new(scene, &truth),
            facet_pairs: if is_second { n_facets * n_facets * n_tests } else { 0.0 },
            n_pixels,
            n_layers: Layers::new(scene, &truth, scene.draw.edge()).n_total() - n_pixels,
        })
    }

    /// Returns the amounts of the passes that run, and of the background.
    fn where_run(&self, runs: impl Fn(Pass) -> bool) -> Amounts {
        let any = |passes: &[Pass]| f64::from(u8::from(passes.iter().any(|pass| runs(*pass))));
        Amounts {
            steps: 1.0,
            particle_steps: any(&[Pass::Live, Pass::Place, Pass::Cull, Pass::Sort])
                * self.n_particles,
            cells: any(&[Pass::Grid]) * self.visits.filled
                + any(&[Pass::Transmit]) * self.visits.marched,
            pixel_samples: self.n_pixels + any(&[Pass::Sprites, Pass::Tiles]) * self.n_layers,
            facet_pairs: any(&[Pass::Second]) * self.facet_pairs,
            textures: 0.0,
        }
    }
}

/// Amounts of a frame as an animation's first, in which every pass runs, and after its neighbour.
struct FrameAmounts {
    first: Amounts,
    next: Amounts,
}

impl FrameAmounts {
    fn new(scene: &Scene, i_frame: u32) -> Result<FrameAmounts> {
        let parts = Parts::new(scene, scene.time.at(i_frame))?;
        let first = parts.where_run(|_| true);
        let plan = plan_of_frame(scene, i_frame)?;
        let next = plan.map_or(first, |plan| parts.where_run(|pass| plan.runs(pass)));
        Ok(FrameAmounts { first, next })
    }
}

/// Returns the amount of making a scene's textures once.
fn textures_of(scene: &Scene) -> Amounts {
    Amounts { textures: f64::from(u8::from(scene.is_textured())), ..Amounts::default() }
}

/// Counts the work of an animation's frames. At most 16 of them are looked at; each stands for its
/// neighbours.
///
/// # Errors
/// When a scene cannot be placed at a frame's time.
pub fn frames_workload(loaded: &LoadedScene, frames: Range<u32>) -> Result<Workload> {
    const N_LOOKED_AT: u32 = 16;
    let n_alike = (frames.end - frames.start).div_ceil(N_LOOKED_AT).max(1);
    let mut items = Vec::new();
    for first in frames.clone().step_by(n_alike as usize) {
        let n = n_alike.min(frames.end - first);
        let middle = first + n / 2;
        let next = FrameAmounts::new(&loaded.clone().at_frame(middle), middle)?.next;
        items.extend(std::iter::repeat_n(next, n as usize));
    }
    let scene = loaded.clone().at_frame(frames.start);
    let FrameAmounts { first, next } = FrameAmounts::new(&scene, frames.start)?;
    // A run's first frame does what the others skip.
    Ok(Workload { items, per_shard: first + next * -1.0 + textures_of(&scene) })
}

/// Counts the work of a bench's cases. Every shard times the first case, too.
///
/// # Errors
/// When a scene cannot be placed at a frame's time.
pub fn bench_workload(cases: &[Case], n_warm_up: u32, n_repeats: u32) -> Result<Workload> {
    let of_case = |case: &Case| {
        let FrameAmounts { first, next } = FrameAmounts::new(&case.scene, case.i_first)?;
        let n_frames = f64::from(case.n_frames + n_warm_up);
        // Every block of frames starts with a new device.
        let block = |of: &Loop| {
            let others = if of.skip { next } else { first };
            first + others * (n_frames - 1.0) + textures_of(&case.scene)
        };
        Ok(case.loops.iter().map(block).sum::<Amounts>() * f64::from(n_repeats))
    };
    let mut items = cases.iter().map(of_case).collect::<Result<Vec<Amounts>>>()?;
    let base = items.first_mut().map(std::mem::take);
    Ok(Workload { items, per_shard: base.unwrap_or_default() })
}

/// The frames that an error study draws of each configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StudyTurns {
    /// The frame that is drawn.
    pub i_frame: u32,
    /// Turns of each configuration.
    pub n_rounds: u32,
    /// Timed frames of a turn.
    pub n_frames: u32,
    /// Whether frames skip passes as they do when they are played.
    pub as_played: bool,
}

impl StudyTurns {
    fn amounts(self, scene: &Scene) -> Result<Amounts> {
        let n_frames = f64::from(n_frames_drawn(self.n_rounds, self.n_frames));
        let frames = if self.as_played {
            let FrameAmounts { first, next } = FrameAmounts::new(scene, self.i_frame)?;
            first + next * (n_frames - 1.0)
        } else {
            Parts::new(scene, scene.time.at(self.i_frame))?.where_run(|_| true) * n_frames
        };
        // Each turn starts with a new player, which makes the textures, and so does the picture.
        Ok(frames + textures_of(scene) * f64::from(self.n_rounds + 1))
    }
}

/// Counts the work of an error study's configurations. The `base` configuration has turns in every
/// shard, between those of the others.
///
/// # Errors
/// When a scene cannot be loaded, or placed at the frame's time.
pub fn study_workload(
    base: &Scene,
    configurations: impl Iterator<Item = Result<Arc<Scene>>>,
    turns: StudyTurns,
) -> Result<Workload> {
    let per_shard = turns.amounts(base)?;
    let of_one = |scene: Result<Arc<Scene>>| {
        Ok(turns.amounts(&*scene?)? + per_shard * (1.0 / BETWEEN as f64))
    };
    Ok(Workload { items: configurations.map(of_one).collect::<Result<_>>()?, per_shard })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::io::scene_file;

    fn loaded(name: &str, set: &[&str]) -> LoadedScene {
        let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
        scene_file::load(&Path::new("scenes").join(name), &set, None).unwrap()
    }

    #[test]
    fn a_scene_at_rest_is_worked_on_in_the_first_frame_alone() {
        let still = loaded("hello.toml", &["lighting.mode=two-reflection"]);
        let Workload { items, per_shard } = frames_workload(&still, 0..20).unwrap();
        let n_pixels = 320.0 * 240.0;
        let background = Amounts { steps: 1.0, pixel_samples: n_pixels, ..Amounts::default() };
        assert!(items.len() == 20 && items.iter().all(|frame| *frame == background), "{items:?}");
        let whole = Parts::new(&still.scene, 0.0).unwrap().where_run(|_| true);
        assert_eq!(per_shard + items[0], Amounts { textures: 1.0, ..whole });
        assert_eq!((whole.particle_steps, whole.facet_pairs), (320.0, 320.0 * 320.0));
        assert!(whole.cells > 64.0 && whole.pixel_samples > n_pixels);
    }

    #[test]
    fn a_moving_scene_is_worked_on_in_every_frame() {
        let moving = loaded("cumulus.toml", &["draw.impostors=off"]);
        let FrameAmounts { next, first } = FrameAmounts::new(&moving.scene, 7).unwrap();
        assert_eq!(next, first);
        // With a moving camera alone the light stays as it is.
        let (mut seen, flight) = (loaded("hello.toml", &[]).scene, loaded("flyby.toml", &[]).scene);
        (seen.camera, seen.time) = (flight.camera, flight.time);
        let FrameAmounts { next, first } = FrameAmounts::new(&seen, 7).unwrap();
        assert_eq!(next, Amounts { cells: 0.0, facet_pairs: 0.0, ..first });
        assert!(first.cells > 0.0 && first.facet_pairs > 0.0);
    }
}
