//! How often cells of the density grid are written and read in a frame: what its light takes, before any of it is made.

use super::truth::Truth;
use crate::model::light::Light;
use crate::model::scene::{LightingMode, Scene};
use crate::reference::grid::n_deposited;
use crate::reference::transmit::n_samples;

/// Cells that are put in order, those that each particle leaves mass in, and samples on the ways from every facet to
/// every light. 0 of a scene without lighting.
pub fn n_visited(scene: &Scene, truth: &Truth) -> f64 {
    let grid = &truth.setting.grid;
    if scene.lighting.mode == LightingMode::None || truth.blobs.is_empty() {
        return 0.0;
    }
    grid.n_total() as f64 + n_deposited(grid, &truth.blobs) + n_marched(scene, truth)
}

/// A facet is taken to be as far from the grid's border as a particle is in the mean.
fn n_marched(scene: &Scene, truth: &Truth) -> f64 {
    let origin = truth.setting.light_origin;
    let of_light = |light: &Light| {
        let samples = |blob: &crate::reference::Blob| {
            let way = light.arrival(blob.position);
            f64::from(n_samples(&truth.setting.grid, blob.position, way.toward, way.distance, scene.lighting.step))
        };
        truth.blobs.iter().map(samples).sum::<f64>()
    };
    let n_samples: f64 = scene.lights.iter().map(|light| of_light(&light.relative_to(origin))).sum();
    n_samples / truth.blobs.len() as f64 * scene.n_facets() as f64
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::io::scene_file;

    fn counted(change: impl Fn(&mut Scene)) -> (f64, Truth) {
        let mut scene = scene_file::load(Path::new("scenes/hello.toml"), &[], None).unwrap().scene;
        change(&mut scene);
        let truth = Truth::unlit(&scene, 0.0).unwrap();
        (n_visited(&scene, &truth), truth)
    }

    #[test]
    fn every_light_marches_from_every_facet_and_cells_are_filled_once() {
        let sun = |scene: &Scene| scene.lights[0];
        let (none, truth) = counted(|scene| scene.lights.clear());
        let grid = truth.setting.grid;
        let met = |n: [u32; 3]| n.iter().map(|n| f64::from(*n)).product::<f64>();
        assert_eq!(none - n_deposited(&grid, &truth.blobs), met(grid.n_cells.to_array()));
        let (one, _) = counted(|scene| scene.lights = vec![sun(scene)]);
        let (two, _) = counted(|scene| scene.lights = vec![sun(scene); 2]);
        assert!(one > none && (two - none - 2.0 * (one - none)).abs() < 1e-6 * one, "{none} {one} {two}");
        // Steps twice as long are half as many, but for the last of each way.
        let (few, _) = counted(|scene| {
            scene.lights = vec![sun(scene)];
            scene.lighting.step *= 2.0;
        });
        let (ways, marched) = (truth.blobs.len() as f64, one - none);
        assert!((few - none - 0.5 * marched).abs() <= 0.5 * ways, "{few} {one}");
        // No way is longer than the grid's diagonal.
        let most = grid.n_cells.as_dvec3().length() / 0.5 + 1.0;
        assert!(marched > ways && marched <= ways * most, "{marched} {ways} {most}");
    }

    #[test]
    fn a_scene_without_lighting_visits_none() {
        assert_eq!(counted(|scene| scene.lighting.mode = LightingMode::None).0, 0.0);
    }
}
