//! Ellipsoidal blobs (docs/explanation/model.md §14) drawn by every path, compared with the f64
//! reference within bounds that follow the shaders' evaluation of conics.

#[path = "harness/bounded.rs"]
mod bounded;
mod harness;
#[path = "harness/mixed.rs"]
mod mixed;
#[path = "harness/picture.rs"]
mod picture;
#[path = "harness/scenery.rs"]
mod scenery;
#[path = "harness/sheets.rs"]
mod sheets;
#[path = "harness/tiled.rs"]
mod tiled;

use bounded::{Random, greatest_ratio};
use glam::{DQuat, DVec3};
use harness::{Gpu, assert_within};
use mixed::{cases, front};
use nimbus::frame::saturation_bound;
use nimbus::gpu::Compiler;
use nimbus::gpu::TargetFormat;
use nimbus::model::cloud::Turn;
use nimbus::model::film::FilmFormat;
use nimbus::passes::{self, tiles::Sharing};
use picture::{FORMATS, Picture, Tiled, Way};

const F32: (TargetFormat, FilmFormat) = (TargetFormat::Rgba32f, FilmFormat::Rgba32f);

fn tiled(gpu: &Gpu, format: FilmFormat, sharing: Option<Sharing>) -> Tiled {
    let invocations = passes::tiles::invocations(gpu.device.limits());
    Tiled {
        invocations,
        sharing,
        max_pairs: None,
        max_tiles: None,
        saturated: saturation_bound(format),
    }
}

/// Returns the device's values, the reference values and their bounds.
fn drawn(
    gpu: &mut Gpu,
    compiler: Option<&Compiler>,
    picture: &Picture,
    (target, format): (TargetFormat, FilmFormat),
    way: Way,
) -> [Vec<f64>; 3] {
    let values = picture.draw_by(gpu, compiler, target, way);
    let (truths, bounds) = match way {
        Way::Sprites | Way::Points => picture.truth(format),
        Way::Tiles(tiled) => picture.tiled_truth(format, tiled.saturated),
        Way::Chunks(_, saturated) => picture.chunked_truth(format, saturated),
    };
    [values, truths, bounds]
}

/// Scales the height of every blob by a random factor between 1/`most` and `most`.
fn shaped(picture: &Picture, seed: u64, most: f32) -> Picture {
    let (mut picture, mut random) = (picture.clone(), Random(seed));
    for particle in &mut picture.particles {
        particle.aspect = most.powf(random.within(-1.0, 1.0));
    }
    picture
}

/// The same with turned axes, the shortest down to a tenth of the longest. Coordinates of a million
/// err by 0.06: there none is thinner than that.
fn turned(picture: &Picture, seed: u64) -> Picture {
    let (mut picture, mut random) = (picture.clone(), Random(seed));
    let most: f64 = if picture.view.pose.position.length() > 1e5 { 2.0 } else { 10.0 };
    for particle in &mut picture.particles {
        let mut of = || f64::from(random.within(-1.0, 1.0));
        let turn = DQuat::from_xyzw(of(), of(), of(), of() + 1e-3).normalize();
        particle.aspect = most.powf(-of().abs()) as f32;
        particle.aspect_z = most.powf(-of().abs()) as f32;
        particle.turn = Turn::new(turn).words();
    }
    picture
}

#[test]
fn ellipsoids_match_the_reference() {
    match_the_reference(|picture, seed| shaped(picture, seed, 10.0));
}

#[test]
fn turned_ellipsoids_match_the_reference() {
    match_the_reference(turned);
}

fn match_the_reference(of: fn(&Picture, u64) -> Picture) {
    let mut gpu = Gpu::new();
    for (i, (what, picture, _)) in cases().into_iter().enumerate() {
        let picture = of(&picture, i as u64);
        // Rounding to a format does not depend on shapes: a third of the cases has all formats.
        let is_in_all = picture.placed.len() <= 100 && i.is_multiple_of(3);
        let formats = if is_in_all { &FORMATS[..] } else { &FORMATS[1..2] };
        for (target, format) in formats.iter().copied() {
            // Every third case runs without subgroup operations.
            let sharing = i.is_multiple_of(3).then_some(Sharing::Barriers);
            let by_tiles = Way::Tiles(tiled(&gpu, format, sharing));
            for way in [Way::Sprites, by_tiles, Way::Chunks(5, saturation_bound(format))] {
                let [values, truths, bounds] =
                    drawn(&mut gpu, None, &picture, (target, format), way);
                println!(
                    "{what}, {format:?}, {way:?}: error/bound {:.3}",
                    greatest_ratio(&values, &truths, &bounds)
                );
                assert_within(&what, &values, &truths, &bounds);
            }
        }
    }
}

/// Returns flat blobs, like cells of weather data, seen from the side, from above and from within.
fn decks(threshold: f64) -> Vec<(&'static str, Picture)> {
    let mut random = Random(8);
    let mut blobs = || {
        let mut within = |low: f64, high: f64| f64::from(random.within(low, high));
        let at = DVec3::new(within(-4.0, 4.0), within(-0.4, 0.4), within(-4.0, 4.0));
        (at, within(0.3, 1.2), within(0.05, 2.0), within(0.02, 0.08))
    };
    let all: Vec<_> = (0..60).map(|_| blobs()).collect();
    let seen = |eye: DVec3, target: DVec3, fov: f64| {
        let mut picture = Picture::new(eye, target, fov, 0.05);
        picture.view.edge.tau = threshold;
        all.iter()
            .fold(picture, |p, (at, sigma, tau, aspect)| p.blob(*at, *sigma, *tau).shaped(*aspect))
    };
    vec![
        ("beside", seen(DVec3::new(0.3, 0.2, 9.0), DVec3::ZERO, 50.0)),
        ("above", seen(DVec3::new(0.5, 12.0, 3.0), DVec3::ZERO, 45.0)),
        ("within", seen(DVec3::new(0.1, 0.05, 0.2), DVec3::new(3.0, 0.4, -2.0), 90.0)),
        ("tall", shaped(&seen(DVec3::new(0.3, 2.0, 14.0), DVec3::ZERO, 50.0), 5, 6.0)),
        ("turned", turned(&seen(DVec3::new(0.3, 2.0, 14.0), DVec3::ZERO, 50.0), 6)),
    ]
}

#[test]
fn flat_blobs_match_the_reference_from_all_sides() {
    let mut gpu = Gpu::new();
    for threshold in [0.0, 0.01] {
        for (what, picture) in decks(threshold) {
            for way in [
                Way::Sprites,
                Way::Tiles(tiled(&gpu, F32.1, None)),
                Way::Chunks(7, saturation_bound(F32.1)),
            ] {
                let [values, truths, bounds] = drawn(&mut gpu, None, &picture, F32, way);
                println!(
                    "{what}, {way:?}: error/bound {:.3}",
                    greatest_ratio(&values, &truths, &bounds)
                );
                assert_within(what, &values, &truths, &bounds);
                // The bound is small for half of the picture. It follows from the largest error of
                // all opacities, which occurs inside a blob fifty times as wide as high.
                let mut sorted = bounds.clone();
                sorted.sort_by(f64::total_cmp);
                let most = if what == "within" { 1e-2 } else { 1e-3 };
                assert!(sorted[sorted.len() / 2] < most, "{what}: {:e}", sorted[sorted.len() / 2]);
                assert!(truths.iter().any(|t| *t > 0.2));
            }
        }
    }
}

#[test]
fn spheres_are_unchanged_by_an_ellipsoid_in_the_scene() {
    let mut gpu = Gpu::new();
    let balls = front();
    let balls = balls.clone().blob(balls.at(0.3, -0.2, 5.0), 0.6, 1.0).blob(
        balls.at(-0.5, 0.4, 6.0),
        1.1,
        0.4,
    );
    // A blob of optical depth 0 switches all blobs to the shaders for ellipsoids.
    let among = balls.clone().blob(balls.at(0.0, 0.0, 9.0), 0.5, 0.0).shaped(0.5);
    for way in [Way::Sprites, Way::Tiles(tiled(&gpu, F32.1, None))] {
        let [values, _, own] = drawn(&mut gpu, None, &among, F32, way);
        let [alone, _, bounds] = drawn(&mut gpu, None, &balls, F32, way);
        assert!(values != vec![0.0; values.len()]);
        // Both have the same reference, and each is within its own bound.
        let both: Vec<f64> = own.iter().zip(&bounds).map(|(a, b)| a + b).collect();
        assert_within("balls", &values, &alone, &both);
    }
}

#[test]
fn faulty_shaders_exceed_the_bounds() {
    let mut gpu = Gpu::new();
    let sprites = [
        (
            "include/blob.glsl",
            "shape.inverse * dot(across_x, across_x) + up_x * up_x",
            "dot(across_x, across_x) + up_x * up_x",
        ),
        (
            "include/blob.glsl",
            "2.0 * (shape.inverse * dot(across_x, across_y)",
            "(shape.inverse * dot(across_x, across_y)",
        ),
        ("include/blob.glsl", "float more = shape.square - 1.0;", "float more = 0.0;"),
        ("sprites.frag", "tau *= sqrt((rest + up * up) / white);", ""),
        ("sprites.frag", "rest + in_conic.w * up * up", "rest + up * up"),
        (
            "sprites.vert",
            "upward = tangents_along(shape, v, 1, r);",
            "upward = tangents_along(shape, v, 0, r);",
        ),
    ];
    let tiles = [
        (
            "include/blob.glsl",
            "shape.inverse * dot(across_x, across_x) + up_x * up_x",
            "dot(across_x, across_x) + up_x * up_x",
        ),
        ("include/blob.glsl", "float more = shape.square - 1.0;", "float more = 0.0;"),
        ("tiles.comp", "across[j] + conic.w * along[j]", "across[j] + along[j]"),
        (
            "tiles.comp",
            "deep[j] = place.w * sqrt((across[j] + along[j]) * inv_white);",
            "deep[j] = place.w;",
        ),
        ("include/particles.glsl", "aspects.x, aspects.y", "aspects.y, aspects.y"),
    ];
    let of = |way: Way, mutations: &[(&str, &str, &str)], gpu: &mut Gpu| {
        for (file, from, to) in mutations {
            let compiler = Gpu::wrong_compiler(file, from, to);
            let is_noticed = decks(0.0).iter().any(|(_, picture)| {
                let [values, truths, bounds] = drawn(gpu, Some(&compiler), picture, F32, way);
                greatest_ratio(&values, &truths, &bounds) > 1.0
            });
            assert!(is_noticed, "{file}: {to} was not noticed");
        }
    };
    let turned = [
        ("include/turn.glsl", "q.y * q.w + q.x * q.z", "q.y * q.w - q.x * q.z"),
        ("include/blob.glsl", "shape.inverse * up * shape.y", "up * shape.y"),
        ("include/blob.glsl", "more = shape.square_z - 1.0;", "more = -1.0;"),
        ("include/blob.glsl", "shape.inverse * of_across + of_up", "of_across + of_up"),
        ("include/blob.glsl", "across -= side * shape.z;", ""),
    ];
    let by_sprites = [
        ("sprites.frag", "dot(in_lean, delta)", "0.5 * dot(in_lean, delta)"),
        ("sprites.frag", "across / (in_blob.z * in_conic.w)", "0.0"),
    ];
    let by_tiles = [
        ("tiles.comp", "1.0 + lean.y * dy", "1.0"),
        ("tiles.comp", "conic.w * along * along - across * inv_scale", "conic.w * along * along"),
    ];
    of(Way::Sprites, &[&turned[..], &by_sprites].concat(), &mut gpu);
    of(Way::Tiles(tiled(&gpu, F32.1, None)), &[&turned[..], &by_tiles].concat(), &mut gpu);
    of(Way::Sprites, &sprites, &mut gpu);
    let way = Way::Tiles(tiled(&gpu, F32.1, None));
    of(way, &tiles, &mut gpu);
}
