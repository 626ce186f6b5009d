//! Pages of benches with the least work of passes, and with cold caches.

use std::fs;

use nimbus::measure::stats::Summary;
use nimbus::timing::frame_rows::FrameTable;
use nimbus::timing::records::{Measured, Mode, Pass, Run};
use nimbus::timing::roofs::{Bandwidth, Ceilings};
use tempfile::TempDir;

use super::report;
use crate::results;

const N_FRAMES: usize = 4;

/// Writes a bench with one pass and returns its page.
fn page(change: impl FnOnce(&mut Run)) -> String {
    let dir = TempDir::new().expect("a folder");
    let folder = dir.path().join("bench");
    fs::create_dir(&folder).expect("a folder");
    let place = Pass {
        name: "place".to_owned(),
        p50_ms: Some(2.0),
        n_run: N_FRAMES,
        bytes: Some(3.5e6),
        operations: Some(7.25e6),
        ..Pass::default()
    };
    let of = Summary::of(&[1.0; N_FRAMES]).expect("a summary");
    let mode = Mode {
        frame_ms: Some(Measured { of, p50_low: None, p50_high: None }),
        passes: vec![place],
        ..results::mode("serial", N_FRAMES, 0)
    };
    let mut run = results::run(vec![mode]);
    change(&mut run);
    let rows = (0..N_FRAMES as u32).map(|i| results::row("serial", i)).collect();
    results::write(&folder, &run, &FrameTable { pass_names: vec![], rows }).expect("results");
    let page = report(&dir, &[folder.to_str().expect("UTF-8")]);
    fs::read_to_string(page).expect("a page")
}

fn pass(run: &mut Run) -> &mut Pass {
    &mut run.cases[0].modes[0].passes[0]
}

#[test]
fn a_page_has_the_least_work_and_the_share_of_the_roof() {
    let known = page(|run| {
        pass(run).roof_share = Some(0.125);
        run.ceilings = Some(Ceilings {
            date: "2026-01-02T03:04:05Z".to_owned(),
            bandwidths: vec![Bandwidth { set_bytes: 1 << 28, bytes_per_s: 2e10 }],
            operations_per_s: 1e11,
        });
    });
    for part in ["How near the floor", "3.5", "7.25", "12.5", "20 GB/s of 256 MiB", "03:04:05Z"] {
        assert!(known.contains(part), "{part}");
    }
    assert!(!known.contains("Cold caches"));
    let unknown = page(|_| {});
    assert!(unknown.contains("nimbus devices --roof"));
    // Results of versions without floors have no such section.
    let older = page(|run| (pass(run).bytes, pass(run).operations) = (None, None));
    assert!(!older.contains("How near the floor"));
}

#[test]
fn a_page_warns_of_times_of_frames_with_cold_caches() {
    let cold = page(|run| run.cold_bytes = Some(32 << 20));
    assert!(cold.contains("Cold caches") && cold.contains("32 MiB before each pass"));
}
