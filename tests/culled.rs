//! Whole frames with and without culling: the same bytes, and the f64 reference's picture; and what
//! a smallest size changes.

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

use std::fmt::Write;
use std::sync::Arc;

use bounded::{Random, greatest_ratio};
use glam::DVec3;
use harness::{Gpu, assert_within};
use nimbus::frame::Game;
use nimbus::frame::Renderer;
use nimbus::frame::saturation_bound;
use nimbus::gpu::Compiler;
use nimbus::io::scene_file;
use nimbus::model::film::FilmFormat;
use nimbus::model::scene::Scene;
use nimbus::model::sort_bits::SortBits;
use nimbus::reference::composite::OpaquePixel;
use nimbus::reference::sort::order;
use nimbus::reference::threshold::omitted;
use nimbus::reference::view::View;
use picture::Picture;

const FORMAT: FilmFormat = FilmFormat::Rgba32f;

/// The particles in a list, seen from `eye` toward `target`.
fn scene(
    particles: &[([f32; 3], f32, f32)],
    [eye, target]: [DVec3; 2],
    overrides: &[String],
) -> Scene {
    let dir = tempfile::tempdir().expect("a folder");
    let mut list = "x,y,z,radius,kappa,r,g,b\n".to_owned();
    for (i, ([x, y, z], sigma, kappa)) in particles.iter().enumerate() {
        let shade = 0.5 + 0.4 * (i as f32).sin();
        writeln!(list, "{x},{y},{z},{},{kappa},1.0,{shade},{}", 3.0 * sigma, 1.5 - shade)
            .expect("a line");
    }
    std::fs::write(dir.path().join("list.csv"), list).expect("a list");
    let (eye, target) = (eye.to_array(), target.to_array());
    let text = format!(
        "[film]\nwidth = 60\nheight = 45\nformat = 'rgba32f'\n[camera]\nposition = {eye:?}\ntarget \
         = {target:?}\nnear = 0.25\n\
         [lighting]\nmode = 'none'\n[[cloud]]\nfrom = 'particles'\nfile = 'list.csv'\n"
    );
    let path = dir.path().join("s.toml");
    std::fs::write(&path, text).expect("a scene");
    scene_file::load(&path, overrides, None).expect("the scene loads").scene
}

/// A frame: its bytes, its numbers, how many were kept, and what the reference draws.
struct Frame {
    bytes: Vec<u8>,
    values: Vec<f64>,
    n_kept: Option<u32>,
    picture: Picture,
}

fn frame(gpu: &Gpu, compiler: &Compiler, scene: &Scene) -> Frame {
    let scene = Arc::new(scene.clone());
    let mut renderer = Renderer::new(&gpu.device, compiler, &scene, true).expect("a renderer");
    // The groups are all drawn, so that what is left out is the device's doing.
    let packet = Game::new(scene.clone(), None).with_culling(false).step(0).expect("a packet");
    let (camera, radius) = (packet.camera, packet.radius);
    let n_kept = renderer.step(packet).expect("a frame").n_kept;
    let eye = DVec3::from(camera.eye.map(f64::from));
    let key = scene.camera.keys[0];
    let fov_y_deg = scene.camera.fov_y_rad.to_degrees();
    let mut picture =
        Picture::new(eye, eye + key.target - key.position, fov_y_deg, scene.camera.near);
    let draw = &scene.draw;
    picture.view = View {
        width: scene.film.width,
        height: scene.film.height,
        edge: draw.edge(),
        smallest: draw.smallest.bound(),
        ..picture.view
    };
    picture.placed = renderer.placed(&gpu.device).expect("places");
    picture.particles = renderer.generate_now(&gpu.device).expect("particles").0;
    if scene.draw.sort_bits == SortBits::Narrow {
        // As the device rounds it: along an axis the depth itself is exact.
        assert_eq!(camera.forward, [0.0, 0.0, -1.0]);
        let steps = (65536.0 / (2.0 * radius)) as f32;
        let key = |z: f32| ((radius as f32 + z) * steps).clamp(0.0, 65535.0) as u32;
        picture.in_order =
            Some(order(&picture.placed.iter().map(|p| key(p.position[2])).collect::<Vec<_>>()));
    }
    let values = renderer.image().expect("pixels").into_iter().map(f64::from).collect();
    Frame { bytes: renderer.image_bytes().expect("bytes"), values, n_kept, picture }
}

/// Ways to draw, as scenes have them: path, chunks.
const WAYS: [(&str, &str); 3] = [("'sprites'", "0"), ("'sprites'", "5"), ("'tiles'", "0")];

fn truth(picture: &Picture, way: (&str, &str)) -> (Vec<f64>, Vec<f64>) {
    match way {
        ("'tiles'", _) => picture.tiled_truth(FORMAT, saturation_bound(FORMAT)),
        (_, "0") => picture.truth(FORMAT),
        _ => picture.chunked_truth(FORMAT, saturation_bound(FORMAT)),
    }
}

/// Blobs all around an eye at z = 0 that looks along −z: before and behind it, some around it, some
/// beside the picture, some just before and just beyond the near plane; by fours at one depth, by
/// sevens at one place.
fn around(seed: u64) -> Vec<([f32; 3], f32, f32)> {
    let mut random = Random(seed);
    let mut all: Vec<([f32; 3], f32, f32)> = vec![];
    for i in 0..260 {
        let mut within = |low: f64, high: f64| random.within(low, high);
        let mut at = [within(-3.0, 3.0), within(-3.0, 3.0), within(-5.0, 3.0)];
        at[2] = match i {
            0..20 => -0.25 + 0.002 * (i as f32 - 9.5),
            _ if i % 4 != 0 => all[i - 1].0[2],
            _ => at[2],
        };
        at = if i % 7 == 6 { all[i - 1].0 } else { at };
        all.push((
            at,
            10f64.powf(f64::from(within(-3.0, -0.3))) as f32,
            10f64.powf(f64::from(within(-1.5, 1.0))) as f32,
        ));
    }
    all
}

fn set(of: &[(&str, &str)]) -> Vec<String> {
    of.iter().map(|(key, value)| format!("draw.{key}={value}")).collect()
}

#[test]
fn culled_frames_are_the_references_and_the_same_bytes() {
    let gpu = Gpu::new();
    let list = around(1);
    for way in WAYS {
        for bits in ["16", "32"] {
            let of = |cull: &str| {
                let (path, chunks) = (("path", way.0), ("chunks", way.1));
                let overrides = set(&[
                    path,
                    chunks,
                    ("sort_bits", bits),
                    ("cull", cull),
                    ("threshold", "0.001"),
                ]);
                frame(&gpu, &gpu.compiler, &scene(&list, [DVec3::ZERO, DVec3::NEG_Z], &overrides))
            };
            let (on, off) = (of("'on'"), of("'off'"));
            let what = format!("{way:?}, {bits} bits");
            // Chunks begin elsewhere, and so does what full pixels leave out.
            assert!(on.bytes == off.bytes || way.1 != "0", "{what}: not the same bytes");
            let (truths, bounds) = truth(&on.picture, way);
            assert_within(&what, &on.values, &truths, &bounds);
            assert_within(&what, &off.values, &truths, &bounds);
            println!(
                "{what}: {:?} kept, error/bound {:.3}",
                on.n_kept,
                greatest_ratio(&on.values, &truths, &bounds)
            );
            let n_kept = on.n_kept.expect("a count");
            assert!(off.n_kept.is_none() && (20..200).contains(&n_kept), "{what}: {n_kept}");
            assert!(truths.iter().filter(|v| **v > 0.1).count() > 1000, "{what}: an empty picture");
        }
    }
}

/// Blobs in the margin of a smaller picture belong to it.
#[test]
fn smaller_pictures_keep_what_their_own_pixels_show() {
    let gpu = Gpu::new();
    let list = around(3);
    for name in ["'sprites'", "'tiles'"] {
        let of = |cull: &str, resolution: &str| {
            let overrides = set(&[("path", name), ("cull", cull), ("resolution", resolution)]);
            frame(&gpu, &gpu.compiler, &scene(&list, [DVec3::ZERO, DVec3::NEG_Z], &overrides))
        };
        let (full, small) = (of("'on'", "1.0"), of("'on'", "0.25"));
        assert!(small.bytes == of("'off'", "0.25").bytes, "{name}: not the same bytes");
        assert!(
            small.bytes != full.bytes && small.n_kept != full.n_kept,
            "{:?} {:?}",
            small.n_kept,
            full.n_kept
        );
    }
}

#[test]
fn wrong_frames_are_noticed() {
    let gpu = Gpu::new();
    let list = around(2);
    // Sprites of a picture this small are points on a CPU, and quads on GPUs.
    let (drawn, half) = match gpu.device.info().kind {
        "cpu" => ("uvec4(n, 1, 0, 0)", "uvec4(n / 2u, 1, 0, 0)"),
        _ => ("uvec4(4, n, 0, 0)", "uvec4(4, n / 2u, 0, 0)"),
    };
    for (name, file, from, to) in [
        ("'sprites'", "cull_test.comp", "GROWTH * reach * sigma", "0.8 * reach * sigma"),
        ("'tiles'", "cull_test.comp", "pixels.x < pixels.y", "pixels.x + 9u < pixels.y"),
        ("'sprites'", "cull_scan.comp", drawn, half),
        ("'tiles'", "cull_scan.comp", "n = before;", "n = before / 2u;"),
        ("'sprites'", "include/depths.glsl", "dot(push.from", "-dot(push.from"),
    ] {
        let of = scene(&list, [DVec3::ZERO, DVec3::NEG_Z], &set(&[("path", name)]));
        let right = frame(&gpu, &gpu.compiler, &of);
        let wrong = frame(&gpu, &Gpu::wrong_compiler(file, from, to), &of);
        assert!(right.bytes != wrong.bytes, "{from} as {to}");
    }
}

/// Of each of a pixel's numbers how much what is left out may change it: what is met is of
/// radiances and of nothing.
fn changes(picture: &Picture) -> Vec<f64> {
    let behind = vec![OpaquePixel::EMPTY; (picture.view.width * picture.view.height) as usize];
    let most = picture.radiance().into_iter().fold(DVec3::ZERO, DVec3::max).to_array();
    let cut = omitted(&picture.view, &behind, &picture.blobs(), None);
    cut.iter().flat_map(|c| [most[0], most[1], most[2], 1.0].map(|s| c.share() * s)).collect()
}

/// Random scenes and cameras drawn with what `on` and with what `off` says, which draws all that
/// `on` does: no number differs by more than what is left out may change. How many particles are
/// left out, how many numbers change, and by how much of that bound at most.
fn compare(
    gpu: &Gpu,
    sets: impl Fn(&mut Random) -> [Vec<(&'static str, String)>; 2],
) -> (u32, usize, f64) {
    let (mut n_changed, mut closest, mut n_left) = (0, 0f64, 0);
    for seed in 1..=5 {
        let mut random = Random(100 + seed);
        let mut point =
            |reach: f64| DVec3::from([0; 3].map(|_| f64::from(random.within(-reach, reach))));
        let (seen, list) = ([point(1.0), point(4.0)], around(seed));
        let sets = sets(&mut random);
        for way in WAYS {
            let what = format!("{seed}, {way:?}, {:?}", sets[0]);
            let of = |keys: &[(&str, String)]| {
                let keys: Vec<(&str, &str)> =
                    keys.iter().map(|(key, value)| (*key, value.as_str())).collect();
                let overrides = [set(&[("path", way.0), ("chunks", way.1)]), set(&keys)].concat();
                let frame = frame(gpu, &gpu.compiler, &scene(&list, seen, &overrides));
                let (truths, bounds) = truth(&frame.picture, way);
                assert_within(&what, &frame.values, &truths, &bounds);
                (frame, truths, bounds)
            };
            let (on, off) = (of(&sets[0]), of(&sets[1]));
            let n_kept = |frame: &Frame| frame.n_kept.unwrap_or(list.len() as u32);
            n_left += n_kept(&off.0) - n_kept(&on.0);
            let changes = changes(&on.0.picture);
            let exact: Vec<f64> = changes.iter().map(|c| c + 1e-13).collect();
            assert_within(&format!("{what}, true numbers"), &on.1, &off.1, &exact);
            let allowed: Vec<f64> =
                (0..changes.len()).map(|i| changes[i] + on.2[i] + off.2[i]).collect();
            assert_within(&format!("{what}, as drawn"), &on.0.values, &off.0.values, &allowed);
            let changed: Vec<usize> =
                (0..changes.len()).filter(|i| (on.1[*i] - off.1[*i]).abs() > 1e-6).collect();
            closest = changed
                .iter()
                .map(|&i| (on.1[i] - off.1[i]).abs() / changes[i])
                .fold(closest, f64::max);
            n_changed += changed.len();
        }
    }
    println!("{n_left} left out, {n_changed} numbers changed, up to {closest:.3} of what may be");
    (n_left, n_changed, closest)
}

#[test]
fn a_smallest_size_changes_no_more_than_it_leaves_out() {
    let (n_left, n_changed, closest) = compare(&Gpu::new(), |random| {
        let smallest = random.within(0.3, 6.0).to_string();
        // The threshold cuts both.
        let of =
            |smallest: String| vec![("smallest", smallest), ("threshold", "0.0005".to_owned())];
        [of(smallest), of("0".to_owned())]
    });
    // The bound is met: a single layer before nothing.
    assert!(n_left > 60 && n_changed > 1000 && closest > 0.5 && closest <= 1.0 + 1e-6);
}

#[test]
fn all_that_leaves_out_together_changes_no_more_than_it_says() {
    let (n_left, n_changed, closest) = compare(&Gpu::new(), |random| {
        let [smallest, threshold] =
            [random.within(0.3, 4.0), random.within(0.001, 0.02)].map(|v| v.to_string());
        let on =
            vec![("cull", "'on'".to_owned()), ("smallest", smallest), ("threshold", threshold)];
        [on, vec![("cull", "'off'".to_owned())]]
    });
    assert!(n_left > 60 && n_changed > 10_000 && closest > 0.5 && closest <= 1.0 + 1e-6);
}
