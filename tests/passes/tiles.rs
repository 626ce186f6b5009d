//! tiles: whole pictures against the f64 reference within a bound that follows the composition near
//! to far, in both formats, with what subgroups can do and without, in one round and in many. The
//! rounds alone against a serial reference.

mod rounds;
mod slices;

use crate::bounded::{Random, greatest_ratio};
use crate::harness::{Gpu, assert_within};
use crate::mixed::{assert_small, cases, front, mixed};
use crate::picture::{FORMATS, Picture, Tiled, Way};
use crate::scenery::Scenery;
use crate::sheets;
use glam::DVec3;
use nimbus::frame::saturation_bound;
use nimbus::gpu::Compiler;
use nimbus::gpu::TargetFormat;
use nimbus::model::film::FilmFormat;
use nimbus::passes::{self, tiles::Sharing};
use nimbus::reference::texture::Pool;

/// As the device does it by default.
fn usual(gpu: &Gpu, format: FilmFormat) -> Tiled {
    let invocations = passes::tiles::invocations(gpu.device.limits());
    Tiled {
        invocations,
        sharing: None,
        max_pairs: None,
        max_tiles: None,
        saturated: saturation_bound(format),
    }
}

/// Draws `picture` in every format and compares every number of every pixel. The greatest value
/// seen.
fn compare(gpu: &mut Gpu, what: &str, picture: &Picture) -> f64 {
    compare_in(&FORMATS, gpu, what, picture)
}

/// The same in some of the formats.
fn compare_in(
    formats: &[(TargetFormat, FilmFormat)],
    gpu: &mut Gpu,
    what: &str,
    picture: &Picture,
) -> f64 {
    let mut greatest = 0f64;
    for &(target, format) in formats {
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
    for (what, picture, least) in cases() {
        let greatest = compare(&mut gpu, &what, &picture);
        assert!(if least > 0.0 { greatest > least } else { greatest == 0.0 }, "{what}: {greatest}");
    }
}

#[test]
fn textures_of_every_size() {
    let mut gpu = Gpu::new();
    let pool = Pool::on_device(4);
    let picture = sheets::textured(front(), &pool);
    let v = DVec3::new;
    let scenery = Scenery::default().rectangle(
        v(0.2, -0.1, 0.5),
        v(1.1, 0.2, 0.3),
        v(-0.18, 0.9, 0.06),
        [2, 3],
    );
    let behind = Picture { scenery: Some(scenery), ..picture.clone() };
    assert!(compare(&mut gpu, "textured, over a surface", &behind) > 0.5);
    let tiled = usual(&gpu, FORMATS[2].1);
    let drawn =
        |gpu: &mut Gpu, tiled: &Tiled| picture.draw_by(gpu, None, FORMATS[2].0, Way::Tiles(*tiled));
    assert!(
        drawn(&mut gpu, &tiled)
            == drawn(&mut gpu, &Tiled { sharing: Some(Sharing::Barriers), ..tiled }),
        "without subgroups"
    );
    let (truths, bounds) = picture.tiled_truth(FORMATS[2].1, tiled.saturated);
    let wrong = Gpu::wrong_compiler(
        "tiles.comp",
        "uvec2(splat.fours[3].w, splat.fours[4].x)",
        "uvec2(0u, splat.fours[4].x)",
    );
    let values = picture.draw_by(&mut gpu, Some(&wrong), FORMATS[2].0, Way::Tiles(tiled));
    assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "another field");
}

/// The same numbers whatever the workgroup is made of, and in however many rounds.
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
    for sharing in [Sharing::Registers, Sharing::Subgroup] {
        let other = Tiled { sharing: Some(sharing), ..tiled };
        assert!(draw(&other) == once, "{sharing:?}");
    }
    for invocations in [8, 16, 32, 64] {
        let other = Tiled { invocations, sharing: Some(Sharing::Barriers), ..tiled };
        assert!(draw(&other) == once, "{invocations} invocations without subgroups");
    }
    for max_tiles in [1, 3, 16].map(Some) {
        assert!(draw(&Tiled { max_tiles, ..tiled }) == once, "{max_tiles:?} tiles a workgroup");
        assert!(
            draw(&Tiled { invocations: 32, sharing: Some(Sharing::Barriers), max_tiles, ..tiled })
                == once,
            "{max_tiles:?}, portable"
        );
    }
    // A round hands on the state that a single round would have. One kernel draws an only round and
    // another one of several. A compiler may fuse other products and sums in each, so that both
    // pictures are only within the bound of the truth.
    let (_, bounds) = picture.tiled_truth(format, tiled.saturated);
    let allowed: Vec<f64> = bounds.iter().map(|bound| 2.0 * bound).collect();
    assert_within("several rounds", &draw(&Tiled { max_pairs: Some(1), ..tiled }), &once, &allowed);
}

/// As many splats as a round may have, all in one bin, of which the last ones alone reach another
/// of its tiles: loops over a bin's pairs take fewer turns than a device may end them after.
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
        picture = if i < 65_520 {
            picture.blob(near, 1.2 * side, 1e-7)
        } else {
            picture.blob(far, 10.0 * side, 0.5)
        };
    }
    let (target, format) = FORMATS[2];
    let tiled = usual(&gpu, format);
    let values = picture.draw_by(&mut gpu, None, target, Way::Tiles(tiled));
    let alpha = values[4 * (60 * 160 + 92) + 3];
    // Sixteen layers of tau = 1/2 through their centres: 1 - e^-8.
    assert!((alpha - (1.0 - (-8f64).exp())).abs() < 1e-5, "{alpha}");
}

/// A picture of floats takes the exact functions, whether thin or not. The functions of fewer bits
/// are some ten times worse. The bound of a whole picture cannot tell: it has to hold at the
/// sprites' edges, where the position errs most.
#[test]
fn pictures_of_floats_have_exact_functions() {
    let mut gpu = Gpu::new();
    let (target, format) = FORMATS[2];
    let tiled = usual(&gpu, format);
    let wrong = Gpu::wrong_compiler("tiles.comp", "PIXEL_WORDS < 4", "PIXEL_WORDS <= 4");
    for tau in [0.1, 2.0] {
        let picture = front();
        let at = picture.at(0.1, 0.1, 5.0);
        let picture = picture.blob(at, 0.5, tau);
        let (truths, _) = picture.tiled_truth(format, tiled.saturated);
        let mut rms = |compiler: Option<&Compiler>| {
            let values = picture.draw_by(&mut gpu, compiler, target, Way::Tiles(tiled));
            let sum: f64 = values.iter().zip(&truths).map(|(a, b)| (a - b).powi(2)).sum();
            (sum / values.len() as f64).sqrt()
        };
        let [exact, coarse] = [rms(None), rms(Some(&wrong))];
        println!("{tau}: {exact:.1e}, of fewer bits {coarse:.1e}");
        assert!(exact < 1e-7 * tau.min(1.0) && coarse > 4.0 * exact, "{tau}: {exact:e} {coarse:e}");
    }
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
        ("tiles.comp", "min_exponent = -push.cut", "min_exponent = -0.9 * push.cut"),
        ("tiles.comp", "* inv_norm[j]", ""),
        ("include/tile_thin.glsl", "alpha[j] += here;", "alpha[j] += 0.999 * here;"),
        ("tiles.comp", "t < n ? splat.fours[0].w", "t <= n ? splat.fours[0].w"),
        (
            "include/tile_splats.glsl",
            "n + subgroupBallotBitCount(hits)",
            "n + min(subgroupBallotBitCount(hits), 7u)",
        ),
        ("include/tile_queue.glsl", "t - subgroupBallotExclusiveBitCount(hits)", "0u"),
        ("include/tile_queue.glsl", "(by_there & k) != 0", "(by_there & k & 3u) != 0"),
        ("include/tile_queue.glsl", "(t - n) &", "(t + 1u - n) &"),
        ("include/tile_queue.glsl", "left_over = r;", "left_over = waiting;"),
        ("tiles_splat.comp", "n_splats - 1u - r", "r"),
        ("tiles_splat.comp", "before + here.x - n;", "before + here.x;"),
        ("tiles_pairs.comp", "y[3 - j]", "y[j]"),
        ("tiles_pairs.comp", "clamp(int(high) - first, 0, 4)", "clamp(int(high) - first, 0, 3)"),
        ("tiles_ranges.comp", "lower_bound(n, bin + 1u)", "lower_bound(n, bin + 1u) - 1u"),
        ("include/blob.glsl", "min(low, high) > 0.0", "true"),
    ] {
        let limits = gpu.device.limits();
        let sharing = match file {
            "include/tile_queue.glsl" => Some(Sharing::Registers),
            "include/tile_splats.glsl" => Some(Sharing::Subgroup),
            _ => None,
        };
        // Where a workgroup is no subgroup, no operation of subgroups is compiled.
        let is_subgroup = limits.is_one_subgroup(passes::tiles::invocations(limits));
        if sharing.is_some() && !is_subgroup {
            continue;
        }
        let tiled = Tiled { sharing, ..tiled };
        let mut sources = passes::sources();
        assert!(sources.replace(file, from, to), "{from}");
        let compiler = Compiler::new(sources, None).expect("shaderc");
        let values =
            picture.draw_by(&mut gpu, Some(&compiler), TargetFormat::Rgba32f, Way::Tiles(tiled));
        assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "{from} as {to}");
    }
}
