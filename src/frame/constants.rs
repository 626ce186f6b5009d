//! The numbers of a scene that passes take as arguments. They are constant over a run.

use super::features::{has_diffusion, is_medium, saturation_bound, target_format};
use super::packet::Packet;
use crate::gpu::TargetFormat;
use crate::layout::frame::CameraRecord;
use crate::model::edge::Edge;
use crate::model::medium;
use crate::model::scene::{Octaves, Overlap, Scene};
use crate::passes::blobs::BlobView;
use crate::passes::transmit::MarchParams;
use crate::passes::{haze, relief};

/// Counts of records, and parameters of the passes.
pub(super) struct FrameConstants {
    pub n_particles: u32,
    pub n_surface_facets: u32,
    /// Facets of surfaces and terrains.
    pub n_solid_facets: u32,
    pub n_regions: u32,
    pub march: MarchParams,
    /// Surfaces and terrains.
    pub n_solids: u32,
    /// g of the ways to surfaces and terrains, where clouds are a medium.
    pub forward: f64,
    /// Terms of the light that a medium scatters once.
    pub terms: Octaves,
    /// The light changes inside of blobs.
    pub has_slopes: bool,
    /// Number of the first sun; 0 without.
    pub i_sun: u32,
    /// Longest edge of a facet of surfaces and terrains, where light diffuses.
    pub longest_facet_edge: f64,
    /// Cycles of the diffusion solver.
    pub n_cycles: u32,
    /// Bounces that follow it.
    pub n_bounces: u32,
    pub texture_seed: u32,
    pub edge: Edge,
    /// Blobs are composed by slices.
    pub slices: bool,
    /// Slices have the light of the cells where they are.
    pub in_cells: bool,
    /// σ below which a blob is left out, in pixels of the film.
    pub smallest: f64,
    pub saturated: f64,
    pub format: TargetFormat,
    /// Columns and rows of the film.
    pub size: [u32; 2],
}

impl FrameConstants {
    pub fn new(scene: &Scene) -> FrameConstants {
        let n_particles = scene.n_particles() as u32;
        FrameConstants {
            n_particles,
            n_surface_facets: scene.n_surface_facets() as u32,
            n_solid_facets: scene.n_solid_facets() as u32,
            n_regions: scene.n_regions() as u32,
            march: MarchParams {
                n_facets: scene.n_facets() as u32,
                n_lights: scene.lights.len() as u32,
                n_surfaces: scene.surfaces.len() as u32,
                step_cells: scene.lighting.step,
                // Without particles there is nothing to march through.
                forward: match is_medium(scene) {
                    _ if n_particles == 0 => 1.0,
                    // The ways' whole depth.
                    true => 0.0,
                    false => scene.lighting.forward,
                },
                // Diffusion brings the sky into the clouds.
                n_under_sky: match has_diffusion(scene) {
                    true => scene.n_solid_facets() as u32,
                    false => scene.n_facets() as u32,
                },
                i_first_ground: scene.n_surface_facets() as u32,
                n_ground: (scene.n_solid_facets() - scene.n_surface_facets()) as u32,
            },
            n_solids: scene.n_solids() as u32,
            forward: scene.lighting.forward,
            terms: medium::terms(&scene.lighting),
            has_slopes: scene.lighting.has_slopes(),
            i_sun: scene.i_sun().unwrap_or(0) as u32,
            longest_facet_edge: match has_diffusion(scene) {
                true => scene.longest_facet_edge(),
                false => 0.0,
            },
            n_cycles: scene.lighting.diffusion.cycles,
            n_bounces: scene.lighting.diffusion.bounces,
            texture_seed: scene.draw.texture_seed,
            edge: scene.draw.edge(),
            in_cells: scene.has_light_of_cells(),
            slices: scene.draw.overlap == Overlap::Slices,
            smallest: scene.draw.smallest.bound(),
            saturated: saturation_bound(scene.film.format),
            format: target_format(scene.film.format),
            size: [scene.film.width, scene.film.height],
        }
    }

    /// Returns the share of the depth that weakens light on its way to surfaces and ground, where
    /// clouds are a medium.
    pub fn backward(&self, packet: &Packet) -> f64 {
        packet.diffusion.as_ref().map_or(1.0 - self.forward, |of| of.mean_weakened())
    }

    /// Returns the facets and lights behind the air.
    pub fn haze(&self, packet: &Packet) -> haze::Push {
        haze::Push {
            n_facets: self.march.n_facets,
            n_lights: self.march.n_lights,
            i_sun: self.i_sun,
            n_solids: self.n_solids,
            backward: self.backward(packet) as f32,
        }
    }

    /// Returns the points and lights of the ground.
    pub fn relief(&self) -> relief::Push {
        let MarchParams { n_lights, n_surfaces, i_first_ground, n_ground, .. } = self.march;
        relief::Push {
            n_points: n_ground,
            n_lights,
            n_grounds: self.n_solids - n_surfaces,
            i_first_region: n_surfaces,
            i_first_ground,
        }
    }

    /// Returns the bytes of a picture.
    pub fn n_bytes(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1]) * self.format.bytes_per_pixel()
    }

    /// Returns `camera`'s view of the blobs of a frame.
    pub fn view<'a>(&self, camera: &'a CameraRecord, packet: &'a Packet) -> BlobView<'a> {
        let FrameConstants {
            edge: Edge { radius: cutoff, tau: threshold, least }, saturated, ..
        } = *self;
        let slice = if self.slices { packet.slice } else { 0.0 };
        let extents = Some(&packet.extents[..]);
        let cells = self.in_cells.then_some(&packet.grid);
        BlobView { camera, cutoff, threshold, least, saturated, slice, extents, cells }
    }
}
