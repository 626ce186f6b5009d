//! Blobs of all kinds before one eye, and how near the truth users are promised a picture of them.

#![allow(dead_code, reason = "each test binary uses its own part")]

use glam::DVec3;
use nimbus::model::film::FilmFormat;

use crate::bounded::Random;
use crate::picture::Picture;

pub const EYE: DVec3 = DVec3::new(0.3, -0.2, 5.0);

pub fn front() -> Picture {
    Picture::new(EYE, DVec3::new(0.3, -0.2, 0.0), 45.0, 0.1)
}

/// What users are promised: the root mean square over the picture, of full scale. Half floats round once to 2^-11 of a value at
/// most; f32 errs by some units of 2^-24 a layer, and where rounding decides on an edge by the step there, in few pixels.
pub fn assert_small(what: &str, format: FilmFormat, [values, truths]: [&[f64]; 2], n_layers: usize) {
    let scale = truths.iter().fold(1.0, |a: f64, b| a.max(b.abs()));
    let sum: f64 = values.iter().zip(truths).map(|(a, b)| ((a - b) / scale).powi(2)).sum();
    let rms = (sum / values.len() as f64).sqrt();
    let most = match format {
        // Half a step, evenly spread: 1/(255 sqrt 12).
        FilmFormat::Rgba8 => 1.2 / (255.0 * 12f64.sqrt()),
        FilmFormat::Rgba16f => 1e-3,
        FilmFormat::Rgba32f => 2e-6 * n_layers.max(1) as f64,
    };
    println!("{what}: rms {rms:.2e} of full scale, {n_layers} layers at most");
    assert!(rms <= most, "{what}: rms {rms:e}, more than {most:e}");
}

/// Blobs thin and opaque, some in one place, before and behind the eye, of sigma from 10^`least` to 1.
pub fn mixed(n: usize, seed: u64, tau_most: f64, least: f64) -> Picture {
    let mut random = Random(seed);
    let mut picture = front();
    let mut last = picture.at(0.0, 0.0, 5.0);
    for k in 0..n {
        let mut within = |low: f64, high: f64| f64::from(random.within(low, high));
        let at = picture.at(within(-3.0, 3.0), within(-2.5, 2.5), within(-1.0, 9.0));
        // Every fifth lies where the one before does.
        last = if k % 5 == 4 { last } else { at };
        let sigma = 10f64.powf(within(least, 0.0));
        picture = picture.blob(last, sigma, tau_most * within(0.0, 1.0).powi(3));
    }
    picture
}
