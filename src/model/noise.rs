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
    let gain = LACUNARITY.powf(-1.0 / 3.0);
    let (mut sum, mut square, mut amplitude, mut at) = (0.0, 0.0, 1.0, place);
    for octave in 0..OCTAVES {
        sum += amplitude * gradient_noise(key, OCTAVES * field + octave, at);
        square += amplitude * amplitude;
        amplitude *= gain;
        // Turned by the angle of a 3-4-5 triangle about two axes, so that no octave has the axes of
        // the cells but the first.
        let DVec3 { x, y, z } = LACUNARITY * at;
        let (x, z) = (0.8 * x - 0.6 * z, 0.6 * x + 0.8 * z);
        at = DVec3::new(0.8 * x - 0.6 * y, 0.6 * x + 0.8 * y, z);
    }
    sum / (DEVIATION * f64::sqrt(square))
}

/// Returns gradient noise: 0 at the points of a lattice, where its gradients are random. *Source*:
/// Perlin, "Improving Noise" (2002), with random gradients in place of twelve.
fn gradient_noise(key: [u32; 2], number: u32, place: DVec3) -> f64 {
    let low = place.floor();
    let t = place - low;
    let fade = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let corner = |k: [i64; 3]| {
        let offset = DVec3::new(k[0] as f64, k[1] as f64, k[2] as f64);
        // The lattice repeats after 2³² units.
        let [x, y, z] = (low + offset).to_array().map(|v| v as i64 as u32);
        let [a, b, c, _] = philox4x32_10(key, [x, y, z, number]).map(uniform);
        (2.0 * DVec3::new(a, b, c) - 1.0).dot(t - offset)
    };
    let along = |y: i64, z: i64| {
        let (a, b) = (corner([0, y, z]), corner([1, y, z]));
        a + fade.x * (b - a)
    };
    let across = |z: i64| {
        let (a, b) = (along(0, z), along(1, z));
        a + fade.y * (b - a)
    };
    let (a, b) = (across(0), across(1));
    a + fade.z * (b - a)
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
