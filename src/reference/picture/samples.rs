//! A reference picture as the mean of samples, each through another place of every pixel and by
//! other random paths; and the sums that parts of it are put together from, tile by tile and range
//! by range, to the same bits as the whole.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec2;

use crate::error::{Error, Result};
use crate::model::scene::{LightingMode, Scene};
use crate::reference::picture::kind::{Drawn, ReferenceKind, Sample, of_scene_light};
use crate::reference::picture::model_light::{Lit, Met, ModelLight, root_mean_square};
use crate::reference::picture::model_picture::Model;
use crate::reference::picture::pixels::Pixels;
use crate::reference::picture::stages::FrameReference;
use crate::reference::picture::whole::{Drawing, Listener, Work};

/// Most samples of a picture: their numbers' last digits still tell places in a pixel apart.
pub const MAX_SAMPLES: u32 = 1 << 20;

/// Values of a pixel in [`Sums`]: premultiplied linear R, G, B, A; the sum of their squares; what
/// quadrature leaves; and the square of the random paths' standard error.
pub const N_VALUES: usize = 7;

/// Sums over samples, [`N_VALUES`] a pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Sums {
    pub n_samples: u32,
    pub values: Vec<f64>,
}

/// What is drawn.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    pub of: ReferenceKind,
    pub scene: &'a Scene,
    pub time_s: f64,
}

/// A mean over samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Mean {
    /// Premultiplied linear RGBA, in the order of the pixels.
    pub rgba: Vec<[f64; 4]>,
    /// Root mean square of the estimates of what each pixel may be off: quadrature, and one
    /// standard error of the mean.
    pub own_error: f64,
}

/// Where in a pixel sample `i` lies, off its centre: the first in it, the others spread evenly
/// (Roberts' R2, the powers of the plastic number's inverse), whatever number of them is taken.
pub fn shift(i: u32) -> DVec2 {
    const STEP: DVec2 = DVec2::new(0.754_877_666_246_692_7, 0.569_840_290_998_053_2);
    (0.5 + f64::from(i) * STEP).fract() - 0.5
}

/// The sums of `samples` at `pixels`. Err where the reference does not know the scene, or it was
/// stopped.
pub fn sums(
    subject: &Subject<'_>,
    pixels: &Pixels,
    samples: Range<u32>,
    stop: &AtomicBool,
    listener: Listener,
) -> Result<Sums> {
    let Subject { of, scene, time_s } = *subject;
    of.check(scene, time_s)?;
    let n = samples.len();
    // Of one sample its parts are told, of several that they are done.
    let inner: Listener = if n > 1 { &|_, _| () } else { listener };
    let mut pairs = Pairs::default();
    let mut each = |draw: &mut dyn FnMut(Sample) -> Drawn| {
        for i in samples.clone() {
            // Before, not after: what is finished counts.
            if stop.load(Ordering::Relaxed) {
                return Err(Error::Interrupted);
            }
            pairs.push(of_drawn(&draw(Sample { i, shift: shift(i) })));
            if n > 1 {
                listener(Work::Sampling, n);
            }
        }
        Ok(())
    };
    let n_reflections = if let ReferenceKind::Reflections(k) = of { Some(k) } else { None };
    match of {
        ReferenceKind::Thin | ReferenceKind::Volume => {
            let truth =
                FrameReference::of_with_listener(scene, time_s, &|n| inner(Work::Lighting, n))?;
            let drawing = if of == ReferenceKind::Thin { Drawing::Thin } else { Drawing::Volume };
            each(&mut |sample| of_scene_light(scene, &truth, drawing, pixels, sample, inner))?;
        }
        ReferenceKind::Model | ReferenceKind::Reflections(_)
            if scene.lighting.mode == LightingMode::None =>
        {
            let truth = FrameReference::unlit(scene, time_s)?;
            each(&mut |sample| {
                of_scene_light(scene, &truth, Drawing::Volume, pixels, sample, inner)
            })?;
        }
        ReferenceKind::Model | ReferenceKind::Reflections(_) => {
            let truth = FrameReference::unlit(scene, time_s)?;
            let met = Met::of(scene, &truth);
            let light = ModelLight::new(scene, &met, &truth, n_reflections);
            let model = Model { scene, truth: &truth, met: &met, light, by_facet: false };
            let mut discs: Option<Vec<Lit>> = None;
            each(&mut |sample| {
                let lit = match discs.take().filter(|_| !model.light.is_random()) {
                    Some(lit) => lit,
                    None => model.discs(sample.i, pixels, inner),
                };
                let drawn = model.draw(&lit, pixels, sample, inner);
                discs = Some(lit);
                drawn
            })?;
        }
    }
    pairs.finish().ok_or_else(|| Error::usage("no samples: expected one at least"))
}

/// As files have it.
pub fn shown(rgba: &[[f64; 4]]) -> Vec<f32> {
    rgba.iter().flatten().map(|v| *v as f32).collect()
}

fn of_drawn(drawn: &Drawn) -> Sums {
    let mut values = Vec::with_capacity(N_VALUES * drawn.rgba.len());
    for (rgba, doubt) in drawn.rgba.iter().zip(&drawn.doubts) {
        let squares = rgba.iter().map(|v| v * v).sum();
        values.extend_from_slice(rgba);
        values.extend([squares, doubt.quadrature, doubt.chance * doubt.chance]);
    }
    Sums { n_samples: 1, values }
}

impl Sums {
    fn add(mut self, other: &Sums) -> Sums {
        self.values.iter_mut().zip(&other.values).for_each(|(a, b)| *a += b);
        self.n_samples += other.n_samples;
        self
    }

    /// The mean, and what it may be off.
    pub fn mean(&self) -> Mean {
        let n = f64::from(self.n_samples);
        let rgba = |v: &[f64]| [v[0] / n, v[1] / n, v[2] / n, v[3] / n];
        let error = |v: &[f64]| {
            let of_mean: f64 = rgba(v).iter().map(|c| c * c).sum();
            // Of all channels together: no channel's alone is greater. Samples are spread more
            // evenly than by chance, and so the mean is nearer than this.
            let spread = ((v[4] / n - of_mean).max(0.0) / (n - 1.0).max(1.0)).sqrt();
            v[5] / n + spread.max(v[6].sqrt() / n)
        };
        let pixels = || self.values.chunks_exact(N_VALUES);
        Mean {
            rgba: pixels().map(rgba).collect(),
            own_error: root_mean_square(pixels().map(error)),
        }
    }

    /// Numbers of f64 in little-endian order.
    pub fn bytes(&self) -> Vec<u8> {
        self.values.iter().flat_map(|v| v.to_le_bytes()).collect()
    }

    /// From [`Sums::bytes`]; none of another length.
    pub fn from_bytes(bytes: &[u8], n_pixels: usize, n_samples: u32) -> Option<Sums> {
        let value = |b: &[u8]| b.try_into().map(f64::from_le_bytes).ok();
        let is_whole = bytes.len() == 8 * N_VALUES * n_pixels;
        let values =
            is_whole.then(|| bytes.chunks_exact(8).map(value).collect::<Option<Vec<f64>>>())??;
        Some(Sums { n_samples, values })
    }
}

/// Sums of neighbouring ranges of samples, added as one fixed tree of pairs: (0 + 1) + (2 + 3) and
/// so on. Ranges whose length is a power of two, and that begin at a multiple of it, are nodes of
/// that tree; so a whole put together from them in order has the bits of a whole that was never
/// cut. What rounding adds grows with the tree's height, not with the samples.
#[derive(Debug, Default)]
pub struct Pairs {
    /// Each shorter than the one before it.
    open: Vec<Sums>,
}

impl Pairs {
    /// The next range. All have one length, a power of two; the last may be shorter.
    pub fn push(&mut self, mut next: Sums) {
        while let Some(last) = self.open.pop_if(|last| last.n_samples == next.n_samples) {
            next = last.add(&next);
        }
        self.open.push(next);
    }

    /// All of them; none where there was none.
    pub fn finish(mut self) -> Option<Sums> {
        let mut all = self.open.pop()?;
        while let Some(before) = self.open.pop() {
            all = before.add(&all);
        }
        Some(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::philox::{philox4x32_10, uniform};

    fn sample(i: u32) -> Sums {
        // Of magnitudes so different that another order of additions shows.
        let words = philox4x32_10([7, 7], [i, 0, 0, 0]).map(uniform);
        let values = (0..N_VALUES)
            .map(|k| (words[k % 4] - 0.5) * 10f64.powi((words[(k + 1) % 4] * 17.0) as i32));
        Sums { n_samples: 1, values: values.collect() }
    }

    fn summed(parts: impl Iterator<Item = Sums>) -> Sums {
        let mut pairs = Pairs::default();
        parts.for_each(|part| pairs.push(part));
        pairs.finish().unwrap()
    }

    #[test]
    fn ranges_of_a_power_of_two_sum_to_the_bits_of_the_whole() {
        let mut n_differ = 0;
        for n in 1..=70u32 {
            let whole = summed((0..n).map(sample));
            for length in [1u32, 2, 4, 8, 16, 32, 64, 128] {
                let range = |k: u32| summed((k * length..n.min((k + 1) * length)).map(sample));
                assert_eq!(
                    summed((0..n.div_ceil(length)).map(range)),
                    whole,
                    "{n} in ranges of {length}"
                );
            }
            // One after another they are not the same bits, and neither are ranges of three.
            let in_turn = (0..n).map(sample).reduce(|a, b| a.add(&b)).unwrap();
            n_differ += usize::from(in_turn != whole);
            assert_eq!(in_turn.n_samples, whole.n_samples);
        }
        assert!(n_differ > 50, "{n_differ}");
    }

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

    #[test]
    fn means_and_their_errors_by_hand() {
        // Red 1 and 3: mean 2, squares 10, variance of the mean ((10/2) - 4)/1 = 1. Quadrature
        // 0.25.
        let of = |red: f64, chance: f64| Sums {
            n_samples: 1,
            values: vec![red, 0.0, 0.0, 0.0, red * red, 0.25, chance * chance],
        };
        let two = of(1.0, 0.0).add(&of(3.0, 0.0));
        assert_eq!(two.mean(), Mean { rgba: vec![[2.0, 0.0, 0.0, 0.0]], own_error: 1.25 });
        // One sample has its own standard error alone; equal ones have what their paths say:
        // sqrt(0.5)/2 · 0.6.
        assert_eq!(of(1.0, 0.5).mean().own_error, 0.75);
        let equal = of(1.0, 0.6).add(&of(1.0, 0.6)).mean().own_error;
        assert!((equal - 0.25 - 0.6 / 2f64.sqrt()).abs() < 1e-15, "{equal}");
        let bytes = two.bytes();
        assert_eq!(Sums::from_bytes(&bytes, 1, 2), Some(two));
        assert_eq!(
            (Sums::from_bytes(&bytes, 2, 2), Sums::from_bytes(&bytes[1..], 1, 2)),
            (None, None)
        );
    }
}
