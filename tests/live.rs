//! Clouds that live: any frame is the same whatever came before it, nothing pops, births are where
//! and when they should be, and the device has what the f64 reference says, on the game thread's
//! behalf, too.

mod harness;

use std::path::Path;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use harness::Gpu;
use nimbus::frame::Game;
use nimbus::frame::Renderer;
use nimbus::frame::plan::Pass;
use nimbus::frame::{open_sides, parallel, serial};
use nimbus::gpu::Compiler;
use nimbus::io::scene_file;
use nimbus::model::cloud::CloudSource;
use nimbus::model::disc::Disc;
use nimbus::model::scene::{Scene, Threading};
use nimbus::reference::live::alive;
use nimbus::reference::picture::FrameReference;

/// The puff, small, with fewer particles.
fn scene(overrides: &[&str]) -> Scene {
    let small = [
        "film.width=80",
        "film.height=60",
        "lighting.mode='first'",
        "lighting.grid=16",
        "cloud.0.particles=300",
        "time.step_s=0.5",
    ];
    let all: Vec<String> = small.iter().chain(overrides).map(|s| (*s).to_owned()).collect();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/puff.toml");
    scene_file::load(&path, &all, None).expect("the scene loads").scene
}

fn disc(scene: &Scene) -> (Disc, u32, DVec3) {
    let cloud = &scene.clouds[0];
    let CloudSource::Disc(disc) = &cloud.source else { panic!("no disc") };
    (*disc, cloud.seed, cloud.wind)
}

fn started(gpu: &Gpu, compiler: &Compiler, scene: Scene, skip: bool) -> (Renderer, Game) {
    open_sides(&gpu.device, compiler, &Arc::new(scene), skip).expect("both sides")
}

fn draw(renderer: &mut Renderer, game: &mut Game, i_frame: u32) -> Vec<u8> {
    let packet = game.step(i_frame).expect("a packet");
    renderer.step(packet).expect("a frame");
    renderer.image_bytes().expect("bytes")
}

/// Frames 0 to 4 as a loop draws them.
fn looped(gpu: &Gpu, scene: Scene, threading: Threading, skip: bool) -> Vec<Vec<u8>> {
    let (mut renderer, mut game) = started(gpu, &gpu.compiler, scene, skip);
    let mut frames = vec![];
    let on_frame = &mut |_, renderer: &mut Renderer| {
        frames.push(renderer.image_bytes()?);
        Ok(true)
    };
    match threading {
        Threading::Serial => serial::run(&mut game, &mut renderer, 0..5, on_frame),
        Threading::Parallel => parallel::run(&mut game, &mut renderer, 0..5, on_frame),
    }
    .expect("the frames run");
    frames
}

#[test]
fn a_frame_is_the_same_alone_in_sequence_backwards_and_in_every_loop() {
    let gpu = Gpu::new();
    let far = "time.start_s=1e6";
    for how in [
        &["threads.simulate='gpu'"][..],
        &["threads.simulate='cpu'"],
        &["draw.path='sprites'", far],
    ] {
        let frames = looped(&gpu, scene(how), Threading::Serial, true);
        assert!(frames.windows(2).all(|w| w[0] != w[1]), "{how:?}: nothing lives");
        assert!(frames == looped(&gpu, scene(how), Threading::Parallel, true), "{how:?}: parallel");
        assert!(
            frames == looped(&gpu, scene(how), Threading::Serial, false),
            "{how:?}: without skipping"
        );
        let (mut renderer, mut game) = started(&gpu, &gpu.compiler, scene(how), true);
        for i in [4, 3, 2, 1, 0, 3] {
            assert!(
                draw(&mut renderer, &mut game, i) == frames[i as usize],
                "{how:?}: frame {i} after a later one"
            );
        }
        let (mut renderer, mut game) = started(&gpu, &gpu.compiler, scene(how), true);
        assert!(draw(&mut renderer, &mut game, 2) == frames[2], "{how:?}: alone");
    }
}

#[test]
fn time_runs_what_depends_on_it_and_stands_still() {
    let gpu = Gpu::new();
    let ran = |overrides: &[&str]| {
        let (mut renderer, mut game) = started(&gpu, &gpu.compiler, scene(overrides), true);
        let mut plan = |i| renderer.step(game.step(i).expect("a packet")).expect("a frame").plan;
        plan(0);
        let second = plan(1);
        Pass::ALL.into_iter().filter(|p| second.runs(*p)).map(Pass::name).collect::<Vec<_>>()
    };
    let all = ["live", "place", "grid", "facets", "transmit", "first", "cull", "sort", "tiles"];
    assert_eq!(ran(&[]), all);
    assert_eq!(ran(&["threads.simulate='cpu'"]), all);
    assert_eq!(ran(&["time.step_s=0"]), [""; 0]);
    // A year later to the period: another generation, and so other particles.
    assert_eq!(ran(&["time.step_s=40", "cloud.0.gust=0"]), all);
}

#[test]
fn the_device_has_what_the_reference_says_for_a_scene() {
    let gpu = Gpu::new();
    for how in [
        ["threads.simulate='gpu'", "time.start_s=0"],
        ["threads.simulate='cpu'", "time.start_s=1e6"],
    ] {
        let scene = scene(&how);
        let truth = FrameReference::unlit(&scene, scene.time.at(3)).expect("a reference");
        let (mut renderer, mut game) = started(&gpu, &gpu.compiler, scene.clone(), true);
        renderer.step(game.step(3).expect("a packet")).expect("a frame");
        let placed = renderer.placed(&gpu.device).expect("places");
        let particles = renderer.generate_now(&gpu.device).expect("particles").0;
        assert_eq!((placed.len(), truth.blobs.len()), (300, 300));
        for (i, ((p, q), b)) in placed.iter().zip(&particles).zip(&truth.blobs).enumerate() {
            // Scenes are some ten units large, of which f32 has 1e-6; gusts' phases are of some
            // tens of radians.
            assert!((Vec3::from(p.position).as_dvec3() - b.position).length() < 1e-4, "{i}");
            assert!((f64::from(p.sigma) / b.sigma - 1.0).abs() < 1e-5, "{i}");
            assert!(
                (f64::from(q.kappa) - b.kappa).abs() < 1e-4 * game_kappa(&scene),
                "{i}: {} {}",
                q.kappa,
                b.kappa
            );
        }
    }
}

fn game_kappa(scene: &Scene) -> f64 {
    disc(scene).0.kappa()
}

#[test]
fn host_and_reference_know_the_same_lives() {
    let (disc, seed, wind) = disc(&scene(&[]));
    for time_s in [-77.7, 0.0, 3.3, 1e6, 1e9 + 0.1] {
        for i in 0..300 {
            let host = disc.particle(seed, wind, i, disc.cycle_at(time_s));
            let truth = alive(&disc, seed, wind, i, time_s);
            assert!((host.position - truth.position).length() < 1e-12, "{i} at {time_s}");
            assert!(
                (host.sigma - truth.sigmas[1]).abs() < 1e-13
                    && (host.kappa - truth.kappa).abs() < 1e-12
            );
        }
    }
}

/// The greatest change of a pixel from one frame to the next, over a second in `n` steps; layers of
/// one colour, so that no change of order shows, and whole sprites.
fn greatest_step(gpu: &Gpu, compiler: &Compiler, n: u32) -> f32 {
    let step = format!("time.step_s={}", 1.0 / f64::from(n));
    let plain =
        ["lighting.mode='none'", "film.format='rgba32f'", "draw.cutoff=8", "draw.path='sprites'"];
    // Short lives: some ten births and deaths in that second, seen large.
    let lives =
        ["cloud.0.lifetime_s=6", "cloud.0.particles=60", "cloud.0.gust=0", "cloud.0.base='none'"];
    let few = ["cloud.0.texture='none'", "draw.sort_bits=32", "camera.near=0.1", &step];
    let (mut renderer, mut game) =
        started(gpu, compiler, scene(&[&plain[..], &lives, &few].concat()), true);
    let mut last: Option<Vec<f32>> = None;
    let mut greatest = 0f32;
    for i in 0..=n {
        draw(&mut renderer, &mut game, i);
        let picture = renderer.image().expect("a picture");
        if let Some(last) = &last {
            greatest =
                picture.iter().zip(last).map(|(a, b)| (a - b).abs()).fold(greatest, f32::max);
        }
        last = Some(picture);
    }
    greatest
}

#[test]
fn births_and_deaths_do_not_pop() {
    let gpu = Gpu::new();
    let steps = [16, 128].map(|n| greatest_step(&gpu, &gpu.compiler, n));
    println!("greatest change of a pixel in a 16th and a 128th of a second: {steps:?}");
    // An eighth of the time is an eighth of the change where all is smooth.
    assert!(steps[0] > 0.01 && steps[1] < steps[0] / 5.0, "{steps:?}");
    // Without fading, particles pop.
    for (from, to) in [
        ("smooth_rise(lived * d.inv_fade_in)", "1.0"),
        ("smooth_rise((1.0 - lived) * d.inv_fade_out)", "1.0"),
    ] {
        let wrong = Gpu::wrong_compiler("live.comp", from, to);
        let steps = [16, 128].map(|n| greatest_step(&gpu, &wrong, n));
        assert!(steps[1] > steps[0] / 3.0, "{from}: {steps:?}");
    }
}

/// Kolmogorov and Smirnov's distance of `sorted` numbers from a uniform distribution on [0, 1],
/// times √n: above 1.95 in one of a thousand samples.
fn from_uniform(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let n = numbers.len() as f64;
    let far =
        |(i, x): (usize, &f64)| (x - i as f64 / n).abs().max((x - (i as f64 + 1.0) / n).abs());
    n.sqrt() * numbers.iter().enumerate().map(far).fold(0.0, f64::max)
}

#[test]
fn births_are_uniform_over_the_disc_and_spread_over_the_period() {
    let (disc, seed, wind) = disc(&scene(&[]));
    // Ten thousand births: a hundred slots over a hundred generations.
    let births = |f: &dyn Fn(DVec3) -> f64| {
        let all = (0..10_000)
            .map(|k| alive(&disc, seed, wind, k % 100, f64::from(k / 100) * disc.period_s));
        all.map(|p| f(p.birth)).collect::<Vec<f64>>()
    };
    let share = births(&|x| x.length_squared() / disc.radius.powi(2));
    let angle = births(&|x| x.x.atan2(x.z) / std::f64::consts::TAU + 0.5);
    assert!(births(&|x| x.y).iter().all(|y| *y == 0.0));
    assert!(from_uniform(share.clone()) < 1.95 && from_uniform(angle) < 1.95);
    // It can fail: radii themselves are not uniform.
    assert!(from_uniform(share.iter().map(|s| s.sqrt()).collect()) > 10.0);

    // Ages of the first n slots at any time: no further from uniform than a van der Corput sequence
    // is, n D ≤ log₂ n + 1.
    for n in [1u32, 5, 37, 300, 1000] {
        for time_s in [0.0, 11.1, 1e6] {
            let ages = (0..n).map(|i| alive(&disc, seed, wind, i, time_s).age.share).collect();
            let apart = from_uniform(ages) * f64::from(n).sqrt();
            // A shift around the circle makes at most two of it.
            assert!(apart <= 2.0 * (f64::from(n).log2() + 1.0), "{n} at {time_s}: {apart}");
        }
    }
}

#[test]
fn a_prefix_of_the_slots_stands_for_all() {
    let (disc, seed, wind) = disc(&scene(&["cloud.0.particles=4096"]));
    let mean = |n: u32, f: &dyn Fn(f64, f64) -> f64| {
        let of = |i| {
            let p = alive(&disc, seed, wind, i, 100.0);
            f(p.kappa * p.sigmas[1], p.position.y)
        };
        (0..n).map(of).sum::<f64>() / f64::from(n)
    };
    let (depth, height) = (|d: f64, _: f64| d, |d: f64, y: f64| d * y);
    let all = [mean(4096, &depth), mean(4096, &height)];
    for n in [256, 777, 2048] {
        let some = [mean(n, &depth), mean(n, &height)];
        for (a, b) in some.iter().zip(all) {
            // Optical depths scatter by about their mean: 1/√n of it, four times.
            assert!((a / b - 1.0).abs() < 4.0 / f64::from(n).sqrt(), "{n}: {some:?} {all:?}");
        }
    }
    // Counted by distance, the picture is drawn from the first slots.
    let counted = ["draw.count='distance'", "draw.count_a=10", "camera.position=[0, 3.2, 25]"];
    let packet = Game::new(Arc::new(scene(&counted)), None).step(9).expect("a packet");
    let n = packet.drawn[0].end;
    assert!((10..100).contains(&n) && packet.drawn[0].kappa_scale > 3.0, "{:?}", packet.drawn);
}
