//! Light computed once and drawn sample by sample, for every kind of reference.

use glam::DVec3;

use super::frame::FrameReference;
use super::kind::ReferenceKind;
use super::limits::check_memory;
use super::model_light::{ModelLight, ModelScene, RadianceEstimate};
use super::model_picture::{ModelDrawing, ModelPicture};
use super::pixels::Pixels;
use super::progress::{OnProgress, RenderStage};
use super::scene_light::{BlobModel, PixelSample, RenderedPixels, render_lit_scene};
use super::transport::TransportPicture;
use crate::error::{Error, Result};
use crate::model::scene::{LightingMode, Scene};

impl ReferenceKind {
    /// Checks that this reference can draw `scene`.
    ///
    /// # Errors
    /// The scene has textures or glossy clouds that the reference does not compute, or reflections
    /// are asked for where nothing is lit.
    pub fn check(self, scene: &Scene, time_s: f64) -> Result<()> {
        check_scene(scene, time_s, self.blob_model())?;
        if matches!(self, ReferenceKind::Reflections(_))
            && scene.lighting.mode == LightingMode::None
        {
            return Err(Error::usage(format!(
                "{self}: nothing reflects where lighting.mode is \"none\"; expected thin, \
                 volume or model"
            )));
        }
        if self == ReferenceKind::Transport {
            check_transport(scene)?;
        }
        let has_air = !matches!(self.blob_model(), BlobModel::AsDrawn) && self != Self::Volume;
        if has_air && scene.has_haze() {
            let sea = if scene.has_sea() { " and no cover = \"sea\"" } else { "" };
            return Err(Error::usage(format!(
                "{self}: this reference has no air between eye and scene; expected --set \
                 sky.haze=0{sea}, or one of thin, slices and volume"
            )));
        }
        Ok(())
    }

    /// Returns how this reference composes blobs.
    fn blob_model(self) -> BlobModel {
        match self {
            ReferenceKind::Thin | ReferenceKind::Slices => BlobModel::AsDrawn,
            _ => BlobModel::Volume,
        }
    }
}

/// Checks that there is light for a medium to scatter.
fn check_transport(scene: &Scene) -> Result<()> {
    if scene.lighting.mode == LightingMode::None {
        return Err(Error::usage(
            "transport: nothing is lit where lighting.mode is \"none\"; expected another \
             reference, or --set 'lighting.mode=\"first\"'",
        ));
    }
    Ok(())
}

/// Checks that the references can draw `scene` with that blob model.
pub(super) fn check_scene(scene: &Scene, time_s: f64, model: BlobModel) -> Result<()> {
    check_memory(0, 1, scene.n_particles())?;
    let textured = scene.clouds.iter().position(|c| !c.texture.is_none());
    if let Some(i) = textured.filter(|_| model == BlobModel::Volume) {
        return Err(Error::usage(format!(
            "cloud {i} is textured, and the volume reference has plain blobs only; expected --set \
             'cloud.{i}.texture=\"none\"'"
        )));
    }
    if scene.lighting.mode == LightingMode::None {
        return Ok(());
    }
    for (i, cloud) in scene.clouds.iter().enumerate().filter(|(_, c)| c.n_particles() > 0) {
        let material = &scene.materials[cloud.i_material];
        if material.at(time_s).ks != DVec3::ZERO {
            return Err(Error::usage(format!(
                "cloud {i}: its material \"{}\" has a lobe, and the f64 reference has diffuse \
                 clouds only; expected ks = [0, 0, 0]",
                material.name
            )));
        }
    }
    Ok(())
}

/// Computes the light of `kind` once, then calls `draw` with a function that renders one sample.
///
/// # Errors
/// The frame cannot be computed, or `draw` fails.
pub(super) fn with_renderer<T>(
    kind: ReferenceKind,
    (scene, time_s): (&Scene, f64),
    pixels: &Pixels,
    on_progress: OnProgress,
    draw: impl FnOnce(&mut dyn FnMut(PixelSample) -> RenderedPixels) -> Result<T>,
) -> Result<T> {
    if kind == ReferenceKind::Transport {
        let frame = FrameReference::unlit(scene, time_s)?;
        let picture = TransportPicture::new(scene, &frame);
        return draw(&mut |sample| picture.draw(pixels, sample, on_progress));
    }
    let is_model = matches!(kind, ReferenceKind::Model | ReferenceKind::Reflections(_));
    if is_model && scene.lighting.mode.is_medium() {
        let mode = scene.lighting.mode.name();
        return Err(Error::usage(format!(
            "the reference \"{kind}\" has facets that reflect, and lighting.mode = \"{mode}\" has \
             none; expected thin, slices, volume or transport"
        )));
    }
    if is_model && scene.lighting.mode != LightingMode::None {
        let how = ModelDrawing { n_reflections: kind.n_reflections(scene), by_facet: false };
        return with_model(how, (scene, time_s), pixels, on_progress, draw);
    }
    let frame = if is_model {
        FrameReference::unlit(scene, time_s)?
    } else {
        let on_facet = |n| on_progress(RenderStage::Lighting, n);
        FrameReference::with_progress(scene, time_s, &on_facet)?
    };
    let model = kind.blob_model();
    draw(&mut |sample| render_lit_scene(scene, &frame, model, pixels, sample, on_progress))
}

fn with_model<T>(
    how: ModelDrawing,
    of_scene: (&Scene, f64),
    pixels: &Pixels,
    on_progress: OnProgress,
    draw: impl FnOnce(&mut dyn FnMut(PixelSample) -> RenderedPixels) -> Result<T>,
) -> Result<T> {
    with_picture(how, of_scene, pixels, on_progress, |picture| {
        let is_random = picture.light.is_random();
        let mut discs: Option<Vec<RadianceEstimate>> = None;
        draw(&mut |sample| {
            let kept = discs.take().filter(|_| !is_random);
            let lit = kept.unwrap_or_else(|| picture.discs(sample.i));
            let drawn = picture.draw(&lit, sample);
            discs = Some(lit);
            drawn
        })
    })
}

/// Prepares a picture in the model's own light, and calls `draw` with it.
pub(super) fn with_picture<T>(
    how: ModelDrawing,
    (scene, time_s): (&Scene, f64),
    pixels: &Pixels,
    on_progress: OnProgress,
    draw: impl FnOnce(&ModelPicture<'_>) -> Result<T>,
) -> Result<T> {
    let frame = FrameReference::unlit(scene, time_s)?;
    let model = ModelScene::new(scene, &frame);
    let light = ModelLight::new(scene, &model, &frame, how.n_reflections);
    let (frame, model) = (&frame, &model);
    draw(&ModelPicture { scene, frame, model, light, how, pixels, on_progress })
}

/// Draws a lit scene in the model's own light, through the centres of `pixels`.
///
/// # Errors
/// The camera has no direction at that time, or an animation cannot be read.
pub fn render_model(
    how: ModelDrawing,
    scene: &Scene,
    time_s: f64,
    pixels: &Pixels,
    on_progress: OnProgress,
) -> Result<RenderedPixels> {
    with_model(how, (scene, time_s), pixels, on_progress, |render| Ok(render(PixelSample::CENTER)))
}
