//! Pictures of scenes by radiative transfer: the same bytes on any number of threads, and what a
//! scene's keys do.

use std::sync::atomic::AtomicBool;

use glam::DVec3;
use nimbus::io::scene_file;
use nimbus::model::scene::Scene;
use nimbus::reference::picture::{Pixels, ReferenceKind, ReferenceRequest, SampleSums, Tile, sums};

fn scene(set: &[&str]) -> Scene {
    let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
    let path = std::path::Path::new("scenes/study-both.toml");
    let mut scene = scene_file::load(path, &set, None).expect("a scene").scene;
    (scene.film.width, scene.film.height) = (40, 30);
    scene
}

fn drawn(scene: &Scene, pixels: &Pixels, samples: std::ops::Range<u32>) -> SampleSums {
    let request = ReferenceRequest { kind: ReferenceKind::Transport, scene, time_s: 0.0 };
    sums(&request, pixels, samples, &AtomicBool::new(false), &|_, _| ()).expect("a picture")
}

#[test]
fn pictures_are_the_same_on_any_number_of_threads_and_in_pieces() {
    let scene = scene(&[]);
    let pixels = Pixels::all(40, 30);
    let whole = drawn(&scene, &pixels, 0..8);
    for n_threads in [1, 2, 7] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().expect("threads");
        assert!(pool.install(|| drawn(&scene, &pixels, 0..8)) == whole, "{n_threads} threads");
    }
    // A tile has the pixels of the whole picture.
    let tile = Tile { left: 12, top: 7, width: 9, height: 11 };
    let part = drawn(&scene, &Pixels::tile(40, 30, tile), 0..8);
    let n = part.values.len() / tile.n_pixels();
    for (k, [i, j]) in tile.pixels().enumerate() {
        let at = (j * 40 + i) as usize;
        assert!(part.values[n * k..n * (k + 1)] == whole.values[n * at..n * (at + 1)], "{i} {j}");
    }
    // Other samples are other paths.
    assert!(drawn(&scene, &pixels, 8..16) != whole);
}

/// Mean radiance over the pixels.
fn mean(scene: &Scene) -> DVec3 {
    let pixels = Pixels::all(40, 30);
    let picture = drawn(scene, &pixels, 0..16).mean();
    let sum: DVec3 = picture.rgba.iter().map(|v| DVec3::new(v[0], v[1], v[2])).sum();
    sum / picture.rgba.len() as f64
}

#[test]
fn materials_say_how_clouds_scatter() {
    let derived = mean(&scene(&[]));
    // What is derived is what the keys say.
    let same = mean(&scene(&["material.*.phase=0.85"]));
    assert_eq!(derived, same);
    let black = mean(&scene(&["material.*.albedo=[0.0,0.0,0.0]"]));
    let red = mean(&scene(&["material.*.albedo=[1.0,0.5,0.5]"]));
    assert!(black.y < 0.7 * derived.y && red.x > 1.2 * red.y, "{black} {red} {derived}");
    let mie = mean(&scene(&["material.*.phase=\"mie\""]));
    let back = mean(&scene(&["material.*.phase=-0.5"]));
    assert!(mie != derived && back.y > 1.02 * derived.y, "{mie} {back} {derived}");
}
