//! `nimbus render --reference`: the whole picture in f64 against the device's picture, and the
//! volume.

use std::path::Path;

use crate::program::{differ, nimbus, path, run};
use crate::signals;
use serde_json::Value;

/// Renders `scene` to `name` in `dir` and returns the output of `--json`.
fn render(dir: &tempfile::TempDir, name: &str, scene: &[&str], more: &[&str]) -> Value {
    let out = path(dir, name);
    let output = run(&[&["render", "-q", "--json", "--force", "-o", &out], scene, more].concat());
    assert!(
        output.status.success(),
        "{scene:?} {more:?}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn temp() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// The volume has no textures.
const PLAIN: &str = "cloud.0.texture=\"none\"";
const CUBES: [&str; 3] = ["scenes/cubes-554.toml", "--size", "100x75"];

const FLAT: [&str; 3] = ["tests/data/flat.toml", "--size", "100x75"];

/// f32 lighting and drawing make some hundred roundings of 2⁻²⁴ a value, 10⁻⁵ if all have one sign.
/// A pixel on a sprite's edge may be drawn or not: e^{−4.5} of its α.
const RMSE_OF_F32: f64 = 1e-5;
const MAX_OF_F32: f64 = 0.012;

#[test]
fn the_thin_reference_is_what_the_device_draws() {
    let dir = temp();
    let unlit = "lighting.mode=\"none\"";
    for (what, scene) in [
        ("two reflections and a list's colours", vec!["scenes/hello.toml", "--size", "80x60"]),
        ("boxes", CUBES.to_vec()),
        (
            "later, with wind",
            [&CUBES[..], &["--time", "3", "--set", "cloud.0.wind=[0.5,0,0]"]].concat(),
        ),
        (
            "facets of many particles",
            [&CUBES[..], &["--set", "lighting.facets_per_cloud=50"]].concat(),
        ),
        (
            "fewer by distance",
            [&CUBES[..], &["--set", "draw.count=\"distance\"", "--set", "draw.count_a=20"]]
                .concat(),
        ),
        ("ellipsoids", FLAT.to_vec()),
        // The grid of a scene that stands still has no spare room.
        ("ellipsoids that stand still", [&FLAT[..], &["--set", "cloud.0.wind=[0,0,0]"]].concat()),
        (
            "ellipsoids that grow",
            [&FLAT[..], &["--time", "2", "--set", "cloud.0.grow_to=1.5"]].concat(),
        ),
        (
            "facets of many ellipsoids",
            [&FLAT[..], &["--set", "lighting.facets_per_cloud=20"]].concat(),
        ),
        (
            "ellipsoids in chunks",
            [&FLAT[..], &["--set", "draw.path=\"sprites\"", "--set", "draw.chunks=3"]].concat(),
        ),
        (
            "surfaces that nothing lights",
            vec!["scenes/ground.toml", "--size", "80x60", "--set", unlit],
        ),
    ] {
        render(&dir, "thin.exr", &scene, &["--reference", "thin"]);
        render(&dir, "drawn.exr", &scene, &["--set", "film.format=\"rgba32f\""]);
        let (rmse, max) = differ(&dir, "thin.exr", "drawn.exr");
        println!("{what}: RMSE {rmse:.1e}, greatest {max:.1e}");
        assert!(rmse <= RMSE_OF_F32 && max <= MAX_OF_F32, "{what}: {rmse:e} {max:e}");
    }
    // The comparison notices another picture: other particles, and one particle fewer.
    render(&dir, "thin.exr", &CUBES, &["--reference", "thin"]);
    for other in
        [&["--seed", "8"][..], &["--set", "draw.count=\"distance\"", "--set", "draw.count_a=5000"]]
    {
        render(&dir, "drawn.exr", &CUBES, &[&["--set", "film.format=\"rgba32f\""], other].concat());
        assert!(
            differ(&dir, "thin.exr", "drawn.exr").0 > 5.0 * RMSE_OF_F32,
            "{other:?} is noticed"
        );
    }
}

#[test]
fn the_volume_has_all_particles_and_says_how_exact_it_is() {
    let dir = temp();
    let size = ["scenes/cubes-554.toml", "--size", "40x30", "--set", PLAIN];
    let fewer = ["--set", "draw.count=\"distance\"", "--set", "draw.count_a=20"];
    let [all, counted] = [&[][..], &fewer].map(|more| {
        let volume =
            render(&dir, "volume.exr", &size, &[&["--reference", "volume"], more].concat());
        let thin = render(&dir, "thin.exr", &size, &[&["--reference", "thin"], more].concat());
        assert_eq!(
            (volume["particles"].as_u64(), volume["not_finite"].as_u64()),
            (Some(554), Some(0))
        );
        let (error, brightest) =
            (volume["error"].as_f64().expect("one"), volume["brightest"].as_f64().expect("one"));
        assert!(error > 0.0 && error < 1e-5 * brightest, "{error:e}");
        assert!(thin["error"].is_null());
        (volume, thin)
    });
    assert_eq!(all.0["image_hash"], counted.0["image_hash"]);
    assert_ne!(all.1["image_hash"], counted.1["image_hash"]);
    assert!(counted.1["particles"].as_u64().expect("a number") < 554);
    // Sprites are near the volume but differ from it.
    render(&dir, "volume.exr", &size, &["--reference", "volume"]);
    render(&dir, "thin.exr", &size, &["--reference", "thin"]);
    let (rmse, _) = differ(&dir, "volume.exr", "thin.exr");
    assert!((1e-3..0.05).contains(&rmse), "{rmse:e}");
    // The PNG shows the volume.
    render(&dir, "volume.png", &size, &["--reference", "volume"]);
    assert!(image::open(path(&dir, "volume.png")).is_ok());
}

#[test]
fn a_target_of_eight_bits_holds_steps_of_0_to_1() {
    let dir = temp();
    // A light that takes the cloud's radiance beyond 1, where the target clamps it.
    let bright =
        ["--set", "light.0.irradiance=[9,9,9]", "--validation", "--set", "film.format=\"rgba8\""];
    render(&dir, "drawn.exr", &CUBES, &bright);
    let drawn = image::open(path(&dir, "drawn.exr")).expect("a picture").into_rgba32f();
    assert!(
        drawn
            .as_raw()
            .iter()
            .all(|v| (0.0..=1.0).contains(v) && (255.0 * v - (255.0 * v).round()).abs() < 1e-4)
    );
    assert!(
        drawn.pixels().any(|p| p.0[0] == 1.0)
            && drawn.pixels().any(|p| p.0[0] > 0.0 && p.0[0] < 0.5)
    );
    // Where nothing is clamped the picture is near the reference: 20 layers and more, each off by
    // up to two steps where it covers much.
    render(&dir, "thin.exr", &CUBES, &["--reference", "thin"]);
    let dim = ["--set", "light.0.irradiance=[1,1,1]", "--set", "light.1.irradiance=[0.5,0.5,0.5]"];
    render(&dir, "dim.exr", &CUBES, &[&dim[..], &["--set", "film.format=\"rgba8\""]].concat());
    render(&dir, "thin.exr", &CUBES, &[&dim[..], &["--reference", "thin"]].concat());
    let (rmse, max) = differ(&dir, "thin.exr", "dim.exr");
    println!("rgba8: RMSE {rmse:.1e}, greatest {max:.1e}");
    assert!((1e-4..2e-2).contains(&rmse) && max < 0.1, "{rmse:e} {max:e}");
}

#[test]
fn no_vulkan_is_needed() {
    let dir = temp();
    let out = path(&dir, "thin.png");
    let args = ["render", "scenes/hello.toml", "--size", "40x30", "-o", &out];
    let without = |args: &[&str]| {
        let mut command = nimbus(args);
        command.env("VK_DRIVER_FILES", "/nowhere.json").env("VK_ICD_FILENAMES", "/nowhere.json");
        command.output().expect("the program runs").status.code()
    };
    assert_eq!(without(&args), Some(3));
    assert_eq!(without(&[&args[..], &["--reference", "thin"]].concat()), Some(0));
}

#[test]
fn what_a_reference_cannot_do_is_said_and_nothing_written() {
    let dir = temp();
    let out = path(&dir, "never.exr");
    for (args, expected) in [
        (&["--reference", "thick"][..], "expected thin, slices, volume, model, reflections=K"),
        (&["--reference", "thin", "--device", "0"], "cannot be used with"),
        (&["--reference", "thin", "--validation"], "cannot be used with"),
        (&["--reference", "volume", "--no-skip"], "cannot be used with"),
        (
            &["--reference", "thin", "--set", "material.0.ks=[0.01,0,0]"],
            "cloud 0: its material \"cloud\" has a lobe, and the f64 reference has diffuse clouds",
        ),
        (&["--reference", "volume"], "cloud 0 is textured"),
        (&["--reference", "volume", "--set", PLAIN, "--time", "nan"], "finite"),
    ] {
        let output = run(&[&["render", "-o", &out], &CUBES[..], args].concat());
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {stderr}");
        assert!(stderr.starts_with("error: ") && stderr.contains(expected), "{args:?}: {stderr}");
        assert!(!Path::new(&out).exists());
    }
    let nowhere = path(&dir, "gone/never.exr");
    let output = run(&[&["render", "-o", &nowhere, "--reference", "volume"], &CUBES[..]].concat());
    assert!(
        output.status.code() == Some(2)
            && String::from_utf8_lossy(&output.stderr).contains("does not exist")
    );
}

#[test]
fn ctrl_c_leaves_nothing_half_written() {
    let dir = temp();
    let out = path(&dir, "late.exr");
    // Rendering takes minutes.
    let args = [
        "render",
        "scenes/cubes-554.toml",
        "--size",
        "1600x1200",
        "--set",
        PLAIN,
        "--reference",
        "volume",
        "-o",
        &out,
    ];
    let (output, _) = signals::interrupt(&mut nimbus(&args), |_| true);
    assert_eq!(output.status.code(), Some(130));
    assert_eq!(std::fs::read_dir(dir.path()).expect("the folder").count(), 0);
}
