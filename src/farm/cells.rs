//! How often cells of the density grid are written and read: what a frame's light takes, before any
//! of it is made.

use crate::model::light::Light;
use crate::model::scene::{LightingMode, Scene};
use crate::reference::Blob;
use crate::reference::grid::n_deposited;
use crate::reference::picture::FrameReference;
use crate::reference::transmit::n_samples;

/// Of one frame whose light is made anew; 0 of a scene without lighting.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Visits {
    /// Cells that are put in order, and those that each particle leaves mass in.
    pub filled: f64,
    /// Samples on the ways from every facet to every light.
    pub marched: f64,
}

impl Visits {
    pub fn of(scene: &Scene, truth: &FrameReference) -> Visits {
        let grid = &truth.state.grid;
        if scene.lighting.mode == LightingMode::None || truth.blobs.is_empty() {
            return Visits::default();
        }
        let filled = grid.n_total() as f64 + n_deposited(grid, &truth.blobs);
        Visits { filled, marched: n_marched(scene, truth) }
    }
}

/// A facet is taken to be as far from the grid's border as a particle is in the mean.
fn n_marched(scene: &Scene, truth: &FrameReference) -> f64 {
    let origin = truth.state.light_origin;
    let of_light = |light: &Light| {
        let samples = |blob: &Blob| {
            let way = light.arrival(blob.position);
            f64::from(n_samples(
                &truth.state.grid,
                blob.position,
                way.toward,
                way.distance,
                scene.lighting.step,
            ))
        };
        truth.blobs.iter().map(samples).sum::<f64>()
    };
    let n_samples: f64 =
        scene.lights.iter().map(|light| of_light(&light.relative_to(origin))).sum();
    n_samples / truth.blobs.len() as f64 * scene.n_facets() as f64
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::io::scene_file;

    fn visits(change: impl Fn(&mut Scene)) -> (Visits, FrameReference) {
        let mut scene = scene_file::load(Path::new("scenes/hello.toml"), &[], None).unwrap().scene;
        change(&mut scene);
        let truth = FrameReference::unlit(&scene, 0.0).unwrap();
        (Visits::of(&scene, &truth), truth)
    }

    #[test]
    fn every_light_marches_from_every_facet_and_cells_are_filled_once() {
        let sun = |scene: &Scene| scene.lights[0];
        let (none, truth) = visits(|scene| scene.lights.clear());
        let grid = truth.state.grid;
        assert_eq!(none.marched, 0.0);
        assert_eq!(none.filled - n_deposited(&grid, &truth.blobs), grid.n_total() as f64);
        let (one, _) = visits(|scene| scene.lights = vec![sun(scene)]);
        let (two, _) = visits(|scene| scene.lights = vec![sun(scene); 2]);
        assert_eq!((one.filled, two.filled), (none.filled, none.filled));
        assert!(
            one.marched > 0.0 && (two.marched / one.marched - 2.0).abs() < 1e-12,
            "{one:?} {two:?}"
        );
        // Steps twice as long are half as many, but for the last of each way.
        let (few, _) = visits(|scene| {
            scene.lights = vec![sun(scene)];
            scene.lighting.step *= 2.0;
        });
        let n_ways = truth.blobs.len() as f64;
        assert!((few.marched - 0.5 * one.marched).abs() <= 0.5 * n_ways, "{few:?} {one:?}");
        // No way is longer than the grid's diagonal.
        let (step, diagonal) = (0.5, grid.n_cells.as_dvec3().length());
        assert!(
            one.marched > n_ways && one.marched <= n_ways * (diagonal / step + 1.0),
            "{one:?} {n_ways}"
        );
    }

    #[test]
    fn a_scene_without_lighting_visits_none() {
        assert_eq!(visits(|scene| scene.lighting.mode = LightingMode::None).0, Visits::default());
    }
}
