//! Noise with the spectrum of turbulence, for invented detail of clouds and invented hills.

use glam::DVec3;

use super::philox::{philox4x32_10, uniform};

/// Number of octaves.
const OCTAVES: u32 = 4;
/// Length of an octave over that of the next one. Not 2, so that their lattices do not meet.
const LACUNARITY: f64 = 1.93;
/// Standard deviation of one octave: gradient noise with gradients in the cube (−1, 1)³.
const DEVIATION: f64 = 0.1909;

/// Returns noise of mean 0 and deviation 1 whose octaves have the variance of k^{−5/3}: a band of
/// wave numbers around k has k^{−2/3}. The longest has the length 1. `key`: a seed, and a stream of
/// its own for each use; `field` numbers independent noises.
pub fn turbulence(key: [u32; 2], field: u32, place: DVec3) -> f64 {
    octaves(field, place, |counter| {
        let [x, y, z, _] = philox4x32_10(key, counter);
        [2.0 * DVec3::new(uniform(x), uniform(y), uniform(z)) - 1.0]
    })[0]
}

/// Returns three independent noises like [`turbulence`], each from a word of the same random ones.
pub fn turbulences(key: [u32; 2], field: u32, place: DVec3) -> [f64; 3] {
    octaves(field, place, |counter| {
        let [a, b, c, _] = philox4x32_10(key, counter);
        [gradient_of(a), gradient_of(b), gradient_of(c)]
    })
}

/// Bits of a component of a gradient, of three in a word.
const PART_BITS: u32 = 10;

/// Returns the gradient of a random word.
#[inline]
fn gradient_of(word: u32) -> DVec3 {
    const MASK: u32 = (1 << PART_BITS) - 1;
    let parts = [word & MASK, word >> PART_BITS & MASK, word >> (2 * PART_BITS) & MASK];
    let of = |part: u32| (2.0 * f64::from(part) + 1.0) / f64::from(1 << PART_BITS) - 1.0;
    DVec3::new(of(parts[0]), of(parts[1]), of(parts[2]))
}

/// Returns the sums of the octaves of noises whose gradients at a point of the lattice are given.
#[inline]
fn octaves<const N: usize>(
    field: u32,
    place: DVec3,
    gradients: impl Fn([u32; 4]) -> [DVec3; N],
) -> [f64; N] {
    let gain = LACUNARITY.powf(-1.0 / 3.0);
    let (mut sums, mut square, mut amplitude, mut at) = ([0.0; N], 0.0, 1.0, place);
    for octave in 0..OCTAVES {
        add_gradient_noise(amplitude, OCTAVES * field + octave, at, &gradients, &mut sums);
        square += amplitude * amplitude;
        amplitude *= gain;
        // Turned by the angle of a 3-4-5 triangle about two axes, so that no octave has the axes of
        // the cells but the first.
        let DVec3 { x, y, z } = LACUNARITY * at;
        let (x, z) = (0.8 * x - 0.6 * z, 0.6 * x + 0.8 * z);
        at = DVec3::new(0.8 * x - 0.6 * y, 0.6 * x + 0.8 * y, z);
    }
    let deviation = DEVIATION * f64::sqrt(square);
    for sum in &mut sums {
        *sum /= deviation;
    }
    sums
}

/// Adds gradient noises: 0 at the points of a lattice, where their gradients are random. *Source*:
/// Perlin, "Improving Noise" (2002), with random gradients in place of twelve.
#[inline]
fn add_gradient_noise<const N: usize>(
    amplitude: f64,
    number: u32,
    place: DVec3,
    gradients: &impl Fn([u32; 4]) -> [DVec3; N],
    sums: &mut [f64; N],
) {
    let low = place.floor();
    let t = place - low;
    let fade = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    // The lattice repeats after 2³² units.
    let lattice = |v: f64| v as i64 as u32;
    let (x, y, z) = (lattice(low.x), lattice(low.y), lattice(low.z));
    for corner in 0..8 {
        let (dx, dy, dz) = (corner & 1, corner >> 1 & 1, corner >> 2);
        let part = |is_far: u32, fade: f64| if is_far == 1 { fade } else { 1.0 - fade };
        let weight = amplitude * part(dx, fade.x) * part(dy, fade.y) * part(dz, fade.z);
        let away = t - DVec3::new(f64::from(dx), f64::from(dy), f64::from(dz));
        let at = [x.wrapping_add(dx), y.wrapping_add(dy), z.wrapping_add(dz), number];
        for (sum, gradient) in sums.iter_mut().zip(gradients(at)) {
            *sum += weight * gradient.dot(away);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: [u32; 2] = [5, 9];

    /// Places of a line through the noise, in no direction of its lattices.
    fn line(n: usize, step: f64) -> Vec<f64> {
        let direction = DVec3::new(0.71, 0.23, 0.67).normalize();
        (0..n)
            .map(|i| turbulence(KEY, 0, direction * (step * i as f64) + DVec3::splat(0.3)))
            .collect()
    }

    #[test]
    fn noise_has_mean_0_and_deviation_1() {
        let all = line(200_000, 0.37);
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        let square = all.iter().map(|v| v * v).sum::<f64>() / all.len() as f64;
        assert!(mean.abs() < 0.02 && (square - 1.0).abs() < 0.02, "{mean} {square}");
    }

    #[test]
    fn three_noises_are_independent_and_alike() {
        let direction = DVec3::new(0.71, 0.23, 0.67).normalize();
        let at = |i: i32| turbulences(KEY, 0, direction * (0.37 * f64::from(i)) + 0.3);
        let all: Vec<[f64; 3]> = (0..100_000).map(at).collect();
        for (a, b) in [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)] {
            let product = all.iter().map(|v| v[a] * v[b]).sum::<f64>() / all.len() as f64;
            let mean = all.iter().map(|v| v[a]).sum::<f64>() / all.len() as f64;
            assert!(mean.abs() < 0.02, "{a}: {mean}");
            assert!((product - f64::from(a == b)).abs() < 0.03, "{a} {b}: {product}");
        }
    }

    #[test]
    fn noise_is_smooth_and_follows_its_seed() {
        let at = DVec3::new(1.3, -7.7, 0.2);
        assert_eq!(turbulence([1, 9], 0, at), turbulence([1, 9], 0, at));
        assert_ne!(turbulence([1, 9], 0, at), turbulence([2, 9], 0, at));
        assert_ne!(turbulence([1, 9], 0, at), turbulence([1, 9], 1, at));
        let steps = line(10_000, 1e-3);
        let steepest = steps.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
        assert!(steepest < 0.05, "{steepest}");
    }

    /// The structure function of a spectrum of k^{−5/3} rises with r^{2/3}.
    #[test]
    fn the_spectrum_is_that_of_turbulence() {
        let step = 0.02;
        let all = line(400_000, step);
        let structure = |lag: usize| {
            let pairs = all.iter().zip(&all[lag..]);
            pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>() / (all.len() - lag) as f64
        };
        // From 0.12 to 0.48 units: within the octaves.
        let slope = (structure(24) / structure(6)).ln() / 4f64.ln();
        // Measured: 0.79. Endless octaves would have 2/3; the shortest of four is smooth within
        // itself, where the slope tends to 2. White noise would have 0.
        assert!((slope - 0.79).abs() < 0.1, "{slope}");
    }
}
