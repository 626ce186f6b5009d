//! `nimbus weather` as it is typed.

use std::fs;
use std::path::Path;

use crate::program::{path, run};
use crate::weather_files::Made;
use serde_json::Value;

fn scenery(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/weather").join(name).display().to_string()
}

/// Exit code, stdout, stderr.
fn said(args: &[&str]) -> (Option<i32>, String, String) {
    let output = run(args);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn tables_for_people() {
    let (code, out, err) = said(&["weather", &scenery("katrina.nc")]);
    assert_eq!((code, err.as_str()), (Some(0), ""));
    let lines = [
        "NetCDF-4 (HDF5), OUTPUT FROM WRF V3.8.1 MODEL",
        "48 x 48 columns of 10000 x 10000 m, 14 levels; map Mercator",
        "clouds from the file's mixing ratios",
        "note: QICE is missing",
        "note: MP_PHYSICS is 3: QCLOUD is ice below 273.15 K",
        "note: at step 1 clouds of 302 columns reach the highest level; the file has nothing above",
        "QCLOUD    float  4 x 14 x 48 x 48",
        "kg kg-1",
    ];
    for line in lines {
        assert!(out.contains(line), "{line}\n{out}");
    }
    // The first step as another program has it (tests/weather/files.rs); the sun is 4 degrees above the
    // Gulf of Mexico.
    let row = out.lines().find(|line| line.starts_with("0 ")).expect("the first step");
    let words: Vec<&str> = row.split_whitespace().collect();
    let expected = [
        "0",
        "2005-08-28",
        "12:00:00",
        "23.8°",
        "N",
        "89.5°",
        "W",
        "4.0°",
        "1077",
        "446",
        "0.2340",
        "549.98",
        "0.1497",
        "146",
        "6101",
        "0",
        "to",
        "0",
        "0",
    ];
    assert_eq!(words, expected, "{out}");
    let (_, quiet, _) = said(&["weather", &scenery("katrina.nc"), "--quiet"]);
    assert!(!quiet.contains("note:") && quiet.contains("2005-08-28 21:00:00"), "{quiet}");
}

#[test]
fn one_step_as_json() {
    let (code, out, _) = said(&["weather", &scenery("supercell.nc"), "--step", "1", "--json"]);
    assert_eq!(code, Some(0));
    let json: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(
        (&json["clouds"], &json["grid"]["idealised"], &json["n_steps"]),
        (&"given".into(), &true.into(), &3.into())
    );
    let [step] = &json["steps"].as_array().expect("a list")[..] else { panic!("one step: {out}") };
    assert_eq!(
        (&step["step"], &step["time"], &step["sun_elevation_deg"]),
        (&1.into(), &"0001-01-01 00:48:00".into(), &Value::Null)
    );
    assert_eq!(
        (&step["clouds"]["cells"], &step["clouds"]["columns"], &step["negative"]),
        (&24891.into(), &1583.into(), &0.into())
    );
    let snow = json["variables"]
        .as_array()
        .and_then(|v| v.iter().find(|v| v["name"] == "QSNOW"))
        .expect("snow");
    assert_eq!(
        (&snow["type"], &snow["units"], &snow["dimensions"][1]["length"]),
        (&"float".into(), &"kg kg-1".into(), &40.into())
    );
}

#[test]
fn diagnosed_clouds_and_clear_steps_are_marked() {
    let dir = tempfile::tempdir().expect("a folder");
    let write =
        |name: &str, made: &Made| fs::write(path(&dir, name), made.bytes()).expect("written");
    write("dry.nc", &Made::wrf(2, 1).without("QCLOUD"));
    let (code, out, _) = said(&["weather", &path(&dir, "dry.nc")]);
    assert_eq!(code, Some(0));
    for words in [
        "clouds from relative humidity: diagnosed",
        "diagnosed cells",
        "no cloud",
        "NetCDF 64-bit offset",
        "idealised, no map",
    ] {
        assert!(out.contains(words), "{words}\n{out}");
    }
    write(
        "odd.nc",
        &Made::wrf(5, 1)
            .with_floats("QCLOUD", |q| q[..3].copy_from_slice(&[-1e-9, f32::NAN, -2.0])),
    );
    let (_, out, _) = said(&["weather", &path(&dir, "odd.nc")]);
    assert!(out.contains("2 negative, 1 missing"), "{out}");
}

#[test]
fn diagnosed_clouds_are_compared_with_the_files_own() {
    let katrina = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/weather/katrina.nc");
    let (code, out, _) = said(&["weather", katrina, "--step", "0", "--diagnosed", "--json"]);
    assert_eq!(code, Some(0));
    let json: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    let of = &json["steps"][0]["diagnosed"];
    let number = |key: &str| of[key].as_f64().unwrap_or(f64::NAN);
    let cells = number("hits") + number("missed") + number("false_alarms") + number("clear");
    assert_eq!(cells, 48.0 * 48.0 * 14.0);
    assert!(number("hit_rate") > 0.99 && number("bias") < 5.0, "{of}");
    let (_, out, _) = said(&["weather", katrina, "--step", "0", "--diagnosed"]);
    assert!(out.contains("hit rate") && out.contains("false alarm ratio"), "{out}");
    let (_, out, _) = said(&["weather", katrina, "--step", "0"]);
    assert!(!out.contains("hit rate"), "{out}");
    // Nothing to compare with.
    let dir = tempfile::tempdir().expect("a folder");
    fs::write(path(&dir, "dry.nc"), Made::wrf(1, 1).without("QCLOUD").bytes()).expect("written");
    let (code, _, error) = said(&["weather", &path(&dir, "dry.nc"), "--diagnosed"]);
    assert!(code == Some(2) && error.contains("to compare them"), "{error}");
}

#[test]
fn bad_files_exit_with_2_and_one_message() {
    let dir = tempfile::tempdir().expect("a folder");
    let bad = path(&dir, "bad.nc");
    fs::write(&bad, Made::wrf(1, 2).without("PHB").bytes()).expect("written");
    let message =
        format!("error: {bad}: variable PHB is missing: expected P, PB, T, PH, PHB of WRF\n");
    assert_eq!(said(&["weather", &bad]), (Some(2), String::new(), message));
    let katrina = scenery("katrina.nc");
    let message = format!("error: step 4: {katrina} has steps 0 to 3\n");
    assert_eq!(said(&["weather", &katrina, "--step", "4"]), (Some(2), String::new(), message));
    let (code, _, err) = said(&["weather", &path(&dir, "none.nc")]);
    assert!(code == Some(2) && err.ends_with("none.nc: no such file\n"), "{err}");
}

#[test]
fn help_names_the_format_and_shows_examples() {
    let (code, help, _) = said(&["weather", "--help"]);
    assert_eq!(code, Some(0));
    for word in
        ["WRF", "diagnosed", "--step <N>", "--json", "Exit codes", "scenes/weather/katrina.nc"]
    {
        assert!(help.contains(word), "{word}\n{help}");
    }
}
