//! `draw.overlap = "slices"` as users run it: the device draws what the f64 twin says, nearer to
//! the integral over the volume than thin sprites, with textures, surfaces, smaller pictures,
//! impostors and culling; "auto" chooses by error; what cannot be drawn is refused.

use crate::program::{differ, path, run};
use nimbus::frame::{DeviceChoice, Stage};
use nimbus::io::scene_file;
use nimbus::model::scene::{DrawPath, Overlap};
use tempfile::TempDir;

const SLICES: &str = "draw.overlap=\"slices\"";

/// Draws `scenes/<scene>.toml` in floats into `name`.
fn draw(dir: &TempDir, name: &str, scene: &str, settings: &[&str], options: &[&str]) {
    let (scene, file) = (format!("scenes/{scene}.toml"), path(dir, name));
    let mut args = vec!["render", &scene, "-o", &file, "--force", "-q"];
    args.extend(["--set", "film.format=\"rgba32f\""]);
    args.extend(settings.iter().flat_map(|s| ["--set", s]));
    args.extend(options);
    let output = run(&args);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn the_device_draws_the_slices_of_the_twin() {
    let dir = tempfile::tempdir().expect("a folder");
    // RMSE of f32 over some 50 layers; textures err by 1e-4 of an optical depth.
    for (scene, settings, most) in [
        ("study-cloud", &["draw.cutoff=8"][..], 2e-6),
        ("study-cloud", &["draw.slice=0.4"], 2e-6),
        ("cubes-554", &[], 5e-6),
        // The f64 reference lights the floor more exactly.
        ("study-both", &["lighting.mode=\"first\""], 1e-3),
    ] {
        let settings = [&[SLICES], settings].concat();
        let size = ["--size", "120x90"];
        draw(&dir, "a.exr", scene, &settings, &[&size[..], &["--validation"]].concat());
        draw(&dir, "b.exr", scene, &settings, &[&size[..], &["--reference", "slices"]].concat());
        let (rmse, _) = differ(&dir, "b.exr", "a.exr");
        println!("{scene} {settings:?}: {rmse:e}");
        assert!(rmse <= most, "{scene} {settings:?}: {rmse:e}");
        // The twin of thin sprites is another picture.
        draw(&dir, "b.exr", scene, &settings, &[&size[..], &["--reference", "thin"]].concat());
        let (thin, _) = differ(&dir, "b.exr", "a.exr");
        assert!(thin > (4.0 * most).max(1e-3), "{scene} {settings:?}: {thin:e}");
    }
}

/// The row "thin sprites stand for a volume" falls to a tenth: 0.077 and 0.088 at 200 x 150 pixels.
#[test]
fn a_tenth_of_the_error_of_thin_sprites_is_left() {
    let dir = tempfile::tempdir().expect("a folder");
    for scene in ["study-cloud", "study-both"] {
        let size = ["--size", "120x90"];
        draw(&dir, "v.exr", scene, &[], &[&size[..], &["--reference", "volume"]].concat());
        let error = |overlap: &str| {
            draw(&dir, "a.exr", scene, &["draw.cutoff=8", overlap], &size);
            differ(&dir, "v.exr", "a.exr").0
        };
        let [thin, slices] = [error("draw.overlap=\"thin\""), error(SLICES)];
        println!("{scene}: {slices:e} of {thin:e}");
        assert!(slices <= 0.1 * thin, "{scene}: {slices:e} of {thin:e}");
    }
}

#[test]
fn what_leaves_out_work_changes_slices_as_little_as_thin_sprites() {
    let dir = tempfile::tempdir().expect("a folder");
    let size = ["--size", "160x120"];
    let frame = ["--size", "160x120", "--frame", "3"];
    // Of a setting: the greatest RMSE, or how often that of thin sprites, and a part that does not
    // depend on the way.
    for (scene, setting, options, times) in [
        ("study-cloud", "draw.cull=\"off\"", &size[..], 0.0),
        ("study-cloud", "draw.sort_bits=32", &size, 0.0),
        ("study-cloud", "draw.resolution=0.5", &size, 1.5),
        ("hello", "draw.impostors=\"on\"", &frame, 2.0),
        ("clusters-20", "draw.impostors=\"on\"", &frame, 2.0),
    ] {
        let error = |overlap: &str| {
            let tiles = "draw.path=\"tiles\"";
            draw(&dir, "a.exr", scene, &[tiles, overlap], options);
            draw(&dir, "b.exr", scene, &[tiles, overlap, setting], options);
            differ(&dir, "a.exr", "b.exr").0
        };
        let [thin, slices] = [error("draw.overlap=\"thin\""), error(SLICES)];
        println!("{scene}, {setting}: {slices:e}, thin {thin:e}");
        assert!(slices <= times * thin + 2e-4, "{scene}, {setting}: {slices:e}, thin {thin:e}");
    }
}

/// Returns the path and the overlap that the drawing of `scene` settles on.
fn chosen(scene: &str, settings: &[&str]) -> (DrawPath, Overlap) {
    let overrides: Vec<String> = settings.iter().map(|s| (*s).to_owned()).collect();
    let file = format!("scenes/{scene}.toml");
    let scene = scene_file::load(file.as_ref(), &overrides, None).expect("it loads").scene;
    let choice = DeviceChoice { validation: true, ..DeviceChoice::default() };
    let stage = Stage::new(scene, &choice, true).expect("a stage");
    let draw = stage.scene.draw;
    for of in &stage.choices {
        println!("{}", of.text());
    }
    stage.close().expect("no message");
    (draw.path, draw.overlap)
}

#[test]
fn auto_takes_thin_sprites_only_where_they_are_near_enough() {
    let small = ["film.width=96", "film.height=72", "draw.overlap=\"auto\""];
    let with = |more: &[&str]| chosen("study-cloud", &[&small[..], more].concat());
    // Thin sprites err by 1e-2: more than the default error allows.
    assert_eq!(with(&[]), (DrawPath::Tiles, Overlap::Slices));
    assert_eq!(with(&["draw.error=0.0"]), (DrawPath::Tiles, Overlap::Slices));
    assert_eq!(with(&["draw.path=\"sprites\""]), (DrawPath::Sprites, Overlap::Thin));
    // Either way where any error is allowed, but never slices on another path.
    let (path, overlap) = with(&["draw.path=\"auto\"", "draw.error=0.9"]);
    assert!(path == DrawPath::Tiles || overlap == Overlap::Thin);
    assert_eq!(chosen("study-cloud", &["draw.path=\"auto\"", SLICES]).1, Overlap::Slices);
}

/// Without a knob, a study varies those that can change slices, and no other.
#[test]
fn studies_and_ledgers_know_slices() {
    let small = ["scenes/hello.toml", "--size", "60x45", "--set", SLICES, "--pixels", "64"];
    let quick = ["--against", "slices", "--rounds", "1", "--frames", "1", "--csv", "-q"];
    let output = run(&[&["error"], &small[..], &quick[..]].concat());
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("draw.slice=2.0") && text.contains("draw.overlap=thin"), "{text}");
    assert!(!text.contains("draw.path"), "{text}");
    let output = run(&[
        &["ledger"],
        &small[..],
        &["--plain", "--reflections", "2", "--json", "-q"],
    ]
    .concat());
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("\"slices\"") && !text.contains("thin sprites"), "{text}");
}

/// Depths and radiances at their greatest: sums of products stay finite.
#[test]
fn the_deepest_and_brightest_blobs_stay_finite() {
    let dir = tempfile::tempdir().expect("a folder");
    let row = "0,0,-1e8,2.4e7,1e15,1e15,1e15,1e15\n";
    let list = format!("x,y,z,radius,kappa,r,g,b\n{}", row.repeat(40));
    std::fs::write(dir.path().join("list.csv"), list).expect("a list");
    let scene = "[film]\nwidth = 32\nheight = 24\nformat = 'rgba32f'\n[camera]\nposition = [0.0, \
        0.0, 12.0]\n[lighting]\nmode = 'none'\n[draw]\noverlap = 'slices'\n[[cloud]]\nfrom = \
        'particles'\nfile = 'list.csv'\n";
    std::fs::write(dir.path().join("s.toml"), scene).expect("a scene");
    let output = run(&["render", &path(&dir, "s.toml"), "-o", &path(&dir, "a.exr")]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !text.contains("not finite"), "{text}");
}

#[test]
fn slices_of_other_paths_and_thicknesses_are_refused() {
    for (settings, expected) in [
        (
            &["draw.path=\"sprites\"", SLICES][..],
            "expected \"thin\" where draw.path is \"sprites\"",
        ),
        (&["draw.overlap=\"thick\""], "known here: `thin`, `slices`, `auto`"),
        (&["draw.slice=0"], "expected a number from 0.1 to 10"),
        (&["draw.slice=11"], "expected a number from 0.1 to 10"),
    ] {
        let mut args = vec!["render", "scenes/hello.toml", "-o", "never.png"];
        args.extend(settings.iter().flat_map(|s| ["--set", s]));
        let output = run(&args);
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains(expected), "{settings:?}: {text}");
    }
}
