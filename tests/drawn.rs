//! The drawn part of clouds: groups out of view draw nothing and change no byte; counts by distance
//! are those of C (6), and the picture follows them without a step.

mod harness;

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use harness::Gpu;
use nimbus::frame::Game;
use nimbus::frame::Packet;
use nimbus::frame::Renderer;
use nimbus::frame::plan::Pass;
use nimbus::io::scene_file;
use nimbus::model::camera::CameraKey;
use nimbus::model::scene::Scene;
use nimbus::reference::count::{printed, weights};

/// Five clouds in a row along x, 12 apart, drifting, growing and stirred; one of them a list.
fn scene(overrides: &[&str]) -> Scene {
    let dir = tempfile::tempdir().expect("a folder");
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for file in ["cubes-554.dat", "hello.csv"] {
        std::fs::copy(scenes.join(file), dir.path().join(file)).expect("a copy");
    }
    let mut text =
        "[film]\nwidth = 160\nheight = 120\n[lighting]\nmode = 'first'\ngrid = 24\n".to_owned();
    for i in 0..5 {
        let (from, file) =
            if i == 2 { ("particles", "hello.csv") } else { ("boxes", "cubes-554.dat") };
        let x = 12 * i - 24;
        text += &format!("[[cloud]]\nfrom = '{from}'\nfile = '{file}'\nposition = [{x}, 0, 0]\n");
        text += "wind = [0.1, 0, 0]\ngust = 0.1\ngrow_to = 1.5\ngrow_time_s = 20\n";
    }
    let path = dir.path().join("s.toml");
    std::fs::write(&path, text).expect("a scene");
    let overrides: Vec<String> = overrides.iter().map(|s| (*s).to_owned()).collect();
    scene_file::load(&path, &overrides, None).expect("the scene loads").scene
}

fn looking(scene: &mut Scene, position: DVec3, target: DVec3) {
    scene.camera.keys = vec![CameraKey { time_s: 0.0, position, target }];
}

/// A frame's packet, its picture, and the passes that ran.
fn frame(renderer: &mut Renderer, game: &mut Game, i: u32) -> (Packet, Vec<u8>, Vec<&'static str>) {
    let packet = game.step(i).expect("a packet");
    let plan = renderer.step(packet.clone()).expect("a frame").plan;
    let ran = Pass::ALL.into_iter().filter(|p| plan.runs(*p)).map(Pass::name).collect();
    (packet, renderer.image_bytes().expect("bytes"), ran)
}

#[test]
fn leaving_out_what_is_out_of_view_changes_no_byte() {
    let gpu = Gpu::new();
    let ways = ["draw.path='tiles'", "draw.path='sprites'"];
    for (count, path) in [
        ("draw.count='all'", ways[0]),
        ("draw.count='distance'", ways[0]),
        ("draw.count='all'", ways[1]),
    ] {
        let mut scene =
            scene(&[count, path, "time.step_s=0.5", "draw.count_a=10", "draw.sort_bits=16"]);
        // Along the row, into a cloud and through it, turning away and back.
        let key = |time_s: f64, x: f64, z: f64, to: [f64; 3]| CameraKey {
            time_s,
            position: DVec3::new(x, 0.5, z),
            target: DVec3::from(to),
        };
        scene.camera.keys = vec![
            key(0.0, -20.0, 30.0, [-20.0, 0.0, 0.0]),
            key(2.0, 0.0, 10.0, [40.0, 0.0, 8.0]),
            key(4.0, 12.0, 2.0, [12.0, 0.0, -10.0]),
            key(6.0, 12.0, -1.0, [12.0, 0.0, -10.0]),
            key(7.0, 12.0, -8.0, [12.0, 0.0, -60.0]),
            key(9.0, 30.0, 0.3, [-20.0, 0.0, 0.0]),
        ];
        let scene = Arc::new(scene);
        let renderer =
            |skip| Renderer::new(&gpu.device, &gpu.compiler, &scene, skip).expect("a renderer");
        let (mut culled, mut whole) = (renderer(true), renderer(false));
        let (mut game, mut all) =
            (Game::new(scene.clone(), None), Game::new(scene.clone(), None).with_culling(false));
        let mut counts = vec![];
        for i in 0..20 {
            let (packet, bytes, _) = frame(&mut culled, &mut game, i);
            let (every, expected, _) = frame(&mut whole, &mut all, i);
            assert!(
                bytes == expected,
                "{count}, {path}, frame {i}: {} of {} drawn",
                packet.n_drawn,
                every.n_drawn
            );
            counts.push((packet.n_drawn, every.n_drawn));
        }
        // There were frames of all, of some and of none.
        assert!(
            counts.iter().any(|(n, all)| n == all) && counts.iter().any(|(n, _)| *n == 0),
            "{counts:?}"
        );
        assert!(counts.iter().filter(|(n, all)| 0 < *n && n < all).count() > 5, "{counts:?}");
    }
}

#[test]
fn looking_away_draws_nothing_and_lights_nothing_anew() {
    let gpu = Gpu::new();
    let still: Vec<String> = (0..5)
        .flat_map(|i| ["wind=[0,0,0]", "gust=0", "grow_to=1"].map(|s| format!("cloud.{i}.{s}")))
        .collect();
    let mut scene = scene(&still.iter().map(String::as_str).collect::<Vec<_>>());
    let key = |time_s, x: f64| CameraKey {
        time_s,
        position: DVec3::new(x, 0.0, 30.0),
        target: DVec3::new(x, 0.0, 0.0),
    };
    scene.camera.keys = vec![key(0.0, 0.0), key(1.0, 500.0)];
    scene.time.step_s = 1.0;
    let scene = Arc::new(scene);
    let mut renderer = Renderer::new(&gpu.device, &gpu.compiler, &scene, true).expect("a renderer");
    let mut game = Game::new(scene.clone(), None);
    let (packet, bytes, _) = frame(&mut renderer, &mut game, 0);
    assert!(packet.n_drawn > 0 && bytes.iter().any(|b| *b != 0));
    let (packet, bytes, ran) = frame(&mut renderer, &mut game, 1);
    assert!(packet.n_drawn == 0 && bytes.iter().all(|b| *b == 0));
    assert_eq!(ran, ["cull", "sort", "tiles"]);
}

#[test]
fn counts_are_those_of_the_formula() {
    for (normalised, conserve) in [(false, true), (true, true), (false, false)] {
        let flags = [
            format!("draw.count_normalised={normalised}"),
            format!("draw.count_conserve={conserve}"),
        ];
        let mut scene = scene(&[
            "draw.count='distance'",
            "draw.count_a=7",
            "draw.count_d0=2",
            &flags[0],
            &flags[1],
        ]);
        looking(&mut scene, DVec3::new(-24.0, 0.0, 9.0), DVec3::ZERO);
        let (groups, clouds) = (scene.groups(), scene.clouds.clone());
        let eye = scene.camera.keys[0].position;
        let mut game = Game::new(Arc::new(scene), None).with_culling(false);
        for time_s in [0.0, 13.0] {
            let packet = game.step_at(0, time_s).expect("a packet");
            let mut n_drawn = 0;
            for (group, drawn) in groups.iter().zip(&packet.drawn) {
                let cloud = &clouds[group.i_cloud];
                let d = (cloud.origin_at(time_s) + cloud.center() - eye).length();
                let s = nimbus::reference::place::scale(cloud, time_s);
                let expected =
                    weights(group.n_particles, printed(d / 2.0, s, 7.0, normalised), conserve);
                for (k, expected) in expected.iter().enumerate() {
                    let i = group.i_first + k as u32;
                    let weight = match i + 1 {
                        next if next < drawn.end => f64::from(drawn.kappa_scale),
                        next if next == drawn.end => {
                            f64::from(drawn.kappa_scale) * f64::from(drawn.last_weight)
                        }
                        _ => 0.0,
                    };
                    // Two f32 roundings; the last weight is a small difference of numbers as great
                    // as the group.
                    let bound = 2.1 * 2f64.powi(-24) * expected + 1e-12 * (1.0 + expected);
                    assert!(
                        (weight - expected).abs() <= bound,
                        "{i} at {d}: {weight} for {expected}"
                    );
                }
                let n = expected.iter().filter(|w| **w > 0.0).count() as u32;
                assert_eq!(
                    (drawn.end - group.i_first, drawn.shift.wrapping_add(group.i_first)),
                    (n, n_drawn)
                );
                n_drawn += n;
            }
            assert!(packet.n_drawn == n_drawn && n_drawn > 10, "{n_drawn}");
        }
    }
}

/// Greatest difference of two pictures' numbers.
fn difference(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn a_picture_follows_its_count_without_a_step() {
    let gpu = Gpu::new();
    let mut scene = scene(&["draw.count='distance'", "draw.count_a=9", "film.format='rgba32f'"]);
    looking(&mut scene, DVec3::new(0.0, 1.0, 30.0), DVec3::new(0.0, 1.0, 0.0));
    let scene = Arc::new(scene);
    let mut renderer = Renderer::new(&gpu.device, &gpu.compiler, &scene, true).expect("a renderer");
    // Light and places are those of one packet: what changes is the count alone.
    let packet = Game::new(scene.clone(), None).step(0).expect("a packet");
    let mut at = |scene: &Scene, z: f64| {
        let mut moved = scene.clone();
        looking(&mut moved, DVec3::new(0.0, 1.0, z), DVec3::new(0.0, 1.0, 0.0));
        let other = Game::new(Arc::new(moved), None).step(0).expect("a packet");
        let packet =
            Packet { drawn: other.drawn.clone(), n_drawn: other.n_drawn, ..packet.clone() };
        renderer.step(packet).expect("a frame");
        (other.n_drawn, renderer.image().expect("pixels"))
    };
    // Where the count changes next, to 1e-7 of a unit.
    let (mut near, mut far) = (30.0, 30.2);
    let (first, _) = at(&scene, near);
    assert_ne!(at(&scene, far).0, first);
    while far - near > 1e-7 {
        let middle = 0.5 * (near + far);
        if at(&scene, middle).0 == first { near = middle } else { far = middle }
    }
    let (before, after) = (at(&scene, near), at(&scene, far));
    assert_ne!(before.0, after.0);
    let step = difference(&before.1, &after.1);
    // A particle more or less changes pixels by some 0.1 of its radiance; its weight here is below
    // 1e-5.
    assert!(step < 1e-5, "{step}");
    assert!(before.0 > 10, "{}", before.0);
    let farther = at(&scene, 33.0);
    assert!(difference(&before.1, &farther.1) > 1e-2, "the count matters");
}
