//! `nimbus report` as a user runs it, and its pages as a browser shows them: whole without a
//! script, quiet, on their own.

#[path = "harness/browser.rs"]
mod browser;
#[path = "harness/program.rs"]
mod program;
#[path = "harness/results.rs"]
mod results;
#[path = "harness/studies.rs"]
mod studies;

use std::fs;
use std::path::PathBuf;

use base64::Engine;
use browser::Browser;
use nimbus::io::image::png_bytes;
use nimbus::studies::error::records::{Front, Study};
use nimbus::timing::attachments::Attachments;
use nimbus::timing::frame_rows::{FrameRow, FrameTable};
use nimbus::timing::results::write_results;
use program::{nimbus, path, run};
use serde_json::{Value, json};
use tempfile::TempDir;

/// A picture of 24 × 16 pixels of one colour.
fn picture(rgb: [u8; 3]) -> Vec<u8> {
    png_bytes(24, 16, &rgb.repeat(24 * 16)).expect("a picture")
}

/// A study with pictures, and a ledger, in folders of their own.
fn written(dir: &TempDir) -> [String; 2] {
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

/// Two real benches of a few frames: the second one's picture is another.
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
        assert!(!shown.contains('\u{1b}'), "no colours where no terminal is");
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
    assert!(
        output.stdout.is_empty() && output.stderr.is_empty(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    if let Ok(kept) = std::env::var("NIMBUS_TEST_KEEP_PAGE") {
        fs::copy(&page, kept).expect("a copy");
    }
    page.into()
}

#[test]
fn a_page_of_everything_is_whole_quiet_and_alone() {
    let dir = tempfile::tempdir().expect("a folder");
    let ([study, ledger], [before, after]) = (written(&dir), benches(&dir));
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
    // Two benches with two charts each, a study, a ledger, and the comparison.
    assert_eq!((n(&mut browser, "main > section"), n(&mut browser, "figure.chart svg")), (5, 6));
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
            "What every approximation is off by"
        ])
    );
    assert_eq!(n(&mut browser, "#run-2 .mark"), 23);
    assert_eq!(n(&mut browser, "#run-2 table:first-of-type tbody tr"), 23 + 3);
    // Nothing hangs over, no picture is broken, all have texts, no two elements one name.
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
    pointing(&mut browser);
    sliding(&mut browser);
    sorting(&mut browser);
    appearances(&mut browser);
    assert_eq!(browser.complaints(), [""; 0]);
    // The check sees what it looks for.
    browser.eval("console.error('seen')");
    browser.eval("fetch('http://127.0.0.1:9/').catch(() => 0)");
    assert!(browser.complaints().len() >= 2, "{:?}", browser.complaints());

    browser.scripts(false);
    browser.open(&page);
    let text = browser.call("Runtime.evaluate", json!({ "expression": "1" }));
    assert!(text.is_object());
    without_scripts(&mut browser);
}

/// A hint on pointing and on focus, gone after.
fn pointing(browser: &mut Browser) {
    let hint = "(() => { const h = document.getElementById('hint'); return h.hidden ? '' : \
        h.textContent; })()";
    assert_eq!(browser.eval(hint), json!(""));
    let at = browser.eval(
        "(() => { const m = document.querySelector('#run-2 .mark'); m.scrollIntoView({ block: \
         'center' }); \
         const b = m.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()",
    );
    let at = [0, 1].map(|i| at[i].as_f64().expect("a number"));
    browser.point_at(at[0], at[1]);
    let said = browser.eval(hint);
    let said = said.as_str().expect("text");
    // The fastest on the front comes first.
    assert!(
        said.contains("draw.resolution=0.25, draw.threshold=0.05")
            && said.contains("GPU time of a frame: 4 (3.8 to 4.2) ms"),
        "{said}"
    );
    assert!(said.contains("RMSE from the reference \"thin\": 0.06 (0.048 to 0.072)"), "{said}");
    browser.point_at(1.0, 1.0);
    assert_eq!(browser.eval(hint), json!(""));
    browser.eval("document.querySelector('#run-2 .mark').focus()");
    assert!(browser.eval(hint).as_str().is_some_and(|s| s.contains("draw.resolution=0.25")));
    browser.key("Tab", 9);
    assert!(
        browser.eval(hint).as_str().is_some_and(|s| s.contains("draw.resolution=0.5")),
        "the next on the front"
    );
    browser.key("Escape", 27);
    assert_eq!(browser.eval(hint), json!(""));
    let inside = "(() => { document.querySelector('#run-2 .mark').focus(); const b = \
        document.getElementById('hint').getBoundingClientRect(); \
                  document.activeElement.blur(); return b.left >= 0 && b.right <= innerWidth; })()";
    assert_eq!(browser.eval(inside), json!(true));
}

/// One of two benches, three of the study against its reference.
fn sliding(browser: &mut Browser) {
    let sliders = "document.querySelectorAll('.slider').length";
    assert_eq!(browser.eval(sliders), json!(4));
    let cut = |browser: &mut Browser| {
        browser.eval(
            "(() => { const s = document.querySelector('#versus-0 .slider'); return \
            [s.querySelector('input').value, s.querySelectorAll('img')[1].style.clipPath]; })()",
        )
    };
    assert_eq!(cut(browser), json!(["50", "inset(0px 0px 0px 50%)"]));
    browser.eval("document.querySelector('#versus-0 .slider input').focus()");
    browser.key("ArrowRight", 39);
    assert_eq!(cut(browser), json!(["51", "inset(0px 0px 0px 51%)"]));
    // The two pictures and where they differ, which they do.
    let captions = browser.eval(
        "[...document.querySelectorAll('#versus-0 .pair figcaption')].map(c => c.textContent)",
    );
    assert_eq!(captions.as_array().map(Vec::len), Some(3));
    assert!(
        captions[2].as_str().is_some_and(|c| c.contains("FLIP") && !c.contains("mean 0;")),
        "{captions}"
    );
}

fn sorting(browser: &mut Browser) {
    let rmse = "[...document.querySelectorAll('#run-2 table')].find(t => t.rows.length === 24)";
    let column = |browser: &mut Browser| -> Vec<f64> {
        let all = browser.eval(&format!(
            "[...{rmse}.tBodies[0].rows].map(r => Number(r.cells[6].dataset.value))"
        ));
        all.as_array().expect("rows").iter().map(|v| v.as_f64().expect("a number")).collect()
    };
    let before = column(browser);
    browser.eval(&format!("{rmse}.tHead.rows[0].cells[6].querySelector('button').click()"));
    let sorted = column(browser);
    assert!(sorted.is_sorted() && !before.is_sorted() && sorted.len() == before.len());
    browser.eval(&format!("{rmse}.tHead.rows[0].cells[6].querySelector('button').click()"));
    assert!(column(browser).iter().rev().is_sorted());
}

/// Light and dark, on a screen and on paper: all differ that should, and what is written can be
/// read.
fn appearances(browser: &mut Browser) {
    let mut shown = Vec::new();
    for (name, scheme, media) in
        [("light", "light", "screen"), ("dark", "dark", "screen"), ("print", "dark", "print")]
    {
        browser.media(scheme, media);
        let contrasts = browser.eval(CONTRAST);
        let contrasts = contrasts.as_array().expect("a list");
        assert!(contrasts.len() > 100, "{} texts", contrasts.len());
        for of in contrasts {
            // WCAG 2.1, 1.4.3.
            assert!(of[0].as_f64().is_some_and(|c| c >= 4.5), "{name}: {of}");
        }
        let dark = browser.eval(&format!(
            "({LUMINANCE})(getComputedStyle(document.documentElement).backgroundColor) < 0.2"
        ));
        assert_eq!(dark, json!(name == "dark"), "{name}");
        let picture = browser.picture();
        let bytes = base64::engine::general_purpose::STANDARD.decode(&picture).expect("base64");
        if let Ok(kept) = std::env::var("NIMBUS_TEST_KEEP_PAGE") {
            fs::write(format!("{kept}.{name}.png"), &bytes).expect("a file");
        }
        assert!(!shown.contains(&picture));
        shown.push(picture);
    }
    browser.media("light", "screen");
}

/// Relative luminance of "rgb(…)" (WCAG 2.1).
const LUMINANCE: &str = "c => { const v = c.match(/[0-9.]+/g).slice(0, 3).map(x => x / 255).map(x \
    => x <= 0.03928 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4); return 0.2126 * v[0] + 0.7152 * \
    v[1] + 0.0722 * v[2]; }";

/// Contrast of every element that has text of its own against what it stands on.
const CONTRAST: &str = "(() => { const lum = c => { const v = c.match(/[0-9.]+/g).slice(0, \
    3).map(x => x / 255).map(x => x <= 0.03928 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4); return \
    0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2]; };\
  const behind = e => { for (; e; e = e.parentElement) { const c = \
  getComputedStyle(e).backgroundColor; if (!c.endsWith(', 0)') && c !== 'transparent') return c; } \
  return 'rgb(255, 255, 255)'; };\
  const out = [];\
  for (const e of document.querySelectorAll('body *')) {\
    if (!e.checkVisibility() || e.closest('script, style, title')) continue;\
    const own = [...e.childNodes].filter(n => n.nodeType === 3).map(n => \
    n.textContent.trim()).join('');\
    if (own === '') continue;\
    const style = getComputedStyle(e);\
    const [a, b] = [lum(e.namespaceURI.endsWith('svg') ? style.fill : style.color), \
    lum(behind(e))];\
    out.push([(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), own.slice(0, 40)]);\
  } return out; })()";

/// All tables and pictures are there; sliders are not.
fn without_scripts(browser: &mut Browser) {
    let document = browser.call("DOM.getDocument", json!({ "depth": 0 }))["root"]["nodeId"].clone();
    let mut n = |selector: &str| {
        let found = browser
            .call("DOM.querySelectorAll", json!({ "nodeId": document, "selector": selector }));
        found["nodeIds"].as_array().map(Vec::len).expect("a list")
    };
    assert_eq!(n(".slider"), 0);
    assert_eq!(n("thead button"), 0);
    assert_eq!(n("figure.chart svg"), 6);
    // Each bench: loops, cases, passes; the study: configurations and budgets; the ledger; what
    // differs, and the ratios.
    assert_eq!(n("table"), 2 * 3 + 2 + 1 + 2);
    assert_eq!(n(".mark title"), n(".mark"));
    // The benches' last frames; the study's reference, three pictures and three error maps; A, B
    // and where they differ.
    assert_eq!(n("img"), 2 + 7 + 3);
}

#[test]
fn what_files_say_cannot_act() {
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
    // A picture elsewhere is none of the study's.
    study.configurations[0].picture = Some("../../secret.png".to_owned());
    write_study(&folder, &study);
    let output = run(&["report", folder.to_str().expect("UTF-8"), "-o", &path(&dir, "other.html")]);
    assert_eq!(output.status.code(), Some(2));
    assert!(!dir.path().join("other.html").exists());
}

#[test]
fn bad_input_is_one_message_and_no_page() {
    let dir = tempfile::tempdir().expect("a folder");
    let [study, _] = written(&dir);
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
    for (given, said) in [
        (
            empty.as_str(),
            "holds no results: none of run.json, study.json, ledger.json; expected a \
             folder that bench",
        ),
        ("nowhere", "nowhere: no such file or folder"),
        (&picture, "expected a results folder, or in one run.json, study.json, ledger.json"),
        (&later, "a study of schema 99; this nimbus reads 1"),
        (&lacking, "missing field `reference`"),
        (&none, "not a study.json of nimbus: it names no schema version"),
        (&cut, "not JSON, or not all of it"),
    ] {
        let output = run(&["report", &study, given, "-o", &page]);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!((output.status.code(), stderr.lines().count()), (Some(2), 1), "{stderr}");
        assert!(stderr.contains(said), "{stderr}");
        assert!(!PathBuf::from(&page).exists(), "{said}");
    }
    for (output, said) in [
        ("page.pdf", "expected a file name that ends in .html"),
        ("gone/page.html", "does not exist"),
    ] {
        let output = run(&["report", &study, "-o", &path(&dir, output)]);
        assert_eq!(output.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&output.stderr).contains(said));
    }
    // What exists stays, unless forced; a file by its name is as good as its folder.
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
fn a_run_without_anything_to_draw_has_a_page() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = dir.path().join("bare");
    fs::create_dir(&folder).expect("a folder");
    let rows = vec![FrameRow { warm_up: false, ..results::row("serial", 0) }];
    let run = results::run(vec![results::mode("serial", 1, 0)]);
    write_results(&folder, &run, &FrameTable { pass_names: vec![], rows }, &Attachments::default())
        .expect("results");
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
fn a_bench_keeps_the_last_frame_of_its_cases_and_no_other_run_s() {
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
    ];
    assert_eq!(swept, all);
    // The frame itself, as `render` writes it.
    let drawn = path(&dir, "drawn.png");
    for (i, exposure) in ["film.exposure=1", "film.exposure=0.5"].into_iter().enumerate() {
        let more = ["--set", exposure, "--frame", "3", "-o", &drawn, "--force"];
        assert!(run(&[&["render"], &scene[..], &more].concat()).status.success());
        let [kept, drawn] = [format!("{out}/case-{i}.png"), drawn.clone()]
            .map(|file| fs::read(file).expect("a picture"));
        assert!(kept == drawn, "{exposure}");
    }
    fs::write(format!("{out}/picture-7.png"), "mine").expect("a file");
    assert_eq!(bench(&["--force"]), ["case-0.png", "frames.csv", "picture-7.png", "run.json"]);
}
