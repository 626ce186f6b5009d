//! `nimbus report`: its messages, and its pages in a browser, with and without scripts.

mod checks;
mod roofs;
mod state;
mod still;
mod sweeps;

use std::fs;
use std::path::PathBuf;

use crate::browser::Browser;
use crate::program::{nimbus, path, run};
use crate::results;
use crate::studies;
use nimbus::io::image::png_bytes;
use nimbus::studies::error::front::Front;
use nimbus::studies::error::records::Study;
use nimbus::timing::frame_rows::{FrameRow, FrameTable};
use serde_json::{Value, json};
use tempfile::TempDir;

/// Returns a picture of 24 × 16 pixels of one colour.
fn picture(rgb: [u8; 3]) -> Vec<u8> {
    png_bytes(24, 16, &rgb.repeat(24 * 16)).expect("a picture")
}

/// Writes a study with pictures and a ledger, each in its own folder.
fn write_results_of_studies(dir: &TempDir) -> [String; 2] {
    let mut study = studies::usual_study();
    for (i, c) in study.configurations.iter_mut().enumerate().take(3) {
        (c.picture, c.error_map) = (Some(format!("p{i}.png")), Some(format!("e{i}.png")));
    }
    let [of_study, of_ledger] = ["study", "ledger"].map(|name| dir.path().join(name));
    for folder in [&of_study, &of_ledger] {
        fs::create_dir(folder).expect("a folder");
    }
    write_study(&of_study, &study);
    fs::write(of_study.join("reference.png"), picture([200, 10, 10])).expect("a picture");
    for i in 0..3 {
        fs::write(of_study.join(format!("p{i}.png")), picture([10, 200, 10])).expect("a picture");
        fs::write(of_study.join(format!("e{i}.png")), picture([10, 10, 200])).expect("a picture");
    }
    let ledger = serde_json::to_string(&studies::usual_ledger()).expect("JSON");
    fs::write(of_ledger.join("ledger.json"), ledger).expect("a ledger");
    [of_study, of_ledger].map(|folder| folder.to_str().expect("UTF-8").to_owned())
}

fn write_study(folder: &std::path::Path, study: &Study) {
    fs::write(folder.join("study.json"), serde_json::to_string(study).expect("JSON"))
        .expect("a study");
}

/// Runs two short benches with different pictures.
fn benches(dir: &TempDir) -> [String; 2] {
    let scene = format!("{}/scenes/threads.toml", env!("CARGO_MANIFEST_DIR"));
    let bench = |name: &str, set: &str| {
        let out = path(dir, name);
        let args = [
            "bench",
            &scene,
            "--size",
            "64x48",
            "--frames",
            "16",
            "--warmup",
            "1",
            "--plot",
            "--out",
            &out,
            "--set",
            set,
            "--set",
            "draw.particles=200",
        ];
        let output = run(&args);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let shown = String::from_utf8(output.stdout).expect("UTF-8");
        assert!(
            shown.contains("Frame time\n● serial  ○ parallel")
                && shown.contains("frame of the scene"),
            "{shown}"
        );
        assert!(!shown.contains('\u{1b}'), "colours without a terminal");
        for file in ["run.json", "frames.csv", "frames.svg", "passes.svg", "case-0.png"] {
            assert!(PathBuf::from(&out).join(file).exists(), "{file}");
        }
        out
    };
    [bench("before", "film.exposure=1"), bench("after", "film.exposure=0.5")]
}

fn report(dir: &TempDir, runs: &[&str]) -> PathBuf {
    let page = path(dir, "page.html");
    let output = run(&[&["report"], runs, &["-o", &page, "--force"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let stderr = String::from_utf8_lossy(&output.stderr);
    let is_one_line = stderr.starts_with(&format!("wrote {page}: ")) && stderr.lines().count() == 1;
    assert!(output.stdout.is_empty() && is_one_line, "{stderr}");
    if let Ok(kept) = std::env::var("NIMBUS_TEST_KEEP_PAGE") {
        fs::copy(&page, kept).expect("a copy");
    }
    page.into()
}

#[test]
fn page_of_all_results_is_complete_and_self_contained() {
    let dir = tempfile::tempdir().expect("a folder");
    let ([study, ledger], [before, after]) = (write_results_of_studies(&dir), benches(&dir));
    let page = report(&dir, &[&before, &after, &study, &ledger]);
    let mut browser = Browser::new();
    browser.size(1200, 900);
    browser.open(&page);
    let n = |browser: &mut Browser, selector: &str| {
        browser
            .eval(&format!("document.querySelectorAll({selector:?}).length"))
            .as_u64()
            .expect("a number")
    };
    // Two benches with two charts each, a study with time and error by two knobs (two values of the
    // third are the same number), a ledger, and a comparison.
    assert_eq!((n(&mut browser, "main > section"), n(&mut browser, "figure.chart svg")), (5, 10));
    let titles = browser.eval(
        "[...document.querySelectorAll('figure.chart svg')].map(s => s.getAttribute('aria-label'))",
    );
    let bench = ["Frame time", "GPU time of an average frame by pass"];
    assert_eq!(
        titles,
        json!([
            bench[0],
            bench[1],
            bench[0],
            bench[1],
            "Time against error",
            "Time against draw.threshold",
            "Error against draw.threshold",
            "Time against draw.cutoff",
            "Error against draw.cutoff",
            "Error of every approximation"
        ])
    );
    assert_eq!(n(&mut browser, "#run-2 .mark"), 23 + 2 * (4 + 2));
    assert_eq!(n(&mut browser, "#run-2 table:first-of-type tbody tr"), 23 + 3);
    // No overflow; pictures are loaded and have texts; ids are unique.
    assert_eq!(browser.eval("document.documentElement.scrollWidth <= innerWidth"), json!(true));
    let pictures = browser
        .eval("[...document.images].every(i => i.complete && i.naturalWidth > 0 && i.alt !== '')");
    assert_eq!(pictures, json!(true));
    assert_eq!(
        browser.eval(
            "document.querySelectorAll('[id]').length === new \
        Set([...document.querySelectorAll('[id]')].map(e => e.id)).size"
        ),
        json!(true)
    );
    assert_eq!(n(&mut browser, "table:not(:has(caption)), th:not([scope])"), 0);
    checks::tooltips(&mut browser);
    checks::sliders(&mut browser);
    checks::sorting(&mut browser);
    checks::contrasts(&mut browser);
    assert_eq!(browser.complaints(), [""; 0]);
    // Errors would be reported.
    browser.eval("console.error('seen')");
    browser.eval("fetch('http://127.0.0.1:9/').catch(() => 0)");
    assert!(browser.complaints().len() >= 2, "{:?}", browser.complaints());

    browser.scripts(false);
    browser.open(&page);
    checks::without_scripts(&mut browser);
}

#[test]
fn page_escapes_text_of_files() {
    let dir = tempfile::tempdir().expect("a folder");
    let evil = "</script><script>document.title='owned'</script><img src=x \
        onerror=\"document.title='owned'\">\"'&";
    let mut study =
        studies::study(vec![studies::configuration(&[(evil, evil)], 10.0, 0.01, Front::On)]);
    (study.made.device.name, study.made.command, study.made.scene) =
        (evil.to_owned(), vec![evil.to_owned()], json!({ evil: evil }));
    study.configurations[0].failure = Some(evil.to_owned());
    let folder = dir.path().join(evil.replace('/', "∕"));
    fs::create_dir(&folder).expect("a folder");
    write_study(&folder, &study);
    let page = report(&dir, &[folder.to_str().expect("UTF-8")]);
    let mut browser = Browser::new();
    browser.open(&page);
    assert_eq!(browser.eval("document.scripts.length + document.images.length"), json!(1));
    assert!(browser.eval("document.title").as_str().is_some_and(|t| t.starts_with("nimbus: ")));
    assert!(
        browser
            .eval("document.body.innerText")
            .as_str()
            .is_some_and(|t| t.matches("onerror=").count() >= 5)
    );
    assert_eq!(browser.complaints(), [""; 0]);
    // A picture in another folder is refused.
    study.configurations[0].picture = Some("../../secret.png".to_owned());
    write_study(&folder, &study);
    let output = run(&["report", folder.to_str().expect("UTF-8"), "-o", &path(&dir, "other.html")]);
    assert_eq!(output.status.code(), Some(2));
    assert!(!dir.path().join("other.html").exists());
}

#[test]
fn bad_input_gives_one_message_and_no_page() {
    let dir = tempfile::tempdir().expect("a folder");
    let [study, _] = write_results_of_studies(&dir);
    let (page, empty) = (path(&dir, "page.html"), path(&dir, "empty"));
    fs::create_dir(&empty).expect("a folder");
    let other = |name: &str, change: fn(&mut Value)| {
        let folder = dir.path().join(name);
        fs::create_dir(&folder).expect("a folder");
        let mut value = serde_json::to_value(studies::usual_study()).expect("JSON");
        change(&mut value);
        fs::write(folder.join("study.json"), value.to_string()).expect("a file");
        folder.to_str().expect("UTF-8").to_owned()
    };
    let later = other("later", |v| v["schema"] = json!(99));
    let lacking =
        other("lacking", |v| drop(v.as_object_mut().expect("an object").remove("reference")));
    let none = other("none", |v| *v = json!({}));
    let cut = path(&dir, "cut");
    fs::create_dir(&cut).expect("a folder");
    fs::write(format!("{cut}/study.json"), "{\"schema\": 1,").expect("a file");
    let picture = path(&dir, "study/reference.png");
    for (given, expected) in [
        (
            empty.as_str(),
            "holds no results: none of run.json, study.json, ledger.json; expected a \
             folder that bench",
        ),
        ("nowhere", "nowhere: no such file or folder"),
        (&picture, "expected a results folder, or in one run.json, study.json, ledger.json"),
        (&later, "study.json of schema 99; this nimbus reads 1"),
        (&lacking, "missing field `reference`"),
        (&none, "not a study.json of nimbus: it names no schema version"),
        (&cut, "not JSON, or not all of it"),
    ] {
        let output = run(&["report", &study, given, "-o", &page]);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!((output.status.code(), stderr.lines().count()), (Some(2), 1), "{stderr}");
        assert!(stderr.contains(expected), "{stderr}");
        assert!(!PathBuf::from(&page).exists(), "{expected}");
    }
    for (output, expected) in [
        ("page.pdf", "expected a file name that ends in .html"),
        ("gone/page.html", "does not exist; make it first, or choose another place"),
    ] {
        let output = run(&["report", &study, "-o", &path(&dir, output)]);
        assert_eq!(output.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&output.stderr).contains(expected));
    }
    // Existing files stay without --force; a file may be named instead of its folder.
    assert!(run(&["report", &study, "-o", &page]).status.success());
    let first = fs::read(&page).expect("a page");
    let refused = run(&["report", &study, "-o", &page]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--force"));
    let again = run(&["report", &format!("{study}/study.json"), "-o", &page, "--force"]);
    assert!(
        again.status.success() && fs::read(&page).expect("a page") != first,
        "the file's name is in it"
    );
    assert!(
        !nimbus(&["report", "-o", &page]).output().expect("it runs").status.success(),
        "a run is needed"
    );
}

#[test]
fn page_of_a_run_without_data() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = dir.path().join("bare");
    fs::create_dir(&folder).expect("a folder");
    let rows = vec![FrameRow { warm_up: false, ..results::row("serial", 0) }];
    let run = results::run(vec![results::mode("serial", 1, 0)]);
    results::write(&folder, &run, &FrameTable { pass_names: vec![], rows }).expect("results");
    let bare = folder.to_str().expect("UTF-8").to_owned();
    let empty = dir.path().join("empty");
    fs::create_dir(&empty).expect("a folder");
    write_study(&empty, &Study { interrupted: true, ..studies::study(vec![]) });
    let page = report(&dir, &[&bare, empty.to_str().expect("UTF-8")]);
    let text = fs::read_to_string(page).expect("a page");
    assert!(
        text.contains("No pass was timed") && text.contains("nothing was both timed and compared")
    );
    assert!(text.contains("Interrupted:"));
}

#[test]
fn bench_replaces_only_its_own_files() {
    let dir = tempfile::tempdir().expect("a folder");
    let (scene, out) =
        (format!("{}/scenes/threads.toml", env!("CARGO_MANIFEST_DIR")), path(&dir, "run"));
    let scene = [scene.as_str(), "--size", "64x48", "--set", "draw.particles=200"];
    let bench = |more: &[&str]| {
        let args = [
            &["bench"],
            &scene[..],
            &["--frames", "4", "--warmup", "1", "--no-saved", "--out", &out],
            more,
        ]
        .concat();
        let output = run(&args);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let mut names: Vec<String> = fs::read_dir(&out)
            .expect("the folder")
            .map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8"))
            .collect();
        names.sort();
        names
    };
    let swept = bench(&["--sweep", "film.exposure=1,0.5", "--plot", "--threading", "serial"]);
    let all = [
        "case-0.png",
        "case-1.png",
        "frames-0.svg",
        "frames-1.svg",
        "frames.csv",
        "passes.svg",
        "run.json",
        "run.sha256",
        "state.csv",
    ];
    assert_eq!(swept, all);
    // The picture equals that of `render`.
    let drawn = path(&dir, "drawn.png");
    for (i, exposure) in ["film.exposure=1", "film.exposure=0.5"].into_iter().enumerate() {
        let more = ["--set", exposure, "--frame", "3", "-o", &drawn, "--force"];
        assert!(run(&[&["render"], &scene[..], &more].concat()).status.success());
        let [kept, drawn] = [format!("{out}/case-{i}.png"), drawn.clone()]
            .map(|file| fs::read(file).expect("a picture"));
        assert!(kept == drawn, "{exposure}");
    }
    fs::write(format!("{out}/picture-7.png"), "mine").expect("a file");
    assert_eq!(
        bench(&["--force"]),
        ["case-0.png", "frames.csv", "picture-7.png", "run.json", "run.sha256", "state.csv"]
    );
}
