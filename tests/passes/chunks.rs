//! chunks: whole pictures, in however many chunks, against the f64 reference within a bound that
//! follows f32 blending near to far, in every format; what is left out behind full pixels; and
//! whole frames, with culling, surfaces and smaller pictures.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use crate::bounded::greatest_ratio;
use crate::harness::{Gpu, assert_within};
use crate::mixed::{EYE, assert_small, cases, front, mixed};
use crate::picture::{FORMATS, Picture, Way};
use glam::DVec3;
use nimbus::frame::Game;
use nimbus::frame::Renderer;
use nimbus::frame::plan::Pass;
use nimbus::frame::saturation_bound;
use nimbus::gpu::TargetFormat;
use nimbus::io::scene_file;
use nimbus::model::film::FilmFormat;

const F32: (TargetFormat, FilmFormat) = (TargetFormat::Rgba32f, FilmFormat::Rgba32f);

/// Draws `picture` in formats and numbers of chunks and compares every number of every pixel. The
/// greatest value seen.
fn compare(
    ways: &[((TargetFormat, FilmFormat), u32)],
    gpu: &mut Gpu,
    what: &str,
    picture: &Picture,
) -> f64 {
    let mut greatest = 0f64;
    for &((target, format), n_chunks) in ways {
        let what = format!("{what}, {format:?}, {n_chunks} chunks");
        let saturated = saturation_bound(format);
        let values = picture.draw_by(gpu, None, target, Way::Chunks(n_chunks, saturated));
        let (truths, bounds) = picture.chunked_truth(format, saturated);
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
    for (i, (what, picture, least)) in cases().into_iter().enumerate() {
        // Formats and numbers of chunks take turns.
        let ways = [(FORMATS[i % 3], [1, 3, 16][i % 3]), (F32, 256)];
        let greatest = compare(&ways, &mut gpu, &what, &picture);
        assert!(if least > 0.0 { greatest > least } else { greatest == 0.0 }, "{what}: {greatest}");
    }
}

/// Where nothing may be left out the same operations are done in the same order.
#[test]
fn chunks_do_not_show() {
    let mut gpu = Gpu::new();
    let picture = mixed(100, 21, 0.5, -1.0);
    let mut draw = |n| picture.draw_by(&mut gpu, None, F32.0, Way::Chunks(n, 0.0));
    let once = draw(1);
    for n in [2, 7, 99, 256] {
        assert!(draw(n) == once, "{n} chunks");
    }
}

/// Pixels that the near half fills show that half alone; the others all of it.
#[test]
fn full_pixels_leave_the_rest_out() {
    let mut gpu = Gpu::new();
    let mut picture = front();
    for k in 0..20 {
        let at = picture.at(
            0.2 * f64::from(k % 5) - 0.4,
            0.1 * f64::from(k % 4),
            4.0 + 0.1 * f64::from(k),
        );
        picture = picture.blob(at, 0.3, 0.6);
    }
    // The depths grow with the number.
    let near = Picture {
        placed: picture.placed[..10].to_vec(),
        particles: picture.particles[..10].to_vec(),
        ..front()
    };
    let mut draw = |p: &Picture, way| p.draw_by(&mut gpu, None, F32.0, way);
    let half = draw(&near, Way::Chunks(1, 0.0));
    let (whole, cut) = (draw(&picture, Way::Chunks(2, 0.0)), draw(&picture, Way::Chunks(2, 0.25)));
    let (mut n_full, mut n_open) = (0, 0);
    for (i, near) in half.chunks(4).enumerate() {
        let (shown, all) = (&cut[4 * i..4 * i + 4], &whole[4 * i..4 * i + 4]);
        // As the device sees it: 1 − A in f32.
        if 1.0 - (near[3] as f32) < 0.25 {
            assert!(shown == near, "pixel {i}: {shown:?}, of the near half {near:?}");
            n_full += usize::from(shown != all);
        } else {
            assert!(shown == all, "pixel {i}: {shown:?}, of all {all:?}");
            n_open += usize::from(near[3] > 0.0);
        }
    }
    assert!(n_full > 500 && n_open > 500, "{n_full} full pixels, {n_open} open ones");
    let (truths, bounds) = picture.chunked_truth(F32.1, 0.25);
    assert_within("a quarter left out", &cut, &truths, &bounds);
}

#[test]
fn wrong_pictures_are_noticed() {
    let mut gpu = Gpu::new();
    let picture = mixed(150, 2, 3.0, -1.0);
    // Bounds of what leaves nothing out.
    let (truths, bounds) = picture.chunked_truth(F32.1, 0.0);
    let way = Way::Chunks(5, saturation_bound(F32.1));
    let mut values = picture.draw_by(&mut gpu, None, F32.0, way);
    assert!(greatest_ratio(&values, &truths, &bounds) <= 1.0);
    let i = (0..truths.len()).max_by(|a, b| truths[*a].total_cmp(&truths[*b])).expect("pixels");
    values[i] -= 2.0 * bounds[i];
    assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "one corrupted number");
    for (file, from, to) in [
        ("chunks_order.comp", "n - 1u - i", "i"),
        ("chunks_order.comp", "i / size * push.stride + i % size", "i"),
        ("chunks_order.comp", "min(size, n - before)", "size - 1u"),
        ("chunks.frag", "!(1.0 - pixel.w < push.saturated)", "1.0 - pixel.w < push.saturated"),
        ("chunks.frag", "!(1.0 - pixel.w < push.saturated)", "!(1.0 - pixel.w < 0.1)"),
        ("chunks.frag", "at.y * int(push.width) + at.x", "at.x"),
        ("sprites.vert", "push.i_first + (POINTS", "(POINTS"),
    ] {
        let wrong = Gpu::wrong_compiler(file, from, to);
        let values = picture.draw_by(&mut gpu, Some(&wrong), F32.0, way);
        assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "{from} as {to}");
    }
}

/// Layers so thin that half floats would lose them far to near: once is rounded, and not ten
/// thousand times.
#[test]
fn ten_thousand_thin_layers_in_half_floats() {
    let mut gpu = Gpu::new();
    let mut picture = Picture::new(EYE, DVec3::new(0.3, -0.2, 0.0), 45.0, 0.1);
    (picture.view.width, picture.view.height) = (40, 30);
    let at = picture.at(0.0, 0.0, 5.0);
    for _ in 0..10_000 {
        picture = picture.blob(at, 0.6, 1e-4);
    }
    let (target, format) = (TargetFormat::Rgba16f, FilmFormat::Rgba16f);
    let truths = picture.truth(FilmFormat::Rgba32f).0;
    let off =
        |values: &[f64]| values.iter().zip(&truths).map(|(v, t)| (v - t).abs()).fold(0.0, f64::max);
    let chunked =
        off(&picture.draw_by(&mut gpu, None, target, Way::Chunks(4, saturation_bound(format))));
    let layered = off(&picture.draw(&mut gpu, None, target));
    println!("greatest error near to far {chunked:.2e}, far to near {layered:.2e}");
    // Half a step of half floats below 1 is left out, half a step is rounded off, and 10 000 sums
    // in f32 err by 2^-24 each to either side.
    assert!(
        chunked < 2.0 * 2f64.powi(-12) + 100.0 * 2f64.powi(-24) && layered > 0.1,
        "{chunked:e}, {layered:e}"
    );
}

/// The numbers of some of a scene's frames, and what is said of the last one's impostors.
fn frames(gpu: &Gpu, file: &str, range: Range<u32>, overrides: &[&str]) -> (Vec<f64>, bool) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(file);
    let all = [
        "draw.path='sprites'",
        "film.format='rgba32f'",
        "lighting.mode='first'",
        "lighting.grid=24",
    ];
    let overrides: Vec<String> = all.iter().chain(overrides).map(|o| (*o).to_owned()).collect();
    let scene = Arc::new(scene_file::load(&file, &overrides, None).expect("the scene").scene);
    let mut renderer = Renderer::new(&gpu.device, &gpu.compiler, &scene, true).expect("a renderer");
    let mut game = Game::new(scene.clone(), None);
    let (mut values, mut shown) = (vec![], false);
    for i in range {
        let done = renderer.step(game.step(i).expect("a packet")).expect("a frame");
        assert!(
            done.plan.runs(Pass::Sprites) || overrides.contains(&"draw.path='tiles'".to_owned())
        );
        shown = done.plan.runs(Pass::Impostors);
        values.extend(renderer.image().expect("pixels").into_iter().map(f64::from));
    }
    (values, shown)
}

/// The greatest difference, as a share of the greatest number.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    let most = a.iter().copied().fold(0.0, f64::max);
    assert!(a.len() == b.len() && most > 0.1);
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / most
}

/// A cloud over surfaces, and one seen through impostors, through the whole frame: the picture of
/// other ways but for rounding, with culling or without, whole or smaller. Some hundred layers of
/// f32.
#[test]
fn frames_are_those_of_other_ways() {
    let gpu = Gpu::new();
    for resolution in ["draw.resolution=1.0", "draw.resolution=0.5"] {
        let of = |more: &[&str]| {
            frames(
                &gpu,
                "ground.toml",
                0..1,
                &[&["film.width=96", "film.height=72", resolution], more].concat(),
            )
            .0
        };
        let sprites = of(&[]);
        assert!(apart(&sprites, &of(&["draw.cutoff=0.5"])) > 0.01, "there is a cloud");
        for more in [
            &["draw.path='tiles'"][..],
            &["draw.chunks=1"],
            &["draw.chunks=6"],
            &["draw.chunks=6", "draw.cull='off'"],
        ] {
            let off = apart(&sprites, &of(more));
            println!("{resolution}, {more:?}: {off:.1e}");
            assert!(off < 1e-5, "{resolution} {more:?}: {off:e}");
        }
    }
    // In a smaller one a shell would save nothing.
    let large =
        ["film.width=320", "film.height=240", "draw.impostors='on'", "draw.impostor_error=2"];
    let of = |chunks| frames(&gpu, "through-615.toml", 217..221, &[&large[..], &[chunks]].concat());
    let ((sprites, _), (chunks, shown)) = (of("draw.chunks=0"), of("draw.chunks=4"));
    let off = apart(&sprites, &chunks);
    println!("over a shell: {off:.1e}");
    assert!(shown && off < 1e-5, "{shown} {off:e}");
}
