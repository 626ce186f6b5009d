//! The time that a picture in the model's own light will take.

use std::time::{Duration, Instant};

use super::frame::FrameReference;
use super::model_picture::ModelDrawing;
use super::pixels::Pixels;
use super::renderer::with_picture;
use super::scene_light::PixelSample;
use super::transport::TransportPicture;
use crate::error::Result;
use crate::model::parallel::parallel_map;
use crate::model::scene::Scene;

/// Time for which points are lit to estimate the time of all.
const PROBE: Duration = Duration::from_secs(1);
/// Pixels that are drawn to estimate the time of all.
const N_PROBED_PIXELS: usize = 128;
/// 2³²/φ: its multiples spread evenly over 32 bits, so that the probed points are far apart.
const SPREAD: u32 = 0x9e37_79b9;

/// Pixels whose paths are timed.
const N_PROBED_PATHS: usize = 2000;

/// Seconds that a picture is expected to take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureTime {
    /// The light of ground and particles.
    pub lighting_s: f64,
    /// The light of surfaces, and the pixels.
    pub drawing_s: f64,
}

/// Extrapolates the seconds that a random path through each of `pixels` takes, from one through
/// some of them.
///
/// # Errors
/// As for [`super::sums`] of "transport".
pub fn expected_path_s(scene: &Scene, time_s: f64, pixels: &Pixels) -> Result<f64> {
    let few = Pixels::sample(pixels.width, pixels.height, N_PROBED_PATHS.min(pixels.at.len()));
    let frame = FrameReference::unlit(scene, time_s)?;
    let picture = TransportPicture::new(scene, &frame);
    let begin = Instant::now();
    picture.draw(&few, PixelSample::CENTER, &|_, _| ());
    let n_times = pixels.at.len() as f64 / few.at.len().max(1) as f64;
    Ok(begin.elapsed().as_secs_f64() * n_times)
}

/// Extrapolates the time of [`super::render_model`] with `n_reflections` at `pixels` from some of
/// its points and pixels. This takes the picture's set-up and some seconds. Points differ, so that
/// the time serves to plan a run and not to compare two.
///
/// # Errors
/// As [`super::render_model`].
pub fn expected_time(
    n_reflections: u32,
    scene: &Scene,
    time_s: f64,
    pixels: &Pixels,
) -> Result<PictureTime> {
    let begin = Instant::now();
    let few = Pixels::sample(pixels.width, pixels.height, N_PROBED_PIXELS.min(pixels.at.len()));
    let how = ModelDrawing { n_reflections, by_facet: false };
    with_picture(how, (scene, time_s), &few, &|_, _| (), |picture| {
        let set_up_s = begin.elapsed().as_secs_f64();
        let (n, round) = (picture.n_discs(), rayon::current_num_threads());
        let (begin, mut n_lit) = (Instant::now(), 0);
        while n_lit < n && begin.elapsed() < PROBE {
            parallel_map(round, |i| {
                let spread = ((n_lit + i) as u32).wrapping_mul(SPREAD);
                picture.disc(((u64::from(spread) * n as u64) >> 32) as usize, 0)
            });
            n_lit += round;
        }
        let lit_s = begin.elapsed().as_secs_f64() * n as f64 / n_lit.max(1) as f64;
        let (dark, begin) = (vec![Default::default(); n], Instant::now());
        picture.draw(&dark, PixelSample::CENTER);
        let drawn_s = begin.elapsed().as_secs_f64();
        let n_times = pixels.at.len() as f64 / few.at.len().max(1) as f64;
        Ok(PictureTime { lighting_s: set_up_s + lit_s, drawing_s: drawn_s * n_times })
    })
}
