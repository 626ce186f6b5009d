//! References by samples: means over a pixel's area, and parts that are put together to the same
//! bits as the whole.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use nimbus::error::Error;
use nimbus::io::scene_file;
use nimbus::model::scene::Scene;
use nimbus::reference::picture::{
    MeanPicture, N_VALUES, PairwiseSum, Pixels, ReferenceKind, ReferenceRequest, SampleSums, Tile,
    sums,
};

fn loaded(scene: &str, set: &[&str]) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(scene);
    let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
    scene_file::load(&path, &set, None).expect("a scene").at_frame(0)
}

fn of(
    subject: &ReferenceRequest<'_>,
    pixels: &Pixels,
    samples: std::ops::Range<u32>,
) -> SampleSums {
    sums(subject, pixels, samples, &AtomicBool::new(false), &|_, _| ()).expect("sums")
}

/// Computes tiles of `size`, each in ranges of two samples.
fn in_parts(subject: &ReferenceRequest<'_>, n: u32, [columns, rows]: [u32; 2]) -> SampleSums {
    let film = subject.scene.film;
    let whole = Pixels::all(film.width, film.height);
    let mut values = vec![f64::NAN; N_VALUES * whole.at.len()];
    for top in (0..film.height).step_by(rows as usize) {
        for left in (0..film.width).step_by(columns as usize) {
            let (width, height) = (columns.min(film.width - left), rows.min(film.height - top));
            let pixels = Pixels::tile(film.width, film.height, Tile { left, top, width, height });
            let mut pairs = PairwiseSum::default();
            (0..n)
                .step_by(2)
                .for_each(|first| pairs.push(of(subject, &pixels, first..n.min(first + 2))));
            let found = pairs.total().expect("a range");
            for (at, value) in pixels.at.iter().zip(found.values.chunks_exact(N_VALUES)) {
                values[N_VALUES * whole.index(*at)..][..N_VALUES].copy_from_slice(value);
            }
        }
    }
    SampleSums { n_samples: n, values }
}

#[test]
fn tiles_and_ranges_are_the_whole_to_the_bit() {
    let size = ["film.width=11", "film.height=8"];
    let plain = "cloud.0.texture=\"none\"";
    for (what, of_which, scene, more) in [
        ("sprites with textures", "thin", "scenes/cubes-554.toml", &[][..]),
        ("the volume", "volume", "scenes/cubes-554.toml", &[plain][..]),
        ("facets of a room", "thin", "scenes/study-light.toml", &["lighting.mode=\"first\""]),
        ("every pixel of a floor lit", "model", "scenes/study-light.toml", &[]),
        (
            "random paths",
            "reflections=3",
            "scenes/study-light.toml",
            &["film.width=7", "film.height=5"],
        ),
        (
            "random paths to particles",
            "reflections=3",
            "scenes/cubes-554.toml",
            &[plain, "draw.particles=12", "film.width=4", "film.height=3"],
        ),
        ("what nothing lights", "model", "scenes/hello.toml", &[plain, "lighting.mode=\"none\""]),
        (
            "hills",
            "thin",
            "scenes/katrina.toml",
            &["lighting.mode=\"none\"", "cloud.0.particles=300"],
        ),
    ] {
        let scene = loaded(scene, &[&size[..], more].concat());
        let subject = ReferenceRequest {
            kind: of_which.parse().expect("a reference"),
            scene: &scene,
            time_s: 0.0,
        };
        let pixels = Pixels::all(scene.film.width, scene.film.height);
        let whole = of(&subject, &pixels, 0..3);
        assert!(
            whole.values.iter().all(|v| v.is_finite()) && whole.values.iter().any(|v| *v > 0.0),
            "{what}"
        );
        for size in [[4, 5], [11, 7]] {
            assert!(in_parts(&subject, 3, size) == whole, "{what}: tiles of {size:?}");
        }
        // Samples differ, so that confused ranges would be noticed.
        let [a, b] = [0..1, 1..2].map(|range| of(&subject, &pixels, range));
        assert!(a.values != b.values, "{what}");
    }
}

/// A white wall one unit before the eye, which sees two units of it in eight pixels. It ends 0.3 of
/// a pixel into column 4, and 0.6 of a pixel below the upper edge of row 2. To the left and below
/// it ends out of sight.
const WALL: &str = r#"
[film]
width = 8
height = 8
[camera]
position = [0.0, 0.0, 1.0]
target = [0.0, 0.0, 0.0]
fov_y_deg = 90
[lighting]
mode = "none"
[[material]]
name = "white"
kd = [1.0, 1.0, 1.0]
[[surface]]
center = [-0.9625, -0.825, 0.0]
u = [1.0375, 0.0, 0.0]
v = [0.0, 1.175, 0.0]
material = "white"
"#;

#[test]
fn a_pixel_has_what_covers_its_area() {
    let dir = tempfile::tempdir().expect("a folder");
    let file = dir.path().join("wall.toml");
    std::fs::write(&file, WALL).expect("a file");
    let scene = scene_file::load(&file, &[], None).expect("a scene").at_frame(0);
    for of_which in ["thin", "volume", "model"] {
        let subject = ReferenceRequest {
            kind: of_which.parse().expect("a reference"),
            scene: &scene,
            time_s: 0.0,
        };
        let alpha = |n: u32| -> Vec<f64> {
            let mean = of(&subject, &Pixels::all(8, 8), 0..n).mean();
            mean.rgba.iter().map(|v| v[3]).collect()
        };
        // The wall's upper edge is at y = 0.35: row 2 begins at y = 0.5, 0.25 a pixel, so 0.4 of it
        // is covered.
        let at = |values: &[f64], column: usize, row: usize| values[8 * row + column];
        let one = alpha(1);
        // The centre is outside in both.
        assert_eq!(
            [at(&one, 4, 5), at(&one, 1, 2), at(&one, 1, 5), at(&one, 6, 5)],
            [0.0, 0.0, 1.0, 0.0]
        );
        for n in [64, 512] {
            let many = alpha(n);
            // A sequence of low discrepancy errs by a few samples, not by √n.
            let off = 4.0 / f64::from(n);
            for (column, row, covered) in
                [(4, 5, 0.3), (1, 2, 0.4), (4, 2, 0.12), (1, 5, 1.0), (6, 5, 0.0)]
            {
                let found = at(&many, column, row);
                assert!(
                    (found - covered).abs() <= off,
                    "{of_which}, {n}, {column} {row}: {found}, not {covered}"
                );
            }
        }
    }
}

/// Root mean square difference of two pictures, of the greatest channel.
fn differ(a: &MeanPicture, b: &MeanPicture) -> f64 {
    let of =
        |(a, b): (&[f64; 4], &[f64; 4])| (0..3).map(|k| (a[k] - b[k]).powi(2)).fold(0.0, f64::max);
    let sum: f64 = a.rgba.iter().zip(&b.rgba).map(of).sum();
    (sum / a.rgba.len() as f64).sqrt()
}

#[test]
fn more_samples_are_nearer_and_say_so() {
    let size = ["film.width=8", "film.height=6"];
    let scene = loaded("scenes/study-light.toml", &size);
    let subject =
        ReferenceRequest { kind: ReferenceKind::Reflections(3), scene: &scene, time_s: 0.0 };
    let pixels = Pixels::all(8, 6);
    // Samples other than those that are compared.
    let truth = of(&subject, &pixels, 1000..1064).mean();
    let mut before = f64::INFINITY;
    for n in [2u32, 8, 32] {
        let mean = of(&subject, &pixels, 0..n).mean();
        let (off, said) = (differ(&mean, &truth), mean.own_error);
        println!("{n} samples: off by {off:.2e}, said {said:.2e}");
        // The stated error is too large, as samples are spread evenly, but by no more than some ten
        // times.
        assert!(off < 1.5 * said + truth.own_error && off < before, "{n}: {off} {said}");
        assert!(said < 20.0 * off, "{n}: {off} {said}");
        before = off;
    }
}

#[test]
fn it_ends_when_it_is_asked_to() {
    let scene = loaded("scenes/hello.toml", &["film.width=8", "film.height=6"]);
    let subject = ReferenceRequest { kind: ReferenceKind::Thin, scene: &scene, time_s: 0.0 };
    let stop = AtomicBool::new(true);
    let ended = sums(&subject, &Pixels::all(8, 6), 0..1_000_000, &stop, &|_, _| ());
    assert!(matches!(ended, Err(Error::Interrupted)), "{ended:?}");
}
