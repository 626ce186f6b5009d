//! What a scene's frames make work of, counted before any is drawn: all of it where everything is
//! done anew, and what is left of it where frames leave out what they do not need.

use std::ops::Range;
use std::sync::Arc;

use super::cost::Work;
use crate::error::Result;
use crate::farm::cells::Visits;
use crate::farm::layers::Layers;
use crate::frame::Game;
use crate::frame::plan::{Pass, Plan, Skipping, plan};
use crate::frame::{SceneFeatures, Tensors};
use crate::io::scene_file::LoadedScene;
use crate::model::scene::{LightingMode, Scene};
use crate::reference::picture::FrameReference;

/// What a frame would make work of, part by part.
struct Parts {
    n_particles: f64,
    visits: Visits,
    facet_pairs: f64,
    n_pixels: f64,
    n_layers: f64,
}

impl Parts {
    fn of(scene: &Scene, time_s: f64) -> Result<Parts> {
        let (truth, n_facets) = (FrameReference::unlit(scene, time_s)?, scene.n_facets() as f64);
        let is_second = scene.lighting.mode == LightingMode::TwoReflection;
        // A pair is an exchange, and a test of every rectangle that may stand between.
        let n_tests = 1.0 + scene.surfaces.len() as f64;
        let n_pixels = f64::from(scene.film.width) * f64::from(scene.film.height);
        Ok(Parts {
            n_particles: scene.n_particles() as f64,
            visits: Visits::of(scene, &truth),
            facet_pairs: if is_second { n_facets * n_facets * n_tests } else { 0.0 },
            n_pixels,
            n_layers: Layers::of(scene, &truth, scene.draw.cutoff).n_whole() - n_pixels,
        })
    }

    /// Of the passes that run; what is behind the layers is always there.
    fn where_run(&self, runs: impl Fn(Pass) -> bool) -> Work {
        let any = |passes: &[Pass]| if passes.iter().any(|pass| runs(*pass)) { 1.0 } else { 0.0 };
        Work {
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

/// A frame at that time in which everything is done anew.
pub fn work_of(scene: &Scene, time_s: f64) -> Result<Work> {
    Ok(Parts::of(scene, time_s)?.where_run(|_| true))
}

/// A frame that is drawn after its neighbour, leaving out what that has done; and the same where it
/// is the first.
pub struct Played {
    pub next: Work,
    pub first: Work,
}

impl Played {
    pub fn of(scene: &Scene, i_frame: u32) -> Result<Played> {
        let parts = Parts::of(scene, scene.time.at(i_frame))?;
        let first = parts.where_run(|_| true);
        Ok(match plan_of(scene, i_frame)? {
            Some(plan) => Played { next: parts.where_run(|pass| plan.runs(pass)), first },
            None => Played { next: first, first },
        })
    }
}

/// What frame `i_frame` runs after its neighbour. None where that follows from what the host reads
/// while it plays.
fn plan_of(scene: &Scene, i_frame: u32) -> Result<Option<Plan>> {
    if scene.is_animated() {
        return Ok(None);
    }
    let scene = Arc::new(scene.exact().into_owned());
    let mut game = Game::new(scene.clone(), None);
    let i_last = i_frame.max(1) - 1;
    let (last, next) = (game.step(i_last)?, game.step(i_last + 1)?);
    let features = SceneFeatures::new(&scene, Tensors::Needless);
    Ok(Some(plan(&features, Skipping::new(true), Some(&last), &next)))
}

/// What making a scene's textures once is.
pub fn textures_of(scene: &Scene) -> Work {
    Work { textures: if scene.is_textured() { 1.0 } else { 0.0 }, ..Work::default() }
}

/// Frame by frame, of `frames`, as they are played: at some of them, each of which stands for its
/// neighbours.
pub fn work_of_frames(loaded: &LoadedScene, frames: Range<u32>) -> Result<Vec<Work>> {
    const N_LOOKED_AT: u32 = 16;
    let n_alike = (frames.end - frames.start).div_ceil(N_LOOKED_AT).max(1);
    let of = |first: u32| {
        let n = n_alike.min(frames.end - first);
        let middle = first + n / 2;
        let work = Played::of(&loaded.clone().at_frame(middle), middle)?.next;
        Ok(vec![work; n as usize])
    };
    let parts = frames.clone().step_by(n_alike as usize).map(of).collect::<Result<Vec<_>>>()?;
    Ok(parts.concat())
}

/// What frame `i_frame` takes more where a run begins with it: textures, and all that the others
/// need not do again.
pub fn work_of_beginning(loaded: &LoadedScene, i_frame: u32) -> Result<Work> {
    let scene = loaded.clone().at_frame(i_frame);
    let Played { next, first } = Played::of(&scene, i_frame)?;
    Ok(first + next * -1.0 + textures_of(&scene))
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
    fn what_stands_still_is_done_once() {
        let still = loaded("hello.toml", &["lighting.mode=two-reflection"]);
        let all = work_of_frames(&still, 0..20).unwrap();
        let begin = work_of_beginning(&still, 0).unwrap();
        let n_pixels = 320.0 * 240.0;
        let nothing = Work { steps: 1.0, pixel_samples: n_pixels, ..Work::default() };
        assert!(all.len() == 20 && all.iter().all(|frame| *frame == nothing), "{all:?}");
        // All of it, in the first.
        let whole = work_of(&still.scene, 0.0).unwrap();
        assert_eq!(begin + all[0], Work { textures: 1.0, ..whole });
        assert_eq!((whole.particle_steps, whole.facet_pairs), (320.0, 320.0 * 320.0));
        assert!(whole.cells > 64.0 && whole.pixel_samples > n_pixels);
    }

    #[test]
    fn what_moves_is_done_in_every_frame() {
        let moving = loaded("cumulus.toml", &["draw.impostors=off"]);
        let Played { next, first } = Played::of(&moving.scene, 7).unwrap();
        assert_eq!(next, first);
        // A flight past a cloud that stands still: drawn anew, its light is what it was.
        let (mut seen, flight) = (loaded("hello.toml", &[]).scene, loaded("flyby.toml", &[]).scene);
        (seen.camera, seen.time) = (flight.camera, flight.time);
        let Played { next, first } = Played::of(&seen, 7).unwrap();
        assert_eq!(next, Work { cells: 0.0, facet_pairs: 0.0, ..first });
        assert!(first.cells > 0.0 && first.facet_pairs > 0.0);
    }
}
