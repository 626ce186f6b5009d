//! The layers of a frame in f64: its picture, the picture of each reflection, and sums over the
//! particles of each pixel (passes.md "layers").

use glam::DVec3;

use super::background::view;
use super::frame::FrameReference;
use super::pixels::Pixels;
use super::progress::{OnProgress, RenderStage};
use super::renderer::check_scene;
use super::scene_light::{BlobModel, PixelSample, render_lit_scene};
use super::shares::{INTERPOLATED, rounding, solid_shares};
use super::sprites::{drawn_blobs, raster, with_textures};
use crate::error::Result;
use crate::model::scene::{LightingMode, Scene};
use crate::reference::composite::Rounding;
use crate::reference::sprite_sums::{SpriteSums, sums_at};
use crate::reference::sprites::Sprites;

/// The layers of a picture, row 0 at the top.
#[derive(Debug, Clone, PartialEq)]
pub struct PictureLayers {
    /// The picture, premultiplied linear RGBA.
    pub beauty: Vec<[f64; 4]>,
    /// Optical depth, number and least depth of the particles of every pixel.
    pub sums: Vec<SpriteSums>,
    /// The picture of the first reflection alone. Where nothing is lit, all of the picture.
    pub first: Vec<[f64; 4]>,
    /// The picture of the second reflection alone.
    pub second: Vec<[f64; 4]>,
}

/// Draws the layers of the scene at `time_s` as thin sprites with its own drawing settings and in
/// its own light.
///
/// # Errors
/// The references cannot draw the scene, or the frame cannot be computed.
pub fn layers_as_set(scene: &Scene, time_s: f64, on_progress: OnProgress) -> Result<PictureLayers> {
    check_scene(scene, time_s, BlobModel::AsDrawn)?;
    let on_facet = |n| on_progress(RenderStage::Lighting, n);
    let frame = FrameReference::with_progress(scene, time_s, &on_facet)?;
    let pixels = Pixels::all(scene.film.width, scene.film.height);
    let picture = |frame: &FrameReference| {
        let (model, sample) = (BlobModel::AsDrawn, PixelSample::CENTER);
        render_lit_scene(scene, frame, model, &pixels, sample, on_progress).rgba
    };
    let beauty = picture(&frame);
    let sums = sums(scene, &frame, &pixels, false);
    let (first, second) = match scene.lighting.mode {
        LightingMode::TwoReflection => {
            let dark = |n: usize| vec![DVec3::ZERO; n];
            let (n, n_second) = (frame.radiance.len(), frame.second.len());
            let first = FrameReference { second: dark(n_second), ..frame.clone() };
            let second = FrameReference { radiance: dark(n), ..frame };
            (picture(&first), picture(&second))
        }
        _ => (beauty.clone(), vec![[0.0; 4]; beauty.len()]),
    };
    Ok(PictureLayers { beauty, sums, first, second })
}

/// Returns the sums of `pixels` with the drawing settings of `scene`, and bounds on a device's
/// difference by rounding.
pub fn sums_by_settings(scene: &Scene, frame: &FrameReference, pixels: &Pixels) -> Vec<SpriteSums> {
    sums(scene, frame, pixels, true)
}

fn sums(
    scene: &Scene,
    frame: &FrameReference,
    pixels: &Pixels,
    is_bounded: bool,
) -> Vec<SpriteSums> {
    let view = view(scene, frame);
    let (mut opaque, _) = solid_shares(scene, frame, &view, pixels);
    let (blobs, order) = drawn_blobs(scene, frame);
    let rounding = if is_bounded { rounding(scene, &view, &blobs) } else { Rounding::NONE };
    for pixel in opaque.iter_mut().filter(|_| is_bounded) {
        pixel.depth_bound = INTERPOLATED * pixel.depth;
    }
    let raster = raster(pixels);
    with_textures(scene, frame, &view, |factor| {
        let sprites = Sprites {
            blobs: &blobs,
            radiance: &[],
            order: &order,
            factor,
            shades: None,
            cells: None,
        };
        sums_at(&view, &raster, &opaque, &sprites, &rounding)
    })
}
