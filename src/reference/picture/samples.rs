//! A reference picture as the mean of samples, each through another place of every pixel and with
//! other random paths. Parts of a picture, by tile and by range of samples, sum to the same bits as
//! the whole.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use glam::DVec2;

use super::kind::ReferenceKind;
use super::limits::check_memory;
use super::pixels::Pixels;
use super::progress::{OnProgress, RenderStage};
use super::renderer::with_renderer;
use super::sample_sums::{MeanPicture, PairwiseSum, SampleSums};
use super::scene_light::PixelSample;
use crate::error::{Error, Result};
use crate::model::scene::Scene;

/// Greatest number of samples: the low digits of their numbers still tell places in a pixel apart.
pub const MAX_SAMPLES: u32 = 1 << 20;

/// Which picture is drawn.
#[derive(Debug, Clone, Copy)]
pub struct ReferenceRequest<'a> {
    /// The reference.
    pub kind: ReferenceKind,
    /// The scene, drawn with its own drawing settings.
    pub scene: &'a Scene,
    /// Time of the frame.
    pub time_s: f64,
}

/// Returns where in a pixel sample `i` lies, off its centre, in pixels. The first sample is the
/// centre; any number of first samples is spread evenly.
///
/// *Source*: R2 sequence, powers of the plastic number's inverse (Roberts 2018).
pub(super) fn shift(i: u32) -> DVec2 {
    const STEP: DVec2 = DVec2::new(0.754_877_666_246_692_7, 0.569_840_290_998_053_2);
    (0.5 + f64::from(i) * STEP).fract() - 0.5
}

/// Draws `samples` at `pixels` and returns their sums.
///
/// # Errors
/// The reference cannot draw the scene, `samples` is empty, or `stop` was set before the last
/// sample began.
pub fn sums(
    request: &ReferenceRequest<'_>,
    pixels: &Pixels,
    samples: Range<u32>,
    stop: &AtomicBool,
    on_progress: OnProgress,
) -> Result<SampleSums> {
    draw(request, pixels, (samples, shift), &Grown::from_nothing(stop, on_progress), |_| false)
}

/// The number of samples that a random picture takes.
pub struct Enough<'a> {
    /// Least number of samples: a spread takes two.
    pub least: u32,
    /// Greatest number of samples.
    pub most: u32,
    /// Returns whether a mean is accurate enough.
    pub is_enough: &'a (dyn Fn(&MeanPicture) -> bool + Sync),
}

impl Enough<'_> {
    /// Returns whether no more samples are needed.
    pub fn holds(&self, sums: &SampleSums) -> bool {
        sums.n_samples >= self.least && (self.is_enough)(&sums.mean())
    }
}

/// A sum that samples are added to, one by one from the number that it has, and who watches.
pub struct Grown<'a> {
    /// The sum of the first samples. Other threads may look at it.
    pub sum: Arc<Mutex<PairwiseSum>>,
    /// Called with the sum after each sample.
    pub on_sample: &'a (dyn Fn(&PairwiseSum) + Sync),
    /// Ends the samples early once it is set.
    pub stop: &'a AtomicBool,
    /// Called for each finished step.
    pub on_progress: OnProgress<'a>,
}

impl<'a> Grown<'a> {
    /// Begins without samples.
    pub fn from_nothing(stop: &'a AtomicBool, on_progress: OnProgress<'a>) -> Grown<'a> {
        Grown { sum: Arc::default(), on_sample: &|_| (), stop, on_progress }
    }

    /// Adds samples until there are `samples.len()`, or `is_last` says that their sum is the last.
    /// `draw` draws the sample of a number.
    pub(super) fn grow(
        &self,
        samples: Range<u32>,
        is_last: impl Fn(&PairwiseSum) -> bool,
        mut draw: impl FnMut(u32) -> SampleSums,
    ) -> Result<SampleSums> {
        let (n, n_before) = (samples.len(), lock(&self.sum).n_samples());
        let mut is_enough = n_before > 0 && is_last(&lock(&self.sum));
        for i in samples.skip(n_before as usize) {
            if is_enough {
                break;
            }
            // A sample that is finished counts, so the check comes before.
            if self.stop.load(Ordering::Relaxed) {
                return Err(Error::Interrupted);
            }
            let drawn = draw(i);
            let mut sum = lock(&self.sum);
            sum.push(drawn);
            (self.on_sample)(&sum);
            is_enough = is_last(&sum);
            drop(sum);
            // A single sample reports progress by its parts, several samples report whole samples.
            if n > 1 {
                (self.on_progress)(RenderStage::Sampling, n - n_before as usize);
            }
        }
        let sum = lock(&self.sum).total();
        sum.ok_or_else(|| Error::usage("no samples: expected at least one"))
    }
}

/// Locks a sum. A panic elsewhere leaves whole samples in it.
fn lock(sum: &Mutex<PairwiseSum>) -> MutexGuard<'_, PairwiseSum> {
    sum.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Adds samples at `pixels` to `grown`, through their centres if `at_centers`, until a number that
/// is a power of two is enough.
///
/// # Errors
/// As for [`sums`], or the greatest number does not fit in memory.
pub fn sums_until(
    request: &ReferenceRequest<'_>,
    pixels: &Pixels,
    at_centers: bool,
    enough: &Enough<'_>,
    grown: &Grown<'_>,
) -> Result<SampleSums> {
    let most = enough.most;
    check_memory(pixels.at.len() as u64, most, request.scene.n_particles())?;
    let place = if at_centers { |_| DVec2::ZERO } else { shift };
    let is_last = |pairs: &PairwiseSum| pairs.whole().is_some_and(|sums| enough.holds(sums));
    draw(request, pixels, (0..most, place), grown, is_last)
}

/// Draws `samples`, each through its `place` in every pixel, until `is_last` says that their sum is
/// the last.
fn draw(
    request: &ReferenceRequest<'_>,
    pixels: &Pixels,
    (samples, place): (Range<u32>, fn(u32) -> DVec2),
    grown: &Grown<'_>,
    is_last: impl Fn(&PairwiseSum) -> bool,
) -> Result<SampleSums> {
    let ReferenceRequest { kind, scene, time_s } = *request;
    kind.check(scene, time_s)?;
    let inner: OnProgress = if samples.len() > 1 { &|_, _| () } else { grown.on_progress };
    with_renderer(kind, (scene, time_s), pixels, inner, |render| {
        grown.grow(samples, is_last, |i| {
            SampleSums::of_one(&render(PixelSample { i, shift: place(i) }))
        })
    })
}

/// Converts a picture to the f32 values that files hold.
pub fn to_f32(rgba: &[[f64; 4]]) -> Vec<f32> {
    rgba.iter().flatten().map(|v| *v as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_in_a_pixel_are_spread_evenly() {
        assert_eq!(shift(0), DVec2::ZERO);
        for n in [4u32, 16, 64, 256] {
            let all: Vec<DVec2> = (0..n).map(shift).collect();
            assert!(all.iter().all(|s| s.abs().max_element() <= 0.5));
            let mean = all.iter().sum::<DVec2>() / f64::from(n);
            // Of random places some 0.29/√n, and of these some 1/n.
            assert!(mean.abs().max_element() < 2.0 / f64::from(n), "{n}: {mean}");
            // Every cell of a raster of √n by √n, grown by half, has its share.
            let cells = (f64::from(n).sqrt() / 2.0) as u32;
            let mut counts = vec![0; (cells * cells) as usize];
            let cell = |v: f64| ((v + 0.5) * f64::from(cells)) as u32;
            all.iter().for_each(|s| counts[(cell(s.y) * cells + cell(s.x)) as usize] += 1);
            assert!(counts.iter().all(|c| (1..=8).contains(c)), "{n}: {counts:?}");
        }
    }
}
