//! Pictures of a scene in the light that a [`FrameReference`] has.

use glam::{DVec2, DVec3};

use super::background::{opaque_pixels, view};
use super::error_estimate::{ErrorEstimate, root_mean_square};
use super::frame::FrameReference;
use super::pixels::Pixels;
use super::progress::{OnProgress, RenderStage};
use super::sprites::{drawn_blobs, drawn_radiance, raster, with_textures};
use crate::model::parallel::parallel_map;
use crate::model::scene::Scene;
use crate::reference::composite::OpaquePixel;
use crate::reference::sprites::{self, Sprites};
use crate::reference::view::View;
use crate::reference::volume::{Pixel, Volume};

/// How overlapping blobs are composed (model.md §9).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlobModel {
    /// As `draw.overlap` says: as sorted thin sprites, or by slices.
    AsDrawn,
    /// The integral over the overlapping blobs.
    Volume,
}

/// A picture at some pixels.
pub struct RenderedPixels {
    /// Premultiplied linear RGBA, in the order of the pixels.
    pub rgba: Vec<[f64; 4]>,
    /// Estimated error of every pixel.
    pub errors: Vec<ErrorEstimate>,
}

impl RenderedPixels {
    /// Returns the root mean square of the pixels' error estimates.
    pub fn own_error(&self) -> f64 {
        root_mean_square(self.errors.iter().map(|error| error.total()))
    }

    pub(super) fn from_volume(
        pixels: Vec<Pixel>,
        error: impl Fn(usize, &Pixel) -> ErrorEstimate,
    ) -> RenderedPixels {
        let errors = pixels.iter().enumerate().map(|(k, p)| error(k, p)).collect();
        RenderedPixels { rgba: pixels.into_iter().map(|p| p.color).collect(), errors }
    }
}

/// One of the samples that a picture is the mean of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelSample {
    /// Number of the sample; it selects the random paths.
    pub i: u32,
    /// Offset of the rays from the pixels' centres, in pixels, to the right and down.
    pub shift: DVec2,
}

impl PixelSample {
    /// The sample through the pixels' centres.
    pub const CENTER: PixelSample = PixelSample { i: 0, shift: DVec2::ZERO };
}

/// Rounding of a composition in f64, as a share of the greatest radiance: some thousand layers.
const ROUNDING: f64 = 1e-12;

/// Draws one sample of `scene` at `pixels` in the light of `frame`.
pub fn render_lit_scene(
    scene: &Scene,
    frame: &FrameReference,
    model: BlobModel,
    pixels: &Pixels,
    sample: PixelSample,
    on_progress: OnProgress,
) -> RenderedPixels {
    let light_error = root_mean_square(frame.second_error.iter().copied());
    let view = View { shift: sample.shift, ..view(scene, frame) };
    let opaque = opaque_pixels(scene, frame, &view, pixels);
    let radiance = frame.particle_radiance(scene);
    if model == BlobModel::AsDrawn {
        let error = light_error + ROUNDING * brightest(&radiance);
        return RenderedPixels {
            rgba: drawn(scene, frame, &view, (&opaque, &radiance), pixels, on_progress),
            errors: vec![ErrorEstimate::from_quadrature(error); pixels.at.len()],
        };
    }
    let shades = frame.particle_shades(scene, &frame.blobs);
    let volume = Volume::new(&view, &frame.blobs, &radiance).shaded(shades.as_deref());
    let found = volume_at(&volume, pixels, &opaque, on_progress);
    RenderedPixels::from_volume(found, |_, p| ErrorEstimate::from_quadrature(p.error + light_error))
}

/// Returns the greatest magnitude of a channel.
pub(super) fn brightest(radiance: &[DVec3]) -> f64 {
    radiance.iter().map(|l| l.abs().max_element()).fold(0.0, f64::max)
}

/// Draws blobs of the given radiance at `pixels` over the opaque ones, as the scene's drawing
/// settings say.
fn drawn(
    scene: &Scene,
    frame: &FrameReference,
    view: &View,
    (opaque, radiance): (&[OpaquePixel], &[DVec3]),
    pixels: &Pixels,
    on_progress: OnProgress,
) -> Vec<[f64; 4]> {
    let (blobs, order) = drawn_blobs(scene, frame);
    let radiance = &drawn_radiance(scene, frame, radiance.to_vec());
    let (raster, shades) = (raster(pixels), frame.particle_shades(scene, &blobs));
    let cells = frame.particle_cells(scene);
    with_textures(scene, frame, view, |factor| {
        let (shades, cells) = (shades.as_deref(), cells.as_ref());
        let sprites = Sprites { blobs: &blobs, radiance, order: &order, factor, shades, cells };
        let on_row = |n| on_progress(RenderStage::Drawing, n);
        sprites::render_at(view, &raster, opaque, &sprites, &on_row)
    })
}

/// Integrates `volume` along the rays of `pixels` up to the opaque ones.
pub(super) fn volume_at(
    volume: &Volume<'_>,
    pixels: &Pixels,
    opaque: &[OpaquePixel],
    on_progress: OnProgress,
) -> Vec<Pixel> {
    // Pixels of a row share the search for its blobs.
    let mut order: Vec<usize> = (0..pixels.at.len()).collect();
    order.sort_by_key(|&k| pixels.at[k][1]);
    let rows: Vec<&[usize]> = order.chunk_by(|&a, &b| pixels.at[a][1] == pixels.at[b][1]).collect();
    let of_rows = parallel_map(rows.len(), |r| {
        let j = pixels.at[rows[r][0]][1];
        let row = volume.row(j, rows[r].iter().map(|&k| (pixels.at[k][0], opaque[k])));
        on_progress(RenderStage::Drawing, rows.len());
        row
    });
    let mut found: Vec<(usize, Pixel)> =
        order.iter().copied().zip(of_rows.into_iter().flatten()).collect();
    found.sort_by_key(|(k, _)| *k);
    found.into_iter().map(|(_, pixel)| pixel).collect()
}
