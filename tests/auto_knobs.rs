//! Every "auto" of a drawing together: what is taken keeps the first frame within `draw.error` of
//! the exact picture, is what a scene that names it draws, and changes nothing where no error is
//! allowed.

use std::fmt::Write;

use nimbus::frame::{Candidate, Choice};
use nimbus::frame::{DeviceChoice, Stage};
use nimbus::io::scene_file;
use nimbus::model::cutoff::Cutoff;
use nimbus::model::resolution::Resolution;
use nimbus::model::scene::{Cull, Draw, DrawPath, Scene};

const ALL: [&str; 6] = [
    "draw.path='auto'",
    "draw.chunks='auto'",
    "draw.cull='auto'",
    "draw.threshold='auto'",
    "draw.smallest='auto'",
    "draw.resolution='auto'",
];

/// Blobs in a list as (place, σ, optical depth), seen by 96 × 72 pixels.
fn scene(blobs: &[([f64; 3], f64, f64)], overrides: &[&str]) -> Scene {
    let dir = tempfile::tempdir().expect("a folder");
    let mut list = "x,y,z,radius,kappa,r,g,b\n".to_owned();
    for (i, ([x, y, z], sigma, depth)) in blobs.iter().enumerate() {
        let (shade, kappa) =
            (0.5 + 0.4 * (i as f64).sin(), depth / (sigma * std::f64::consts::TAU.sqrt()));
        writeln!(list, "{x},{y},{z},{},{kappa},1.0,{shade},{}", 3.0 * sigma, 1.5 - shade)
            .expect("a line");
    }
    std::fs::write(dir.path().join("list.csv"), list).expect("a list");
    let text = "[film]\nwidth = 96\nheight = 72\nformat = 'rgba32f'\n[camera]\nposition = [0.0, \
        0.0, 12.0]\n\
                [lighting]\nmode = 'none'\n[[cloud]]\nfrom = 'particles'\nfile = 'list.csv'\n";
    let path = dir.path().join("s.toml");
    std::fs::write(&path, text).expect("a scene");
    let overrides: Vec<String> = overrides.iter().map(|s| (*s).to_owned()).collect();
    scene_file::load(&path, &overrides, None).expect("the scene loads").scene
}

/// Blobs in view, of σ between `sigma`'s ends and optical depth between `depth`'s.
fn blobs(n: usize, sigma: [f64; 2], depth: [f64; 2]) -> Vec<([f64; 3], f64, f64)> {
    let mut state = 3u64;
    let mut within = |[low, high]: [f64; 2]| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut blob = || {
        let at = [within([-5.0, 5.0]), within([-4.0, 4.0]), within([-0.5, 0.5])];
        (at, within(sigma), within(depth))
    };
    (0..n).map(|_| blob()).collect()
}

/// The scene's first frame: its bytes and its numbers.
struct Frame {
    draw: Draw,
    choices: Vec<Choice>,
    bytes: Vec<u8>,
    values: Vec<f32>,
}

fn frame(scene: Scene) -> Frame {
    let choice = DeviceChoice { validation: true, ..DeviceChoice::default() };
    let mut stage = Stage::new(scene, &choice, true).expect("a stage");
    let packet = stage.game.step(0).expect("a packet");
    stage.renderer.step(packet).expect("a frame");
    let (bytes, values) =
        (stage.renderer.image_bytes().expect("bytes"), stage.renderer.image().expect("a picture"));
    let (draw, choices) = (stage.scene.draw, std::mem::take(&mut stage.choices));
    stage.close().expect("no message");
    Frame { draw, choices, bytes, values }
}

fn rmse(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len());
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
    (sum / a.len() as f64).sqrt()
}

/// The scene with what was taken, and the exact one by the path and the chunks that were taken.
fn named(scene: &Scene, taken: &Frame) -> [Scene; 2] {
    let draw = scene.draw.exact();
    [taken.draw, Draw { path: taken.draw.path, chunks: taken.draw.chunks, ..draw }]
        .map(|draw| Scene { draw, ..scene.clone() })
}

/// Draws with everything "auto" and checks what has to hold whatever was the fastest.
fn check(blobs: &[([f64; 3], f64, f64)], error: f64, more: &[&str]) -> Frame {
    let error_set = format!("draw.error={error}");
    let asked = scene(blobs, &[&ALL[..], &[&error_set], more].concat());
    let auto = frame(asked.clone());
    let [named, exact] = named(&asked, &auto).map(frame);
    auto.choices.iter().for_each(|choice| println!("{}", choice.text()));
    assert!(named.choices.is_empty() && exact.choices.is_empty());
    assert!(auto.bytes == named.bytes, "{:?} draws another picture", auto.draw);
    let found = rmse(&auto.values, &exact.values);
    assert!(found <= error, "RMSE {found:e}, {error:e} allowed");
    assert!(exact.values.iter().any(|v| *v > 0.1), "something is drawn");
    // The last error, of all choices together, is the one found here; every value was tried.
    let n_tried: Vec<(&str, usize)> =
        auto.choices.iter().map(|c| (c.key, c.candidates.len())).collect();
    let of_sprites = if auto.draw.path == DrawPath::Sprites { &[("chunks", 4)][..] } else { &[] };
    let of_size =
        if asked.draw.resolution == Resolution::Auto { &[("resolution", 3)][..] } else { &[] };
    let cuts = [("threshold", 4), ("smallest", 4)];
    assert_eq!(n_tried, [&[("path", 2)], of_sprites, &[("cull", 2)], of_size, &cuts].concat());
    let last =
        auto.choices.last().map(|c| &c.candidates[c.taken]).and_then(|t| t.rmse).expect("an error");
    assert!((last - found).abs() <= 1e-6 * (1.0 + found), "told {last:e}, found {found:e}");
    assert!(
        auto.choices.iter().flat_map(|c| &c.candidates).all(|t| t.ms().is_some_and(|ms| ms > 0.0))
    );
    if error == 0.0 {
        assert!(auto.bytes == exact.bytes);
    }
    // Whatever was the fastest, it was not slower than changing nothing.
    for choice in &auto.choices {
        let ms = |i: usize| choice.candidates[i].ms().expect("a time");
        assert!(ms(choice.taken) <= ms(0), "{}", choice.text());
    }
    auto
}

/// Returns how many candidates of a knob change something and lie within the error.
fn n_allowed(frame: &Frame, key: &str, error: f64) -> usize {
    let choice = frame.choices.iter().find(|choice| choice.key == key).expect("a choice");
    assert_eq!(choice.error, Some(error));
    let allows = |c: &&Candidate| !c.is_first && c.rmse.is_some_and(|rmse| rmse <= error);
    choice.candidates.iter().filter(allows).count()
}

#[test]
fn with_sprites_chunks_are_chosen_too() {
    let layers = blobs(600, [0.8, 1.2], [0.5, 1.0]);
    let set = [
        "draw.path='sprites'",
        "draw.chunks='auto'",
        "draw.threshold='auto'",
        "film.format='rgba16f'",
    ];
    let asked = scene(&layers, &set);
    let auto = frame(asked.clone());
    auto.choices.iter().for_each(|choice| println!("{}", choice.text()));
    let keys: Vec<(&str, usize)> =
        auto.choices.iter().map(|c| (c.key, c.candidates.len())).collect();
    assert_eq!(keys, [("chunks", 4), ("threshold", 4)]);
    // They round otherwise than half floats do layer by layer, which is no error of theirs.
    assert!(auto.choices[0].candidates[1..].iter().all(|t| t.rmse.is_some_and(|rmse| rmse > 0.0)));
    let [named, exact] = named(&asked, &auto).map(frame);
    assert!(auto.bytes == named.bytes && rmse(&auto.values, &exact.values) <= asked.draw.error);
}

#[test]
fn thresholds_that_keep_the_error_may_be_taken() {
    // τ₀ 0.002 out to 8 σ of three pixels: cut at 0.001 they end at 1.2 σ, with a 45th of the
    // pixels.
    let thin = blobs(2500, [0.4, 0.5], [0.002, 0.0021]);
    // A smaller size would be taken before.
    let far = ["draw.cutoff=8", "draw.resolution=1.0"];
    let taken = check(&thin, 0.1, &far);
    assert_eq!(n_allowed(&taken, "threshold", 0.1), 3);
    // So much is not allowed, but for what later knobs add.
    let less = check(&thin, 1e-3, &far);
    assert!(less.draw.threshold.bound() < 1e-3, "{:?}", less.draw);
    // And nothing is where there is no error.
    let none = check(&thin, 0.0, &far);
    let is_exact = |draw: &Draw| (draw.threshold, draw.smallest, draw.resolution);
    assert_eq!(is_exact(&none.draw), (Cutoff::NONE, Cutoff::NONE, Resolution::Full));
}

#[test]
fn where_nothing_helps_the_picture_stays_within_the_error() {
    // Dense, wide, few: nothing is cut, none is small, and half the pixels show it.
    let dense = blobs(12, [0.8, 1.2], [2.0, 4.0]);
    for error in [1e-3, 0.0] {
        let taken = check(&dense, error, &[]);
        assert!(taken.draw.resolution == Resolution::Full || error > 0.0);
    }
}

#[test]
fn what_is_small_goes_where_it_may() {
    // Nine of ten are a tenth of a pixel wide, and 0.01 deep.
    let mut mixed = blobs(20_000, [0.01, 0.012], [0.01, 0.011]);
    mixed.extend(blobs(20, [0.8, 1.2], [0.5, 1.0]));
    let taken = check(&mixed, 0.1, &[]);
    assert_eq!(n_allowed(&taken, "smallest", 0.1), 3);
}

#[test]
fn other_knobs_stay_what_they_are() {
    let few = blobs(30, [0.4, 0.5], [0.1, 0.5]);
    let set = [
        "draw.path='tiles'",
        "draw.cull='off'",
        "draw.threshold=0.01",
        "draw.resolution='auto'",
        "draw.error=0.5",
    ];
    let asked = scene(&few, &set);
    let auto = frame(asked.clone());
    let draw = Draw { resolution: auto.draw.resolution, ..asked.draw };
    assert_eq!(auto.draw, draw);
    assert_eq!(
        (draw.path, draw.cull, draw.threshold),
        (DrawPath::Tiles, Cull::Off, Cutoff::At(0.01))
    );
    // Errors are by what the scene asks for: its first value has none.
    let [choice] = &auto.choices[..] else { panic!("{:?}", auto.choices) };
    assert_eq!(choice.candidates[0].rmse, Some(0.0));
    assert!(
        choice.candidates[1..].iter().all(|t: &Candidate| t.rmse.is_some_and(|rmse| rmse > 0.0))
    );
    // A scene without particles has nothing to choose, and what shells show is not culled.
    for (blobs, set) in [(&[][..], &ALL[..]), (&few, &["draw.cull='auto'", "draw.impostors='on'"])]
    {
        let frame = frame(scene(blobs, set));
        assert!(frame.choices.is_empty(), "{:?}", frame.choices);
        assert_eq!(frame.draw.cull, Cull::On);
    }
}
