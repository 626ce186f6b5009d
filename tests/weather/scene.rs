//! Clouds of weather files in scenes: what of the file the particles keep, and how such scenes are
//! drawn.

use std::path::Path;

use crate::program;
use crate::program::run;
use crate::weather_files::{Made, NX, NY, NZ};
use glam::DVec3;
use nimbus::io::scene_file::{self, LoadedScene};
use nimbus::io::weather::wrf;
use nimbus::model::cloud::{CloudSource, Facing, Particle, Shapes};
use nimbus::model::light::Light;
use nimbus::model::medium::MeanMedium;
use nimbus::model::scene::Scene;

const KATRINA: &str = "
[[cloud]]
from = 'weather'
file = 'scenes/weather/katrina.nc'
";

fn loaded(text: &str) -> nimbus::error::Result<LoadedScene> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scene.toml");
    scene_file::parse(text.to_owned(), &path, &[], None)
}

fn load(text: &str) -> nimbus::error::Result<Scene> {
    loaded(text).map(|loaded| loaded.scene)
}

fn list(scene: &Scene) -> &[Particle] {
    match &scene.clouds[0].source {
        CloudSource::Particles(list) => list,
        other => panic!("{other:?}"),
    }
}

/// κ (2π)^{3/2} σ² σ_y of all.
fn mass(list: &[Particle]) -> f64 {
    let of = |p: &Particle| {
        p.kappa * (2.0 * std::f64::consts::PI).powf(1.5) * p.sigma.powi(3) * p.shape.aspect
    };
    list.iter().map(of).sum()
}

#[test]
fn particles_hold_the_files_extinction_whatever_the_exaggeration() {
    let file = wrf::open(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/weather/katrina.nc"))
        .expect("the file");
    let step = file.step(2).expect("a step");
    let n_columns = step.grid.shape().n_columns();
    let of = |(i, beta): (usize, &f64)| {
        beta * step.grid.thickness_m(i) * step.grid.ground.area_m2(i % n_columns)
    };
    let truth: f64 = step.extinction.iter().enumerate().map(of).sum();
    for exaggeration in ["1", "7.5"] {
        let scene =
            load(&format!("{KATRINA}step = 2\nparticles = 5000\nexaggeration = {exaggeration}"))
                .expect("a scene");
        let found = mass(list(&scene));
        // 0.1 % is what is promised; the sums are f64's.
        assert!((found / truth - 1.0).abs() < 1e-9, "{exaggeration}: {found:e} of {truth:e}");
        assert!(list(&scene).len() <= 5000 && list(&scene).len() > 4000);
        assert!(
            list(&scene)
                .iter()
                .all(|p| p.position.is_finite() && p.sigma > 0.0 && p.shape.aspect > 0.0)
        );
        assert_eq!(scene.clouds[0].facing, Facing::Up);
        assert_eq!(scene.shapes(), Shapes::Upright);
    }
    // Another step, and another seed, are other particles.
    let first = load(&format!("{KATRINA}particles = 500")).expect("a scene");
    for other in ["step = 1", "seed = 9"] {
        assert_ne!(
            list(&first),
            list(&load(&format!("{KATRINA}particles = 500\n{other}")).expect("a scene")),
            "{other}"
        );
    }
}

const SUPERCELL: &str = "
[threads]
simulate = 'cpu'
[[cloud]]
from = 'weather'
file = 'scenes/weather/supercell.nc'
particles = 3000
speed = 60
";

/// The particles of a cloud that moves.
fn at(scene: &Scene, time_s: f64) -> std::sync::Arc<Vec<Particle>> {
    match &scene.clouds[0].source {
        CloudSource::Animated(m) => m.animation.at(time_s).expect("a moment"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn between_steps_cells_come_and_go_evenly_and_particles_keep_their_numbers() {
    let scene = load(SUPERCELL).expect("a scene");
    // Steps of 120 s at 60 s a second: at 0, 2 and 4 s, and for ever before and after.
    let [first, second, third] = [0.0, 2.0, 4.0].map(|t| at(&scene, t));
    assert!(first != second && second != third);
    assert_eq!([at(&scene, -7.0), at(&scene, 1e6)], [first.clone(), third.clone()]);
    for (t, a, b, share) in [(0.5, &first, &second, 0.25), (3.0, &second, &third, 0.5)] {
        let now = at(&scene, t);
        assert_eq!((now.len(), a.len()), (3000, 3000));
        // A cell that comes or goes has less than its share of the mass.
        let even = (1.0 - share) * mass(a) + share * mass(b);
        assert!((0.3 * even..even).contains(&mass(&now)), "{t}: {} of {even}", mass(&now));
        // Their places differ by the heights of the levels alone.
        assert!(now.iter().zip(a.iter()).all(|(p, q)| (p.position - q.position).length() < 100.0));
        assert_eq!(at(&scene, t), now, "again");
    }
    // A step's own extinction: as a scene has it that stands still, but for who has how much of it.
    let still = load(&SUPERCELL.replace("speed = 60", "step = 1")).expect("a scene");
    assert!((mass(&second) / mass(list(&still)) - 1.0).abs() < 1e-9);
    // All keep to the bounds that light and culling go by.
    let group = scene.groups()[0];
    for t in [0.0, 1.3, 4.0] {
        for p in at(&scene, t).iter() {
            assert!(
                (p.position - group.center).abs().cmple(group.half_extent + 1e-6).all(),
                "{p:?}"
            );
            assert!(
                p.sigma <= group.sigma_max * (1.0 + 1e-12)
                    && p.sigma * p.shape.aspect <= group.sigma_y_max * (1.0 + 1e-12)
            );
        }
    }
    let what =
        load(&SUPERCELL.replace("particles = 3000", "particles = 1")).unwrap_err().to_string();
    assert!(
        what.contains("`cloud.0.particles`: expected 2 or more where `speed` is not 0"),
        "{what}"
    );
    let what = load(&SUPERCELL.replace("'cpu'", "'gpu'")).unwrap_err().to_string();
    assert!(
        what.contains("`cloud.0.speed`: expected 0 where threads.simulate is \"gpu\""),
        "{what}"
    );
}

#[test]
fn the_sun_stands_where_the_almanac_has_it() {
    // Greenwich at noon on the June solstice: 62.0° high (90° - 51.48° + 23.44°), within the
    // equation of time's 2 minutes in the south.
    let sun = |more: &str| {
        load(&format!(
            "{KATRINA}particles = 10\n[[light]]\nkind = 'sun'\nirradiance = [1, 1, 1]\n{more}"
        ))
    };
    let scene = sun("date = '2024-06-20 12:00:00'\nlatitude_deg = 51.48\nlongitude_deg = 0.0")
        .expect("a scene");
    let Light::Directional { direction, .. } = scene.lights[0] else {
        panic!("{:?}", scene.lights)
    };
    assert!(((-direction.y).asin().to_degrees() - 61.95).abs() < 0.1, "{direction}");
    // South is +z: the sun's light comes from there.
    assert!(direction.normalize().dot(DVec3::new(0.0, -0.8826, -0.4701)) > 0.9999, "{direction}");
    for (more, expected) in [
        (
            "date = '2024-06-20 00:00:00'\nlatitude_deg = 51.48",
            "the sun is 15.1° below the horizon",
        ),
        ("date = 'noon'", "expected a time such as \"2005-08-28 18:00:00\" (UTC), found noon"),
        (
            "date = '2024-06-20 12:00:00'\nlatitude_deg = 95",
            "expected a number from -90 to 90, found 95",
        ),
    ] {
        let what = sun(more).expect_err(more).to_string();
        assert!(what.contains(expected), "{what}");
    }
}

#[test]
fn faults_of_a_file_are_reported_with_its_name() {
    let of = |more: &str, file: &str| {
        load(
            &KATRINA
                .replace("scenes/weather/katrina.nc", file)
                .replace("\n[[", &format!("{more}\n[[")),
        )
        .unwrap_err()
        .to_string()
    };
    let what = of("", "scenes/weather/none.nc");
    assert!(what.contains("scene.toml:4") && what.contains("none.nc"), "{what}");
    let what = of("", "scenes/hello.csv");
    assert!(what.contains("hello.csv"), "{what}");
    let what = load(&format!("{KATRINA}step = 4")).unwrap_err().to_string();
    assert!(what.contains("`cloud.0.step`: expected an integer from 0 to 3, found 4"), "{what}");
}

/// Particles of a made file's cloud at 1 s, with a wind of its own and one that takes detail along.
fn carried(wind: [f32; 2], speed: f64, detail_wind: &str) -> Vec<Particle> {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("a.nc");
    std::fs::write(&path, Made::wrf(1, 2).with_wind(wind).bytes()).expect("a file");
    let scene = load(&format!(
        "[[cloud]]\nfrom = 'weather'\nfile = '{}'\nparticles = 900\nspeed = {speed}\ndetail = 1\n\
         detail_wind = {detail_wind}\n[threads]\nsimulate = 'cpu'\n",
        path.display()
    ))
    .expect("a scene");
    if speed == 0.0 { list(&scene).to_vec() } else { at(&scene, 1.0).to_vec() }
}

/// Returns the mean distance of two sets of particles, in cells of 1000 m.
fn distance(a: &[Particle], b: &[Particle]) -> f64 {
    assert_eq!(a.len(), b.len());
    let sum: f64 = a.iter().zip(b).map(|(p, q)| (p.position - q.position).length()).sum();
    sum / a.len() as f64 / 1000.0
}

#[test]
fn winds_of_a_file_take_detail_along() {
    // A wind that is everywhere the same is as one that the scene gives: eastward and southward.
    let of_file = carried([12.0, 5.0], 30.0, "'file'");
    let given = carried([12.0, 5.0], 30.0, "[12, 0, -5]");
    assert!(distance(&of_file, &given) < 1e-12);
    for (p, q) in of_file.iter().zip(&given) {
        assert!((p.kappa - q.kappa).abs() <= 1e-12 * q.kappa);
    }
    assert!(distance(&of_file, &carried([12.0, 5.0], 30.0, "[0, 0, 0]")) > 0.1);
    assert!(distance(&of_file, &carried([12.0, -5.0], 30.0, "'file'")) > 0.05);
    // Weather that stands still has no time in which an even wind would change anything.
    let still = carried([12.0, 5.0], 0.0, "'file'");
    assert_eq!(still, carried([12.0, 5.0], 0.0, "[12, 0, -5]"));
    // Winds that shear shape the detail of weather that stands still, too.
    let of = |wind: &str| {
        load(&format!("{KATRINA}particles = 900\ndetail = 1\ndetail_wind = {wind}"))
            .expect("a scene")
    };
    let (calm, shaped) = (of("[0, 0, 0]"), of("'file'"));
    assert_ne!(list(&calm), list(&shaped));
    assert!((mass(list(&calm)) / mass(list(&shaped)) - 1.0).abs() < 1e-9);
}

#[test]
fn winds_that_are_missing_or_wrong_are_refused_where_they_are_used() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("a.nc");
    let load = |made: &Made, wind: &str| {
        std::fs::write(&path, made.bytes()).expect("a file");
        let file = path.display();
        load(&format!("[[cloud]]\nfrom = 'weather'\nfile = '{file}'\n{wind}\n"))
    };
    let told = |made: &Made| {
        load(made, "").expect("winds are not needed");
        // Without detail, "file" needs no winds either.
        load(made, "detail = 0\ndetail_wind = 'file'").expect("a scene without detail");
        load(made, "detail = 1\ndetail_wind = 'file'").unwrap_err().to_string()
    };
    let good = || Made::wrf(1, 2).with_wind([3.0, 4.0]);
    load(&good(), "detail = 1\ndetail_wind = 'file'").expect("a scene");
    let what = told(&Made::wrf(1, 2));
    assert!(
        what.contains(
            "`cloud.0.detail_wind`: expected three numbers: \"file\" needs the variables U"
        ),
        "{what}"
    );
    let what = told(&good().without("V"));
    assert!(what.contains("the file lacks one or both"), "{what}");
    let what = told(&good().with_units("U", "knots"));
    assert!(what.contains("variable U: units \"knots\", expected \"m s-1\""), "{what}");
    // The last of five western and eastern faces, and the last of four southern and northern ones.
    let what = told(&good().with_floats("U", |all| all[4 + 5 * (2 + 3)] = 1001.0));
    assert!(
        what.contains("step 0: U is 1001 m/s at level 1, row 2, column 4, expected -1000 to 1000"),
        "{what}"
    );
    let what = told(&good().with_floats("V", |all| all[1 + 4 * (3 + 4)] = f32::NAN));
    assert!(what.contains("variable V, step 0: 1 values are NaN or fill values"), "{what}");
    assert!(what.contains("the first at level 1, row 3, column 1"), "{what}");
    let mut narrow = good();
    narrow.var("U").dims[3] = 2;
    let narrow = narrow.with_floats("U", |all| all.truncate(60));
    let what = told(&narrow);
    assert!(
        what.contains("variable U: it is 2 x 5 x 3 x 4, expected 2 steps of 5 x 3 x 5"),
        "{what}"
    );
    let what = load(&good(), "detail_wind = [1, 2000, 3]").unwrap_err().to_string();
    assert!(what.contains("expected a number from -1000 to 1000, found 2000"), "{what}");
}

/// Clouds that come later have the light that they have in a scene that begins with them.
#[test]
fn weather_that_begins_clear_is_lit_when_it_comes() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("a.nc");
    let (made, n) = (Made::wrf(1, 2), NX * NY * NZ);
    let mut bytes = made.bytes();
    let loaded = |bytes: &[u8]| {
        std::fs::write(&path, bytes).expect("a file");
        load(&format!(
            "[[cloud]]\nfrom = 'weather'\nfile = '{}'\nparticles = 300\nspeed = 30\n[threads]\n\
             simulate = 'cpu'\n",
            path.display()
        ))
        .expect("a scene")
    };
    let cloudy = loaded(&bytes).groups()[0];
    // A step ends with QCLOUD, MAPFAC_M and HGT. The first is made clear.
    let of_step = made.bytes_of_step();
    let end = bytes.len() - of_step - 4 * 2 * NX * NY;
    bytes[end - 4 * n..end].fill(0);
    let clear = loaded(&bytes);
    assert!(at(&clear, 0.0).iter().all(|p| p.kappa == 0.0));
    let group = clear.groups()[0];
    assert_eq!((group.kappa_max, group.mass_max), (cloudy.kappa_max, cloudy.mass_max));
    // Clouds between steps that were read may have mass that no bound tells of: they scatter, too.
    let mut groups = clear.groups();
    let known = MeanMedium::new(&clear, &groups, 0.0);
    groups.iter_mut().for_each(|group| group.mass_max = 0.0);
    assert_eq!(MeanMedium::new(&clear, &groups, 0.0), known);
    assert!(known.albedo.min_element() > 0.9);
}

/// A reference that is kept belongs to all that a scene can show: of moving weather, to steps that
/// nobody drew yet, too.
#[test]
fn the_hash_follows_every_step_of_a_file_that_moves() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("a.nc");
    let of = |bytes: &[u8], speed: &str| {
        std::fs::write(&path, bytes).expect("a file");
        let file = path.to_string_lossy();
        let scene = format!(
            "[[cloud]]\nfrom = \"weather\"\nfile = \"{file}\"\nparticles = 500\nspeed = {speed}"
        );
        loaded(&format!("{scene}\n[threads]\nsimulate = \"cpu\"\n"))
            .expect("a scene")
            .hash()
            .to_owned()
    };
    let mut bytes = Made::wrf(1, 2).bytes();
    let first = [of(&bytes, "0"), of(&bytes, "60")];
    assert_ne!(first[0], first[1]);
    // The last step ends with QCLOUD, MAPFAC_M and HGT: the least bit of the first cell with cloud.
    let n_columns = NX * NY;
    let at = bytes.len() - 4 * (2 * n_columns + (NZ - 1) * n_columns) + 3;
    bytes[at] ^= 1;
    let second = [of(&bytes, "0"), of(&bytes, "60")];
    assert_eq!(first[0], second[0], "the first step is what it was");
    assert_ne!(first[1], second[1]);
}

#[test]
fn weather_is_drawn_and_benched_like_every_other_scene() {
    for (scene, speed) in [("scenes/katrina.toml", "0"), ("scenes/supercell.toml", "30")] {
        let speed = format!("cloud.0.speed={speed}");
        let cpu = ["--set", "threads.simulate=\"cpu\"", "--set", &speed];
        let set = [
            "--size",
            "80x60",
            "--set",
            "cloud.0.particles=2000",
            "--set",
            "lighting.grid=24",
            "--validation",
        ];
        let set = [&set[..], &cpu].concat();
        let dir = tempfile::tempdir().expect("a folder");
        let out = dir.path().join("w.png");
        let output =
            run(&[&["render", scene, "-q", "-o", &out.to_string_lossy()], &set[..]].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let output = run(&[
            &["bench", scene, "-q", "--json", "--frames", "3", "--repeat", "2", "--warmup", "2"],
            &set[..],
        ]
        .concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn the_device_draws_what_the_reference_has() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = |name: &str| dir.path().join(name).to_string_lossy().into_owned();
    let base = [
        "scenes/katrina.toml",
        "-q",
        "--json",
        "--force",
        "--size",
        "64x48",
        "--set",
        "cloud.0.particles=1500",
    ];
    let more = [
        "--set",
        "lighting.grid=24",
        "--set",
        "film.format=\"rgba32f\"",
        "--set",
        "lighting.mode=\"first\"",
    ];
    // Without ground: a pixel on its rim may show it or not (tests/passes/terrain.rs).
    let more = [&more[..], &["--set", "cloud.0.ground=\"none\""]].concat();
    let render = |name: &str, of: &[&str]| {
        let output = run(&[&["render", "-o", &path(name)], &base[..], &more, of].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    render("thin.exr", &["--reference", "thin"]);
    render("drawn.exr", &[]);
    let (rmse, max) = program::differ(&dir, "thin.exr", "drawn.exr");
    println!("RMSE {rmse:.1e}, greatest {max:.1e}");
    // The same halfway between two steps.
    let moving = [
        "--time",
        "1",
        "--set",
        "cloud.0.file=\"weather/supercell.nc\"",
        "--set",
        "cloud.0.exaggeration=1",
    ];
    let moving = [&moving[..], &["--set", "cloud.0.step=0", "--set", "cloud.0.speed=60"]].concat();
    let moving = [
        &moving[..],
        &["--set", "threads.simulate=\"cpu\"", "--set", "camera.position=[-30000,5000,55000]"],
    ]
    .concat();
    let moving = [&moving[..], &["--set", "camera.target=[0,7000,0]"]].concat();
    render("thin.exr", &[&["--reference", "thin"], &moving[..]].concat());
    render("drawn.exr", &moving);
    let (moved, _) = program::differ(&dir, "thin.exr", "drawn.exr");
    println!("moving: RMSE {moved:.1e}");
    assert!(moved < 1e-5, "{moved:e}");
    render("still.exr", &[&moving[..], &["--set", "cloud.0.speed=0"]].concat());
    assert!(
        program::differ(&dir, "still.exr", "drawn.exr").0 > 1e-3,
        "another time is another picture"
    );
    // f32 lighting and drawing, as in tests/commands/render_reference.rs.
    assert!(rmse < 1e-5, "{rmse:e}");
}
