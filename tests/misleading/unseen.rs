//! The reasons for pictures in which nothing can be seen.

use std::path::Path;

use proptest::prelude::*;

use glam::DVec3;
use nimbus::frame::{DrawnFrame, unseen};
use nimbus::io::scene_file;
use nimbus::model::scene::Scene;

use crate::generated;
use crate::program::run;

fn scene(set: &[&str]) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml");
    let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
    scene_file::load(&path, &set, None).expect("a scene").scene
}

fn warning(scene: &Scene, n_shown: Option<u32>, rgba: &[f32]) -> Option<String> {
    unseen(scene, DrawnFrame { time_s: 0.0, n_shown }, rgba).expect("a camera")
}

/// One pixel that differs by a step of the display is enough; pixels below half a step of
/// it are not.
#[test]
fn a_picture_is_empty_if_no_pixel_shows() {
    generated::check(256, (0usize..64, 0.05f32..10.0, 0.0f32..1e-6), |(i, v, dim)| {
        let scene = scene(&["film.background=[0,0,0]"]);
        let mut rgba = vec![dim; 4 * 64];
        let text = warning(&scene, Some(9), &rgba).expect("nothing shows");
        prop_assert!(text.starts_with("nothing can be seen in the picture: "));
        rgba[4 * i + i % 3] = v;
        prop_assert_eq!(warning(&scene, Some(9), &rgba), None);
        Ok(())
    });
}

/// A camera that looks away from the cloud by more than a right angle has it behind itself;
/// one that looks at it does not.
#[test]
fn a_camera_that_looks_away_is_named() {
    generated::check(256, (-1.2f64..1.2, -1.0f64..1.0), |(turn, lift)| {
        let aim = |sign: f64| {
            let at = |base: f64, d: f64| base + sign * 10.0 * d;
            let (s, c) = turn.sin_cos();
            let pose = scene(&[]).camera.keys[0];
            let f = (pose.target - pose.position).normalize();
            let right = f.cross(DVec3::Y).normalize();
            let d = (c * f + s * right + 0.2 * lift * DVec3::Y).normalize();
            let p = pose.position;
            let to = [at(p.x, d.x), at(p.y, d.y), at(p.z, d.z)];
            format!("camera.target=[{}, {}, {}]", to[0], to[1], to[2])
        };
        let away = warning(&scene(&[&aim(-1.0)]), Some(0), &[0.0; 4]).expect("nothing shows");
        // At a great angle a corner of the scene's bounds lies before the camera.
        prop_assert!(away.contains("looks away") || away.contains("looks past"), "{}", away);
        let toward = warning(&scene(&[&aim(1.0)]), Some(0), &[0.0; 4]).expect("nothing shows");
        prop_assert!(!toward.contains("looks away"), "{}", toward);
        Ok(())
    });
}

#[test]
fn every_reason_is_named() {
    let hello = scene(&[]);
    let none = [0.0; 4];
    let of = |scene: &Scene, n, rgba: &[f32]| warning(scene, n, rgba).expect("nothing shows");
    assert!(of(&hello, Some(0), &none).contains("too small"));
    assert!(of(&hello, Some(9), &none).contains("is transparent"));
    assert!(of(&hello, None, &none).contains("is transparent"));
    let thin = [0.0, 0.0, 0.0, 1e-4];
    assert!(of(&scene(&["film.background=[0,0,0]"]), None, &thin).contains("nearly"));
    let black = [0.0, 0.0, 0.0, 1.0];
    let dark = scene(&["film.background=[0,0,0]"]);
    assert!(of(&dark, None, &black).contains("colour of the background"));
    let mut bare = hello.clone();
    bare.clouds.clear();
    assert!(of(&bare, None, &none).contains("no particles"));
    // A number that is not finite is another fault, with a warning of its own.
    assert_eq!(warning(&hello, None, &[f32::NAN, 0.0, 0.0, 0.0]), None);
}

/// A lamp inside a cloud lights nearly nothing, one outside of it does.
#[test]
fn a_lamp_inside_a_cloud_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(at("b.dat"), "600\n1\n600, 2, 1, 1.5, 0, 0, 0, 0.4\n").expect("boxes");
    for (y, is_named) in [("0", true), ("4", false)] {
        let lamp = format!("{{ kind = \"point\", position = [0, {y}, 0], intensity = [9, 9, 9] }}");
        let cloud = "{ from = \"boxes\", file = \"b.dat\", texture = \"none\" }";
        let text = format!("light = [{lamp}]\ncloud = [{cloud}]\n");
        std::fs::write(at("s.toml"), text).expect("a scene");
        let (scene, picture) = (at("s.toml"), at(&format!("{y}.png")));
        let output = run(&["render", &scene, "--size", "32x24", "-o", &picture]);
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{text}");
        assert_eq!(text.contains("warning: light.0 lights"), is_named, "{text}");
    }
}
