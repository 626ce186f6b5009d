//! Scene files and the files that they name: accepted values, refused values, and the places of
//! messages.

use std::fs;
use std::path::Path;

use crate::scene_text::{
    BOXES, CLOUD, assert_message, assert_table, folder, good, load_with, message, to_toml,
};
use glam::DVec3;
use nimbus::io::scene_file::load;
use nimbus::model::boxes::{BoxLaw, Form};
use nimbus::model::cloud::CloudSource;
use nimbus::model::edge::Reach;
use nimbus::model::film::ToneMap;
use nimbus::model::light::Light;
use nimbus::model::scene::{Simulate, Threading};
use nimbus::model::sort_bits::SortBits;
use serde_json::json;

#[test]
fn a_cloud_alone_is_a_complete_scene() {
    let loaded = good(CLOUD);
    let scene = &loaded.scene;
    assert_eq!(
        (scene.film.width, scene.film.height, scene.film.tone_map),
        (800, 600, ToneMap::Neutral)
    );
    assert_eq!(scene.film.background, DVec3::new(0.32, 0.52, 0.80));
    assert_eq!(scene.camera.keys[0].position, DVec3::new(0.0, 0.0, 18.0));
    assert_eq!(scene.camera.fov_y_rad, 45f64.to_radians());
    assert_eq!((scene.time.step_s, scene.time.n_frames), (0.0333, 300));
    assert_eq!((scene.lighting.grid, scene.lighting.step, scene.lighting.forward), (64, 1.0, 0.85));
    assert_eq!((scene.draw.cutoff, scene.draw.sort_bits), (Reach::Auto, SortBits::Auto));
    assert_eq!((scene.threads.mode, scene.threads.simulate), (Threading::Parallel, Simulate::Gpu));
    let [Light::Directional { direction, irradiance }, Light::Sky { constant, .. }] =
        scene.lights[..]
    else {
        panic!("{:?}", scene.lights)
    };
    assert!(
        (direction.length() - 1.0).abs() < 1e-15
            && direction.dot(DVec3::new(-0.5, -0.8, -0.3)) > 0.98
    );
    assert_eq!((irradiance, constant), (DVec3::new(3.0, 2.9, 2.7), 0.55));
    assert_eq!((scene.materials[0].name.as_str(), scene.materials[0].at(0.0).ns), ("cloud", 8.0));
    assert_eq!((scene.clouds[0].seed, scene.n_particles()), (1, 3));
    assert!(matches!(
        scene.clouds[0].source,
        CloudSource::Boxes {
            law: BoxLaw { form: Form::Centred, optical_depth: 1.0, radius_scale: 1.0 },
            ..
        }
    ));
    assert_eq!(loaded.warnings, [""; 0]);
}

#[test]
fn a_scene_without_clouds_is_an_empty_sky() {
    assert_eq!(good("title = 'sky'").scene.clouds, []);
    assert_eq!(good("light = []\n# nothing").scene.lights, []);
}

#[test]
fn toml_errors_point_at_the_place() {
    assert!(message("[film]\nwidth = = 3\n", &[]).starts_with("scene.toml:2:9: "));
    assert!(message("title = 'ä' x\n", &[]).starts_with("scene.toml:1:13: "));
    assert!(message("[film]\nwidth = 3\nwidth = 4\n", &[]).starts_with("scene.toml:3:1: "));
    assert!(message("title = \"open\n", &[]).starts_with("scene.toml:1:"));
}

#[test]
fn unknown_keys_are_refused_with_the_nearest_and_all_known_ones() {
    assert_message(
        "[film]\nheight = 5\nwidht = 3\n",
        "scene.toml:3:1: unknown key `film.widht`; did you mean `width`? known here: \
         `width`, `height`, `format`, `background`, `exposure`, `tone_map`, `metering`",
    );
    assert_message(
        "[time]\nbanana = 1\n",
        "scene.toml:2:1: unknown key `time.banana`; known here: `start_s`, `step_s`, `frames`",
    );
    assert!(
        message("[clouds]\n", &[])
            .starts_with("scene.toml:1:2: unknown key `clouds`; did you mean `cloud`?")
    );
    // The first in file order, not in the alphabet's.
    assert!(
        message("[film]\nzzzz = 1\naaaa = 1\n", &[])
            .starts_with("scene.toml:2:1: unknown key `film.zzzz`")
    );
    assert!(
        message("[[light]]\nkind = 'sky'\nirradiance = [1, 1, 1]\ndirection = [0, 1, 0]\n", &[])
            .starts_with("scene.toml:4:1: unknown key `light.0.direction`")
    );
}

#[test]
fn wrong_types_and_ranges_name_what_was_expected_and_found() {
    assert_table(include_str!("../data/wrong-values.txt"));
}

#[test]
fn a_camera_that_looks_nowhere_or_runs_backward_is_refused() {
    let nowhere = "the camera looks nowhere: position equals target, or the view runs along `up`";
    assert_message(
        "[camera]\nposition = [1, 2, 3]\ntarget = [1, 2, 3]",
        &format!("scene.toml:2:12: `camera.position`: {nowhere}"),
    );
    assert_message(
        "[camera]\nup = [0, 0, 2]",
        &format!("scene.toml:1:1: `camera.position`: {nowhere}"),
    );
    let path = |second: &str| {
        format!(
            "[camera]\npath = [\n{{ time_s = 1, position = [0, 0, 9], target = [0, 0, 0] \
             }},\n{second}\n]"
        )
    };
    assert_message(
        &path("{ time_s = 2, position = [0, 9, 0], target = [0, 0, 0] }"),
        &format!("scene.toml:4:26: `camera.path.1.position`: {nowhere}"),
    );
    assert_message(
        &path("{ time_s = 1, position = [0, 1, 9], target = [0, 0, 0] }"),
        "scene.toml:4:12: `camera.path.1.time_s`: times must grow, found 1 after 1",
    );
    assert_message(
        &path("{ time_s = 2 }"),
        "scene.toml:4:1: missing key `camera.path.1.position`: expected three numbers",
    );
    assert!(message(&(path("") + "\ntarget = [0, 0, 0]"), &[]).contains("not both"));
    let scene = good(&path("{ time_s = 3, position = [0, 1, 9], target = [0, 0, 0] }")).scene;
    assert_eq!(scene.camera.keys.iter().map(|k| k.time_s).collect::<Vec<_>>(), [1.0, 3.0]);
}

#[test]
fn defaults_may_be_written_out() {
    good("[draw]\nresolution = 1.0\n[[cloud]]\nfrom = 'boxes'\nfile = 'b.dat'\ntexture = 'none'");
    good("[draw]\nresolution = 1");
}

#[test]
fn textures_are_named() {
    let scene = |keys: &str| good(&format!("{CLOUD}{keys}")).scene;
    let plain = scene("");
    assert!(!plain.is_textured() && plain.clouds[0].texture.of_box(3) == (0, 0.0));
    let one = scene("texture = '6'\ntexture_strength = 0.5");
    assert!(one.is_textured() && one.clouds[0].texture.of_box(3) == (6, 0.5));
    assert_eq!(scene("texture = 'by-box'").clouds[0].texture.of_box(11), (3, 1.0));
    let wrong = |keys: &str| message(&format!("{CLOUD}{keys}"), &[]);
    assert!(wrong("texture = '8'").contains("`cloud.0.texture`: unknown value `8`"));
    assert!(wrong("texture = 'bybox'").contains("did you mean `by-box`?"));
    assert!(wrong("texture_strength = 5").contains("expected a number from 0 to 4, found 5"));
}

#[test]
fn overrides_are_laid_over_the_file() {
    let set = [
        "lighting.grid=32",
        "cloud.0.seed = 5",
        "light.0.irradiance=[1,1,1]",
        "threads.mode=serial",
        "film={width=7}",
        "film.height=9",
        "title='a=b'",
    ];
    let scene = load_with(CLOUD, &set, None).unwrap().scene;
    assert_eq!((scene.lighting.grid, scene.clouds[0].seed), (32, 5));
    assert_eq!(scene.lights[0].energy(), DVec3::ONE);
    assert_eq!(scene.threads.mode, Threading::Serial);
    assert_eq!((scene.film.width, scene.film.height, scene.title.as_str()), (7, 9, "a=b"));
    let later =
        load_with(CLOUD, &["film.width=1", "film.width=2", "cloud.0.file=b.dat"], None).unwrap();
    assert_eq!(later.scene.film.width, 2);
}

#[test]
fn overrides_that_do_not_fit_are_named() {
    for (set, expected) in [
        ("film.width", "expected key.path=VALUE, for example lighting.grid=32"),
        ("film..width=3", "expected key.path=VALUE, found an empty key"),
        ("film.width=", "expected a value after `=`"),
        (
            "film.width=wide",
            "`film.width`: expected an integer from 1 to 16384, found string \"wide\"; for example \
             `film.width=800`",
        ),
        (
            "film.widht=3",
            "unknown key `film.widht`; did you mean `width`? known here: `width`, `height`, \
             `format`, `background`, `exposure`, `tone_map`, `metering`",
        ),
        ("cloud.1.seed=3", "`cloud.1` does not exist: `cloud` has 1 item, numbered from 0"),
        ("light.-1.kind=sky", "`light`: expected a number from 0 to 1, or *, found `-1`"),
        ("material.0.kd=[1,1,2]", "`material.0.kd.2`: expected a number from 0 to 1, found 2.0"),
        ("cloud.0.seed.x=3", "`cloud.0.seed` is no table: integer 4"),
        ("surface.0.u=3", "the scene has no `surface`"),
        ("film.exposure=inf", "`film.exposure`: expected a number from 0 to 1e15, found inf"),
    ] {
        assert_eq!(
            message(&format!("{CLOUD}seed = 4"), &[set]),
            format!("--set {set}: {expected}")
        );
    }
    assert!(
        message(CLOUD, &["light.0.irradiance=[1,1"])
            .starts_with("--set light.0.irradiance=[1,1: the value is no TOML")
    );
    assert!(message(CLOUD, &["film.width=1 2"]).starts_with("--set film.width=1 2: "));
}

#[test]
fn the_seed_argument_numbers_the_clouds() {
    let two = format!("{CLOUD}seed = 9\n{CLOUD}");
    let seeds = |seed| {
        let loaded = load_with(&two, &[], seed).unwrap();
        let resolved: Vec<_> =
            (0..2).map(|i| loaded.resolved["cloud"][i]["seed"].as_u64().unwrap() as u32).collect();
        assert_eq!(loaded.scene.clouds.iter().map(|c| c.seed).collect::<Vec<_>>(), resolved);
        resolved
    };
    assert_eq!(seeds(None), [9, 2]);
    assert_eq!(seeds(Some(100)), [100, 101]);
    assert_eq!(seeds(Some(u32::MAX)), [u32::MAX, 0]);
}

#[test]
fn the_resolved_scene_is_complete_and_reads_back_as_itself() {
    let loaded = good(CLOUD);
    assert_eq!(
        loaded.resolved,
        json!({
            "title": "",
            "film": { "width": 800, "height": 600, "format": "rgba16f",
            "background": [0.32, 0.52, 0.80], "exposure": 1.0, "tone_map": "neutral",
            "metering": "none" },
            "sky": { "model": "none", "ground": "none", "turbidity": 3.0,
            "albedo": [0.1, 0.1, 0.1], "metres_per_unit": 1.0, "exaggeration": 1.0,
            "sea_level": 0.0, "haze": 1.0, "disc": true },
            "camera": { "position": [0.0, 0.0, 18.0], "target": [0.0, 0.0, 0.0],
            "up": [0.0, 1.0, 0.0], "fov_y_deg": 45.0, "near": 0.01 },
            "time": { "start_s": 0.0, "step_s": 0.0333, "frames": 300 },
            "lighting": {
                "mode": "two-reflection", "grid": 64, "layers": "auto", "step": 1.0,
                "forward": 0.85, "bases": 8, "sampling": "log",
                "exponents": [1.0, 256.0], "gather": "auto", "theta": 0.4, "facets_per_cloud": "auto",
                "pair_size": 0.5, "pair_levels": 6, "pair_steps": 16, "summation": "plain",
                "precision": "f32",
                "sun_radius_deg": 0.27,
                "octaves": 8, "octave_light": 0.5, "octave_depth": 0.7, "octave_phase": 0.5,
                "diffusion_cycles": 2, "bounces": 0, "bounce_cells": 2,
                "bounce_order": 2, "slopes": true,
                "budget_ms": 0.0, "budget_error": 0.0,
            },
            "draw": { "path": "tiles", "impostors": "off", "impostor_error": 0.5, "cutoff": "auto",
            "threshold": 0.0, "overlap": "thin", "slice": 1.25, "chunks": 0, "cull": "on",
            "smallest": 0.0, "lod": 0.0, "sort_bits": "auto",
            "resolution": 1.0, "error": 1.0 / 1020.0, "count": "all", "count_a": 280.0,
            "count_d0": 1.0,
                      "count_normalised": false, "count_conserve": true, "particles": 0,
                      "texture_seed": 1 },
            "threads": { "mode": "parallel", "simulate": "gpu" },
            "light": [
                { "kind": "directional", "direction": [-0.5, -0.8, -0.3],
                "irradiance": [3.0, 2.9, 2.7] },
                { "kind": "sky", "irradiance": [0.8, 0.87, 1.0], "constant": 0.55 },
            ],
            "material": [{ "name": "cloud", "kd": [0.9, 0.9, 0.9], "ks": [0.0, 0.0, 0.0],
            "ns": 8.0, "albedo": "derived", "phase": "derived", "droplet_um": 10.0,
            "cover": "plain", "contrast": 0.25, "patch_length": 1.0, "sea_wind": 5.0 }],
            "surface": [],
            "ground": [],
            "air": { "temperature_c": 20.0, "humidity": 0.6, "pressure_hpa": 1013.25,
            "saturation": "bolton", "ice": false, "metres_per_unit": 250.0, "ground": 0.0 },
            "cloud": [{
                "from": "boxes", "file": "b.dat", "form": "centred", "optical_depth": 1.0,
                "radius_scale": 1.0, "texture": "none", "texture_strength": 1.0,
                "position": [0.0, 0.0, 0.0], "base": "none", "wind": [0.0, 0.0, 0.0],
                "gust": 0.0, "gust_length": 4.0, "gust_period_s": 8.0, "gust_waves": 16,
                "grow_to": 1.0, "grow_time_s": 60.0, "material": "cloud", "facing": "outward",
                "seed": 1,
            }],
        })
    );
    let again = good(&to_toml(&loaded.resolved));
    assert_eq!(
        (&again.scene, &again.resolved, again.hash()),
        (&loaded.scene, &loaded.resolved, loaded.hash())
    );
}

#[test]
fn the_hash_follows_content_and_nothing_else() {
    let (dir, path) = folder(CLOUD);
    let hash = || load(&path, &[], None).unwrap().hash().to_owned();
    let first = hash();
    assert!(first.len() == 64 && first.bytes().all(|b| b.is_ascii_hexdigit()));
    fs::write(&path, format!("# another layout\n{CLOUD}seed = 1\n[film]\nexposure = 1\n")).unwrap();
    assert_eq!(hash(), first, "layout and defaults written out do not count");
    assert_eq!(good(CLOUD).hash(), first, "nor does the folder");
    fs::write(dir.path().join("b.dat"), BOXES.replace("0, 1\n", "0, 2\n")).unwrap();
    assert_ne!(hash(), first, "a box that changed does");
    fs::write(dir.path().join("b.dat"), BOXES).unwrap();
    assert_eq!(hash(), first);
    assert_ne!(load(&path, &["film.width=3".to_owned()], None).unwrap().hash(), first);
    assert_ne!(load(&path, &[], Some(7)).unwrap().hash(), first);
}

#[test]
fn warnings_say_what_and_where() {
    let loaded = good("[[material]]\nname = 'wet'\nks = [0.02, 0.1, 0]\n");
    assert_eq!(loaded.warnings.len(), 1);
    assert!(
        loaded.warnings[0].contains("scene.toml:3:6: material `wet` has K_d + 4 K_s = 1.300"),
        "{:?}",
        loaded.warnings
    );
    let sea = "[[material]]\nname = 'cloud'\ncover = 'sea'\n[[ground]]\nsize = [9, 9]\n";
    assert!(good(sea).warnings[0].contains("mirrors nothing without a [sky]"));
    assert!(good(&format!("[sky]\nmodel = 'hosek-wilkie'\n{sea}")).warnings.is_empty());
}

#[test]
fn deep_nesting_is_refused_without_a_crash() {
    for (scene, expected) in [
        (format!("x = {}", "[".repeat(100_000)), "max recursion depth met"),
        (format!("x = {}", "{a=".repeat(100_000)), "max recursion depth met"),
        (format!("{}x = 1", "a.".repeat(100_000)), "no key of nimbus has this many dots"),
        (format!("[{}x]", "a.".repeat(100_000)), "no key of nimbus has this many dots"),
        // As deep as the bounds allow, so that it is the reader that must bear it.
        (
            format!("x = {}", format!("{{{}x=", "a.".repeat(16)).repeat(70))
                + "1"
                + &"}".repeat(70),
            "unknown key `x`",
        ),
    ] {
        let found = message(&scene, &[]);
        assert!(
            found.contains(expected),
            "expected {expected}, found {}",
            &found[..found.len().min(300)]
        );
        message("title = 'x'", &[&scene]);
    }
}

#[test]
fn every_scene_of_the_repository_loads() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut n = 0;
    for entry in fs::read_dir(scenes).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "toml") {
            let loaded = load(&path, &[], None).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(loaded.warnings, [""; 0], "{}", path.display());
            assert!(loaded.scene.n_facets() > 0 && !loaded.scene.title.is_empty());
            n += 1;
        }
    }
    assert!(n >= 4, "{n}");
    let count = |name: &str| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
        load(&path, &[], None).unwrap().scene.n_particles()
    };
    assert_eq!(
        (count("cubes-554.toml"), count("cubes-615.toml"), count("threads.toml")),
        (554, 615, 11_690)
    );
}
