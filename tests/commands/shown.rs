//! Times at which a window's pictures are visible, on a driver that tells them.

#![cfg(feature = "window")]

use crate::display::Display;
use crate::driver_files::DriverFiles;
use crate::program::nimbus;
use serde_json::Value;

const HELLO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hello.toml");

/// Shows 300 frames of a small scene with the validation layers, and returns what `view` prints.
fn view(shown_ms: Option<&str>, args: &[&str]) -> String {
    let (display, driver) = (Display::open(), DriverFiles::new());
    let dir = tempfile::tempdir().expect("a folder");
    let log = dir.path().join("log");
    let options =
        ["--size", "200x150", "--frames", "300", "--validation", "--present", "immediate"];
    let mut command = nimbus(&[&["view", HELLO], &options[..], args].concat());
    command
        .current_dir(dir.path())
        .envs(display.variables())
        .envs(driver.variables())
        .env("NIMBUS_FAKE_LOG", &log)
        .env("NIMBUS_CACHE_DIR", dir.path().join("cache"))
        .envs(shown_ms.map(|ms| ("NIMBUS_FAKE_SHOWN_MS", ms)));
    let output = command.output().expect("the program runs");
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
    let logged = std::fs::read_to_string(&log).unwrap_or_default();
    assert_eq!(logged, "", "{text}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Returns the field `shown` of what `view` prints as JSON.
fn shown(shown_ms: Option<&str>) -> Value {
    let text = view(shown_ms, &["--json"]);
    serde_json::from_str::<Value>(&text).expect("JSON")["shown"].clone()
}

#[test]
fn pictures_are_visible_as_long_after_their_game_step_as_the_display_takes() {
    const DELAY_MS: f64 = 60.0;
    let slow = shown(Some("60"));
    let number = |of: &str, name: &str| slow[of][name].as_f64().unwrap_or_else(|| panic!("{slow}"));
    assert!(number("to_screen_ms", "min") >= DELAY_MS, "{slow}");
    assert!(number("interval_ms", "p50") > 0.0, "{slow}");
    let n = slow["n"].as_u64().expect("a number");
    // The last pictures become visible after the last frame, and the first ten are a warm-up.
    assert!((1..=290).contains(&n), "{slow}");
}

#[test]
fn pictures_that_are_visible_at_once_are_all_told() {
    let fast = shown(Some("0"));
    let n = fast["n"].as_u64().expect("a number") + fast["n_replaced"].as_u64().expect("a number");
    assert!((1..=290).contains(&n), "{fast}");
    let text = view(Some("0"), &[]);
    assert!(text.contains(" pictures were seen, "), "{text}");
}

#[test]
fn a_device_that_does_not_tell_has_no_times() {
    assert_eq!(shown(None), Value::Null);
    assert!(!view(None, &[]).contains("were seen"));
}
