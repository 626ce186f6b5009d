//! Pages of benches whose loops skip passes, or in which nothing moves.

use std::fs;

use nimbus::measure::stats::Summary;
use nimbus::timing::frame_rows::{FrameRow, FrameTable};
use nimbus::timing::names::Setting;
use nimbus::timing::records::{Case, Measured, Mode, Pass, Ratio, Run};
use tempfile::TempDir;

use super::report;
use crate::results;

const N_FRAMES: usize = 40;

/// Returns a loop in which `n_empty` frames drew nothing and `n_skipped` skipped the pass `grid`.
fn mode(threading: &str, skip: bool, n_empty: usize, n_skipped: usize) -> Mode {
    let grid = Pass {
        name: "grid".to_owned(),
        p50_ms: Some(2.0),
        share: None,
        n_run: N_FRAMES - n_skipped,
        n_skipped,
        reason: None,
        reasons: vec![],
        saved_ms: (n_skipped > 0).then_some(1.5),
        ..Pass::default()
    };
    let of = Summary::of(&[1.0; N_FRAMES]).expect("a summary");
    Mode {
        skip,
        frame_ms: Some(Measured { of, p50_low: Some(1.0), p50_high: Some(1.0) }),
        empty_frames: Some(n_empty),
        passes: vec![grid],
        ..results::mode(threading, N_FRAMES, 0)
    }
}

/// Writes a bench of these cases and returns its page.
fn page(cases: Vec<Case>) -> String {
    let dir = TempDir::new().expect("a folder");
    let folder = dir.path().join("bench");
    fs::create_dir(&folder).expect("a folder");
    let run = Run { cases, ..results::run(vec![]) };
    let sweep = |case: &Case| {
        case.sweep.iter().map(|s| format!("{}={}", s.key, s.value)).collect::<String>()
    };
    let row = |case: &Case, mode: &Mode, i: usize| FrameRow {
        sweep: sweep(case),
        skip: mode.skip,
        ..results::row(&mode.threading, i as u32)
    };
    let rows = run.modes().flat_map(|(c, m)| (0..N_FRAMES).map(move |i| row(c, m, i))).collect();
    results::write(&folder, &run, &FrameTable { pass_names: vec![], rows }).expect("results");
    let page = report(&dir, &[folder.to_str().expect("UTF-8")]);
    fs::read_to_string(page).expect("a page")
}

fn case(modes: Vec<Mode>) -> Case {
    let ratio = Some(Ratio { parallel_by_serial: 0.875, low: Some(0.75), high: Some(0.9375) });
    Case { ratio, ..results::run(modes).cases.remove(0) }
}

#[test]
fn a_page_of_a_still_scene_agrees_with_the_terminal() {
    let of = |n_empty: usize| {
        page(vec![case(vec![
            mode("serial", true, n_empty, N_FRAMES),
            mode("parallel", true, n_empty, N_FRAMES),
            mode("serial", false, 0, 0),
        ])])
    };
    let still = of(N_FRAMES);
    for word in [
        "not given: the loops that skip draw nothing; --no-skip times them",
        "serial (draws nothing)",
        "parallel (draws nothing)",
    ] {
        assert!(still.contains(word), "{word} in\n{still}");
    }
    assert!(!still.contains("0.875"), "the ratio of empty frames");
    // The figure is the first loop of the table, and the only one of the chart of frames.
    let table = &still[still.find("Every loop: medians").expect("a table")..];
    let place = |word: &str| table.find(word).expect(word);
    assert!(place("serial no-skip") < place("serial (draws nothing)"));
    let chart = &still[still.find("aria-label=\"Frame time\"").expect("a chart")..];
    let chart = &chart[..chart.find("</svg>").expect("its end")];
    assert!(chart.contains("serial no-skip") && !chart.contains("parallel"), "{chart}");

    let mostly = of(N_FRAMES - 1);
    assert!(mostly.contains("serial (draws nothing in 39 of 40 frames)"), "{mostly}");
    let moving = of(0);
    assert!(moving.contains("0.875") && !moving.contains("draws nothing"), "{moving}");
}

#[test]
fn a_page_of_a_sweep_names_the_skipped_passes() {
    let swept = |n_skipped: usize| {
        let at = |value: &str| {
            let setting = Setting { key: "lighting.grid".to_owned(), value: value.to_owned() };
            let modes = vec![mode("serial", true, 0, n_skipped), mode("serial", false, 0, 0)];
            Case { sweep: vec![setting], ..case(modes) }
        };
        page(["16", "32"].map(at).to_vec())
    };
    let line = "Skipped in some timed frames or in all: grid; the loop without skipping (serial \
        no-skip) times them in every frame.";
    assert!(swept(30).contains(line), "{}", swept(30));
    assert!(!swept(0).contains("Skipped in some"));
}
