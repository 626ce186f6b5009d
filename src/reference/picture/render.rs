//! Reference pictures through the centres of their pixels.

use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::background::{opaque_pixels, view};
use super::error_estimate::root_mean_square;
use super::frame::FrameReference;
use super::kind::ReferenceKind;
use super::pixels::Pixels;
use super::progress::{OnProgress, RenderStage};
use super::renderer::{check_scene, with_renderer};
use super::sample_sums::MeanPicture;
use super::samples::{Enough, Grown, ReferenceRequest, sums_until};
use super::scene_light::{BlobModel, PixelSample, brightest, render_lit_scene};
use super::sprites::{drawn_blobs, with_textures};
use crate::error::Result;
use crate::model::scene::Scene;
use crate::reference::threshold::{self, Omitted};

/// A reference picture at some pixels, with an estimate of its own error.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// Premultiplied linear RGBA, in the order of the pixels.
    pub rgba: Vec<[f64; 4]>,
    /// Root mean square of the pixels' error estimates.
    pub own_error: f64,
    /// By pixel the variance of the mean of random paths, the sum over the channels. Empty where
    /// there are none.
    pub variances: Vec<f64>,
    /// Description of that estimate.
    pub accuracy: String,
    /// Time to compute the picture.
    pub seconds: f64,
    /// The part of that time that grows with the number of pixels.
    pub pixels_s: f64,
}

impl ReferenceKind {
    /// Draws `scene` at `time_s` through the centres of `pixels`, without the approximations of
    /// its drawing.
    ///
    /// # Errors
    /// This reference cannot draw the scene ([`ReferenceKind::check`]), or the frame cannot be
    /// computed.
    pub fn render(
        self,
        scene: &Scene,
        time_s: f64,
        pixels: &Pixels,
        on_progress: OnProgress,
    ) -> Result<Reference> {
        let begin = Instant::now();
        if self.is_random() {
            let request = ReferenceRequest { kind: self, scene, time_s };
            let never = AtomicBool::new(false);
            let grown = Grown::from_nothing(&never, on_progress);
            let is_enough = |mean: &MeanPicture| PathLimits::USUAL.hold(mean);
            return render_paths(&request, pixels, &PathLimits::USUAL.enough(&is_enough), &grown);
        }
        self.check(scene, time_s)?;
        let scene = &self.without_approximations(scene);
        let drawing_since = OnceLock::new();
        let on_progress: OnProgress = &|stage, n| {
            if stage == RenderStage::Drawing {
                drawing_since.get_or_init(Instant::now);
            }
            on_progress(stage, n);
        };
        let drawn = with_renderer(self, (scene, time_s), pixels, on_progress, |render| {
            Ok(render(PixelSample::CENTER))
        })?;
        Ok(Reference {
            own_error: drawn.own_error(),
            variances: vec![],
            rgba: drawn.rgba,
            accuracy: self.accuracy_text(scene, 1),
            seconds: begin.elapsed().as_secs_f64(),
            pixels_s: drawing_since.get().map_or(0.0, |since| since.elapsed().as_secs_f64()),
        })
    }
}

/// How many random paths a reference takes at its pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathLimits {
    /// Paths end where the error of a pixel is this share of the picture's root mean square.
    pub error: f64,
    /// Greatest number of paths of a pixel.
    pub most: u32,
}

impl PathLimits {
    /// A hundredth of the picture, or as many paths as take some minutes at two thousand pixels.
    pub const USUAL: PathLimits = PathLimits { error: 0.01, most: 4096 };

    /// Returns whether a mean is accurate enough.
    pub fn hold(&self, mean: &MeanPicture) -> bool {
        let magnitude = root_mean_square(mean.rgba.iter().flatten().copied());
        mean.random_error <= self.error * magnitude
    }

    /// Returns the number of paths by these limits; `is_enough` is [`PathLimits::hold`].
    pub fn enough<'a>(&self, is_enough: &'a (dyn Fn(&MeanPicture) -> bool + Sync)) -> Enough<'a> {
        /// Fewer paths do not tell their own error.
        const LEAST: u32 = 64;
        Enough { least: LEAST.min(self.most), most: self.most, is_enough }
    }
}

/// Draws a scene by random paths through the centre of each pixel until there are enough. They add
/// to those in `grown`.
///
/// # Errors
/// As [`super::sums`].
pub fn render_paths(
    request: &ReferenceRequest<'_>,
    pixels: &Pixels,
    enough: &Enough<'_>,
    grown: &Grown<'_>,
) -> Result<Reference> {
    let begin = Instant::now();
    let found = sums_until(request, pixels, true, enough, grown)?;
    let (mean, seconds) = (found.mean(), begin.elapsed().as_secs_f64());
    Ok(Reference {
        own_error: mean.random_error,
        variances: mean.variances,
        rgba: mean.rgba,
        accuracy: request.kind.accuracy_text(request.scene, found.n_samples),
        seconds,
        pixels_s: seconds,
    })
}

/// A whole picture drawn in f64 with the scene's own drawing settings.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnPicture {
    /// Premultiplied linear RGBA, row 0 at the top.
    pub rgba: Vec<[f64; 4]>,
    /// Greatest error estimate of a pixel's radiance; `None` for thin sprites, whose only error
    /// is rounding.
    pub error: Option<f64>,
    /// Greatest magnitude of a particle's radiance, which the error is compared with.
    pub brightest: f64,
    /// Number of particles drawn, in view or not.
    pub n_particles: usize,
    /// The most that `draw.threshold` and `draw.smallest` omit from a pixel; nothing for the
    /// volume.
    pub omitted: Omitted,
}

/// Draws the scene at `time_s` in f64 with its own drawing settings and in its own light.
///
/// # Errors
/// The references cannot draw the scene, or the frame cannot be computed.
pub fn drawn_as_set(
    scene: &Scene,
    time_s: f64,
    model: BlobModel,
    on_progress: OnProgress,
) -> Result<DrawnPicture> {
    check_scene(scene, time_s, model)?;
    let on_facet = |n| on_progress(RenderStage::Lighting, n);
    let mut frame = FrameReference::with_progress(scene, time_s, &on_facet)?;
    // The error of the light is not an error of the drawing.
    frame.second_error.clear();
    let pixels = Pixels::all(scene.film.width, scene.film.height);
    let drawn = render_lit_scene(scene, &frame, model, &pixels, PixelSample::CENTER, on_progress);
    let picture = DrawnPicture {
        rgba: drawn.rgba,
        error: None,
        brightest: brightest(&frame.particle_radiance(scene)),
        n_particles: frame.blobs.len(),
        omitted: Omitted::default(),
    };
    if model == BlobModel::Volume {
        let greatest = drawn.errors.iter().map(|e| e.total()).fold(0.0, f64::max);
        return Ok(DrawnPicture { error: Some(greatest), ..picture });
    }
    let view = view(scene, &frame);
    let (blobs, order) = drawn_blobs(scene, &frame);
    let opaque = opaque_pixels(scene, &frame, &view, &pixels);
    let omitted = with_textures(scene, &frame, &view, |factor| {
        threshold::omitted(&view, &opaque, &blobs, factor)
    });
    let omitted = omitted.into_iter().fold(Omitted::default(), Omitted::most);
    Ok(DrawnPicture { n_particles: order.len(), omitted, ..picture })
}
