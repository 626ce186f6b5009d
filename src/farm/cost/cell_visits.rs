//! How often the light of a frame writes and reads cells of the density grid.

use crate::model::light::Light;
use crate::model::scene::{LightingMode, Scene};
use crate::reference::Blob;
use crate::reference::deposit::n_deposited;
use crate::reference::picture::FrameReference;
use crate::reference::transmit::n_samples;

/// Visits of grid cells in a frame that computes its light. A scene without lighting has none.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CellVisits {
    /// Cells that are cleared, and those that each particle adds mass to.
    pub filled: f64,
    /// Samples along the rays from every facet to every light.
    pub marched: f64,
}

impl CellVisits {
    /// Counts the visits in a scene as `truth` has placed it.
    pub fn new(scene: &Scene, truth: &FrameReference) -> CellVisits {
        let grid = &truth.state.grid;
        if scene.lighting.mode == LightingMode::None || truth.blobs.is_empty() {
            return CellVisits::default();
        }
        let filled = grid.n_total() as f64 + n_deposited(grid, &truth.blobs);
        CellVisits { filled, marched: n_marched(scene, truth) }
    }
}

/// Counts samples from the particles. Facets are taken to be as far from the grid's border as
/// particles are on average.
fn n_marched(scene: &Scene, truth: &FrameReference) -> f64 {
    let (grid, origin) = (&truth.state.grid, truth.state.light_origin);
    let of_light = |light: Light| {
        let samples = |blob: &Blob| {
            let ray = light.arrival(blob.position);
            let step = scene.lighting.step;
            f64::from(n_samples(grid, blob.position, ray.toward, ray.distance, step))
        };
        truth.blobs.iter().map(samples).sum::<f64>()
    };
    let n_samples: f64 = scene.lights.iter().map(|light| of_light(light.relative_to(origin))).sum();
    n_samples / truth.blobs.len() as f64 * scene.n_facets() as f64
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::io::scene_file;

    fn visits(change: impl Fn(&mut Scene)) -> (CellVisits, FrameReference) {
        let mut scene = scene_file::load(Path::new("scenes/hello.toml"), &[], None).unwrap().scene;
        change(&mut scene);
        let truth = FrameReference::unlit(&scene, 0.0).unwrap();
        (CellVisits::new(&scene, &truth), truth)
    }

    #[test]
    fn every_light_is_marched_to_from_every_facet_and_cells_are_filled_once() {
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
        // Twice the step halves the samples, except for the last of each ray.
        let (few, _) = visits(|scene| {
            scene.lights = vec![sun(scene)];
            scene.lighting.step *= 2.0;
        });
        let n_rays = truth.blobs.len() as f64;
        assert!((few.marched - 0.5 * one.marched).abs() <= 0.5 * n_rays, "{few:?} {one:?}");
        // No ray is longer than the grid's diagonal.
        let (step, diagonal) = (0.5, grid.n_cells.as_dvec3().length());
        assert!(
            one.marched > n_rays && one.marched <= n_rays * (diagonal / step + 1.0),
            "{one:?} {n_rays}"
        );
    }

    #[test]
    fn a_scene_without_lighting_visits_no_cell() {
        let (visits, _) = visits(|scene| scene.lighting.mode = LightingMode::None);
        assert_eq!(visits, CellVisits::default());
    }
}
