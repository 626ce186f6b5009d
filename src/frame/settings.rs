//! What of the scene the passes are told and that is constant over a run.

use super::limits;
use super::tiling::saturated;
use crate::gpu::TargetFormat;
use crate::model::scene::Scene;

pub(super) struct Settings {
    pub n_particles: u32,
    pub n_surface_facets: u32,
    pub n_solid_facets: u32,
    pub n_facets: u32,
    pub n_lights: u32,
    pub n_surfaces: u32,
    pub step_cells: f64,
    pub forward: f64,
    pub texture_seed: u32,
    pub cutoff: f64,
    pub threshold: f64,
    pub smallest: f64,
    /// What lies behind a pixel that lets less through is left out, where the way of drawing knows.
    pub saturated: f64,
    pub format: TargetFormat,
    pub size: [u32; 2],
    pub n_pixels: u64,
}

impl Settings {
    pub fn of(scene: &Scene) -> Settings {
        let n_particles = scene.n_particles() as u32;
        Settings {
            n_particles,
            n_surface_facets: scene.n_surface_facets() as u32,
            n_solid_facets: scene.n_solid_facets() as u32,
            n_facets: scene.n_facets() as u32,
            n_lights: scene.lights.len() as u32,
            n_surfaces: scene.surfaces.len() as u32,
            step_cells: scene.lighting.step,
            // Without particles there is nothing to march through.
            forward: if n_particles > 0 { scene.lighting.forward } else { 1.0 },
            texture_seed: scene.draw.texture_seed,
            cutoff: scene.draw.cutoff,
            threshold: scene.draw.threshold.bound(),
            smallest: scene.draw.smallest.bound(),
            saturated: saturated(scene.film.format),
            format: limits::target_format(scene.film.format),
            size: [scene.film.width, scene.film.height],
            n_pixels: u64::from(scene.film.width) * u64::from(scene.film.height),
        }
    }

    /// Bytes of a picture.
    pub fn n_bytes(&self) -> u64 {
        self.n_pixels * self.format.bytes_per_pixel()
    }
}
