//! Ground of weather files in scenes: the device's picture compared with the reference, its effect
//! on light, and errors.

#[path = "harness/program.rs"]
mod program;
#[path = "harness/weather_files.rs"]
mod weather_files;

use std::fs;

use glam::DVec3;
use nimbus::io::scene_file::load;
use nimbus::model::light::Light;
use nimbus::model::shape::Shape;
use nimbus::reference::Blob;
use nimbus::reference::area::AreaScene;
use nimbus::reference::picture::FrameReference;
use program::{differ, path, run};
use tempfile::TempDir;
use weather_files::Made;

const NX: usize = 8;
const NY: usize = 6;

/// A mountain of 1500 m in the west of 8 × 6 columns of 1 km, and clouds in the east.
fn file() -> Made {
    Made::wrf_of(1, 1, [NX, NY, 5])
        .with_floats("HGT", |h| {
            for (k, h) in h.iter_mut().enumerate() {
                let (x, north) = ((k % NX) as f32 - 1.5, (k / NX) as f32 - 2.2);
                *h = 1500.0 * (-(x * x + north * north) / 3.0).exp();
            }
        })
        .with_floats("QCLOUD", |q| {
            q.iter_mut()
                .enumerate()
                .for_each(|(i, q)| *q = if i / (NX * NY) == 3 && i % NX > 3 { 2e-4 } else { 0.0 });
        })
}

/// Writes a scene with that file; `more` holds further keys of the cloud.
fn scene_of(made: &Made, more: &str) -> TempDir {
    let dir = tempfile::tempdir().expect("a folder");
    fs::write(dir.path().join("w.nc"), made.bytes()).expect("a file");
    let scene = format!(
        r#"
[film]
width = 100
height = 75
format = "rgba32f"
[camera]
position = [300.0, 9000.0, 500.0]
target = [0.0, 0.0, 0.0]
fov_y_deg = 30.0
near = 10.0
[lighting]
mode = "first"
grid = 24
step = 1.0
[[light]]
kind = "directional"
direction = [-0.3, -1.0, 0.2]
irradiance = [3.0, 2.9, 2.7]
[[light]]
kind = "sky"
irradiance = [0.8, 0.87, 1.0]
constant = 0.3
[[material]]
name = "cloud"
[[material]]
name = "rock"
kd = [0.5, 0.4, 0.3]
[[cloud]]
from = "weather"
file = "w.nc"
particles = 120
{more}
"#
    );
    fs::write(dir.path().join("scene.toml"), scene).expect("a scene");
    dir
}

fn render(dir: &TempDir, name: &str, more: &[&str]) {
    let (scene, out) = (path(dir, "scene.toml"), path(dir, name));
    let output = run(&[&["render", &scene, "-q", "--force", "-o", &out], more].concat());
    assert!(output.status.success(), "{more:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Error of lighting and drawing in f32, as in tests/commands/render_reference.rs. The ground's
/// edge, where a pixel may belong to either side, is out of view.
const RMSE_OF_F32: f64 = 1e-5;

#[test]
fn device_matches_the_reference() {
    let dir = scene_of(&file(), "ground = \"rock\"\nmaterial = \"cloud\"\nexaggeration = 1.5");
    let plate = "[[surface]]\ncenter = [3000.0, 400.0, 1000.0]\nu = [900.0, 0.0, 0.0]\nv = [0.0, \
        0.0, -900.0]\n\
                 subdivide = [3, 3]\nmaterial = \"rock\"\n";
    let scene = fs::read_to_string(dir.path().join("scene.toml")).expect("the scene");
    let unlit = ["--set", "lighting.mode=\"none\""];
    let two = ["--set", "lighting.mode=\"two-reflection\"", "--set", "lighting.gather=\"exact\""];
    let fields = ["--set", "material.1.cover=\"land\"", "--set", "material.1.patch_length=900"];
    let sea = ["--set", "material.1.cover=\"sea\"", "--set", "sky.model=\"hosek-wilkie\""];
    // Out of sight: its facets stand before those of the ground.
    let far = "[[surface]]\ncenter = [0.0, -90000.0, 0.0]\nu = [9.0, 0.0, 0.0]\nv = [0.0, 0.0, -9.0]\n\
               subdivide = [3, 5]\nmaterial = \"rock\"\n";
    let few = [&two[..], &["--set", "lighting.facets_per_cloud=20"]].concat();
    for (what, more) in [
        ("one reflection", vec![]),
        ("nothing lit", unlit.to_vec()),
        ("two reflections", few.clone()),
        ("from below", vec!["--set", "camera.position=[100,-900,100]"]),
        ("low sun", vec!["--set", "light.0.direction=[1,-0.15,0.1]"]),
        (
            "slanting sun, two reflections",
            [&few[..], &["--set", "light.0.direction=[1,-0.5,0.1]"]].concat(),
        ),
        (
            "a lamp behind the mountain",
            vec![
                "--set",
                "light.0={kind=\"point\",position=[-3400,300,0],intensity=[9e6,9e6,9e6]}",
            ],
        ),
        (
            "low sun, diffuse",
            vec![
                "--set",
                "light.0.direction=[1,-0.15,0.1]",
                "--set",
                "lighting.mode=\"diffusion\"",
            ],
        ),
        ("fields", fields.to_vec()),
        ("fields, diffuse", [&fields[..], &["--set", "lighting.mode=\"diffusion\""]].concat()),
        ("sea", sea.to_vec()),
        ("sea, diffuse", [&sea[..], &["--set", "lighting.mode=\"diffusion\""]].concat()),
        ("sea, two reflections", [&sea[..], &few[..]].concat()),
        ("by sprites", vec!["--set", "draw.path=\"sprites\""]),
        (
            "far from the origin",
            vec![
                "--set",
                "cloud.0.position=[5e7,0,0]",
                "--set",
                "camera.position=[50000300,9000,500]",
                "--set",
                "camera.target=[50000000,0,0]",
            ],
        ),
    ] {
        // Lit surfaces are not compared: the reference is in closed form, the device marches.
        for plates in ["", plate].into_iter().take(if what == "nothing lit" { 2 } else { 1 }) {
            let far = if what == "sea" { far } else { "" };
            fs::write(dir.path().join("scene.toml"), format!("{scene}{plates}{far}"))
                .expect("a scene");
            render(&dir, "thin.exr", &[&["--reference", "thin"], &more[..]].concat());
            render(&dir, "drawn.exr", &[&["--validation"], &more[..]].concat());
            let (rmse, max) = differ(&dir, "thin.exr", "drawn.exr");
            println!("{what}, {} plates: RMSE {rmse:.1e}, greatest {max:.1e}", plates.len().min(1));
            // Pairs of facets err by more than rounding: lighting.pair_size keeps them within 1 %
            // of L2.
            let most = if what.ends_with("two reflections") { 2e-3 } else { RMSE_OF_F32 };
            assert!(rmse <= most, "{what}: {rmse:e}");
        }
    }
}

#[test]
fn every_path_draws_the_ground() {
    let dir = scene_of(&file(), "ground = \"rock\"\nmaterial = \"cloud\"\nexaggeration = 1.5");
    render(&dir, "full.exr", &[]);
    for (more, most) in [
        (vec!["--set", "draw.path=\"sprites\"", "--set", "draw.chunks=3"], RMSE_OF_F32),
        (vec!["--no-skip"], 0.0),
        (vec!["--set", "draw.cull=\"off\""], 0.0),
    ] {
        render(&dir, "other.exr", &[&["--validation"], &more[..]].concat());
        let (rmse, _) = differ(&dir, "full.exr", "other.exr");
        println!("{more:?}: {rmse:.1e}");
        assert!(rmse <= most, "{more:?}: {rmse:e}");
    }
    // At half resolution the loss is no larger than without ground, where blobs end at 3 σ: their
    // edges lose more than ridges do.
    let loss = |more: &[&str]| {
        let more = &[more, &["--set", "draw.cutoff=3.0"]].concat()[..];
        render(&dir, "full.exr", more);
        render(
            &dir,
            "half.exr",
            &[&["--validation", "--set", "draw.resolution=0.5"], more].concat(),
        );
        differ(&dir, "full.exr", "half.exr").0
    };
    for more in [&[][..], &["--set", "draw.path=\"sprites\""]] {
        let [with, without] =
            [loss(more), loss(&[more, &["--set", "cloud.0.ground=\"none\""]].concat())];
        println!("half the size: {with:.1e}, without ground {without:.1e}");
        assert!(with < 1.1 * without, "{with:e} {without:e}");
    }
    // A flight in both loops, with and without impostors: the same bytes and no validation
    // messages.
    let bench = ["--frames", "4", "--repeat", "2", "--warmup", "1", "-q", "--validation"];
    let scene = path(&dir, "scene.toml");
    for more in [&["--set", "draw.impostors=\"on\""][..], &[]] {
        let output = run(&[&["bench", &scene], &bench[..], more].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn clouds_shade_the_ground_and_the_ground_lights_clouds() {
    let dir = scene_of(&file(), "ground = \"rock\"\nmaterial = \"cloud\"");
    let facets = |more: &[&str]| -> Vec<[f64; 5]> {
        let scene = path(&dir, "scene.toml");
        let output = run(&[&["inspect", &scene, "--facets"], more].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let mut reader = csv::Reader::from_reader(&output.stdout[..]);
        let names = reader.headers().expect("names").clone();
        let column = |name: &str| names.iter().position(|n| n == name).expect(name);
        let columns = ["region", "x", "y", "id_g", "ii_g"].map(column);
        reader
            .records()
            .map(|r| r.expect("a row"))
            .map(|r| columns.map(|c| r[c].parse().expect("a number")))
            .collect()
    };
    let sun = ["--set", "light.1.irradiance=[0,0,0]", "--set", "lighting.mode=\"two-reflection\""];
    let found = facets(&sun);
    let ground: Vec<_> = found.iter().filter(|f| f[0] == 0.0).collect();
    assert_eq!(ground.len(), NX * NY);
    // The light comes from the upper west, so the shadow of the eastern half lies a little west of
    // it: it covers the two easternmost columns but not the plain in the middle west.
    let cosine = 1.0 / (0.09f64 + 1.0 + 0.04).sqrt();
    let in_shadow: Vec<f64> =
        ground.iter().filter(|f| f[1] > 1900.0 && f[1] < 3000.0).map(|f| f[3]).collect();
    assert!(in_shadow.iter().all(|light| *light < 0.9 * 2.9 * cosine), "{in_shadow:?}");
    let lit =
        ground.iter().filter(|f| f[1] < -3000.0 && f[2] < 100.0).map(|f| f[3] / (2.9 * cosine));
    let lit: Vec<f64> = lit.collect();
    assert!(!lit.is_empty() && lit.iter().all(|light| (light - 1.0).abs() < 0.15), "{lit:?}");
    // The ground lights the clouds, except if it is black.
    let of_clouds =
        |found: &[[f64; 5]]| found.iter().filter(|f| f[0] == 1.0).map(|f| f[4]).sum::<f64>();
    let black = facets(&[&sun[..], &["--set", "material.1.kd=[0,0,0]"]].concat());
    assert!(
        of_clouds(&found) > 1.05 * of_clouds(&black),
        "{} {}",
        of_clouds(&found),
        of_clouds(&black)
    );
}

#[test]
fn errors_of_the_ground_are_reported() {
    let render_error = |made: &Made, more: &str| {
        let dir = scene_of(made, &format!("material = \"cloud\"\n{more}"));
        let output = run(&["render", &path(&dir, "scene.toml"), "-o", &path(&dir, "out.png")]);
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    for (made, more, expected) in [
        (
            file().without("HGT"),
            "ground = \"rock\"",
            "`cloud.0.ground`: expected \"none\": the file has no variable HGT",
        ),
        (
            file(),
            "ground = \"rok\"",
            "`cloud.0.ground`: unknown material `rok`; did you mean `rock`?",
        ),
        (file(), "ground = 3", "`cloud.0.ground`: expected a string, found integer 3"),
        (
            Made::wrf_of(1, 1, [4, 1, 5]),
            "ground = \"rock\"",
            "the file has 4 x 1 columns, and ground lies between 2 x 2",
        ),
        (
            file(),
            "ground = \"rock\"\nbase = 300.0",
            "`cloud.0.ground`: expected \"none\" where a `base` or `grow_to`",
        ),
        (
            file(),
            "ground = \"rock\"\ngrow_to = 2.0",
            "`cloud.0.ground`: expected \"none\" where a `base` or `grow_to`",
        ),
        (file().with_units("HGT", "feet"), "ground = \"rock\"", "w.nc: variable HGT"),
        (
            file().with_floats("HGT", |h| h[9] = f32::NAN),
            "ground = \"rock\"",
            "w.nc: variable HGT, step 0",
        ),
        (
            file().with_floats("HGT", |h| h[9] = 1e6),
            "ground = \"rock\"",
            "w.nc: step 0: HGT is 1000000 m at row 1, column 1, expected -1000 to 200000",
        ),
    ] {
        let message = render_error(&made, more);
        assert!(message.contains(expected), "{message}");
    }
    // Without ground, HGT is not needed.
    let dir = scene_of(&file().with_floats("HGT", |h| h[9] = f32::NAN), "material = \"cloud\"");
    render(&dir, "none.exr", &[]);
    // `nimbus weather` reports the fault of HGT, and everything else.
    for (made, expected) in [
        (file().with_floats("HGT", |h| h[9] = f32::NAN), "no ground: "),
        (file().with_units("HGT", "feet"), "no ground: "),
        (file(), "0 to 1"),
    ] {
        let dir = scene_of(&made, "");
        let output = run(&["weather", &path(&dir, "w.nc")]);
        let report = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success() && report.contains(expected), "{report}");
    }
}

/// Width of a column of [`file`].
const COLUMN_M: f64 = 1000.0;

/// Shadows of clouds on the ground, as the march sees them and as they are drawn between points,
/// against f64 rays through the blobs themselves.
#[test]
fn edges_of_the_clouds_shadows_lie_within_half_a_column() {
    let level = file().with_floats("HGT", |h| h.fill(0.0));
    for (sun, points) in [("[0.4,-1.0,0.1]", 1), ("[0.4,-1.0,0.1]", 4), ("[1,-0.6,0.3]", 4)] {
        let dir = scene_of(&level, "ground = \"rock\"\nmaterial = \"cloud\"");
        let set = [
            format!("light.0.direction={sun}"),
            format!("cloud.0.ground_points={points}"),
            "cloud.0.particles=2000".to_owned(),
            "lighting.forward=0".to_owned(),
            "light.1.irradiance=[0,0,0]".to_owned(),
        ];
        let scene = load(&dir.path().join("scene.toml"), &set, None).expect("a scene").scene;
        let frame = FrameReference::new(&scene, 0.0).expect("a frame");
        let light = scene.lights[0];
        let [n_u, n_v] = scene.terrains[0].n.map(|n| n as usize);
        let cosine = light.arrival(DVec3::ZERO).toward.y;
        let drawn = |i: usize| {
            let share = frame.irradiance[i].x / (light.energy().x * cosine);
            (share, frame.facets[i].position)
        };
        let rays = AreaScene::new(&[], &[], &scene.lights[..1], &frame.blobs, 0.0, &[]);
        let (mut n_edges, mut worst) = (0, 0.0f64);
        for row in 0..n_v {
            let of_row: Vec<(f64, DVec3)> = (0..n_u).map(|k| drawn(row * n_u + k)).collect();
            for pair in of_row.windows(2) {
                let [(a, from), (b, to)] = [pair[0], pair[1]];
                if (a < 0.5) == (b < 0.5) {
                    continue;
                }
                let at = from.lerp(to, (0.5 - a) / (b - a));
                // The nearest true edge along the row.
                let true_edge = (-100 * points..100 * points)
                    .map(|k| 0.01 * f64::from(k) * (to - from))
                    .filter(|off| {
                        let v = |by: f64| rays.visibility(at + *off + by * (to - from), &light);
                        (v(0.0) < 0.5) != (v(0.01) < 0.5)
                    })
                    .map(|off| off.length() / COLUMN_M)
                    .fold(f64::INFINITY, f64::min);
                (n_edges, worst) = (n_edges + 1, worst.max(true_edge));
            }
        }
        println!("{sun}, {points} a column: {n_edges} edges, off by {worst:.3} at most");
        assert!(n_edges >= 4 && worst <= 0.5, "{n_edges} edges, {worst}");
    }
}

/// Light between points, at most h²/4 (‖∇x‖² + ‖∇²x‖) beside what it is (model.md §16). h: distance
/// of points; x: depth that counts. The bound says something, and shrinks with h².
#[test]
fn light_between_points_is_within_its_bound() {
    let (sigma, peak, height) = (1.5, 2.0, 9.0);
    let kappa = peak / (sigma * (2.0 * std::f64::consts::PI).sqrt());
    let blob = Blob { position: DVec3::Y * height, sigma, shape: Shape::BALL, kappa };
    let sun = Light::Directional {
        direction: DVec3::new(0.5, -1.0, 0.25).normalize(),
        irradiance: DVec3::ONE,
    };
    let (lights, blobs) = ([sun], [blob]);
    let rays = AreaScene::new(&[], &[], &lights, &blobs, 0.0, &[]);
    let v = |x: f64, z: f64| rays.visibility(DVec3::new(x, 0.0, z), &sun);
    let mut worst = vec![];
    for h in [1.0, 0.5, 0.25] {
        let bound = 0.25 * h * h * ((peak / sigma).powi(2) / 1f64.exp() + peak / sigma.powi(2));
        let n = (16.0 / h) as i32;
        let mut greatest = 0.0f64;
        for (i, k) in (-n..n).flat_map(|i| (-n..n).map(move |k| (i, k))) {
            let (x, z) = (h * f64::from(i), h * f64::from(k));
            let [a, b, c] = [v(x, z), v(x + h, z), v(x, z + h)];
            for (s, t) in [(0.5, 0.5), (0.5, 0.0), (0.0, 0.5), (0.3, 0.3)] {
                let drawn = (1.0 - s - t) * a + s * b + t * c;
                greatest = greatest.max((drawn - v(x + s * h, z + t * h)).abs());
            }
        }
        println!("points {h} apart: {greatest:.4} of {bound:.4}");
        assert!(greatest <= bound && greatest > 0.1 * bound, "{h}: {greatest} of {bound}");
        worst.push(greatest);
    }
    assert!(worst[1] < 0.3 * worst[0] && worst[2] < 0.3 * worst[1], "{worst:?}");
}

#[test]
fn more_points_than_a_side_may_have_are_refused() {
    let wide = Made::wrf_of(1, 1, [300, 2, 2]);
    let dir = scene_of(&wide, "ground = \"rock\"\nmaterial = \"cloud\"\nground_points = 14");
    let loaded = load(&dir.path().join("scene.toml"), &[], None);
    let what = loaded.expect_err("a fault").to_string();
    assert!(what.contains("`cloud.0.ground_points`: expected at most 13"), "{what}");
    let fewer = ["cloud.0.ground_points=13".to_owned()];
    assert!(load(&dir.path().join("scene.toml"), &fewer, None).is_ok());
}
