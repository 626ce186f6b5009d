//! terrain: whole pictures of ground, colour and depth, against the f64 reference, within a bound
//! derived pixel by pixel. Where a rasteriser or rounding decides which triangle a pixel shows it
//! must show one of those around.

use crate::bounded::greatest_ratio;
use crate::grounds::{Candidate, Relief};
use crate::harness::Gpu;
use crate::picture::Picture;
use glam::DVec3;
use nimbus::gpu::{Buffer, Compiler, Image, LoadOp, MemoryUsage, Target};
use nimbus::gpu::{TargetFormat, has_depth24};
use nimbus::layout::facet::{FacetRecord, RegionRecord};
use nimbus::model::cloud::Shapes;
use nimbus::passes::facets::Facets;
use nimbus::passes::terrain::{Piece, Terrain};

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Colour and near/z of every pixel.
fn draw(
    gpu: &mut Gpu,
    compiler: Option<&Compiler>,
    picture: &Picture,
    relief: &Relief,
) -> Vec<[f64; 5]> {
    let format = TargetFormat::Rgba32f;
    let pass = Terrain::new(&gpu.device, compiler.unwrap_or(&gpu.compiler), format, false)
        .expect("terrain");
    let (width, height) = (picture.view.width, picture.view.height);
    let mut color =
        Image::color_target(&gpu.device, "test.target", width, height, format).expect("a target");
    let mut depth = Image::depth(&gpu.device, "test.depth", width, height).expect("depth");
    let n = (width * height) as usize;
    let buffer = |name, bytes: usize| {
        Buffer::new::<u8>(&gpu.device, name, bytes as u64, MemoryUsage::Readback)
    };
    let (colors, depths) =
        (buffer("test.colors", 16 * n).expect("room"), buffer("test.depths", 4 * n).expect("room"));
    let [regions, points, lit] =
        [gpu.upload(&relief.regions), gpu.upload(&relief.points), gpu.upload(&relief.lit)];
    let camera = picture.camera_record();
    gpu.run(|rec| {
        let mut start = LoadOp::Clear;
        for (region, i_region) in relief.regions.iter().zip(0u32..) {
            let target = Target { color: &mut color, depth: Some(&mut depth) };
            let n_cells = (region.n_u - 1) * (region.n_v - 1);
            let piece = Piece { i_region, i_first_ground: relief.n_before, n_cells };
            pass.record(rec, [&regions, &points, &lit], (target, start), &camera, piece)?;
            start = LoadOp::Load;
        }
        rec.copy_image(&mut color, &colors);
        rec.copy_image(&mut depth, &depths);
        Ok(())
    });
    let colors = colors.read::<[f32; 4]>(n).expect("colours");
    let depths = depths.read::<u32>(n).expect("depths");
    let depth = |bits: u32| match has_depth24(&gpu.device) {
        true => f64::from(bits & 0xFF_FFFF) / f64::from(0xFF_FFFFu32),
        false => f64::from(f32::from_bits(bits)),
    };
    let pixel = |([r, g, b, a], z): (&[f32; 4], &u32)| {
        let [r, g, b, a] = [*r, *g, *b, *a].map(f64::from);
        [r, g, b, a, depth(*z)]
    };
    colors.iter().zip(&depths).map(pixel).collect()
}

/// The values that each pixel may show, its depth as rounded as the device keeps it.
fn may_show(gpu: &Gpu, picture: &Picture, relief: &Relief) -> Vec<Vec<Candidate>> {
    let mut candidates = relief.candidates(&picture.view, |i, j| picture.ray(i, j));
    let rounded = if has_depth24(&gpu.device) { 2f64.powi(-24) } else { 0.0 };
    candidates.iter_mut().flatten().for_each(|c| c.bounds[4] += rounded);
    candidates
}

/// The greatest error/bound of a pixel against the candidate that suits it best, the worst pixel's.
fn worst(values: &[[f64; 5]], candidates: &[Vec<Candidate>]) -> f64 {
    let pixel = |(value, of): (&[f64; 5], &Vec<Candidate>)| {
        of.iter().map(|c| greatest_ratio(value, &c.values, &c.bounds)).fold(f64::INFINITY, f64::min)
    };
    values.iter().zip(candidates).map(pixel).fold(0.0, f64::max)
}

/// Draws and compares; the share of the pixels that can show one thing alone, and of those that
/// surely show ground.
fn compare(gpu: &mut Gpu, what: &str, picture: &Picture, relief: &Relief) -> [f64; 2] {
    let candidates = may_show(gpu, picture, relief);
    let values = draw(gpu, None, picture, relief);
    let ratio = worst(&values, &candidates);
    let share = |f: &dyn Fn(&Vec<Candidate>) -> bool| {
        candidates.iter().filter(|c| f(c)).count() as f64 / candidates.len() as f64
    };
    let alone = share(&|c| c.len() == 1);
    let covered = share(&|c| c.iter().all(|c| c.values[3] == 1.0));
    println!(
        "{what}: error/bound {ratio:.3}; {:.1} % alone, {:.1} % covered",
        100.0 * alone,
        100.0 * covered
    );
    assert!(ratio <= 1.0, "{what}: error/bound {ratio}");
    [alone, covered]
}

/// Hills and valleys.
fn hills(x: f64, north: f64) -> f64 {
    0.4 * (1.3 * x).sin() * (0.9 * north + 0.4).cos() + 0.1 * (3.1 * x + north).sin()
}

fn hilly() -> Relief {
    Relief::after(5).ground(v(0.3, -0.2, -0.1), [13, 11], 0.5, hills)
}

#[test]
fn hills_from_all_sides() {
    let mut gpu = Gpu::new();
    let eyes = [
        v(0.3, 2.0, 5.0),
        v(5.0, 0.4, 0.2),
        v(0.2, 4.0, 0.1),
        v(-3.0, 1.0, -4.0),
        v(0.4, 0.5, 0.3),
    ];
    for (eye, target) in
        eyes.into_iter().flat_map(|e| [(e, v(0.1, 0.0, 0.0)), (e, v(1.5, 0.1, -1.0))])
    {
        let [alone, covered] = compare(
            &mut gpu,
            &format!("from {eye}"),
            &Picture::new(eye, target, 45.0, 0.1),
            &hilly(),
        );
        // A triangle of an edge of 20 pixels has a rim of 1/16 pixel along its sides: 1 to 3 % of
        // its area; of 5 pixels 10 %.
        assert!(alone > 0.7 && covered > 0.05, "{alone} {covered}");
    }
    // From below: black, and it hides.
    let below = Picture::new(v(0.2, -4.0, 0.1), v(0.0, 0.0, 0.0), 45.0, 0.1);
    let [_, covered] = compare(&mut gpu, "from below", &below, &hilly());
    assert!(
        covered > 0.5 && draw(&mut gpu, None, &below, &hilly()).iter().all(|p| p[..3] == [0.0; 3])
    );
}

#[test]
fn the_near_plane_cuts_and_the_eye_may_be_underground() {
    let mut gpu = Gpu::new();
    for (eye, near) in [(v(0.2, 0.3, 2.0), 1.0), (v(0.2, 0.6, 0.4), 0.5), (v(0.2, -0.3, 0.4), 0.05)]
    {
        let picture = Picture::new(eye, eye + v(0.1, -0.4, -1.0), 70.0, near);
        let [_, covered] = compare(&mut gpu, &format!("{near} before {eye}"), &picture, &hilly());
        assert!(covered > 0.1);
    }
}

#[test]
fn grounds_of_kilometres_far_from_the_origin_and_two_at_once() {
    let mut gpu = Gpu::new();
    // A storm's: 48 by 48 points 10 km apart, the eye 100 km up.
    let wide = Relief::default().ground(v(2e4, 0.0, -3e4), [48, 48], 1e4, |x, north| {
        2000.0 * hills(1e-4 * x, 1e-4 * north)
    });
    let picture = Picture::new(v(4e4, 1e5, 2.5e5), v(1e5, 0.0, -1.3e5), 48.0, 100.0);
    assert!(compare(&mut gpu, "48 x 48", &picture, &wide)[1] > 0.4);
    // One through the other, and another that is a plain to the horizon.
    let two = hilly().ground(v(0.0, -0.1, 0.0), [2, 2], 40.0, |x, _| 0.01 * x).ground(
        v(0.5, 0.0, 0.5),
        [4, 3],
        0.7,
        |x, n| x * n,
    );
    let picture = Picture::new(v(0.3, 1.0, 5.0), v(0.1, 0.3, 0.0), 60.0, 0.1);
    assert!(compare(&mut gpu, "three", &picture, &two)[1] > 0.4);
    // A triangle without area draws nothing.
    let flat = Relief::default().ground(v(0.0, 0.0, 0.0), [3, 3], 0.0, |_, _| 0.0);
    assert_eq!(compare(&mut gpu, "a point", &picture, &flat), [1.0, 0.0]);
}

#[test]
fn wrong_pictures_are_noticed() {
    let mut gpu = Gpu::new();
    let two = hilly().ground(v(0.0, -0.1, 0.0), [5, 3], 3.0, |x, _| 0.05 * x);
    let pictures = [
        Picture::new(v(0.3, 1.0, 5.0), v(0.1, 0.0, 0.0), 45.0, 0.1),
        Picture::new(v(0.2, -4.0, 0.1), v(0.0, 0.0, 0.0), 45.0, 0.1),
    ];
    let candidates = pictures.each_ref().map(|p| may_show(&gpu, p, &two));
    let mut is_right = |compiler: Option<&Compiler>| {
        let of = |(p, c): (&Picture, &Vec<Vec<Candidate>>)| {
            worst(&draw(&mut gpu, compiler, p, &two), c) <= 1.0
        };
        pictures.iter().zip(&candidates).map(of).collect::<Vec<_>>().iter().all(|right| *right)
    };
    assert!(is_right(None));
    for (file, from, to) in [
        ("terrain.vert", "second ? 3u : 0u", "0u"),
        ("terrain.vert", "(k >> 1)", "(k & 1u)"),
        ("terrain.vert", "i_cell / n)", "i_cell / region.n_u)"),
        ("terrain.vert", "region.i_first_facet - push.i_first_ground", "0u"),
        (
            "terrain.vert",
            "radiance_of(region.i_first_facet + d)",
            "radiance_of(region.i_first_facet + b)",
        ),
        ("terrain.vert", "lit[i].first + lit[i].second", "lit[i].first"),
        ("terrain.vert", "region.center - push.camera.eye", "-push.camera.eye"),
        ("terrain.frag", "push.camera.near / z", "push.camera.near / in_depths.x"),
        ("terrain.frag", "in_plane.w > 0.0", "in_plane.w != 0.0"),
        ("terrain.frag", "in_along * s", "in_along * t"),
    ] {
        assert!(
            !is_right(Some(&Gpu::wrong_compiler(file, from, to))),
            "{file}: {to} was not noticed"
        );
    }
    // A pixel that shows something else, by a thousandth.
    let mut values = draw(&mut gpu, None, &pictures[0], &two);
    let lit = values.iter().rposition(|p| p[0] > 1.0).expect("ground");
    values[lit][0] *= 1.001;
    assert!(worst(&values, &candidates[0]) > 1.0);
}

#[test]
fn facets_lie_where_their_origins_are() {
    let mut gpu = Gpu::new();
    let relief = Relief::after(5).ground(v(1e3, 5.0, -7.0), [7, 5], 10.0, hills).ground(
        v(-4.0, 0.0, 2.0),
        [3, 9],
        2.0,
        hills,
    );
    let run = |gpu: &mut Gpu, compiler: Option<&Compiler>| -> Vec<FacetRecord> {
        let pass =
            Facets::new(&gpu.device, compiler.unwrap_or(&gpu.compiler), Shapes::Balls, false)
                .expect("facets");
        let (regions, points) = (gpu.upload(&relief.regions), gpu.upload(&relief.points));
        let n = relief.points.len() as u32;
        let facets = gpu.upload(&vec![FacetRecord::default(); (n + 5) as usize]);
        gpu.run(|rec| pass.record_terrain(rec, [&regions, &points, &facets], n, 5));
        gpu.download(&facets, (n + 5) as usize)
    };
    let is_right = |facets: &[FacetRecord]| {
        facets[..5] == [FacetRecord::default(); 5]
            && facets[5..].iter().zip(&relief.points).all(|(made, point)| {
                let region: &RegionRecord = &relief.regions[point.i_region as usize];
                // One sum, rounded.
                let expected = [0, 1, 2].map(|k| point.position[k] + region.center[k]);
                *made == FacetRecord { position: expected, ..*point }
            })
    };
    assert!(is_right(&run(&mut gpu, None)));
    let wrong = Gpu::wrong_compiler("facets_terrain.comp", "push.i_first_facet + i", "i");
    assert!(!is_right(&run(&mut gpu, Some(&wrong))));
}
