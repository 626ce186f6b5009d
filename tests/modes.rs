//! Whatever way a frame is made, it is the same frame: serial and parallel, with and without
//! skipping, twice, alone or after others. Compared byte for byte as it lies in the target, every
//! frame of a short run.

#[path = "modes/failures.rs"]
mod failures;
mod harness;

use harness::Gpu;
use nimbus::frame::FrameTimes;
use nimbus::frame::Game;
use nimbus::frame::Renderer;
use nimbus::frame::plan::Pass;
use nimbus::frame::{open_sides, parallel, serial};
use nimbus::io::scene_file;
use nimbus::model::camera::CameraKey;
use nimbus::model::scene::{DrawPath, Scene, Threading};
use std::path::Path;
use std::sync::Arc;

const N_FRAMES: u32 = 6;

/// A moving camera, two drifting clouds with gusts, a list beside boxes: every pass has something
/// to do.
fn scene(overrides: &[&str]) -> Scene {
    let mut all = vec!["film.width=160", "film.height=120", "lighting.grid=24"];
    all.extend(overrides);
    let all: Vec<String> = all.into_iter().map(str::to_owned).collect();
    scene_file::load(Path::new("tests/data/modes.toml"), &all, None).expect("the scene loads").scene
}

/// The scene on a device, and its game step on the GPU's behalf.
fn started(gpu: &Gpu, overrides: &[&str]) -> (Renderer, Game) {
    let scene = Arc::new(scene(overrides));
    let renderer = Renderer::new(&gpu.device, &gpu.compiler, &scene, true).expect("a renderer");
    (renderer, Game::new(scene, None))
}

/// Every frame's bytes, and what each ran.
fn run(scene: Scene, threading: Threading, skip: bool) -> Vec<(Vec<u8>, FrameTimes)> {
    run_for(N_FRAMES, scene, threading, skip)
}

fn run_for(
    n_frames: u32,
    scene: Scene,
    threading: Threading,
    skip: bool,
) -> Vec<(Vec<u8>, FrameTimes)> {
    let gpu = Gpu::new();
    let scene = Arc::new(scene);
    let (mut renderer, mut game) =
        open_sides(&gpu.device, &gpu.compiler, &scene, skip).expect("both sides");
    let mut frames = Vec::new();
    let on_frame = &mut |times: FrameTimes, renderer: &mut Renderer| {
        frames.push((renderer.image_bytes()?, times));
        Ok(true)
    };
    let done = match threading {
        Threading::Serial => serial::run(&mut game, &mut renderer, 0..n_frames, on_frame),
        Threading::Parallel => parallel::run(&mut game, &mut renderer, 0..n_frames, on_frame),
    };
    done.expect("the frames run");
    assert_eq!(frames.len(), n_frames as usize);
    assert!(frames.iter().all(|(bytes, _)| bytes.iter().any(|b| *b != 0)), "a frame is empty");
    frames
}

fn images(frames: Vec<(Vec<u8>, FrameTimes)>) -> Vec<Vec<u8>> {
    frames.into_iter().map(|f| f.0).collect()
}

#[test]
fn two_runs_serial_parallel_and_no_skip_give_the_same_bytes_for_every_frame() {
    for simulate in
        [&["threads.simulate=gpu"][..], &["threads.simulate=cpu", "lighting.gather='exact'"]]
    {
        for motion in [
            &[][..],
            &["cloud.0.wind=[0,0,0]", "cloud.1.wind=[0,0,0]", "cloud.0.gust=0", "cloud.1.gust=0"],
        ] {
            let overrides = [simulate, motion].concat();
            let first = images(run(scene(&overrides), Threading::Serial, true));
            assert_eq!(
                first,
                images(run(scene(&overrides), Threading::Serial, true)),
                "{overrides:?}: twice"
            );
            assert_eq!(
                first,
                images(run(scene(&overrides), Threading::Parallel, true)),
                "{overrides:?}: parallel"
            );
            assert_eq!(
                first,
                images(run(scene(&overrides), Threading::Serial, false)),
                "{overrides:?}: no skip"
            );
            // The comparison can fail: the camera moves, so no two frames are alike.
            assert!(first.windows(2).all(|w| w[0] != w[1]));
        }
    }
}

/// A camera that moves, stands still for a while and moves on: frames in flight share a picture and
/// part again.
#[test]
fn three_hundred_frames_are_the_same_in_both_loops() {
    let still =
        ["cloud.0.wind=[0,0,0]", "cloud.1.wind=[0,0,0]", "cloud.0.gust=0", "cloud.1.gust=0"];
    let scene = || {
        let mut scene =
            scene(&[&still[..], &["film.width=48", "film.height=36", "time.step_s=0.01"]].concat());
        let [first, second] = [0, 1].map(|k| scene.camera.keys[k]);
        // A path's curve between two keys looks at the keys beside them, too.
        let stop = [0.99, 1.0, 2.0, 2.01].map(|time_s| CameraKey { time_s, ..second });
        scene.camera.keys = [&[first][..], &stop, &[CameraKey { time_s: 3.0, ..first }]].concat();
        scene
    };
    let serial = run_for(300, scene(), Threading::Serial, true);
    let stood = serial.iter().filter(|f| !f.1.plan.runs(Pass::Tiles)).count();
    assert!((90..110).contains(&stood), "{stood}");
    let serial = images(serial);
    assert!(serial == images(run_for(300, scene(), Threading::Parallel, true)), "the loops differ");
    assert_ne!(serial[0], serial[150]);
}

#[test]
fn tiles_give_the_same_bytes_in_every_mode() {
    let tiled = || scene(&["draw.path='tiles'"]);
    let frames = run(tiled(), Threading::Serial, true);
    assert!(frames.iter().all(|f| f.1.plan.runs(Pass::Tiles) && !f.1.plan.runs(Pass::Sprites)));
    let first = images(frames);
    assert!(first == images(run(tiled(), Threading::Serial, true)), "twice");
    assert!(first == images(run(tiled(), Threading::Parallel, true)), "parallel");
    assert!(first == images(run(tiled(), Threading::Serial, false)), "no skip");
    assert!(first.windows(2).all(|w| w[0] != w[1]));
    // Another way to draw, and so other roundings.
    assert!(first != images(run(scene(&["draw.path='sprites'"]), Threading::Serial, true)));
}

#[test]
fn ellipsoids_give_the_same_bytes_in_every_mode() {
    let flat = |more: &[&str]| {
        let set: Vec<String> = more.iter().map(|s| (*s).to_owned()).collect();
        scene_file::load(Path::new("tests/data/flat.toml"), &set, None)
            .expect("the scene loads")
            .scene
    };
    for more in [&[][..], &["lighting.facets_per_cloud=20", "draw.path='sprites'"]] {
        let first = images(run(flat(more), Threading::Serial, true));
        assert!(first == images(run(flat(more), Threading::Parallel, true)), "parallel");
        assert!(first == images(run(flat(more), Threading::Serial, false)), "no skip");
        let by_host = [more, &["threads.simulate='cpu'"]].concat();
        let placed = images(run(flat(&by_host), Threading::Parallel, true));
        assert!(
            placed == images(run(flat(&by_host), Threading::Serial, false)),
            "placed by the host, no skip"
        );
        assert!(first.windows(2).all(|w| w[0] != w[1]));
    }
}

#[test]
fn every_way_to_sum_gives_the_same_bytes_in_every_mode() {
    let summed = |[summation, precision]: [&str; 2]| {
        let set = [
            format!("lighting.summation='{summation}'"),
            format!("lighting.precision='{precision}'"),
        ];
        scene(&[&set[0], &set[1]])
    };
    let default = images(run(scene(&[]), Threading::Serial, true));
    assert!(
        default == images(run(summed(["plain", "f32"]), Threading::Serial, true)),
        "what is said by default"
    );
    for way in [["kahan", "f64"], ["pairwise", "f32"]] {
        let first = images(run(summed(way), Threading::Serial, false));
        assert!(first == images(run(summed(way), Threading::Parallel, true)), "{way:?}");
    }
}

#[test]
fn chunks_give_the_same_bytes_in_every_mode() {
    let chunks = || scene(&["draw.path='sprites'", "draw.chunks=4"]);
    let frames = run(chunks(), Threading::Serial, true);
    assert!(frames.iter().all(|f| f.1.plan.runs(Pass::Sprites)));
    let first = images(frames);
    assert!(first == images(run(chunks(), Threading::Parallel, true)), "parallel");
    assert!(first == images(run(chunks(), Threading::Serial, false)), "no skip");
    assert!(first != images(run(scene(&["draw.path='sprites'"]), Threading::Serial, true)));
}

#[test]
fn smaller_pictures_give_the_same_bytes_in_every_mode() {
    for path in ["sprites", "tiles"] {
        let path = format!("draw.path='{path}'");
        let shrunk = || scene(&[&path, "draw.resolution=0.5"]);
        let frames = run(shrunk(), Threading::Serial, true);
        assert!(frames.iter().all(|f| f.1.plan.runs(Pass::Upsample)));
        let first = images(frames);
        assert!(first == images(run(shrunk(), Threading::Parallel, true)), "{path}: parallel");
        assert!(first == images(run(shrunk(), Threading::Serial, false)), "{path}: no skip");
        assert!(first != images(run(scene(&[&path]), Threading::Serial, true)), "{path}");
    }
}

/// "auto" draws what the path that it took draws, and says which.
#[test]
fn the_faster_way_is_taken_and_named() {
    let stage = |path: &str| {
        let choice = nimbus::frame::DeviceChoice { validation: true, ..Default::default() };
        nimbus::frame::Stage::new(scene(&[path]), &choice, true).expect("a stage")
    };
    let mut auto = stage("draw.path='auto'");
    let choice = auto.choices.pop().expect("a choice");
    let [sprites_ms, tiles_ms] =
        [0, 1].map(|i| choice.candidates[i].ms().expect("both can draw it"));
    let (faster, path) = [("sprites", DrawPath::Sprites), ("tiles", DrawPath::Tiles)][choice.taken];
    // The first value is taken even if the other is faster by noise.
    assert!(path == DrawPath::Sprites || tiles_ms < sprites_ms, "{}", choice.text());
    assert_eq!((choice.key, auto.scene.draw.path), ("path", path));
    assert!(choice.text().contains(&format!("took \"{faster}\"")), "{}", choice.text());
    let mut named = stage(&format!("draw.path='{faster}'"));
    assert!(named.choices.is_empty());
    let images = [&mut auto, &mut named].map(|stage| {
        let packet = stage.game.step(3).expect("a packet");
        stage.renderer.step(packet).expect("a frame");
        stage.renderer.image_bytes().expect("a picture")
    });
    assert!(images[0] == images[1]);
    [auto, named].into_iter().for_each(|stage| stage.close().expect("no message"));
}

#[test]
fn edited_materials_give_the_same_bytes_in_every_mode() {
    let edited = || {
        scene_file::load(Path::new("tests/data/edited.toml"), &[], None)
            .expect("the scene loads")
            .scene
    };
    let frames = run(edited(), Threading::Serial, true);
    assert!(
        frames[1..].iter().all(|f| f.1.plan.runs(Pass::Contract) && !f.1.plan.runs(Pass::Second))
    );
    let first = images(frames);
    assert_eq!(first, images(run(edited(), Threading::Parallel, true)), "parallel");
    assert_eq!(first, images(run(edited(), Threading::Serial, false)), "no skip");
    // The comparison can fail: every frame is edited.
    assert!(first.windows(2).all(|w| w[0] != w[1]));
}

#[test]
fn a_still_scene_skips_and_a_moving_one_does_not() {
    let still =
        ["cloud.0.wind=[0,0,0]", "cloud.1.wind=[0,0,0]", "cloud.0.gust=0", "cloud.1.gust=0"];
    let runs = |overrides: &[&str]| {
        let frames = run(scene(overrides), Threading::Serial, true);
        let plan = frames[2].1.plan;
        Pass::ALL.into_iter().filter(|p| plan.runs(*p)).map(Pass::name).collect::<Vec<_>>()
    };
    // The camera turns, so that the order may change; the floor's lobe shines elsewhere, what is
    // dull stays as it is.
    assert_eq!(runs(&still), ["first", "second", "cull", "sort", "surfaces", "tiles"]);
    let dull = [&still[..], &["material.1.ks=[0,0,0]"]].concat();
    assert_eq!(runs(&dull), ["cull", "sort", "surfaces", "tiles"]);
    let moving = runs(&[]);
    let all: Vec<&str> = Pass::ALL[1..]
        .iter()
        .map(|p| p.name())
        .filter(|p| {
            let others =
                ["live", "contract", "texture", "terrain", "impostors", "sprites", "relief"];
            let unused = ["upsample", "diffusion", "scatter", "harmonics", "lod", "haze"];
            !others.contains(p) && !unused.contains(p)
        })
        .collect();
    assert_eq!(moving, all);
}

#[test]
fn enough_facets_are_one_a_particle() {
    // Clouds of different sizes: between them one has a facet a particle among others that have
    // not.
    let of = |n: u64| {
        images(run(scene(&[&format!("lighting.facets_per_cloud={n}")]), Threading::Serial, true))
    };
    let sizes: Vec<u64> = scene(&[]).clouds.iter().map(|c| c.n_particles()).collect();
    let most = sizes.iter().copied().max().unwrap_or(0);
    let singly = of(0);
    assert!(singly == of(most), "{sizes:?}");
    assert!(singly != of(most - 1) && sizes.iter().any(|n| *n < most), "{sizes:?}");
}

#[test]
fn a_frame_made_alone_is_the_frame_of_the_run() {
    let in_run = images(run(scene(&[]), Threading::Serial, true));
    let gpu = Gpu::new();
    let scene = Arc::new(scene(&[]));
    let mut renderer = Renderer::new(&gpu.device, &gpu.compiler, &scene, true).expect("a renderer");
    let mut game = Game::new(scene.clone(), None);
    for i_frame in [4, 1] {
        renderer.step(game.step(i_frame).expect("a packet")).expect("a frame");
        assert_eq!(
            renderer.image_bytes().expect("bytes"),
            in_run[i_frame as usize],
            "frame {i_frame}"
        );
    }
}

#[test]
fn the_game_thread_and_the_gpu_place_particles_alike() {
    let placed = |simulate: &str| {
        let gpu = Gpu::new();
        let scene = Arc::new(scene(&[simulate, "cloud.0.grow_to=1.5", "cloud.0.grow_time_s=0.5"]));
        let (mut renderer, mut game) =
            open_sides(&gpu.device, &gpu.compiler, &scene, true).expect("both sides");
        renderer.step(game.step(3).expect("a packet")).expect("a frame");
        renderer.placed(&gpu.device).expect("places")
    };
    let (gpu, cpu) = (placed("threads.simulate=gpu"), placed("threads.simulate=cpu"));
    assert_eq!(gpu.len(), cpu.len());
    for (a, b) in gpu.iter().zip(&cpu) {
        // Once rounded against three times.
        assert!((a.sigma - b.sigma).abs() <= 2f32.powi(-22) * a.sigma, "{a:?} {b:?}");
        for axis in 0..3 {
            // f32 roundings of sums of magnitude < 16 (2⁻²⁰ each, a handful) and of 16 waves whose
            // amplitudes sum to less than 1 and whose arguments, below 64, are off by 2⁻¹⁸.
            assert!((a.position[axis] - b.position[axis]).abs() < 1e-5, "{a:?} {b:?}");
        }
    }
}
