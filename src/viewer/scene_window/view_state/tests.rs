//! Keys, flying, panels by size, and the command line of a view.

use super::*;
use crate::io::scene_file;

fn state() -> ViewState {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml");
    ViewState::new(Arc::new(scene_file::load(&path, &[], None).unwrap().scene), true).unwrap()
}

#[test]
fn every_key_has_one_command_and_is_listed() {
    let names: Vec<&str> =
        SHORTCUTS.iter().map(|s| s.key).chain(FLYING_KEYS.iter().map(|f| f.0)).collect();
    assert_eq!(names.iter().collect::<BTreeSet<_>>().len(), names.len());
    let mut s = state();
    let message = |text: &str| Response::Message(text.to_owned());
    assert_eq!(s.press("t"), message("threads.mode = \"serial\""));
    assert_eq!((s.press("k"), s.version), (message("skipping is off"), 2));
    assert_eq!((s.press("nothing"), s.press("i")), (Response::Nothing, Response::PrintCommandLine));
    s.press("f12");
    s.press("?");
    s.press("escape");
    assert!(s.capture == Some(ImageKind::Png) && !s.shows_help && !s.is_closing);
    s.press("escape");
    assert!(s.is_closing);
}

#[test]
#[cfg(feature = "window")]
fn every_key_is_in_one_group_of_the_list() {
    let groups = crate::viewer::scene_window::commands::key_groups();
    let listed: Vec<&str> =
        groups.iter().flat_map(|(_, keys)| keys.iter().flat_map(|k| k.0.split(' '))).collect();
    for key in SHORTCUTS.iter().map(|s| s.key).chain(FLYING_KEYS.iter().map(|f| f.0)) {
        assert_eq!(listed.iter().filter(|k| **k == key).count(), 1, "{key}");
    }
}

#[test]
#[cfg(feature = "window")]
fn panels_follow_the_size_until_the_user_chooses() {
    let mut s = state();
    s.fits_panels = true;
    for (width, expected) in [(640, true), (300, false), (1280, true), (0, false)] {
        s.resize([width, 480], 1.0);
        assert_eq!((s.has_panels, s.size), (expected, [width, 480]));
    }
    s.press("h");
    assert!(s.has_panels);
    s.resize([320, 240], 1.0);
    assert!(s.has_panels);
    s.press("h");
    s.resize([1280, 960], 1.0);
    assert!(!s.has_panels);
}

#[test]
fn the_hint_goes_with_any_key() {
    let keys = SHORTCUTS.iter().map(|s| s.key).chain(FLYING_KEYS.iter().map(|f| f.0));
    for key in keys.chain(["no key of nimbus"]) {
        let mut s = state();
        s.shows_hint = true;
        s.press(key);
        assert!(!s.shows_hint, "{key}");
    }
}

#[test]
fn held_keys_fly_until_they_are_released() {
    let mut s = state();
    let from = s.camera.position();
    s.fly(1.0);
    assert_eq!(s.camera.position(), from);
    s.press("w");
    s.press("w");
    s.fly(0.5);
    let ahead = s.camera.position() - from;
    assert!((ahead.length() - 0.5 * s.camera.speed()).abs() < 1e-9 * s.camera.speed());
    assert!(ahead.normalize().dot(s.camera.pose().forward) > 1.0 - 1e-12);
    s.release("w");
    s.fly(1.0);
    assert_eq!(s.camera.position() - from, ahead);
    // Opposite keys cancel.
    s.press("a");
    s.press("d");
    s.fly(1.0);
    assert_eq!(s.camera.position() - from, ahead);
    s.release_all();
    s.drag(DVec2::new(100.0, 0.0), false);
    assert!(s.camera.pose().forward.dot(ahead.normalize()) < 0.999);
}

/// Reads the printed settings back as a scene with the same camera and knobs.
#[test]
fn the_command_line_draws_the_view() {
    let mut s = state();
    let first = s.scene.clone();
    for key in ["l", "b", "r", "k", ".", "."] {
        s.press(key);
    }
    s.drag(DVec2::new(31.0, -17.0), true);
    let line = s.command_line("scenes/hello.toml", &first);
    assert!(
        line.starts_with("nimbus render scenes/hello.toml -o view.png --frame 2 --size "),
        "{line}"
    );
    assert!(line.contains(" --no-skip"));
    let set: Vec<String> = line
        .split(" --set '")
        .skip(1)
        .map(|part| part.split('\'').next().unwrap().to_owned())
        .collect();
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml");
    let read = scene_file::load(&path, &set, None).unwrap().scene;
    for knob in Knob::ALL {
        assert_eq!(knob.value(&read), knob.value(&s.scene));
    }
    let key = read.camera.keys[0];
    assert!(key.position == s.camera.position() && key.target == s.camera.target(), "{line}");
}
