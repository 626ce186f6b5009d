//! surfaces: whole pictures of rectangles against the f64 reference, alone and under sprites,
//! within a bound derived pixel by pixel. Where rounding decides what a pixel shows it must show
//! one of the candidates; such pixels are counted.

mod with_sprites;

use crate::bounded::greatest_ratio;
use crate::harness::{Gpu, assert_within};
use crate::picture::{FORMATS, Picture};
use crate::scenery::{Candidates, Scenery};
use glam::DVec3;
use nimbus::error::Error;
use nimbus::gpu::TargetFormat;
use nimbus::gpu::{Barriers, BlendMode, Image, LoadOp, Primitives, RecordCount, Target};
use nimbus::layout::facet::LitRecord;
use nimbus::layout::frame::CameraRecord;
use nimbus::model::film::FilmFormat;
use nimbus::passes::blobs::{BlobBuffers, BlobCount, BlobVariant, BlobView};
use nimbus::passes::sprites::Sprites;
use nimbus::passes::surfaces::Surfaces;

const EYE: DVec3 = DVec3::new(0.3, -0.2, 5.0);

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Looks along −z.
fn front(near: f64, scenery: Scenery) -> Picture {
    Picture { scenery: Some(scenery), ..Picture::new(EYE, EYE - DVec3::Z, 45.0, near) }
}

/// The greatest error/bound of a pixel against the candidate that suits it best, the worst pixel's.
fn worst(values: &[f64], candidates: &[Candidates]) -> f64 {
    let pixel = |(value, of): (&[f64], &Candidates)| {
        of.iter().map(|c| greatest_ratio(value, &c.color, &c.bound)).fold(f64::INFINITY, f64::min)
    };
    values.chunks(4).zip(candidates).map(pixel).fold(0.0, f64::max)
}

/// The result of a picture of surfaces.
struct Shown {
    /// Share of the pixels that show a surface, of its front where `lit`.
    covered: f64,
    lit: f64,
    n_apart: usize,
}

/// Draws `picture`, which has no particles, in both formats and compares every pixel.
///
/// Of pixels with several candidates there is at most one a line on average: a line crosses at most
/// width + height = 280 rows and columns, in each it passes the nearest pixel's centre at a
/// distance spread evenly over half a pixel, and in these pictures rounding moves it by 1e-4 pixels
/// or less: 0.1 pixels a line are expected.
fn compare(gpu: &mut Gpu, what: &str, picture: &Picture) -> Shown {
    let scenery = picture.scenery.as_ref().expect("rectangles");
    let mut shown = Shown { covered: 0.0, lit: 0.0, n_apart: 0 };
    for (target, format) in FORMATS {
        let candidates = picture.behind(format);
        let n_apart = candidates.iter().filter(|c| c.len() > 1).count();
        let values = picture.draw(gpu, None, target);
        let ratio = worst(&values, &candidates);
        println!(
            "{what}, {format:?}: error/bound {ratio:.3}; {n_apart} pixels with several candidates"
        );
        assert!(ratio <= 1.0, "{what}, {format:?}: error/bound {ratio}");
        assert!(n_apart <= scenery.n_lines(), "{what}: {n_apart} pixels with several candidates");
        let share = |f: &dyn Fn(&Candidates) -> bool| {
            candidates.iter().filter(|c| f(c)).count() as f64 / candidates.len() as f64
        };
        shown = Shown {
            covered: share(&|c| c[0].color[3] > 0.0),
            lit: share(&|c| c[0].color[0] > 0.0),
            n_apart,
        };
    }
    shown
}

#[test]
fn one_rectangle_from_before_and_behind() {
    let mut gpu = Gpu::new();
    // Turned about two axes; u ⟂ v.
    let (u, w) = (v(1.1, 0.3, 0.4), v(-0.3, 0.9, 0.15));
    for subdivide in [[1, 1], [5, 3], [1, 64], [512, 2]] {
        let scenery = Scenery::default().rectangle(v(0.2, -0.1, 0.5), u, w, subdivide);
        let shown = compare(&mut gpu, &format!("front {subdivide:?}"), &front(0.1, scenery));
        assert!(shown.covered > 0.2 && shown.covered == shown.lit);
    }
    let back = Scenery::default().rectangle(v(0.2, -0.1, 0.5), w, u, [5, 3]);
    let shown = compare(&mut gpu, "back", &front(0.1, back));
    assert!(shown.covered > 0.2 && shown.lit == 0.0);
    // Not quite square, as typed digits leave it.
    let scenery = Scenery::default().rectangle(v(0.2, -0.1, 0.5), u, w + 1e-6 * u, [5, 3]);
    assert!(compare(&mut gpu, "not quite square", &front(0.1, scenery)).covered > 0.2);
}

#[test]
fn nearer_rectangles_hide_farther_ones() {
    let mut gpu = Gpu::new();
    let wall = |s: Scenery, x: f64, z: f64| {
        s.rectangle(v(x, 0.1, z), v(1.0, 0.1, 0.0), v(-0.1, 1.0, 0.0), [4, 4])
    };
    for depths in [[1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [0.0, 1.0, -1.0]] {
        let scenery =
            wall(wall(wall(Scenery::default(), 0.0, depths[0]), 0.5, depths[1]), -0.7, depths[2]);
        // Two that go through all of them and each other, one of them seen from behind.
        let scenery =
            scenery.rectangle(v(0.1, 0.0, 0.0), v(0.9, 0.1, 1.7), v(0.1, -0.9, 0.0), [3, 7]);
        let scenery =
            scenery.rectangle(v(0.1, 0.2, 0.0), v(-1.2, 0.3, 2.0), v(0.3, 1.2, 0.0), [2, 2]);
        let shown = compare(&mut gpu, &format!("{depths:?}"), &front(0.1, scenery));
        assert!(shown.covered > 0.4 && shown.lit > 0.1 && shown.lit < shown.covered - 0.1);
    }
}

#[test]
fn of_equally_near_rectangles_the_last_is_seen() {
    let mut gpu = Gpu::new();
    let (center, u, w) = (v(0.2, -0.1, 0.5), v(1.1, 0.3, 0.4), v(-0.3, 0.9, 0.15));
    let one = Scenery::default().rectangle(center, u, w, [3, 3]);
    let two = one.clone().rectangle(center, u, w, [5, 4]);
    let (one, two) = (front(0.1, one), front(0.1, two));
    assert!(compare(&mut gpu, "twice the same", &two).n_apart <= 4);
    let [a, b] = [&one, &two].map(|p| p.draw(&mut gpu, None, TargetFormat::Rgba32f));
    let n_other = a.chunks(4).zip(b.chunks(4)).filter(|(a, b)| a != b).count();
    let n_covered = b.chunks(4).filter(|p| p[3] > 0.0).count();
    assert_eq!(n_other, n_covered, "the first is seen nowhere");
    // A hair before and behind, 1e-4 of 5: the depths' rounding is some 1e-6.
    for (offset, is_first) in [(5e-4, false), (-5e-4, true)] {
        let hair =
            one.scenery.clone().expect("one").rectangle(center + v(0.0, 0.0, offset), u, w, [5, 4]);
        let hair = front(0.1, hair);
        assert!(compare(&mut gpu, "a hair apart", &hair).covered > 0.2);
        let middle = 4 * (60 * 160 + 80);
        let c = hair.draw(&mut gpu, None, TargetFormat::Rgba32f);
        assert_eq!(c[middle..middle + 4] == a[middle..middle + 4], is_first);
    }
}

/// Runs from behind the eye far before it, rolled, through a near plane that stands far off.
fn through_near_plane() -> Picture {
    let scenery = Scenery::default().rectangle(
        v(0.3, -1.0, 3.0),
        v(2.0, 0.5, 0.0),
        v(-0.6, 2.4, -9.0),
        [3, 9],
    );
    front(3.0, scenery)
}

#[test]
fn the_near_plane_cuts_through() {
    let mut gpu = Gpu::new();
    let cut = compare(&mut gpu, "through the near plane", &through_near_plane());
    let mut whole = through_near_plane();
    (whole.camera.near, whole.view.near) = (0.01, 0.01);
    let whole = compare(&mut gpu, "the same with a near plane close by", &whole);
    assert!(cut.covered > 0.02 && whole.covered > cut.covered + 0.05);
    // 1e-4 from a near plane at 1: the depth's rounding is some 1e-6.
    for (z, is_seen) in [(0.9999, false), (1.0001, true), (-1.0, false)] {
        let wall = Scenery::default().rectangle(EYE - v(0.02, 0.01, z), DVec3::X, DVec3::Y, [2, 2]);
        assert_eq!(
            compare(&mut gpu, &format!("a wall at {z}"), &front(1.0, wall)).covered > 0.5,
            is_seen
        );
    }
}

#[test]
fn edge_on_there_is_nothing_to_see() {
    let mut gpu = Gpu::new();
    // The eye's height is a number of f32 too: the plane holds the eye and meets the screen between
    // two rows.
    let height = f64::from(EYE.y as f32);
    let floor = |y: f64| {
        Scenery::default().rectangle(v(0.0, y, 0.0), v(0.0, 0.0, 3.0), v(2.0, 0.0, 0.0), [3, 3])
    };
    let mut picture = front(0.1, floor(height));
    picture.view.pose.position.y = height;
    let shown = compare(&mut gpu, "edge on", &picture);
    assert!(shown.covered == 0.0 && shown.n_apart == 0);
    // Just off its plane, above and below: a few rows, at the greatest slant.
    for (y, is_lit) in [(height - 0.05, true), (height + 0.05, false)] {
        let shown = compare(&mut gpu, "nearly edge on", &front(0.1, floor(y)));
        assert!(shown.covered > 0.003 && (shown.lit > 0.0) == is_lit);
    }
}

/// The inside of a box around the eye: its walls' fronts.
fn room(half: f64) -> Scenery {
    let walls = [(DVec3::X, DVec3::Y), (DVec3::Y, DVec3::Z), (DVec3::Z, DVec3::X)];
    let both = walls.into_iter().flat_map(|(u, v)| [(u, v), (v, u)]);
    both.fold(Scenery::default(), |s, (u, v)| {
        s.rectangle(-half * u.cross(v), half * u, half * v, [4, 5])
    })
}

#[test]
fn a_room_all_around() {
    let mut gpu = Gpu::new();
    for (half, target) in
        [(6.0, v(3.0, 1.0, 0.0)), (6.0, v(0.5, 7.0, 6.0)), (1000.0, v(-2.0, -1.0, 9.0))]
    {
        let picture = Picture::new(EYE, target, 120.0, 0.1);
        let shown = compare(&mut gpu, "a room", &Picture { scenery: Some(room(half)), ..picture });
        assert!(shown.covered == 1.0 && shown.lit == 1.0);
    }
}

#[test]
fn tiny_and_huge_rectangles() {
    let mut gpu = Gpu::new();
    // A floor to the horizon, its corners off the screen by 1e4 to 1e9 screens; f32 knows the near
    // plane at its corners no more.
    for half in [1e4, 1e6, 1e15] {
        let floor = |s: Scenery| {
            s.rectangle(v(0.0, -3.0, 0.0), v(0.0, 0.0, half), v(half, 0.0, 0.0), [2, 3])
        };
        let picture = front(0.1, floor(Scenery::default()));
        assert!(compare(&mut gpu, &format!("a floor of {half:e}"), &picture).covered > 0.4);
        // Something stands on it, and sinks into it.
        let on = floor(Scenery::default()).rectangle(
            v(0.4, -2.9, -1.0),
            v(0.8, 0.0, 0.3),
            v(0.0, 0.7, 0.0),
            [2, 2],
        );
        assert!(
            compare(&mut gpu, &format!("on a floor of {half:e}"), &front(0.1, on)).covered > 0.4
        );
    }
    // Pixels of 0.0345 at depth 5: on a pixel's ray, and between four.
    let view = front(0.1, Scenery::default()).view;
    let small = |at: DVec3, half: f64| {
        Scenery::default().rectangle(at, half * DVec3::X, half * DVec3::Y, [2, 2])
    };
    let on = small(EYE + 5.0 * view.ray(100, 30), 0.001);
    assert_eq!(compare(&mut gpu, "sub-pixel on a ray", &front(0.1, on)).covered, 1.0 / 19200.0);
    let between = small(EYE + 2.5 * (view.ray(100, 30) + view.ray(101, 31)), 0.001);
    assert_eq!(compare(&mut gpu, "sub-pixel between rays", &front(0.1, between)).covered, 0.0);
    let least = small(EYE + 2.5 * (view.ray(100, 30) + view.ray(101, 31)), 1e-15);
    assert_eq!(compare(&mut gpu, "the least", &front(0.1, least)).covered, 0.0);
    let far = small(v(3e14, 1e14, -1e15), 2e14);
    assert!(compare(&mut gpu, "far off", &front(0.1, far)).covered > 0.05);
}

/// Blobs before, among and behind three walls and a floor, some cut by them, in lit colours.
/// Replaces `from` by `to` in `file` and gives what is drawn then.
fn draw_wrong(gpu: &mut Gpu, picture: &Picture, (file, from, to): (&str, &str, &str)) -> Vec<f64> {
    picture.draw(gpu, Some(&Gpu::wrong_compiler(file, from, to)), TargetFormat::Rgba32f)
}

#[test]
fn wrong_pictures_are_noticed() {
    let mut gpu = Gpu::new();
    // A rectangle that the near plane cuts, and two more that cross, one of them seen from behind.
    let mut picture = through_near_plane();
    let scenery = picture.scenery.take().expect("one");
    let scenery = scenery.rectangle(v(-0.5, 0.3, 0.0), v(0.5, 0.2, 1.0), v(-0.2, 0.9, 0.0), [3, 4]);
    let scenery = scenery.rectangle(v(-0.4, 0.5, 0.2), v(-0.8, 0.1, 1.0), v(0.1, 0.8, 0.0), [2, 1]);
    picture.scenery = Some(scenery);
    let candidates = picture.behind(FilmFormat::Rgba32f);
    let mut values = picture.draw(&mut gpu, None, TargetFormat::Rgba32f);
    assert!(worst(&values, &candidates) <= 1.0);
    let lit = (0..candidates.len())
        .find(|i| candidates[*i].len() == 1 && candidates[*i][0].color[0] > 0.0);
    let lit = lit.expect("a lit pixel");
    for wrong in [values[4 * lit] + 2.0 * candidates[lit][0].bound[0], f64::NAN] {
        values[4 * lit] = wrong;
        assert!(worst(&values, &candidates) > 1.0, "one corrupted number");
    }
    for wrong in [
        ("surfaces.frag", "vec2(n) - 0.5", "vec2(n) - 0.4999"),
        ("surfaces.frag", "(0.5 * st + 0.5)", "(0.5 * st.yx + 0.5)"),
        ("surfaces.frag", "share.y);", "share.x);"),
        ("surfaces.frag", "lit[i].first + lit[i].second", "lit[i].first"),
        ("surfaces.frag", "abs(s) <= in_s.w * size", "abs(s) <= 0.98 * in_s.w * size"),
        ("surfaces.frag", "abs(t) <= in_t.w * size", "true"),
        ("surfaces.frag", " && q >= push.camera.near * size", ""),
        ("surfaces.frag", "in_plane.w > 0.0", "in_plane.w < 0.0"),
        (
            "surfaces.frag",
            "min(push.camera.near * size / q, 1.0)",
            "1.0 - min(push.camera.near * size / q, 1.0)",
        ),
        ("surfaces.frag", "regions[in_i]", "regions[in_i / 2]"),
        ("surfaces.vert", "-corner.y", "corner.y"),
        ("surfaces.vert", "+ SNAP * push.pixel", "- 8.0 * push.pixel"),
        ("surfaces.vert", "(a.z >= near) != (b.z >= near)", "false"),
        ("surfaces.vert", "if (a.z >= near) {", "if (false) {"),
        ("include/plane.glsl", "vec4(cross(c, u), length_v)", "vec4(cross(c, u), length_u)"),
    ] {
        let values = draw_wrong(&mut gpu, &picture, wrong);
        assert!(worst(&values, &candidates) > 1.0, "{} as {}", wrong.1, wrong.2);
    }
    let picture = with_sprites::clouded();
    let (truths, bounds) = picture.truth(FilmFormat::Rgba32f);
    for wrong in [
        (
            "sprites.vert",
            "min(push.camera.near / v.z, 1.0)",
            "min(1.1 * push.camera.near / v.z, 1.0)",
        ),
        ("sprites.vert", "push.i_first_facet + i", "i"),
        (
            "surfaces.frag",
            "gl_FragDepth = min(push.camera.near * size / q, 1.0)",
            "gl_FragDepth = 0.0",
        ),
    ] {
        let values = draw_wrong(&mut gpu, &picture, wrong);
        assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "{} as {}", wrong.1, wrong.2);
    }
}

#[test]
fn a_target_that_does_not_fit_is_refused() {
    let mut gpu = Gpu::new();
    let format = TargetFormat::Rgba16f;
    let variant = BlobVariant::default();
    let over = |blend| {
        let way = (blend, Primitives::Strips);
        Sprites::new(&gpu.device, &gpu.compiler, format, variant, way).expect("sprites")
    };
    let (alone, behind) = (over(BlendMode::Over), over(BlendMode::OverTested));
    let surfaces = Surfaces::new(&gpu.device, &gpu.compiler, format, false).expect("surfaces");
    let mut color =
        Image::color_target(&gpu.device, "test.target", 8, 4, format).expect("a target");
    let mut depth = Image::depth(&gpu.device, "test.depth", 8, 4).expect("depth");
    let mut other = Image::depth(&gpu.device, "test.depth", 8, 5).expect("depth");
    let buffer = gpu.buffer::<[u32; 64]>(1);
    let camera = CameraRecord { tan_x: 1.0, tan_y: 1.0, near: 1.0, ..CameraRecord::default() };
    let mut record = |pass: Option<&Sprites>, depth: Option<&mut Image>| {
        let target = Target { color: &mut color, depth };
        gpu.commands.record(Barriers::Placed, |rec| match pass {
            Some(pass) => {
                let start = if target.depth.is_some() { LoadOp::Load } else { LoadOp::Clear };
                let buffers = BlobBuffers {
                    entries: &buffer,
                    placed: &buffer,
                    particles: &buffer,
                    lit: &buffer,
                    i_facet: &buffer,
                    i_group: &buffer,
                    drawn: &buffer,
                    textured: &buffer,
                    pool: &buffer,
                    slopes: &buffer,
                    seen: &buffer,
                };
                let view = BlobView {
                    camera: &camera,
                    cutoff: 3.0,
                    threshold: 0.0,
                    least: 0.0,
                    saturated: 0.0,
                    slice: 0.0,
                    extents: None,
                    cells: None,
                };
                let count = BlobCount { n: RecordCount::Known(0), i_first_facet: 0 };
                pass.record(rec, &buffers, (target, start), &view, count)
            }
            None => surfaces.record(rec, [&buffer; 2], target, &camera, 0),
        })
    };
    let is_refused = |r: nimbus::error::Result<()>| matches!(r, Err(Error::Shader { .. }));
    assert!(is_refused(record(Some(&behind), None)) && is_refused(record(None, None)));
    assert!(is_refused(record(Some(&alone), Some(&mut depth))));
    assert!(
        is_refused(record(Some(&behind), Some(&mut other)))
            && is_refused(record(None, Some(&mut other)))
    );
    assert!(
        record(None, Some(&mut depth)).is_ok() && record(Some(&behind), Some(&mut depth)).is_ok()
    );
    assert!(record(Some(&alone), None).is_ok());
    // Too large an image is refused before it is allocated.
    let refused = Image::depth(&gpu.device, "test.wide", 10_000_000, 4).err().expect("refused");
    assert!(
        matches!(&refused, Error::Limit { what } if what.contains("test.wide: 10000000×4")),
        "{refused}"
    );
}
