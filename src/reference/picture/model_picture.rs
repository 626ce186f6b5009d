//! Pictures in the model's own light, sample by sample.

use glam::DVec3;

use super::background::{draw_ground, view};
use super::error_estimate::ErrorEstimate;
use super::frame::FrameReference;
use super::model_light::{ModelLight, ModelScene, RadianceEstimate};
use super::pixels::Pixels;
use super::progress::{OnProgress, RenderStage};
use super::scene_light::{PixelSample, RenderedPixels, volume_at};
use crate::model::parallel::parallel_map;
use crate::model::scene::Scene;
use crate::model::surface::Surface;
use crate::reference::composite::OpaquePixel;
use crate::reference::surfaces;
use crate::reference::view::View;
use crate::reference::volume::Volume;

/// A pixel that shows a surface or the ground, and the error of its light.
type SurfacePixel = (OpaquePixel, ErrorEstimate);

/// How a picture in the model's own light is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelDrawing {
    /// Number of reflections.
    pub n_reflections: u32,
    /// Lights surfaces at their facets and interpolates, instead of at every pixel.
    pub by_facet: bool,
}

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
    /// How surfaces are lit.
    pub how: ModelDrawing,
    /// The pixels to draw.
    pub pixels: &'a Pixels,
    /// Called as parts are done.
    pub on_progress: OnProgress<'a>,
}

impl ModelPicture<'_> {
    /// Lights the facets of ground and particles in one sample. The result is the same in every
    /// sample unless the light is random.
    pub fn discs(&self, i_sample: u32) -> Vec<RadianceEstimate> {
        self.light_each(self.n_discs(), |i| self.disc(i, i_sample))
    }

    /// Returns the number of facets of ground and particles.
    pub fn n_discs(&self) -> usize {
        self.model.discs.len()
    }

    /// Lights one of the facets of ground and particles.
    pub fn disc(&self, i: usize, i_sample: u32) -> RadianceEstimate {
        self.light.toward_eye(&self.light.area_scene.on_disc(i), [i as u32, i_sample])
    }

    /// Returns the radiance at a point of a surface's front. `i` numbers the points on surfaces.
    fn on_surface(
        &self,
        i_surface: usize,
        position: DVec3,
        [i, i_sample]: [u32; 2],
    ) -> RadianceEstimate {
        let number = [self.model.discs.len() as u32 + i, i_sample];
        self.light.toward_eye(&self.light.area_scene.on_surface(i_surface, position), number)
    }

    /// Lights `n` points of one kind.
    fn light_each<T: Send>(&self, n: usize, light: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        parallel_map(n, |i| {
            let lit = light(i);
            // Points of another kind take other times: together they would mislead about the rest.
            (self.on_progress)(RenderStage::Lighting, n);
            lit
        })
    }

    /// Draws one sample whose discs are lit as given.
    pub fn draw(&self, discs: &[RadianceEstimate], sample: PixelSample) -> RenderedPixels {
        let view = View { shift: sample.shift, ..view(self.scene, self.frame) };
        let (ground, particles) = discs.split_at(self.model.local.ground.len());
        let opaque = if self.how.by_facet {
            self.interpolated_surfaces(&view, sample.i)
        } else {
            self.surfaces_at_pixels(&view, sample.i)
        };
        let opaque = self.with_ground(opaque, &view, ground);
        let (radiance, particle_error) = separate(particles);
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
    fn surfaces_at_pixels(&self, view: &View, i_sample: u32) -> Vec<SurfacePixel> {
        self.light_each(self.pixels.at.len(), |k| {
            let [i, j] = self.pixels.at[k];
            let ray = view.ray(i, j);
            let Some((i_surface, hit)) = surfaces::seen(view, &self.model.local.surfaces, ray)
            else {
                return (OpaquePixel::EMPTY, ErrorEstimate::default());
            };
            let lit = if hit.is_front {
                let position = view.pose.position + hit.depth * ray;
                self.on_surface(i_surface, position, [self.pixels.number(k) as u32, i_sample])
            } else {
                RadianceEstimate::default()
            };
            let color = lit.radiance.extend(1.0).to_array();
            (OpaquePixel { color, depth: hit.depth, ..OpaquePixel::EMPTY }, lit.error)
        })
    }

    /// Lights the surfaces at their facets and draws them from that.
    fn interpolated_surfaces(&self, view: &View, i_sample: u32) -> Vec<SurfacePixel> {
        let surfaces = &self.model.local.surfaces;
        let of = |(i, s): (usize, &Surface)| {
            (0..s.n_facets() as u32).map(|k| (i, s.facet_center(k))).collect::<Vec<_>>()
        };
        let facets: Vec<(usize, DVec3)> = surfaces.iter().enumerate().flat_map(of).collect();
        let (radiance, error) = separate(&self.light_each(facets.len(), |k| {
            self.on_surface(facets[k].0, facets[k].1, [k as u32, i_sample])
        }));
        let at = self.pixels.at.iter().copied();
        let seen = surfaces::render_at(view, surfaces, &radiance, at);
        seen.into_iter().map(|pixel| (pixel, error)).collect()
    }

    /// Draws the ground over `opaque` where it is nearer, from the light of its points.
    fn with_ground(
        &self,
        opaque: Vec<SurfacePixel>,
        view: &View,
        ground: &[RadianceEstimate],
    ) -> Vec<SurfacePixel> {
        if ground.is_empty() {
            return opaque;
        }
        let (radiance, error) = separate(ground);
        let tile = self.pixels.tile;
        let mut picture = vec![OpaquePixel::EMPTY; tile.n_pixels()];
        draw_ground((&mut picture, tile), self.scene, self.frame, view, &radiance);
        let nearer = |(other, seen): (SurfacePixel, OpaquePixel)| {
            if seen.depth < other.0.depth { (seen, error) } else { other }
        };
        opaque.into_iter().zip(self.pixels.pick_tile(&picture)).map(nearer).collect()
    }
}

/// Returns the radiances, and the root mean square of their errors.
fn separate(lit: &[RadianceEstimate]) -> (Vec<DVec3>, ErrorEstimate) {
    let error = ErrorEstimate::root_mean_square(lit.iter().map(|lit| lit.error));
    (lit.iter().map(|lit| lit.radiance).collect(), error)
}
