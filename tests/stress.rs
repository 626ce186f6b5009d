//! `nimbus stress`: every case passes on this device, under validation, and is documented.

#[path = "harness/program.rs"]
mod program;

use std::collections::BTreeSet;

use nimbus::stress::cases;
use serde_json::Value;

fn stress(args: &[&str]) -> (Option<i32>, String, String) {
    let output = program::run(&[&["stress"], args].concat());
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn every_case_passes() {
    let (code, stdout, stderr) = stress(&["--json", "--validation", "-q"]);
    let report: Value = serde_json::from_str(&stdout).expect("JSON");
    let schema: Value =
        serde_json::from_str(include_str!("../docs/reference/schemas/stress.schema.json"))
            .expect("the schema");
    let errors: Vec<String> = jsonschema::draft202012::new(&schema)
        .expect("a schema")
        .iter_errors(&report)
        .map(|e| e.to_string())
        .collect();
    assert!(errors.is_empty(), "{errors:?}");
    let list = report["cases"].as_array().expect("cases");
    let bad: Vec<&Value> =
        list.iter().filter(|c| c["verdict"] != "passed" && c["verdict"] != "not-here").collect();
    assert!(bad.is_empty() && code == Some(0), "{bad:#?}\n{stderr}");
    assert!(list.len() == cases().len() && list.len() >= 80, "{}", list.len());
    // At most one case does not apply to a device, and every other case compares values.
    assert!(list.iter().filter(|c| c["verdict"] == "not-here").count() <= 1);
    assert!(list.iter().all(|c| c["verdict"] == "not-here" || c["n"].as_u64() > Some(0)));
    let seconds: f64 = list.iter().filter_map(|c| c["seconds"].as_f64()).sum();
    println!("{} cases in {seconds:.1} s", list.len());
}

#[test]
fn every_case_is_explained() {
    let page = std::fs::read_to_string("docs/explanation/stability.md")
        .expect("docs/explanation/stability.md");
    let mut names = BTreeSet::new();
    for case in cases() {
        assert!(names.insert(case.name), "{} twice", case.name);
        assert!(
            page.contains(&format!("`{}`", case.name)),
            "docs/explanation/stability.md does not name {}",
            case.name
        );
        assert!(
            !case.what.is_empty() && !case.bound.is_empty() && case.what.len() < 140,
            "{}",
            case.name
        );
    }
    // The page names no other cases.
    for word in page.split('`').skip(1).step_by(2) {
        let is_family = |f: &str| cases().iter().any(|c| c.family() == f);
        if word.split_once('/').is_some_and(|(family, _)| is_family(family)) {
            assert!(names.contains(word), "docs/explanation/stability.md names {word}");
        }
    }
    // The list of families fits a screen, and so does that of each family.
    let (code, stdout, _) = stress(&["--list"]);
    let fits = |text: &str| {
        text.lines().count() <= 50 && text.lines().all(|line| line.chars().count() <= 80)
    };
    assert!(code == Some(0) && fits(&stdout), "{stdout}");
    let mut families: Vec<&str> = cases().iter().map(nimbus::stress::Case::family).collect();
    families.dedup();
    for family in families {
        let n = cases().iter().filter(|c| c.family() == family).count();
        let row = stdout.lines().find(|line| line.split_whitespace().next() == Some(family));
        let row = row.unwrap_or_else(|| panic!("{family} is missing: {stdout}"));
        assert_eq!(row.split_whitespace().nth(1), Some(n.to_string().as_str()), "{row}");
        let (code, of_family, _) = stress(&["--list", family]);
        assert!(code == Some(0) && fits(&of_family), "{of_family}");
        for case in cases().iter().filter(|c| c.family() == family) {
            assert!(of_family.contains(case.name), "{} is missing: {of_family}", case.name);
        }
    }
    let (_, one, _) = stress(&["--list", "functions/division"]);
    assert!(one.contains("allowed: 2.5 ulp"), "{one}");
}

#[test]
fn faulty_shader_fails_with_exit_code_1() {
    let dir = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(dir.path().join("include")).expect("a folder");
    let text = std::fs::read_to_string("shaders/include/functions.glsl").expect("a shader");
    std::fs::write(
        dir.path().join("include/functions.glsl"),
        text.replace("0.00833307858", "0.00833007858"),
    )
    .expect("written");
    let (code, stdout, stderr) =
        stress(&["functions", "--shaders", &dir.path().display().to_string(), "-q"]);
    assert_eq!(code, Some(1));
    assert!(
        stdout.contains("functions/sine ")
            && stdout.contains("FAILED")
            && stdout.contains("out of bound; at x = ")
    );
    assert!(stderr.contains("cases failed: functions/sine"), "{stderr}");
}

#[test]
fn unknown_case_is_reported() {
    let (code, _, stderr) = stress(&["functoins"]);
    assert_eq!(code, Some(2));
    assert!(
        stderr.contains("no case begins with \"functoins\"")
            && stderr.contains("; did you mean `functions`? expected one of")
            && stderr.contains("functions, generation"),
        "{stderr}"
    );
    let (code, stdout, _) = stress(&["count/most", "functions/rounding", "--csv", "-q"]);
    let rows: Vec<&str> = stdout.lines().collect();
    assert!(
        code == Some(0) && rows.len() == 3 && rows[0].starts_with("name,verdict,n,"),
        "{stdout}"
    );
}

/// Number of the driver's threads: the same bytes.
#[test]
fn pictures_are_independent_of_driver_threads() {
    let hash = |threads: &str| {
        let dir = tempfile::tempdir().expect("a folder");
        let out = dir.path().join("out.png").display().to_string();
        let args = ["render", "scenes/hello.toml", "--size", "160x120", "--json", "-q", "-o", &out];
        let output = program::nimbus(&args)
            .env("LP_NUM_THREADS", threads)
            .output()
            .expect("the program runs");
        assert!(output.status.success());
        let printed: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        (printed["hash"].clone(), std::fs::read(dir.path().join("out.png")).expect("a picture"))
    };
    let one = hash("1");
    assert!(one == hash("2") && one == hash("7"));
}
