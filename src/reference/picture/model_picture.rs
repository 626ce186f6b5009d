//! Pictures in the model's own light, sample by sample.

use glam::DVec3;

use super::background::{draw_ground, view};
use super::error_estimate::ErrorEstimate;
use super::frame::FrameReference;
use super::model_light::{ModelLight, ModelScene, RadianceEstimate};
use super::pixels::Pixels;
use super::progress::{OnProgress, RenderStage};
use super::scene_light::{PixelSample, RenderedPixels, volume_at};
use crate::model::scene::Scene;
use crate::model::surface::Surface;
use crate::reference::composite::OpaquePixel;
use crate::reference::parallel::parallel_map;
use crate::reference::surfaces;
use crate::reference::view::View;
use crate::reference::volume::Volume;

/// A scene and the light in it.
pub(super) struct ModelPicture<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its particles.
    pub frame: &'a FrameReference,
    /// Everything that its light meets.
    pub model: &'a ModelScene,
    /// The light.
    pub light: ModelLight<'a>,
    /// Lights surfaces at their facets and interpolates, instead of at every pixel.
    pub by_facet: bool,
    /// The pixels to draw.
    pub pixels: &'a Pixels,
    /// Called as parts are done.
    pub on_progress: OnProgress<'a>,
}

impl ModelPicture<'_> {
    /// Lights the facets of ground and particles in one sample. The result is the same in every
    /// sample unless the light is random.
    pub fn discs(&self, i_sample: u32) -> Vec<RadianceEstimate> {
        let n_parts = self.n_parts();
        parallel_map(self.model.n_discs(), |i| {
            let lit = self.light.of_disc(i, i_sample);
            (self.on_progress)(RenderStage::Lighting, n_parts);
            lit
        })
    }

    /// Surface and centre of every facet, if surfaces are lit at their facets.
    fn surface_facets(&self) -> Vec<(usize, DVec3)> {
        if !self.by_facet {
            return Vec::new();
        }
        let of = |(i, s): (usize, &Surface)| {
            (0..s.n_facets() as u32).map(|k| (i, s.facet_center(k))).collect::<Vec<_>>()
        };
        self.model.surfaces().iter().enumerate().flat_map(of).collect()
    }

    /// Number of points that are lit one by one.
    fn n_parts(&self) -> usize {
        let n_on_surfaces =
            if self.by_facet { self.surface_facets().len() } else { self.pixels.at.len() };
        self.model.n_discs() + n_on_surfaces
    }

    /// Draws one sample whose discs are lit as given.
    pub fn draw(&self, discs: &[RadianceEstimate], sample: PixelSample) -> RenderedPixels {
        let view = View { shift: sample.shift, ..view(self.scene, self.frame) };
        let (ground, particles) = discs.split_at(self.model.n_ground());
        let opaque = if self.by_facet {
            self.interpolated_surfaces(&view, sample.i)
        } else {
            self.surfaces_at_pixels(&view, sample.i)
        };
        let opaque = self.with_ground(opaque, &view, ground);
        let radiance: Vec<DVec3> = particles.iter().map(|lit| lit.radiance).collect();
        let particle_error = ErrorEstimate::root_mean_square(particles.iter().map(|lit| lit.error));
        let places: Vec<OpaquePixel> = opaque.iter().map(|(pixel, _)| *pixel).collect();
        let volume = Volume::new(&view, &self.frame.blobs, &radiance);
        let found = volume_at(&volume, self.pixels, &places, self.on_progress);
        // A surface's error may show entirely, a particle's as far as the particles are opaque.
        RenderedPixels::from_volume(found, |k, p| {
            let (pixel, error) = opaque[k];
            let through = if pixel.color[3] > 0.0 { 1.0 } else { 0.0 };
            ErrorEstimate::from_quadrature(p.error) + error * through + particle_error * p.color[3]
        })
    }

    /// Lights the surface seen in every pixel; its back is black.
    fn surfaces_at_pixels(&self, view: &View, i_sample: u32) -> Vec<(OpaquePixel, ErrorEstimate)> {
        let (n_discs, n_parts) = (self.model.n_discs(), self.n_parts());
        parallel_map(self.pixels.at.len(), |k| {
            let ([i, j], number) = (self.pixels.at[k], n_discs + self.pixels.number(k));
            let ray = view.ray(i, j);
            let mut found = (OpaquePixel::EMPTY, ErrorEstimate::default());
            if let Some((i_surface, hit)) = surfaces::seen(view, self.model.surfaces(), ray) {
                let lit = if hit.is_front {
                    let position = view.pose.position + hit.depth * ray;
                    self.light.of_surface(i_surface, position, number, i_sample)
                } else {
                    RadianceEstimate::DARK
                };
                let color = lit.radiance.extend(1.0).to_array();
                found = (OpaquePixel { color, depth: hit.depth, ..OpaquePixel::EMPTY }, lit.error);
            }
            (self.on_progress)(RenderStage::Lighting, n_parts);
            found
        })
    }

    /// Lights the surfaces at their facets and draws them from that.
    fn interpolated_surfaces(
        &self,
        view: &View,
        i_sample: u32,
    ) -> Vec<(OpaquePixel, ErrorEstimate)> {
        let (facets, n_parts) = (self.surface_facets(), self.n_parts());
        let lit: Vec<RadianceEstimate> = parallel_map(facets.len(), |k| {
            let (i_surface, position) = facets[k];
            let number = self.model.n_discs() + k;
            let lit = self.light.of_surface(i_surface, position, number, i_sample);
            (self.on_progress)(RenderStage::Lighting, n_parts);
            lit
        });
        let radiance: Vec<DVec3> = lit.iter().map(|lit| lit.radiance).collect();
        let error = ErrorEstimate::root_mean_square(lit.iter().map(|lit| lit.error));
        let at = self.pixels.at.iter().copied();
        let seen = surfaces::render_at(view, self.model.surfaces(), &radiance, at);
        seen.into_iter().map(|pixel| (pixel, error)).collect()
    }

    /// Draws the ground over `opaque` where it is nearer, from the light of its points.
    fn with_ground(
        &self,
        opaque: Vec<(OpaquePixel, ErrorEstimate)>,
        view: &View,
        ground: &[RadianceEstimate],
    ) -> Vec<(OpaquePixel, ErrorEstimate)> {
        if ground.is_empty() {
            return opaque;
        }
        let radiance: Vec<DVec3> = ground.iter().map(|lit| lit.radiance).collect();
        let error = ErrorEstimate::root_mean_square(ground.iter().map(|lit| lit.error));
        let tile = self.pixels.tile;
        let mut picture = vec![OpaquePixel::EMPTY; tile.n_pixels()];
        draw_ground((&mut picture, tile), self.scene, self.frame, view, &radiance);
        let nearer = |(other, seen): ((OpaquePixel, ErrorEstimate), OpaquePixel)| {
            if seen.depth < other.0.depth { (seen, error) } else { other }
        };
        opaque.into_iter().zip(self.pixels.pick_tile(&picture)).map(nearer).collect()
    }
}
