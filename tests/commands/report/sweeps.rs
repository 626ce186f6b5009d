//! The page of a sweep.

use std::path::Path;

use serde_json::{Value, json};

use super::report;
use crate::browser::Browser;
use crate::program::{path, run};

#[test]
fn a_sweep_has_one_plot_a_measure_and_fits_narrow_pages() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = path(&dir, "swept");
    let scene = format!("{}/scenes/threads.toml", env!("CARGO_MANIFEST_DIR"));
    let args = [
        "bench",
        &scene,
        "--size",
        "32x24",
        "--frames",
        "2",
        "--warmup",
        "0",
        "--repeat",
        "1",
        "--no-saved",
        "--threading",
        "serial",
        "--sweep",
        "draw.particles=40,80,400",
        "--sweep",
        "draw.cutoff=2,3",
        "--sweep",
        "draw.path=tiles,sprites",
        "--out",
        &out,
    ];
    let output = run(&args);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let page = report(&dir, &[&out]);
    let mut browser = Browser::new();
    browser.size(1280, 900);
    browser.open(&page);
    // Particles along the axis, a line for each cutoff, a panel for each path.
    let titles = browser.eval(
        "[...document.querySelectorAll('.panels svg')].map(s => s.getAttribute('aria-label'))",
    );
    let of = |name: &str, path: &str| format!("{name} against draw.particles, {path}, serial");
    let [tiles, sprites] = ["draw.path=tiles", "draw.path=sprites"];
    assert_eq!(
        titles,
        json!([
            of("Frame time", tiles),
            of("Frame time", sprites),
            of("GPU time", tiles),
            of("GPU time", sprites)
        ])
    );
    let marks = "document.querySelectorAll('.panels figure:first-child .mark').length";
    assert_eq!(browser.eval(marks), json!(6));
    let first = browser.eval("document.querySelector('.panels .mark').getAttribute('aria-label')");
    assert!(
        first.as_str().is_some_and(|t| t.starts_with("draw.particles=40\ndraw.cutoff=2\n")),
        "{first}"
    );
    // Wide tables scroll in their own box, at any width of the page.
    for width in [1280, 640, 400] {
        browser.size(width, 900);
        browser.open(&page);
        let fits = browser.eval("document.documentElement.scrollWidth <= innerWidth");
        assert_eq!(fits, json!(true), "{width} pixels");
    }
    // Long tables are folded.
    assert_eq!(browser.eval("document.querySelectorAll('details.folded').length > 0"), json!(true));
    assert_eq!(hidden(&mut browser, &page, "screen"), json!(true));
    // Paper shows what a screen shows when everything is unfolded.
    assert_eq!(hidden(&mut browser, &page, "print"), json!(false));
    let text = browser.eval("document.body.innerText");
    let text = text.as_str().expect("text");
    for remark in [
        "A value alone has too few values for a confidence interval, which needs 30 frames",
        "12 charts, one for each point of the sweep",
    ] {
        assert!(text.contains(remark), "{remark} in\n{text}");
    }
}

/// Returns whether all that is in a fold is hidden in a medium; null if one part is and another is
/// not.
fn hidden(browser: &mut Browser, page: &Path, medium: &str) -> Value {
    browser.media("light", medium);
    // A page that is open keeps what it has hidden until its next frame.
    browser.open(page);
    let inside = "[...document.querySelectorAll('details > :not(summary)')]";
    let is_visible = "e => e.checkVisibility({ contentVisibilityAuto: true }) && \
        e.getBoundingClientRect().height > 0";
    browser.eval(&format!(
        "(() => {{ const all = {inside}.map({is_visible}); return all.length < 14 ? 'few' : \
        all.every(v => v) ? false : all.some(v => v) ? null : true; }})()"
    ))
}
