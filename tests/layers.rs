//! The layers of a frame: every one against its f64 reference, whole, and their sum against the
//! picture; and `nimbus render --layers`.

#[path = "harness/program.rs"]
mod program;

use std::path::Path;

use exr::prelude::read_first_flat_layer_from_file;
use glam::{DVec2, DVec3};
use nimbus::frame::{DeviceChoice, GpuContext, scene_of_layers};
use nimbus::io::layers::CHANNELS;
use nimbus::io::scene_file;
use nimbus::model::film::FilmFormat;
use nimbus::model::layers::Layers;
use nimbus::model::scene::{DrawPath, LightingMode, Scene};
use nimbus::reference::picture::{
    Emitters, FrameReference, Pixels, drawn_by_settings, sums_by_settings,
};
use program::{path, run};

/// Share of the shown pixels that may be beyond their bounds: the bounds hold for all blobs but the
/// narrowest, as in the check of a bench.
const BEYOND: f64 = 0.01;
/// Unit round-off of f32.
const U: f64 = 1.0 / 16_777_216.0;

/// A frame that the device has drawn, with the light of every facet.
struct Drawn {
    scene: Scene,
    layers: Layers,
    /// First and second reflection by facet.
    light: Vec<[DVec3; 2]>,
}

fn scene(file: &str, more: &[&str]) -> Scene {
    let size = ["film.width=80", "film.height=60"];
    let set: Vec<String> = size.iter().chain(more).map(|s| (*s).to_owned()).collect();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    scene_file::load(&path, &set, None).expect("the scene loads").at_frame(0)
}

/// Draws frame 0 and its layers on a device with validation.
fn draw(file: &str, more: &[&str]) -> Drawn {
    let scene = scene_of_layers(scene(file, more)).expect("a scene with layers");
    let choice = DeviceChoice { validation: true, ..DeviceChoice::default() };
    let context = GpuContext::open(&choice).expect("a device");
    let mut player = context.player(scene, true).expect("the scene fits");
    let packet = player.game.step_at(0, player.scene.time.at(0)).expect("a packet");
    player.renderer.step(packet).expect("a frame");
    let before = player.renderer.image().expect("a picture");
    let (device, compiler) = (&context.device, context.compiler());
    let light = |renderer: &mut nimbus::frame::Renderer| {
        let (_, lit) = renderer.facets(device).expect("facets");
        lit.iter()
            .map(|l| [l.first, l.second].map(|l| DVec3::from(l.map(f64::from))))
            .collect::<Vec<_>>()
    };
    let lit = light(&mut player.renderer);
    let layers = player.renderer.layers(device, compiler, &player.scene).expect("layers");
    assert_eq!(layers.beauty, before, "the picture is that of the frame");
    assert_eq!(player.renderer.image().expect("a picture"), before, "and it stays");
    assert_eq!(light(&mut player.renderer), lit, "so does the light");
    let scene = Scene::clone(&player.scene);
    drop(player);
    context.close().expect("no validation messages");
    Drawn { scene, layers, light: lit }
}

/// Returns the number of pixels whose number `k` is beyond its bound, of those that show something.
fn beyond(values: &[f64], truths: &[f64], bounds: &[f64]) -> (usize, usize) {
    assert_eq!((values.len(), truths.len()), (bounds.len(), bounds.len()));
    let shown = (0..values.len()).filter(|k| values[*k] != 0.0 || truths[*k] != 0.0);
    let is_within = |k: &usize| (values[*k] - truths[*k]).abs() <= bounds[*k];
    let shown: Vec<usize> = shown.collect();
    (shown.iter().filter(|k| !is_within(k)).count(), shown.len())
}

fn most(n_shown: usize) -> usize {
    (BEYOND * n_shown as f64).ceil() as usize
}

impl Drawn {
    /// Returns colours of a picture in f64 in which emitters have `radiance`, and their bounds.
    fn picture(&self, frame: &FrameReference, radiance: &[DVec3]) -> [Vec<f64>; 2] {
        let emitters = Emitters::new(&self.scene, frame);
        let pixels = Pixels::all(self.scene.film.width, self.scene.film.height);
        let of = (&emitters, radiance);
        let (values, bounds) = drawn_by_settings(&self.scene, frame, of, &pixels, DVec2::ZERO);
        [values, bounds].map(|p| p.iter().flat_map(|p| [p[0], p[1], p[2]]).collect())
    }

    /// Returns the pictures in f64 of the device's own first and second reflection.
    fn pictures(&self, frame: &FrameReference) -> [[Vec<f64>; 2]; 2] {
        [0, 1].map(|k| {
            let of_light: Vec<DVec3> = self.light.iter().map(|l| l[k]).collect();
            let radiance = match self.scene.lighting.mode {
                LightingMode::None if k == 0 => Emitters::radiance(&self.scene, frame),
                LightingMode::None => {
                    vec![DVec3::ZERO; Emitters::radiance(&self.scene, frame).len()]
                }
                _ => of_light,
            };
            self.picture(frame, &radiance)
        })
    }

    /// Compares every layer with its reference.
    fn check(&self, what: &str) {
        let time_s = self.scene.time.at(0);
        let frame = FrameReference::unlit(&self.scene, time_s).expect("a frame");
        let double = |values: &[f32]| values.iter().map(|v| f64::from(*v)).collect::<Vec<_>>();
        let [first, second] = self.pictures(&frame);
        let layers =
            [("first", &self.layers.first, &first), ("second", &self.layers.second, &second)];
        for (name, layer, [truth, bound]) in layers {
            let (n_beyond, n_shown) = beyond(&double(layer), truth, bound);
            println!("{what}: {name}: {n_beyond} of {n_shown} beyond");
            assert!(n_beyond <= most(n_shown), "{what}: {name}: {n_beyond} of {n_shown} beyond");
        }
        let has_second = self.scene.lighting.mode == LightingMode::TwoReflection;
        assert_eq!(has_second, self.layers.second.iter().any(|v| *v > 0.0), "{what}");
        // The comparison notices that the layers are swapped.
        if has_second {
            let (n_beyond, n_shown) = beyond(&double(&self.layers.first), &second[0], &second[1]);
            assert!(n_beyond > n_shown / 2, "{what}: {n_beyond} of {n_shown}");
        }
        self.check_sums(what, &frame);
        self.check_sum_of_reflections(what, [&first[0], &second[0]]);
    }

    /// Compares optical depth, number and depth.
    fn check_sums(&self, what: &str, frame: &FrameReference) {
        let film = self.scene.film;
        let sums = sums_by_settings(&self.scene, frame, &Pixels::all(film.width, film.height));
        let Layers { depth, optical_depth, n_particles, .. } = &self.layers;
        let (mut n_beyond, mut n_shown, mut n_sure) = ([0; 3], 0, 0);
        for (k, truth) in sums.iter().enumerate() {
            let found = [depth[k], optical_depth[k], n_particles[k]].map(f64::from);
            let [least, most] = truth.depth_range;
            let is_within = [
                (least..=most).contains(&found[0]),
                (found[1] - truth.optical_depth.value).abs() <= truth.optical_depth.bound,
                (found[2] - truth.n.value).abs() <= truth.n.bound,
            ];
            n_shown += usize::from(truth.n.value > 0.0 || truth.depth.is_finite());
            n_sure += usize::from(truth.n.value > 0.0 && truth.n.bound == 0.0);
            for (n, is_within) in n_beyond.iter_mut().zip(is_within) {
                *n += usize::from(!is_within);
            }
        }
        println!("{what}: depth, optical depth, number: {n_beyond:?} of {n_shown} beyond");
        assert!(n_shown > 100 && n_sure > n_shown / 4, "{what}: {n_sure} of {n_shown} are sure");
        assert!(n_beyond.iter().all(|n| *n <= most(n_shown)), "{what}: {n_beyond:?} of {n_shown}");
    }

    /// Compares the picture with the sum of its reflections, by the bounds of
    /// docs/reference/files.md.
    fn check_sum_of_reflections(&self, what: &str, exact: [&Vec<f64>; 2]) {
        let Scene { film, draw, .. } = &self.scene;
        let unit = film.format.unit_roundoff();
        let least = if film.format == FilmFormat::Rgba16f { 2f64.powi(-14) } else { 0.0 };
        let brightest =
            |k: usize| self.light.iter().map(|l| l[k].max_element()).fold(1.0, f64::max);
        let brightest = 2.0 * (brightest(0) + brightest(1));
        let (mut greatest, mut n_lit) = (0.0, 0);
        for (i, (first, second)) in self.layers.first.iter().zip(&self.layers.second).enumerate() {
            let beauty = f64::from(self.layers.beauty[i / 3 * 4 + i % 3]);
            let [first, second] = [*first, *second].map(f64::from);
            let n = f64::from(self.layers.n_particles[i / 3]);
            let sum = beauty + first + second;
            let bound = match draw.path {
                DrawPath::Tiles => (unit + (n + 6.0) * U) * sum + 3.0 * unit * least,
                _ => 2.0 * unit * (n + 2.0) * (brightest + 3.0 * least),
            };
            let off = (beauty - first - second).abs();
            assert!(off <= bound, "{what}: [{i}] {beauty} is not {first} + {second}: {off:e}");
            greatest = f64::max(greatest, off / bound.max(f64::MIN_POSITIVE));
            n_lit += usize::from(exact[0][i] > 0.0 && second > 0.0);
        }
        println!("{what}: the sum is off by {greatest:.2} of its bound at most");
        let has_second = self.scene.lighting.mode == LightingMode::TwoReflection;
        assert!(!has_second || n_lit > 100, "{what}: {n_lit}");
    }
}

const SPRITES: &str = "draw.path=\"sprites\"";
const TILES: &str = "draw.path=\"tiles\"";
const F32: &str = "film.format=\"rgba32f\"";

#[test]
fn layers_are_those_of_the_reference_on_both_paths() {
    let hello = "scenes/hello.toml";
    let cubes = "scenes/cubes-554.toml";
    for (what, file, more) in [
        ("tiles", hello, vec![TILES]),
        ("sprites", hello, vec![SPRITES]),
        ("tiles in f32", hello, vec![TILES, F32]),
        ("sprites in f32", hello, vec![SPRITES, F32]),
        ("chunks", hello, vec![SPRITES, "draw.chunks=3"]),
        ("boxes and textures", cubes, vec![F32]),
        ("a facet of many", cubes, vec![F32, "lighting.facets_per_cloud=50"]),
        ("cut by depth", cubes, vec![F32, SPRITES, "draw.threshold=0.01"]),
        ("large ones alone", cubes, vec![F32, "draw.smallest=2"]),
        ("fewer by distance", cubes, vec![F32, "draw.count=\"distance\"", "draw.count_a=20"]),
        ("one reflection", cubes, vec!["lighting.mode=\"first\""]),
        ("ellipsoids", "tests/data/flat.toml", vec![F32]),
        ("without light", "scenes/ground.toml", vec!["lighting.mode=\"none\"", F32]),
        ("over a floor", "scenes/ground.toml", vec![TILES, F32]),
        ("over a floor, sprites", "scenes/ground.toml", vec![SPRITES, F32]),
        (
            "discs, of which some slots show nothing",
            "scenes/puff.toml",
            vec![F32, "lighting.mode=\"first\""],
        ),
    ] {
        draw(file, &more).check(what);
    }
}

#[test]
fn both_paths_give_the_same_layers() {
    let [tiles, sprites] =
        [TILES, SPRITES].map(|way| draw("scenes/hello.toml", &[way, F32]).layers);
    // Sums are drawn the same way; colours differ by f32.
    assert_eq!(tiles.n_particles, sprites.n_particles);
    assert_eq!((&tiles.depth, &tiles.optical_depth), (&sprites.depth, &sprites.optical_depth));
    for (a, b) in [(&tiles.first, &sprites.first), (&tiles.second, &sprites.second)] {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 2e-5), "colours differ");
    }
    // What lets e^{−τ} through has the opacity 1 − e^{−τ}.
    for (k, tau) in tiles.optical_depth.iter().enumerate() {
        let alpha = 1.0 - (-f64::from(*tau)).exp();
        assert!((alpha - f64::from(tiles.beauty[4 * k + 3])).abs() < 1e-4, "{k}: {tau}");
        let is_empty = tiles.n_particles[k] == 0.0;
        assert_eq!(is_empty, tiles.depth[k].is_infinite());
        assert_eq!(is_empty, *tau == 0.0);
    }
    assert!(tiles.n_particles.contains(&0.0));
    assert!(tiles.n_particles.iter().any(|n| *n > 20.0));
}

/// Returns the samples of every channel of an EXR file by name.
fn channels(file: &str) -> Vec<(String, Vec<f32>)> {
    let read = read_first_flat_layer_from_file(file).expect("an EXR").layer_data.channel_data;
    read.list
        .iter()
        .map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect()))
        .collect()
}

#[test]
fn the_program_writes_layers_of_device_and_reference() {
    let dir = tempfile::tempdir().expect("a folder");
    let scene = ["scenes/hello.toml", "--size", "80x60", "--set", F32, "--json", "-q"];
    let render = |name: &str, more: &[&str]| {
        let out = path(&dir, name);
        let output = run(&[&["render", "-o", &out][..], &scene, more].concat());
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{more:?}: {error}");
        serde_json::from_slice::<serde_json::Value>(&output.stdout).expect("JSON")
    };
    let plain = render("plain.exr", &[]);
    let drawn = render("drawn.exr", &["--layers"]);
    render("thin.exr", &["--layers", "--reference", "thin"]);
    // The picture is the one without layers, and readers of colours find it.
    assert_eq!(plain["image_hash"], drawn["image_hash"]);
    assert!(plain["channels"].is_null());
    assert_eq!(drawn["channels"].as_array().map(Vec::len), Some(CHANNELS.len()));
    assert_eq!(program::differ(&dir, "plain.exr", "drawn.exr").0, 0.0);
    let [drawn, thin] = ["drawn.exr", "thin.exr"].map(|name| channels(&path(&dir, name)));
    let mut names = CHANNELS.map(str::to_owned);
    names.sort();
    for (k, name) in names.iter().enumerate() {
        assert_eq!((&drawn[k].0, &thin[k].0), (name, name));
        // The light of the device differs from that in f64 by a few per cent of the second
        // reflection; everything else by f32, but for pixels on a particle's edge.
        let off = |(a, b): (&f32, &f32)| if a == b { 0.0 } else { f64::from((a - b).abs()) };
        let pairs = || drawn[k].1.iter().zip(&thin[k].1);
        let rms = (pairs().map(off).map(|v| v * v).sum::<f64>() / pairs().count() as f64).sqrt();
        let most = if name.as_str() == "Z" { 1e-3 } else { 2e-2 };
        println!("{name}: {rms:.1e}");
        assert!(rms <= most, "{name}: {rms:e}");
        assert!(pairs().any(|(a, _)| *a > 0.0), "{name} is empty");
    }
}

#[test]
fn what_has_no_layers_is_refused_and_nothing_is_written() {
    let dir = tempfile::tempdir().expect("a folder");
    for (name, more, text) in [
        ("a.png", vec![], "a PNG has no layers"),
        (
            "a.exr",
            vec!["--reference", "volume"],
            "the reference \"volume\" is no picture of layers",
        ),
        ("a.exr", vec!["--reference", "thin", "--samples", "4"], "expected --samples 1"),
        ("a.exr", vec!["--set", "draw.resolution=0.5"], "--set draw.resolution=1"),
        ("a.exr", vec!["--set", "sky.model=\"hosek-wilkie\""], "--set sky.haze=0"),
    ] {
        let out = path(&dir, name);
        let args = ["render", "scenes/hello.toml", "--layers", "-o", &out];
        let output = run(&[&args[..], &more].concat());
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(error.contains("--layers") && error.contains(text), "{error}");
        assert_eq!((output.status.code(), Path::new(&out).exists()), (Some(2), false), "{error}");
    }
}
