//! `draw.threshold`: both draw paths end sprites where the f64 reference does, and the picture
//! changes by no more than the omitted parts.

#[path = "harness/bounded.rs"]
mod bounded;
mod harness;
#[path = "harness/picture.rs"]
mod picture;
#[path = "harness/scenery.rs"]
mod scenery;
#[path = "harness/sheets.rs"]
mod sheets;
#[path = "harness/tiled.rs"]
mod tiled;

use std::sync::Arc;

use bounded::{Random, greatest_ratio};
use glam::{DVec2, DVec3};
use harness::{Gpu, assert_within};
use nimbus::frame::saturation_bound;
use nimbus::gpu::TargetFormat;
use nimbus::layout::particle::{DrawnRecord, TexturedRecord};
use nimbus::model::edge::Edge;
use nimbus::model::film::FilmFormat;
use nimbus::passes;
use nimbus::reference::composite::OpaquePixel;
use nimbus::reference::texture::Pool;
use nimbus::reference::threshold::{Omitted, omitted};
use nimbus::reference::view::View;
use picture::{Picture, Tiled, Way};
use scenery::Scenery;

const FORMAT: (TargetFormat, FilmFormat) = (TargetFormat::Rgba32f, FilmFormat::Rgba32f);

/// Returns blobs of optical depths from 10^-4.5 to 3 around the eye, with or without textures and a
/// rectangle behind them.
fn random(seed: u64, pool: &Arc<Pool>) -> Picture {
    let mut random = Random(seed);
    let mut within = |low: f64, high: f64| f64::from(random.within(low, high));
    let mut point = |reach: f64| {
        DVec3::new(within(-reach, reach), within(-reach, reach), within(-reach, reach))
    };
    let (eye, target) = (point(2.0), point(2.0));
    let mut picture = Picture::new(eye, target, within(15.0, 130.0), within(0.01, 0.3));
    let n = 60;
    for _ in 0..n {
        let v = |w: &mut dyn FnMut(f64, f64) -> f64| {
            DVec3::new(w(-3.0, 3.0), w(-3.0, 3.0), w(-3.0, 3.0))
        };
        let at = v(&mut within);
        picture = picture.blob(at, 10f64.powf(within(-2.5, 0.0)), 10f64.powf(within(-4.5, 0.5)));
    }
    let tau = 2f64.powf(within(-13.0, -2.0));
    let least = if seed.is_multiple_of(5) { 0.0 } else { within(0.0, 1.0) };
    let view = View {
        width: 60,
        height: 45,
        edge: Edge { tau, least, radius: within(1.0, 5.0) },
        ..picture.view
    };
    if seed.is_multiple_of(2) {
        let record = |i: u32| TexturedRecord {
            seed: 9,
            i_box: i,
            i_first: 0,
            i_field: i % 8,
            strength: 0.2 * i as f32,
        };
        let i_group = (0..n).map(|i| i / 10).collect();
        picture.textured = Some((i_group, (0..6).map(record).collect(), pool.clone()));
    }
    if seed.is_multiple_of(3) {
        let part = |i: u32| DrawnRecord {
            shift: 0,
            end: 10 * i + 7,
            kappa_scale: 1.0 + 0.2 * i as f32,
            last_weight: 0.3,
        };
        picture.drawn = Some(((0..n).map(|i| i / 10).collect(), (0..6).map(part).collect()));
    }
    if seed % 4 == 1 {
        let (u, v) = (0.8 * view.pose.right, 0.7 * view.pose.up);
        let rectangle = Scenery::default().rectangle(picture.at(0.1, 0.0, 1.5), u, v, [2, 1]);
        picture.scenery = Some(rectangle);
    }
    Picture { view, ..picture }
}

fn at_tau(picture: &Picture, tau: f64) -> Picture {
    let edge = Edge { tau, ..picture.view.edge };
    Picture { view: View { edge, ..picture.view }, ..picture.clone() }
}

fn without(picture: &Picture) -> Picture {
    at_tau(picture, 0.0)
}

fn usual(gpu: &Gpu) -> Tiled {
    let invocations = passes::tiles::invocations(gpu.device.limits());
    Tiled {
        invocations,
        sharing: None,
        max_pairs: None,
        max_tiles: None,
        saturated: saturation_bound(FORMAT.1),
    }
}

/// Returns the reference picture and its bound for sprites or tiles.
fn truth(picture: &Picture, way: Way) -> (Vec<f64>, Vec<f64>) {
    match way {
        Way::Sprites | Way::Points => picture.truth(FORMAT.1),
        Way::Tiles(tiled) => picture.tiled_truth(FORMAT.1, tiled.saturated),
        Way::Chunks(_, saturated) => picture.chunked_truth(FORMAT.1, saturated),
    }
}

fn cut_of(picture: &Picture) -> Vec<Omitted> {
    let behind: Vec<OpaquePixel> = match &picture.scenery {
        None => vec![OpaquePixel::EMPTY; (picture.view.width * picture.view.height) as usize],
        Some(_) => picture.behind(FORMAT.1).iter().map(|c| picture.widened(c)).collect(),
    };
    let sheets = picture.sheets();
    let factor = |j: usize, delta: DVec2| picture.factor(&sheets, j, delta);
    // Pixels with an uncertain background have no bound.
    omitted(&picture.view, &behind, &picture.blobs(), Some(&factor))
}

/// Returns by how much omitted parts may change each of a pixel's four values.
fn changes(picture: &Picture) -> Vec<f64> {
    let mut met = picture.radiance();
    met.push(DVec3::ZERO);
    if picture.scenery.is_some() {
        met.extend(
            picture.behind(FORMAT.1).iter().flatten().map(|b| DVec3::from_slice(&b.color[..3])),
        );
    }
    let high = met.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let low = met.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let spread = (high - low).to_array();
    cut_of(picture)
        .iter()
        .flat_map(|c| [spread[0], spread[1], spread[2], 1.0].map(|s| c.share() * s))
        .collect()
}

#[test]
fn pictures_match_the_reference_and_change_by_the_omitted_parts() {
    let mut gpu = Gpu::new();
    let pool = Pool::on_device(4);
    let (mut n_cut, mut closest, mut greatest) = (0, 0f64, 0f64);
    for seed in 1..=12 {
        let picture = random(seed, &pool);
        let (whole, changes) = (without(&picture), changes(&picture));
        let tiled = usual(&gpu);
        for way in [Way::Sprites, Way::Tiles(tiled), Way::Chunks(3, tiled.saturated)] {
            let what = format!("{seed}, {way:?}");
            let [on, off] = [&picture, &whole].map(|p| {
                let values = p.draw_by(&mut gpu, None, FORMAT.0, way);
                let (truths, bounds) = truth(p, way);
                assert_within(&what, &values, &truths, &bounds);
                greatest = greatest.max(greatest_ratio(&values, &truths, &bounds));
                (values, truths, bounds)
            });
            // Reference values, then drawn values.
            let exact: Vec<f64> = changes.iter().map(|c| c + 1e-13).collect();
            assert_within(&format!("{what}, true numbers"), &on.1, &off.1, &exact);
            let allowed: Vec<f64> =
                (0..changes.len()).map(|i| changes[i] + on.2[i] + off.2[i]).collect();
            assert_within(&format!("{what}, as drawn"), &on.0, &off.0, &allowed);
            let cut: Vec<usize> = (0..changes.len()).filter(|i| changes[*i] > 1e-6).collect();
            closest = cut
                .iter()
                .map(|&i| (on.1[i] - off.1[i]).abs() / changes[i])
                .fold(closest, f64::max);
            n_cut += cut.len();
        }
    }
    println!(
        "{n_cut} numbers cut, up to {closest:.3} of what may be; rounding up to {greatest:.3} \
         of its bound"
    );
    // The bound is attained by a single layer before black.
    assert!(n_cut > 10_000 && closest > 0.5 && closest <= 1.0 + 1e-6, "{n_cut} {closest}");
}

#[test]
fn number_of_layers_bounds_the_omitted_parts() {
    let pool = Pool::on_device(4);
    let mut most = Omitted::default();
    for seed in [1, 3, 5, 7, 9] {
        let picture = random(seed, &pool);
        assert!(picture.textured.is_none());
        for pixel in cut_of(&picture) {
            let of_layers = -(-f64::from(pixel.n_layers) * picture.view.edge.tau).exp_m1();
            assert!(pixel.share() <= of_layers);
            most = most.most(pixel);
        }
        assert!(cut_of(&without(&picture)).iter().all(|c| *c == Omitted::default()));
    }
    assert!(most.n_layers > 3 && most.tau > 0.01, "{most:?}");
}

#[test]
fn faulty_shaders_exceed_the_bounds() {
    let mut gpu = Gpu::new();
    let mut picture = Picture::new(DVec3::Z * 5.0, DVec3::ZERO, 45.0, 0.1);
    for k in 0..12 {
        let at =
            picture.at(0.4 * f64::from(k) - 2.2, 0.2 * f64::from(k % 4), 4.0 + 0.1 * f64::from(k));
        picture = picture.blob(at, 0.1 + 0.04 * f64::from(k), 0.5 * 0.5f64.powi(k % 6));
    }
    picture.view.edge = Edge { tau: 1.0 / 40.0, least: 1.0, ..picture.view.edge };
    let tiled = Way::Tiles(usual(&gpu));
    for (way, file, from, to) in [
        (
            Way::Sprites,
            "sprites.vert",
            "log(tau * push.inv_threshold)",
            "0.98 * log(tau * push.inv_threshold)",
        ),
        (Way::Sprites, "sprites.vert", "sqrt(2.0 * cut)", "sqrt(1.8 * cut)"),
        (Way::Sprites, "sprites.vert", "if (THRESHOLD != 0) {", "if (THRESHOLD > 1) {"),
        (Way::Sprites, "sprites.frag", "lowest = in_lowest", "lowest = 1.02 * in_lowest"),
        (tiled, "tiles_splat.comp", "sqrt(2.0 * cut)", "sqrt(1.5 * cut)"),
        (tiled, "tiles_pairs.comp", "log2(splat.w", "0.7 * log2(splat.w"),
        (tiled, "tiles.comp", "max(log2(uintBits", "max(0.98 * log2(uintBits"),
        (tiled, "tiles.comp", "max(min_exponent, -cut)", "min(min_exponent, -cut)"),
        // A blob's least reach.
        (Way::Sprites, "sprites.vert", "push.least_cut));", "0.9 * push.least_cut));"),
        (tiled, "tiles.comp", "inv_threshold), push.least_cut", "inv_threshold), 0.0"),
        (tiled, "tiles_splat.comp", "push.least_cut);", "0.5 * push.least_cut);"),
    ] {
        let (truths, bounds) = truth(&picture, way);
        let values = picture.draw_by(&mut gpu, None, FORMAT.0, way);
        assert!(greatest_ratio(&values, &truths, &bounds) <= 1.0);
        let wrong = Gpu::wrong_compiler(file, from, to);
        let values = picture.draw_by(&mut gpu, Some(&wrong), FORMAT.0, way);
        assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "{from} as {to}");
    }
}

#[test]
fn blobs_below_the_threshold_are_not_drawn() {
    let mut gpu = Gpu::new();
    let tiled = usual(&gpu);
    let mut picture =
        Picture::new(DVec3::Z * 5.0, DVec3::ZERO, 45.0, 0.1).blob(DVec3::ZERO, 0.5, 0.0099);
    picture.view.edge.tau = 0.01;
    for way in [Way::Sprites, Way::Tiles(tiled), Way::Chunks(2, tiled.saturated)] {
        let drawn = |p: &Picture, gpu: &mut Gpu| p.draw_by(gpu, None, FORMAT.0, way);
        assert!(drawn(&picture, &mut gpu).iter().all(|v| *v == 0.0));
        assert!(drawn(&without(&picture), &mut gpu).iter().any(|v| *v > 0.0));
        // A threshold so small that its inverse overflows f32 gives the same bytes as none.
        let least = at_tau(&picture, 1e-300);
        assert!(drawn(&least, &mut gpu) == drawn(&without(&picture), &mut gpu));
    }
}
