//! `nimbus inspect SCENE --basis` as a user runs it: no device is needed.

use std::fs;

use assert_cmd::Command;
use nimbus::inspect::basis::basis_warnings;
use nimbus::io::scene_file;
use serde_json::Value;

/// Exit code, stdout, stderr. No device is requested: the loader lists none.
fn run(args: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("nimbus").expect("the program is built");
    command.env("NIMBUS_PROGRESS_S", "0");
    let no_driver = [("VK_DRIVER_FILES", "/nowhere"), ("VK_ICD_FILENAMES", "/nowhere")];
    let output = command.args(args).envs(no_driver).output().expect("the program runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code().expect("an exit code"), text(output.stdout), text(output.stderr))
}

/// A scene with a glossy and a matte material, its folder, and its path.
fn scene(lighting: &str) -> (tempfile::TempDir, String) {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let hello = fs::read_to_string("scenes/hello.toml").expect("the scene");
    fs::copy("scenes/hello.csv", dir.path().join("hello.csv")).expect("the list");
    let materials = "[[material]]\nname = \"cloud\"\nkd = [0.5, 0.5, 0.5]\n\n[[material]]\nname \
        = \"gloss\"\n\
                     kd = [0.3, 0.3, 0.3]\nks = [0.1, 0.1, 0.1]\nns = 50\n";
    let path = dir.path().join("scene.toml");
    fs::write(&path, format!("{hello}\n[lighting]\n{lighting}\n{materials}")).expect("a scene");
    let path = path.to_str().expect("a UTF-8 path").to_owned();
    (dir, path)
}

fn numbers(line: &str) -> Vec<f64> {
    line.split(',').map(|cell| cell.parse().expect("a number")).collect()
}

#[test]
fn the_table_is_a_row_for_every_node() {
    let (_dir, scene) = scene("bases = 5");
    let (code, table, stderr) = run(&["inspect", &scene, "--basis", "-q"]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!((lines[0], lines.len()), ("t,gamma_deg,b0,b1,b2,b3,b4", 1 + 1025));
    let rows: Vec<Vec<f64>> = lines[1..].iter().map(|line| numbers(line)).collect();
    assert!(rows.iter().all(|r| r.len() == 7 && r[2] == std::f64::consts::FRAC_1_PI));
    assert_eq!((rows[0][0], rows[0][1], rows[1024][0]), (0.0, 0.0, 1.0));
    assert!((rows[1024][1] - 90.0).abs() < 1e-12);
    // Node 512: 1 − cos γ = 1/16.
    assert!((rows[512][1] - 0.9375f64.acos().to_degrees()).abs() < 1e-12, "{:?}", rows[512]);
    assert_eq!(run(&["inspect", &scene, "--basis", "table"]).1, table);
}

#[test]
fn values_and_errors_are_tables_of_their_own() {
    let (_dir, scene) = scene("bases = 5");
    let (code, values, _) = run(&["inspect", &scene, "--basis", "values"]);
    let kept = values.lines().filter(|line| line.ends_with(",true")).count();
    assert_eq!((code, values.lines().next(), kept), (0, Some("basis,singular_value,kept"), 4));
    assert_eq!(values.lines().count(), 1 + 64);
    let (code, errors, _) = run(&["inspect", &scene, "--basis", "errors"]);
    let lines: Vec<&str> = errors.lines().collect();
    assert_eq!(
        (code, lines[0], lines.len()),
        (0, "of,material,ns,error", 1 + 17 + 1 + 1),
        "{errors}"
    );
    let error = |line: &str| {
        line.rsplit(',').next().and_then(|cell| cell.parse::<f64>().ok()).expect("an error")
    };
    assert!(
        lines[1].starts_with("range,,1.0,") && lines[17].starts_with("range,,256.0,"),
        "{errors}"
    );
    assert!(
        lines[18].starts_with("worst,,") && lines[1..].iter().all(|l| error(l) <= error(lines[18])),
        "{errors}"
    );
    assert!(lines[19].starts_with("material,gloss,50.0,"), "{errors}");
}

#[test]
fn json_holds_all_tables() {
    let (_dir, scene) = scene("bases = 8\nexponents = [1, 64]");
    let (code, text, stderr) = run(&["inspect", &scene, "--basis", "--json"]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    let found: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(
        (&found["asked"], &found["kept"], &found["sampling"]),
        (&8.into(), &8.into(), &"log".into())
    );
    assert_eq!(found["exponents"], serde_json::json!([1.0, 64.0]));
    let length = |v: &Value| v.as_array().map(Vec::len);
    assert_eq!(
        (length(&found["table"]["bases"]), length(&found["table"]["t"])),
        (Some(8), Some(1025))
    );
    assert_eq!(length(&found["singular_values"]), Some(64));
    // The page's first row: 2.6e-3.
    let worst = found["errors"]
        .as_array()
        .and_then(|e| e.iter().find(|row| row["of"] == "worst"))
        .expect("a worst");
    assert_eq!(format!("{:.1e}", worst["error"].as_f64().expect("a number")), "2.6e-3");
    assert_eq!(run(&["inspect", &scene, "--basis", "errors", "--json"]).1, text);
}

#[test]
fn fewer_bases_than_asked_for_are_noted() {
    let (_dir, scene) = scene("bases = 32\nexponents = [49, 51]");
    let (code, table, stderr) = run(&["inspect", &scene, "--basis"]);
    assert_eq!(code, 0);
    let n_bases = table.lines().next().map_or(0, |header| header.split(',').count() - 2);
    let expected = format!(
        "note: 32 bases asked for, {n_bases} kept: the lobes of n_s from 49 to 51 differ in \
         no more\n"
    );
    assert!(n_bases < 32 && stderr == expected, "{stderr}");
    let (_, again, nothing) = run(&["inspect", &scene, "--basis", "-q"]);
    assert_eq!((again, nothing), (table, String::new()));
}

#[test]
fn contradicting_arguments_are_refused() {
    for more in [&["--plan"][..], &["--reference"], &["--frame", "3"], &["--particles"]] {
        let (code, stdout, stderr) =
            run(&[&["inspect", "scenes/hello.toml", "--basis"], more].concat());
        assert!(
            code == 2 && stdout.is_empty() && stderr.contains("cannot be used with"),
            "{more:?}: {stderr}"
        );
    }
    let (code, _, stderr) = run(&["inspect", "scenes/hello.toml", "--basis", "vectors"]);
    assert!(code == 2 && stderr.contains("table, values, errors"), "{stderr}");
    let (_, help, _) = run(&["inspect", "--help"]);
    assert!(help.contains("--basis") && help.contains("singular values"), "{help}");
}

#[test]
fn a_basis_too_small_for_a_material_is_warned_of() {
    let warnings = |lighting: &str| {
        let (_dir, path) = scene(lighting);
        basis_warnings(&scene_file::load(path.as_ref(), &[], None).expect("a scene").scene)
    };
    let found = warnings("bases = 3");
    assert!(
        found.len() == 1
            && found[0].starts_with("material `gloss`: 3 bases represent n_s = 50 only to"),
        "{found:?}"
    );
    assert!(warnings("bases = 1")[0].contains("leaves out its lobe"));
    for fine in ["bases = 12", "bases = 2\nexponents = [50, 50]", "bases = 3\nmode = \"none\""] {
        assert_eq!(warnings(fine), [""; 0], "{fine}");
    }
}
