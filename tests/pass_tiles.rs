//! tiles: whole pictures against the f64 reference within a bound that follows the composition near to far, in both formats,
//! with what subgroups can do and without, in one round and in many.

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

use std::sync::Arc;

use bounded::{Random, greatest_ratio};
use glam::DVec3;
use harness::{Gpu, assert_within};
use mixed::{EYE, assert_small, front, mixed};
use nimbus::frame::tiling::saturated;
use nimbus::gpu::Compiler;
use nimbus::gpu::memory::TargetFormat;
use nimbus::layout::facet::LitRecord;
use nimbus::layout::particle::DrawnRecord;
use nimbus::model::film::FilmFormat;
use nimbus::passes;
use nimbus::reference::texture::Pool;
use picture::{FORMATS, Picture, Tiled, Way};
use scenery::Scenery;

/// As the device does it by default.
fn usual(gpu: &Gpu, format: FilmFormat) -> Tiled {
    let invocations = passes::tiles::invocations(gpu.device.limits());
    Tiled { invocations, portable: false, most_pairs: None, most_tiles: None, saturated: saturated(format) }
}

/// Draws `picture` in every format and compares every number of every pixel. The greatest value seen.
fn compare(gpu: &mut Gpu, what: &str, picture: &Picture) -> f64 {
    let mut greatest = 0f64;
    for (target, format) in FORMATS {
        let what = format!("{what}, {format:?}");
        let tiled = usual(gpu, format);
        let values = picture.draw_by(gpu, None, target, Way::Tiles(tiled));
        let (truths, bounds) = picture.tiled_truth(format, tiled.saturated);
        println!("{what}: error/bound {:.3}", greatest_ratio(&values, &truths, &bounds));
        assert_within(&what, &values, &truths, &bounds);
        assert_small(&what, format, [&values, &truths], picture.most_layers());
        greatest = truths.iter().fold(greatest, |a, b| a.max(*b));
    }
    greatest
}

#[test]
fn blobs_of_all_kinds() {
    let mut gpu = Gpu::new();
    // Above 1/8 the opacity has another form.
    for (seed, tau_most) in [(1, 0.125), (2, 3.0), (3, 30.0)] {
        let what = format!("tau up to {tau_most}");
        assert!(compare(&mut gpu, &what, &mixed(150, seed, tau_most, -4.0)) > 0.1);
    }
}

#[test]
fn far_from_the_origin_and_around_the_eye() {
    let mut gpu = Gpu::new();
    let eye = DVec3::new(1e6, -1e6, 5e5);
    let mut far = Picture::new(eye, eye - DVec3::Z, 60.0, 0.1);
    for k in 0..20 {
        let at = far.at(f64::from(k % 5) - 2.0, f64::from(k / 5) - 1.5, 4.0 + f64::from(k % 3));
        far = far.blob(at, 0.5, 0.8);
    }
    assert!(compare(&mut gpu, "coordinates of a million", &far) > 0.3);
    let around = front();
    let (near, beside) = (around.at(0.2, 0.1, 0.5), around.at(1.5, 0.0, 0.3));
    assert!(compare(&mut gpu, "around the eye", &around.blob(near, 2.0, 1.0).blob(beside, 0.8, 0.5)) > 0.5);
}

#[test]
fn wide_fields_of_view_the_near_plane_and_nothing_at_all() {
    let mut gpu = Gpu::new();
    let p = Picture::new(EYE, DVec3::new(3.0, 1.0, 0.0), 120.0, 0.1);
    let (a, b, c, d) = (p.at(2.0, 1.5, 1.0), p.at(-3.0, -2.4, 1.5), p.at(4.0, 0.0, 2.3), p.at(0.1, -1.0, 0.5));
    let wide = p.blob(a, 0.2, 1.0).blob(b, 0.5, 0.5).blob(c, 1.4, 0.4).blob(d, 0.33, 0.7);
    assert!(compare(&mut gpu, "120 degrees", &wide) > 0.5);
    let empty = Picture::new(EYE, DVec3::new(0.3, -0.2, 0.0), 45.0, 1.0);
    let near = |z: f64| empty.clone().blob(empty.at(0.05, 0.02, z), 0.1, 1.0);
    assert_eq!(compare(&mut gpu, "before the near plane", &near(0.9999)), 0.0);
    assert!(compare(&mut gpu, "behind the near plane", &near(1.0001)) > 0.5);
    assert_eq!(compare(&mut gpu, "no particles", &front()), 0.0);
    let at = front().at(0.0, 0.0, 5.0);
    assert_eq!(compare(&mut gpu, "no size", &front().blob(at, 0.0, 1.0)), 0.0);
    assert!(compare(&mut gpu, "among others", &front().blob(at, 0.0, 1.0).blob(at, 0.5, 0.0).blob(at, 0.3, 0.5)) > 0.3);
}

#[test]
fn light_of_facets_and_weights_of_groups() {
    let mut gpu = Gpu::new();
    let mut random = Random(77);
    let picture = mixed(40, 9, 1.0, -2.0);
    let mut lit = || {
        let first = [random.within(0.0, 4.0), random.within(0.0, 1.0), random.within(0.0, 0.01)];
        LitRecord { first, second: [0.25, 0.0, random.within(-0.001, 0.1)], ..LitRecord::default() }
    };
    let singly = Picture { lit: Some((0..40).map(|_| lit()).collect()), ..picture.clone() };
    assert!(compare(&mut gpu, "lit", &singly) > 0.3);
    let i_facet = Some((0..40).map(|i| (7 * i) % 11).collect());
    let shared = Picture { lit: Some((0..11).map(|_| lit()).collect()), i_facet, ..picture.clone() };
    assert!(compare(&mut gpu, "shared facets", &shared) > 0.3);
    let part = |end, kappa_scale, last_weight| DrawnRecord { shift: 0, end, kappa_scale, last_weight };
    let i_group = (0..40).map(|i| i / 10).collect();
    let drawn = vec![part(8, 1.6, 0.25), part(20, 1.0, 1.0), part(20, 1.0, 1.0), part(39, 2.0, 0.5)];
    assert!(compare(&mut gpu, "weights", &Picture { drawn: Some((i_group, drawn)), ..picture }) > 0.3);
}

#[test]
fn surfaces_hide_and_shine_through() {
    let mut gpu = Gpu::new();
    let v = DVec3::new;
    let scenery = Scenery::default()
        .rectangle(v(0.2, -0.1, 0.5), v(1.1, 0.2, 0.3), v(-0.18, 0.9, 0.06), [2, 3])
        .rectangle(v(-0.9, 0.3, 2.0), v(0.4, 0.0, 0.0), v(0.0, 0.4, 0.0), [1, 1]);
    let picture = Picture { scenery: Some(scenery), ..mixed(60, 5, 1.0, -2.0) };
    assert!(compare(&mut gpu, "over surfaces", &picture) > 0.3);
}

#[test]
fn textures_of_every_size() {
    let mut gpu = Gpu::new();
    let pool = Arc::new(Pool::new(4).rounded());
    let picture = sheets::textured(front(), &pool);
    assert!(compare(&mut gpu, "textured", &picture) > 0.5);
    let v = DVec3::new;
    let scenery = Scenery::default().rectangle(v(0.2, -0.1, 0.5), v(1.1, 0.2, 0.3), v(-0.18, 0.9, 0.06), [2, 3]);
    let behind = Picture { scenery: Some(scenery), ..picture.clone() };
    assert!(compare(&mut gpu, "textured, over a surface", &behind) > 0.5);
    let tiled = usual(&gpu, FORMATS[2].1);
    let drawn = |gpu: &mut Gpu, tiled: &Tiled| picture.draw_by(gpu, None, FORMATS[2].0, Way::Tiles(*tiled));
    assert!(drawn(&mut gpu, &tiled) == drawn(&mut gpu, &Tiled { portable: true, ..tiled }), "without subgroups");
    let (truths, bounds) = picture.tiled_truth(FORMATS[2].1, tiled.saturated);
    let wrong = Gpu::wrong_compiler("tiles.comp", "uvec2(splat.gain.w, splat.side)", "uvec2(0u, splat.side)");
    let values = picture.draw_by(&mut gpu, Some(&wrong), FORMATS[2].0, Way::Tiles(tiled));
    assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "another field");
}

/// The same numbers whatever the workgroup is made of; and, but for the rounding of what one round hands to the next, in
/// however many rounds.
#[test]
fn workgroups_and_rounds_do_not_show() {
    let mut gpu = Gpu::new();
    // Three blocks of splats, most of which reach most of the bins: too many pairs for two.
    let mut picture = mixed(100, 21, 0.5, -1.0);
    let mut random = Random(4);
    for _ in 0..668 {
        let mut within = |low: f64, high: f64| f64::from(random.within(low, high));
        let at = picture.at(within(-1.0, 1.0), within(-1.0, 1.0), within(4.0, 6.0));
        picture = picture.blob(at, within(1.0, 2.0), 0.004);
    }
    let (target, format) = FORMATS[2];
    let tiled = usual(&gpu, format);
    let mut draw = |tiled: &Tiled| picture.draw_by(&mut gpu, None, target, Way::Tiles(*tiled));
    let once = draw(&tiled);
    assert!(draw(&tiled) == once, "drawn twice");
    for invocations in [8, 16, 32, 64] {
        let other = Tiled { invocations, portable: true, ..tiled };
        assert!(draw(&other) == once, "{invocations} invocations without subgroups");
    }
    for most_tiles in [1, 3, 16].map(Some) {
        assert!(draw(&Tiled { most_tiles, ..tiled }) == once, "{most_tiles:?} tiles a workgroup");
        assert!(
            draw(&Tiled { invocations: 32, portable: true, most_tiles, ..tiled }) == once,
            "{most_tiles:?}, portable"
        );
    }
    let rounds = draw(&Tiled { most_pairs: Some(1), ..tiled });
    assert!(rounds != once, "several rounds");
    let (truths, bounds) = picture.tiled_truth(format, tiled.saturated);
    // 1 - passed is rounded by 2^-25 at the end of a round, and is a factor of all that follows: of what is at most 1.5.
    let bounds: Vec<f64> = bounds.iter().map(|b| b + 3.0 * 1.5 * 2f64.powi(-25)).collect();
    assert_within("rounds", &rounds, &truths, &bounds);
}

/// As many splats as a round may have, all in one bin, of which the last ones alone reach another of its tiles: loops over
/// a bin's pairs take fewer turns than a device may end them after.
#[test]
fn a_bin_of_all_splats_keeps_the_last_ones() {
    let mut gpu = Gpu::new();
    let mut picture = front();
    let side = 2.0 * (22.5f64).to_radians().tan() / 120.0;
    // Of a pixel's centre, at a depth.
    let at = |picture: &Picture, i: f64, j: f64, z: f64| {
        let slopes = [(i + 0.5 - 80.0) * side, (60.0 - j - 0.5) * side];
        picture.at(slopes[0] * z, slopes[1] * z, z)
    };
    let [near, far] = [at(&picture, 66.0, 34.0, 4.0), at(&picture, 92.0, 60.0, 5.0)];
    for i in 0..65_536 {
        picture = if i < 65_520 { picture.blob(near, 1.2 * side, 1e-7) } else { picture.blob(far, 10.0 * side, 0.5) };
    }
    let (target, format) = FORMATS[2];
    let tiled = usual(&gpu, format);
    let values = picture.draw_by(&mut gpu, None, target, Way::Tiles(tiled));
    let alpha = values[4 * (60 * 160 + 92) + 3];
    // Sixteen layers of tau = 1/2 through their centres: 1 - e^-8.
    assert!((alpha - (1.0 - (-8f64).exp())).abs() < 1e-5, "{alpha}");
}

#[test]
fn wrong_pictures_are_noticed() {
    let mut gpu = Gpu::new();
    let picture = mixed(150, 2, 3.0, -1.0);
    let format = FilmFormat::Rgba32f;
    let tiled = usual(&gpu, format);
    let (truths, bounds) = picture.tiled_truth(format, tiled.saturated);
    let mut values = picture.draw_by(&mut gpu, None, TargetFormat::Rgba32f, Way::Tiles(tiled));
    assert!(greatest_ratio(&values, &truths, &bounds) <= 1.0);
    let i = (0..truths.len()).max_by(|a, b| truths[*a].total_cmp(&truths[*b])).expect("pixels");
    values[i] -= 2.0 * bounds[i];
    assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "one corrupted number");
    for (file, from, to) in [
        ("tiles.comp", "least = -push.cut", "least = -0.9 * push.cut"),
        ("tiles.comp", "* inv_norm[j]", ""),
        ("tiles.comp", "passed[j] -= here;", "passed[j] -= 0.999 * here;"),
        ("tiles.comp", "k + t < n ? splat.place.w", "k + t <= n ? splat.place.w"),
        ("tiles.comp", "n + subgroupBallotBitCount(hits)", "n + min(subgroupBallotBitCount(hits), 7u)"),
        ("tiles_splat.comp", "n_splats - 1u - r", "r"),
        ("tiles_splat.comp", "before + here.x - n;", "before + here.x;"),
        ("tiles_pairs.comp", "y[3 - j]", "y[j]"),
        ("tiles_pairs.comp", "clamp(int(high) - first, 0, 4)", "clamp(int(high) - first, 0, 3)"),
        ("tiles_ranges.comp", "lower_bound(n, bin + 1u)", "lower_bound(n, bin + 1u) - 1u"),
        ("include/blob.glsl", "min(low, high) > 0.0", "true"),
    ] {
        let mut sources = passes::sources();
        assert!(sources.replace(file, from, to), "{from}");
        let compiler = Compiler::new(sources, None).expect("shaderc");
        let values = picture.draw_by(&mut gpu, Some(&compiler), TargetFormat::Rgba32f, Way::Tiles(tiled));
        assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "{from} as {to}");
    }
}
