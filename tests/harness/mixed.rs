//! Pictures of blobs of all kinds, and their documented accuracy.

#![allow(dead_code, reason = "each test binary uses its own part")]

use glam::DVec3;
use nimbus::layout::facet::LitRecord;
use nimbus::layout::particle::DrawnRecord;
use nimbus::model::film::FilmFormat;
use nimbus::reference::texture::Pool;

use crate::bounded::Random;
use crate::picture::Picture;
use crate::scenery::Scenery;
use crate::sheets;

pub const EYE: DVec3 = DVec3::new(0.3, -0.2, 5.0);

pub fn front() -> Picture {
    Picture::new(EYE, DVec3::new(0.3, -0.2, 0.0), 45.0, 0.1)
}

/// Returns the documented RMSE over the picture, relative to full scale. Half floats round once, by
/// 2^-11 of a value; f32 errs by some units of 2^-24 a layer, and in a few pixels by the
/// discontinuity at a sprite's edge.
pub fn assert_small(
    what: &str,
    format: FilmFormat,
    [values, truths]: [&[f64]; 2],
    n_layers: usize,
) {
    let scale = truths.iter().fold(1.0, |a: f64, b| a.max(b.abs()));
    let sum: f64 = values.iter().zip(truths).map(|(a, b)| ((a - b) / scale).powi(2)).sum();
    let rms = (sum / values.len() as f64).sqrt();
    let most = match format {
        // A uniformly distributed half step: 1/(255 sqrt 12).
        FilmFormat::Rgba8 => 1.2 / (255.0 * 12f64.sqrt()),
        FilmFormat::Rgba16f => 1e-3,
        FilmFormat::Rgba32f => 2e-6 * n_layers.max(1) as f64,
    };
    println!("{what}: rms {rms:.2e} of full scale, {n_layers} layers at most");
    assert!(rms <= most, "{what}: rms {rms:e}, more than {most:e}");
}

/// Returns thin and opaque blobs, some coincident, in front of and behind the eye, of sigma from
/// 10^`least` to 1.
pub fn mixed(n: usize, seed: u64, tau_most: f64, least: f64) -> Picture {
    let mut random = Random(seed);
    let mut picture = front();
    let mut last = picture.at(0.0, 0.0, 5.0);
    for k in 0..n {
        let mut within = |low: f64, high: f64| f64::from(random.within(low, high));
        let at = picture.at(within(-3.0, 3.0), within(-2.5, 2.5), within(-1.0, 9.0));
        // Every fifth blob coincides with the one before it.
        last = if k % 5 == 4 { last } else { at };
        let sigma = 10f64.powf(within(least, 0.0));
        picture = picture.blob(last, sigma, tau_most * within(0.0, 1.0).powi(3));
    }
    picture
}

/// Returns pictures of every kind with their names and a lower bound of their largest value; 0: the
/// picture is empty.
pub fn cases() -> Vec<(String, Picture, f64)> {
    let mut all = Vec::new();
    let mut case =
        |what: &str, picture: Picture, least: f64| all.push((what.to_owned(), picture, least));
    // Above 1/8 the tile path evaluates opacity by another formula.
    for (seed, tau_most) in [(1, 0.125), (2, 3.0), (3, 30.0)] {
        case(&format!("tau up to {tau_most}"), mixed(150, seed, tau_most, -4.0), 0.1);
    }
    let eye = DVec3::new(1e6, -1e6, 5e5);
    let mut far = Picture::new(eye, eye - DVec3::Z, 60.0, 0.1);
    for k in 0..20 {
        let at = far.at(f64::from(k % 5) - 2.0, f64::from(k / 5) - 1.5, 4.0 + f64::from(k % 3));
        far = far.blob(at, 0.5, 0.8);
    }
    case("coordinates of a million", far, 0.3);
    let around = front();
    let (near, beside) = (around.at(0.2, 0.1, 0.5), around.at(1.5, 0.0, 0.3));
    case("around the eye", around.blob(near, 2.0, 1.0).blob(beside, 0.8, 0.5), 0.5);
    let p = Picture::new(EYE, DVec3::new(3.0, 1.0, 0.0), 120.0, 0.1);
    let (a, b, c, d) =
        (p.at(2.0, 1.5, 1.0), p.at(-3.0, -2.4, 1.5), p.at(4.0, 0.0, 2.3), p.at(0.1, -1.0, 0.5));
    case(
        "120 degrees",
        p.blob(a, 0.2, 1.0).blob(b, 0.5, 0.5).blob(c, 1.4, 0.4).blob(d, 0.33, 0.7),
        0.5,
    );
    let empty = Picture::new(EYE, DVec3::new(0.3, -0.2, 0.0), 45.0, 1.0);
    let near = |z: f64| empty.clone().blob(empty.at(0.05, 0.02, z), 0.1, 1.0);
    case("before the near plane", near(0.9999), 0.0);
    case("behind the near plane", near(1.0001), 0.5);
    let at = front().at(0.0, 0.0, 5.0);
    case("no particles", front(), 0.0);
    case("no size", front().blob(at, 0.0, 1.0), 0.0);
    case("among others", front().blob(at, 0.0, 1.0).blob(at, 0.5, 0.0).blob(at, 0.3, 0.5), 0.3);
    for (what, picture) in lit_and_weighted() {
        case(what, picture, 0.3);
    }
    let v = DVec3::new;
    let scenery = Scenery::default()
        .rectangle(v(0.2, -0.1, 0.5), v(1.1, 0.2, 0.3), v(-0.18, 0.9, 0.06), [2, 3])
        .rectangle(v(-0.9, 0.3, 2.0), v(0.4, 0.0, 0.0), v(0.0, 0.4, 0.0), [1, 1]);
    case("over surfaces", Picture { scenery: Some(scenery), ..mixed(60, 5, 1.0, -2.0) }, 0.3);
    case("textured", sheets::textured(front(), &Pool::on_device(4)), 0.5);
    all
}

/// Own and shared facets; groups that are drawn in part.
fn lit_and_weighted() -> [(&'static str, Picture); 3] {
    let mut random = Random(77);
    let picture = mixed(40, 9, 1.0, -2.0);
    let mut lit = || {
        let first = [random.within(0.0, 4.0), random.within(0.0, 1.0), random.within(0.0, 0.01)];
        LitRecord { first, second: [0.25, 0.0, random.within(-0.001, 0.1)], ..LitRecord::default() }
    };
    let singly = Picture { lit: Some((0..40).map(|_| lit()).collect()), ..picture.clone() };
    let i_facet = Some((0..40).map(|i| (7 * i) % 11).collect());
    let shared =
        Picture { lit: Some((0..11).map(|_| lit()).collect()), i_facet, ..picture.clone() };
    let part =
        |end, kappa_scale, last_weight| DrawnRecord { shift: 0, end, kappa_scale, last_weight };
    let i_group = (0..40).map(|i| i / 10).collect();
    let drawn =
        vec![part(8, 1.6, 0.25), part(20, 1.0, 1.0), part(20, 1.0, 1.0), part(39, 2.0, 0.5)];
    [
        ("lit", singly),
        ("shared facets", shared),
        ("weights", Picture { drawn: Some((i_group, drawn)), ..picture }),
    ]
}
