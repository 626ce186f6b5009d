//! Blobs composed by slices: whole pictures against the f64 reference, within a bound that follows
//! their shares through the composition.

use glam::DVec3;
use nimbus::gpu::Compiler;
use nimbus::gpu::TargetFormat;
use nimbus::model::edge::Edge;
use nimbus::model::film::FilmFormat;
use nimbus::passes::{self, tiles::Sharing};

use super::{compare_in, usual};
use crate::bounded::{Random, greatest_ratio};
use crate::harness::{Gpu, assert_within};
use crate::mixed::{cases, front, mixed};
use crate::picture::{FORMATS, Picture, Tiled, Way};
use crate::scenery::Scenery;

/// Draws picture `i` of a test by slices and compares it as [`compare_in`] does, in one of the
/// formats: they take turns. Greatest value seen.
fn compare(i: usize, gpu: &mut Gpu, what: &str, picture: &Picture) -> f64 {
    compare_in(&FORMATS[i % FORMATS.len()..][..1], gpu, &format!("slices, {what}"), picture)
}

/// Overlapping blobs of a few sizes, thin and opaque, some before and behind one another.
fn crowd(n: usize, seed: u64) -> Picture {
    let mut random = Random(seed);
    let mut picture = front();
    for _ in 0..n {
        let mut within = |low: f64, high: f64| f64::from(random.within(low, high));
        let at = picture.at(within(-1.5, 1.5), within(-1.2, 1.2), within(3.0, 7.0));
        picture = picture.blob(at, within(0.1, 0.5), 4.0 * within(0.0, 1.0).powi(2));
    }
    picture
}

/// The same as discs and spindles.
fn shaped(picture: &Picture) -> Picture {
    let mut picture = picture.clone();
    for (i, particle) in picture.particles.iter_mut().enumerate() {
        particle.aspect = [1.0, 0.2, 0.5, 2.0][i % 4];
    }
    picture
}

fn scenery() -> Scenery {
    let v = DVec3::new;
    Scenery::default()
        .rectangle(v(0.2, -0.1, 0.5), v(1.1, 0.2, 0.3), v(-0.18, 0.9, 0.06), [2, 3])
        .rectangle(v(-0.9, 0.3, -0.4), v(0.6, 0.0, 0.2), v(0.0, 0.5, 0.0), [1, 1])
}

#[test]
fn blobs_of_all_kinds_by_slices() {
    let mut gpu = Gpu::new();
    // Distances are relative to the lighting origin, which is not a million away from the blobs.
    let near_origin = |(what, ..): &(String, Picture, f64)| !what.contains("million");
    for (i, (what, picture, least)) in cases().into_iter().filter(near_origin).enumerate() {
        let greatest = compare(i, &mut gpu, &what, &picture.sliced(0.43));
        assert!(if least > 0.0 { greatest > least } else { greatest == 0.0 }, "{what}: {greatest}");
    }
}

#[test]
fn slices_of_every_thickness() {
    let mut gpu = Gpu::new();
    for n in [2, 3, 4] {
        for (i, slice) in [0.02, 0.1, 0.37, 1.0, 30.0].into_iter().enumerate() {
            let picture = crowd(120, 3).sliced(slice).in_parts(n);
            compare(i + n as usize, &mut gpu, &format!("{n} of {slice}"), &picture);
        }
    }
}

#[test]
fn ellipsoids_surfaces_and_edges_by_slices() {
    let mut gpu = Gpu::new();
    let crowd = crowd(100, 8).sliced(0.35);
    let over = |picture: &Picture| Picture { scenery: Some(scenery()), ..picture.clone() };
    let mut auto = crowd.clone();
    auto.view.edge = Edge::AUTO;
    let pictures = [
        ("ellipsoids", shaped(&crowd)),
        ("over surfaces", over(&crowd)),
        ("ellipsoids over surfaces", over(&shaped(&crowd))),
        ("edges", auto.clone()),
        ("edges of ellipsoids over surfaces", over(&shaped(&auto))),
        ("two slices over surfaces", over(&crowd.clone().in_parts(2))),
        ("two slices of ellipsoids over surfaces", over(&shaped(&crowd)).in_parts(2)),
    ];
    for (i, (what, picture)) in pictures.into_iter().enumerate() {
        assert!(compare(i, &mut gpu, what, &picture) > 0.3, "{what}");
    }
}

/// The same numbers whatever the workgroup is made of; within the bound in several rounds.
#[test]
fn workgroups_and_rounds_of_slices_do_not_show() {
    let mut gpu = Gpu::new();
    let (target, format) = FORMATS[2];
    let tiled = usual(&gpu, format);
    let mut picture = crowd(200, 4).sliced(0.3);
    let mut random = Random(6);
    for _ in 0..568 {
        let mut within = |low: f64, high: f64| f64::from(random.within(low, high));
        let at = picture.at(within(-1.0, 1.0), within(-1.0, 1.0), within(4.0, 6.0));
        picture = picture.blob(at, within(1.0, 2.0), 0.004);
    }
    let scenes = [
        picture.clone(),
        Picture { scenery: Some(scenery()), ..picture.clone() },
        Picture { scenery: Some(scenery()), ..shaped(&picture) },
        picture.clone().in_parts(2),
    ];
    for (i, picture) in scenes.into_iter().enumerate() {
        let mut draw = |tiled: &Tiled| picture.draw_by(&mut gpu, None, target, Way::Tiles(*tiled));
        let once = draw(&tiled);
        assert!(draw(&tiled) == once, "drawn twice");
        for sharing in [Sharing::Registers, Sharing::Subgroup] {
            let other = Tiled { sharing: Some(sharing), ..tiled };
            assert!(draw(&other) == once, "{sharing:?}");
        }
        for invocations in [8, 16, 32, 64] {
            let other = Tiled { invocations, sharing: Some(Sharing::Barriers), ..tiled };
            assert!(draw(&other) == once, "{invocations} invocations without subgroups");
        }
        assert!(draw(&Tiled { max_tiles: Some(3), ..tiled }) == once, "tiles of a workgroup");
        // The bounds take long in f64: of balls, and of ellipsoids over surfaces.
        if i % 2 == 1 {
            continue;
        }
        let (_, bounds) = picture.tiled_truth(format, tiled.saturated);
        let allowed: Vec<f64> = bounds.iter().map(|bound| 2.0 * bound).collect();
        let rounds = draw(&Tiled { max_pairs: Some(1), ..tiled });
        assert_within("several rounds", &rounds, &once, &allowed);
    }
}

#[test]
fn wrong_slices_are_noticed() {
    let mut gpu = Gpu::new();
    let crowd = crowd(100, 8).sliced(0.35);
    let over = Picture { scenery: Some(scenery()), ..shaped(&crowd) };
    let format = FilmFormat::Rgba32f;
    let tiled = usual(&gpu, format);
    let truths = [&crowd, &over].map(|p| p.tiled_truth(format, tiled.saturated));
    // The picture that tells: the one of balls, or that of ellipsoids over surfaces.
    for (file, from, to, i) in [
        ("include/tile_slices.glsl", "int(roundEven(at))", "int(floor(at))", 0),
        ("include/tile_slices.glsl", "int(m) + 2 - int(OPEN)) - at)", "int(m) - 1) - at)", 0),
        ("include/tile_slices.glsl", "1.38629436112", "1.2", 0),
        ("include/tile_slices.glsl", "share = within - before", "share = within", 0),
        ("include/tile_slices.glsl", "clamp(boundary - i_boundary, 0, int(OPEN))", "1", 0),
        ("include/tile_slices.glsl", "here[j] / max(t[j], 1e-30)", "here[j]", 0),
        (
            "include/tile_slices.glsl",
            "m < OPEN; ++m) { close_slice(true,",
            "m < 3; ++m) { close_slice(true,",
            0,
        ),
        ("include/tile_slices.glsl", "(wall[j] - distance) * in_sigmas", "10.0", 1),
        ("include/tile_slices.glsl", "+ flatness * upward[j]", "", 1),
        ("include/tile_slices.glsl", "sqrt(white / norm)", "1.0", 1),
        ("tiles.comp", "tau[j] = uint", "tau[j] = 0.99 * uint", 0),
    ] {
        let mut sources = passes::sources();
        assert!(sources.replace(file, from, to), "{from}");
        let compiler = Compiler::new(sources, None).expect("shaderc");
        let picture = [&crowd, &over][i];
        let values =
            picture.draw_by(&mut gpu, Some(&compiler), TargetFormat::Rgba32f, Way::Tiles(tiled));
        let (truths, bounds) = &truths[i];
        assert!(greatest_ratio(&values, truths, bounds) > 1.0, "{from} as {to}");
    }
}

/// Thin and opaque blobs of very different sizes: a crowd for which no slice fits all.
#[test]
fn blobs_of_very_different_sizes_by_slices() {
    let mut gpu = Gpu::new();
    for (i, slice) in [0.05, 2.0].into_iter().enumerate() {
        compare(
            i + 1,
            &mut gpu,
            &format!("mixed, {slice}"),
            &mixed(150, 12, 30.0, -3.0).sliced(slice),
        );
    }
}
