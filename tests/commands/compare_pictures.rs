//! `nimbus compare` of two pictures as a user types it: numbers known by hand, and everything that
//! is no pair of pictures.

use crate::program;
use image::{ImageBuffer, Rgb, Rgba};
use serde_json::Value;

/// Exit code, stdout, stderr.
fn compare(args: &[&str]) -> (i32, String, String) {
    let output = program::run(&[&["compare"], args].concat());
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code().expect("an exit code"), text(output.stdout), text(output.stderr))
}

fn json(args: &[&str]) -> Value {
    let (code, stdout, stderr) = compare(&[args, &["--json"]].concat());
    assert_eq!((code, stderr.as_str()), (0, ""), "{args:?}");
    serde_json::from_str(&stdout).expect("JSON")
}

fn metric(json: &Value, name: &str) -> f64 {
    json["metrics"][name].as_f64().unwrap_or_else(|| panic!("{name} in {json}"))
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Folder {
        Folder(tempfile::tempdir().expect("a temporary folder"))
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().expect("UTF-8").to_owned()
    }

    fn exr(
        &self,
        name: &str,
        width: u32,
        height: u32,
        pixel: impl Fn(u32, u32) -> [f32; 4],
    ) -> String {
        let path = self.path(name);
        ImageBuffer::from_fn(width, height, |x, y| Rgba(pixel(x, y))).save(&path).expect("an EXR");
        path
    }

    fn png(
        &self,
        name: &str,
        width: u32,
        height: u32,
        pixel: impl Fn(u32, u32) -> [u8; 3],
    ) -> String {
        let path = self.path(name);
        ImageBuffer::from_fn(width, height, |x, y| Rgb(pixel(x, y))).save(&path).expect("a PNG");
        path
    }
}

#[test]
fn offsets_of_linear_pictures_by_hand() {
    let dir = Folder::new();
    // 0.25 and 0.5: exact in f32. Alpha is off by 0.5 in half of the pixels.
    let a = dir.exr("a.exr", 32, 16, |_, _| [0.5, 0.5, 0.5, 1.0]);
    let b = dir.exr("b.exr", 32, 16, |x, _| [0.75, 0.75, 0.75, if x < 16 { 1.0 } else { 0.5 }]);
    let json = json(&[&a, &b]);
    assert_eq!((metric(&json, "rmse"), metric(&json, "max")), (0.25, 0.25));
    // 1536 terms: some roundings of their sum.
    assert!((metric(&json, "relmse") - 0.0625 / 0.26).abs() < 1e-12);
    assert!((metric(&json, "psnr") - 20.0 * 4f64.log10()).abs() < 1e-12);
    assert_eq!((metric(&json, "alpha_max"), metric(&json, "alpha_rmse")), (0.5, 0.125f64.sqrt()));
    assert!(metric(&json, "ssim") < 1.0 && metric(&json, "flip") > 0.05);
    assert_eq!((json["values"].as_str(), json["not_finite"].as_u64()), (Some("linear"), Some(0)));
    assert_eq!(
        (json["psnr_peak"].as_f64(), json["rel_mse_epsilon"].as_f64()),
        (Some(1.0), Some(0.01))
    );
    assert_eq!(json["pixels_per_degree"].as_f64(), Some(67.0));
}

#[test]
fn pngs_of_8_and_16_bits_are_compared_as_display_values() {
    let dir = Folder::new();
    let black = dir.png("black.png", 24, 24, |_, _| [0; 3]);
    let white = dir.png("white.png", 24, 24, |_, _| [255; 3]);
    let apart = json(&[&black, &white]);
    assert_eq!(
        (metric(&apart, "rmse"), metric(&apart, "max"), metric(&apart, "psnr")),
        (1.0, 1.0, 0.0)
    );
    // (C1)/(1 + C1) of SSIM's formula, and FLIP's of black against white (measure::picture::flip).
    assert!((metric(&apart, "ssim") - 1e-4 / 1.0001).abs() < 1e-9);
    assert!((0.95..1.0).contains(&metric(&apart, "flip")));
    assert!(apart["metrics"]["alpha_max"].is_null() && apart["values"] == "display");
    let deep = dir.path("deep.png");
    ImageBuffer::from_fn(24, 24, |_, _| Rgb([65535u16; 3])).save(&deep).expect("a PNG");
    let same = json(&[&white, &deep]);
    assert!(
        metric(&same, "rmse") == 0.0
            && metric(&same, "flip") == 0.0
            && same["metrics"]["psnr"].is_null()
    );
    assert!((metric(&same, "ssim") - 1.0).abs() < 1e-12);
}

#[test]
fn values_that_are_not_finite_are_counted_and_left_out() {
    let dir = Folder::new();
    let a = dir.exr("a.exr", 16, 16, |x, y| {
        [0.5, 0.5, if (x, y) == (3, 3) { f32::NAN } else { 0.5 }, 1.0]
    });
    let bad = |x: u32, y: u32| if x == 9 && y < 2 { f32::INFINITY } else { 0.5 };
    let b = dir.exr("b.exr", 16, 16, |x, y| [bad(x, y), 0.5, 0.5, 1.0]);
    let json = json(&[&a, &b]);
    let count = |name: &str| json[name].as_u64();
    assert_eq!(
        [count("not_finite_a"), count("not_finite_b"), count("not_finite")],
        [Some(1), Some(2), Some(3)]
    );
    assert_eq!(
        (metric(&json, "rmse"), metric(&json, "max"), metric(&json, "flip")),
        (0.0, 0.0, 0.0)
    );
    let (code, stdout, stderr) = compare(&[&a, &b, "--fail-above", "not_finite=2"]);
    assert_eq!((code, stderr.as_str()), (1, "error: not_finite is 3, above 2\n"));
    assert!(stdout.contains("not finite: 1 pixels of A, 2 of B"), "{stdout}");
    let none = dir.exr("none.exr", 16, 16, |_, _| [f32::NAN; 4]);
    let (code, _, stderr) = compare(&[&a, &none]);
    assert!(code == 2 && stderr.contains("no pixel is finite in both"), "{stderr}");
}

#[test]
fn limits_decide_the_exit_code() {
    let dir = Folder::new();
    let a = dir.png("a.png", 20, 20, |_, _| [100; 3]);
    let b = dir.png("b.png", 20, 20, |x, _| [if x < 10 { 100 } else { 110 }; 3]);
    assert_eq!(compare(&[&a, &b, "--fail-above", "rmse=0.1", "--fail-below", "ssim=0.5"]).0, 0);
    let (code, stdout, stderr) =
        compare(&[&a, &b, "--fail-above", "max=0.01", "--fail-below", "psnr=60"]);
    assert!(code == 1 && stdout.contains("rmse"), "{stdout}");
    assert!(
        stderr.starts_with("error: max is 0.0392") && stderr.contains("; psnr is 31."),
        "{stderr}"
    );
    // Equal pictures have a PSNR without end, which is below nothing; of so few pixels there is no
    // SSIM.
    assert_eq!(compare(&[&a, &a, "--fail-below", "psnr=200"]).0, 0);
    let small = dir.png("small.png", 10, 20, |_, _| [0; 3]);
    assert_eq!(compare(&[&small, &small, "--fail-below", "ssim=0"]).0, 1);
    let table = compare(&[&small, &small]).1;
    let ssim = table.lines().find(|line| line.starts_with("ssim")).expect("a row");
    assert_eq!(ssim.split_whitespace().nth(1), Some("-"));
}

#[test]
fn the_map_is_written_once() {
    let dir = Folder::new();
    let a = dir.png("a.png", 20, 14, |_, _| [0; 3]);
    let b = dir.png("b.png", 20, 14, |_, _| [255; 3]);
    let map = dir.path("map.png");
    assert_eq!(compare(&[&a, &b, "-o", &map]).0, 0);
    let shown = image::open(&map).expect("a PNG").into_rgb8();
    assert_eq!(shown.dimensions(), (20, 14));
    assert!(shown.pixels().all(|p| p.0[0] > 200), "bright all over");
    let (code, _, stderr) = compare(&[&a, &b, "-o", &map]);
    assert!(code == 2 && stderr.contains("--force replaces it"), "{stderr}");
    assert_eq!(compare(&[&a, &a, "-o", &map, "--force"]).0, 0);
    assert!(image::open(&map).expect("a PNG").into_rgb8().pixels().all(|p| p.0[0] < 10));
}

#[test]
fn other_arguments_give_one_clear_error() {
    let dir = Folder::new();
    let a = dir.exr("a.exr", 16, 12, |_, _| [0.5; 4]);
    let wide = dir.exr("wide.exr", 17, 12, |_, _| [0.5; 4]);
    let png = dir.png("a.png", 16, 12, |_, _| [5; 3]);
    let text = dir.path("text.exr");
    std::fs::write(&text, "no picture").expect("a file");
    let run = dir.path("run");
    std::fs::create_dir(&run).expect("a folder");
    for (args, expected) in [
        (&[&a[..], &wide][..], "a.exr has 16×12 pixels, "),
        (&[&a, &png], "is for display; expected two .exr or two .png"),
        (&[&a, &text], "text.exr: cannot be read as a picture: "),
        (&[&a, &dir.path("gone.exr")], "gone.exr: "),
        (&[&a, &run], "run is not; expected two pictures or two results folders"),
        (&[&run, &png], "a.png is a picture, "),
        (&[&a, &a, "--allow", "scene"], "--allow is for results folders"),
        (&[&run, &run, "--fail-above", "rmse=1"], "are for pictures"),
        (
            &[&a, &a, "--fail-above", "psnr=30"],
            "--fail-above psnr: expected one of rmse, max, relmse, flip",
        ),
        (&[&a, &a, "--fail-below", "rmse=30"], "--fail-below rmse: expected one of psnr, ssim"),
        (&[&a, &a, "--fail-above", "rmse"], "expected METRIC=VALUE such as rmse=1e-3"),
        (&[&a, &a, "--pixels-per-degree", "0"], "expected a number from 1 to 500"),
        (&[&a, &a, "-o", &dir.path("map.exr")], "expected a file name that ends in .png"),
    ] {
        let (code, stdout, stderr) = compare(args);
        assert_eq!((code, stdout.as_str()), (2, ""), "{args:?}: {stderr}");
        assert!(stderr.starts_with("error: ") && stderr.contains(expected), "{args:?}: {stderr}");
    }
    assert!(!dir.0.path().join("map.exr").exists());
}
