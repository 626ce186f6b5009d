//! The defaults lie where they should: in the main scenes no value of a knob that is cheaper than
//! the default is as near to the reference. By errors alone, which are the same on every machine;
//! what takes longer is known from what a knob does.

use crate::program;
use nimbus::timing::sweep::Axis;

/// Keys of drawing with values below the default, each of which does less work than the next, and
/// than the default.
const DRAWING: [&str; 5] = [
    "draw.cutoff=2,2.5",
    "draw.resolution=0.25,0.5",
    "draw.threshold=0.01,0.03",
    "film.format=rgba8",
    "draw.sort_bits=16",
];
/// The same of light in a cloud.
const LIGHT: [&str; 2] = ["lighting.grid=16,24,32", "lighting.step=4,2"];

/// A cheaper value that is nearer by less than this share of the default's error is as near: both
/// errors are then those of something else, which the knob moves by chance. (Half of the resolution
/// blurs the rim of the cut at 3 sigma: 1.6 % in study-cloud.)
const CHANCE: f64 = 0.02;

/// Every error of a scene by name; the unchanged scene first.
fn errors(args: &[&str], knobs: &[&str]) -> Vec<(String, f64)> {
    let mut all =
        vec!["error", "--csv", "-q", "--rounds", "1", "--frames", "1", "--pixels", "4096"];
    all.extend(args);
    all.extend(knobs.iter().flat_map(|knob| ["--knob", knob]));
    let output = program::run(&all);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut rows = csv::Reader::from_reader(&output.stdout[..]);
    let rmse = rows.headers().unwrap().iter().position(|h| h == "rmse").unwrap();
    let row = |r: csv::StringRecord| (r[0].to_owned(), r[rmse].parse().unwrap());
    // Combinations of several knobs are not tested here.
    rows.records().map(|r| row(r.unwrap())).filter(|(name, _)| !name.contains(", ")).collect()
}

/// The rows of a study: the unchanged scene and each value of each knob.
fn n_rows(knobs: &[&str]) -> usize {
    let n_values = |knob: &&str| Axis::parse("--knob", knob).unwrap().values.len();
    1 + knobs.iter().map(n_values).sum::<usize>()
}

/// The cheaper values that are as near as the default: complaints.
fn as_near(found: &[(String, f64)]) -> Vec<String> {
    let (base, default) = &found[0];
    assert_eq!(base, "as it stands");
    let is_as_near = |(_, error): &&(String, f64)| *error < default * (1.0 - CHANCE);
    found[1..]
        .iter()
        .filter(is_as_near)
        .map(|(name, error)| format!("{name}: {error:.3e} < {default:.3e}"))
        .collect()
}

#[test]
fn no_cheaper_value_is_nearer_to_the_reference() {
    // By sprites in f64: what sprites themselves err would hide what the knobs do.
    let scenes: [&[&str]; 4] = [
        &["scenes/hello.toml"],
        &["scenes/cubes-554.toml", "--size", "400x300"],
        &["scenes/cubes-615.toml", "--size", "400x300"],
        &["scenes/study-cloud.toml", "--size", "200x150"],
    ];
    for scene in scenes {
        let found = errors(&[scene, &["--against", "thin"]].concat(), &DRAWING);
        // A value that the scene has already shares the row of the unchanged scene.
        assert!(n_rows(&DRAWING) - found.len() < 2, "{found:?}");
        assert_eq!(as_near(&found), Vec::<String>::new(), "{scene:?}: {found:?}");
    }
}

#[test]
fn of_slices_neither() {
    // Thicker slices are fewer, and thin sprites need none. The integral over the volume tells.
    for scene in ["scenes/study-cloud.toml", "scenes/study-both.toml"] {
        let knobs = ["draw.slice=1.75,2.5", "draw.overlap=thin"];
        let slices = ["--set", "draw.overlap=slices", "--size", "160x120"];
        let found = errors(&[&[scene, "--against", "volume"], &slices[..]].concat(), &knobs);
        assert_eq!(found.len(), n_rows(&knobs));
        assert_eq!(as_near(&found), Vec::<String>::new(), "{scene}: {found:?}");
    }
}

#[test]
fn of_light_in_a_cloud_neither() {
    let found =
        errors(&["scenes/study-cloud.toml", "--against", "model", "--size", "200x150"], &LIGHT);
    assert_eq!(found.len(), n_rows(&LIGHT));
    assert_eq!(as_near(&found), Vec::<String>::new(), "{found:?}");
}

#[test]
fn of_light_between_surfaces_neither() {
    let knobs = [
        "lighting.mode=first",
        "surface.*.subdivide=[4,4],[6,6]",
        "lighting.bases=3,4",
        "lighting.sampling=uniform",
        "lighting.pair_size=1,2",
    ];
    let found =
        errors(&["scenes/study-light.toml", "--against", "model", "--size", "120x90"], &knobs);
    assert_eq!(found.len(), n_rows(&knobs));
    assert_eq!(as_near(&found), Vec::<String>::new(), "{found:?}");
    // Of 2048 facets the tree gathers.
    let fine = ["--set", "surface.*.subdivide=[16,16]"];
    let scene = ["scenes/study-light.toml", "--against", "model", "--size", "120x90"];
    let found = errors(&[&scene[..], &fine].concat(), &["lighting.theta=0.6,0.8"]);
    assert_eq!(found.len(), 3);
    assert_eq!(as_near(&found), Vec::<String>::new(), "{found:?}");
}

#[test]
fn a_default_that_is_too_cheap_is_found() {
    // With the default's place taken by a poor value better ones are cheaper or equal: the
    // comparison sees it.
    let found = errors(
        &[
            "scenes/hello.toml",
            "--against",
            "thin",
            "--set",
            "draw.resolution=0.25",
            "--size",
            "160x120",
        ],
        &["draw.resolution=0.5,1.0"],
    );
    assert_eq!(as_near(&found).len(), 2, "{found:?}");
}
