//! Pages of benches that read the state of the machine.

use std::fs;

use nimbus::timing::frame_rows::FrameTable;
use nimbus::timing::records::{Case, Run};
use nimbus::timing::state::{CaseState, RunState, Spread, ThrottleCount};
use tempfile::TempDir;

use super::report;
use crate::results;

const N_FRAMES: u32 = 4;

/// Writes a bench with this state and returns its page.
fn page(state: Option<RunState>) -> String {
    let dir = TempDir::new().expect("a folder");
    let folder = dir.path().join("bench");
    fs::create_dir(&folder).expect("a folder");
    let run = results::run(vec![results::mode("serial", N_FRAMES as usize, 0)]);
    let of_case = state.as_ref().map(|state| state.all.clone());
    let cases = vec![Case { state: of_case, ..run.cases[0].clone() }];
    let run = Run { cases, state, ..run };
    let rows = (0..N_FRAMES).map(|i| results::row("serial", i)).collect();
    results::write(&folder, &run, &FrameTable { pass_names: vec![], rows }).expect("results");
    let page = report(&dir, &[folder.to_str().expect("UTF-8")]);
    fs::read_to_string(page).expect("a page")
}

#[test]
fn a_page_shows_the_state_of_the_machine() {
    let all = CaseState {
        n_readings: 12,
        gpu_mhz: Spread::of(&[1200.0, 1905.0, 1920.0]),
        throttle: Some(vec![ThrottleCount { reason: "hw_thermal_slowdown".to_owned(), n: 3 }]),
        peak_own_bytes: Some(137 << 20),
        n_slow_clock: 2,
        ..CaseState::default()
    };
    let state = RunState {
        sources: vec!["NVML".to_owned()],
        clock: "gpu".to_owned(),
        all,
        governor: Some("powersave".to_owned()),
        remarks: vec!["2 of 4 timed frames ran below 75 %".to_owned()],
        ..RunState::default()
    };
    let shown = page(Some(state));
    for text in [
        "State of the machine",
        "12 readings from NVML; GPU 1905 (1200 to 1920) MHz; throttled by hw_thermal_slowdown in 3 \
         readings; device memory 137 MiB of nimbus; governor powersave.",
        "2 of 4 timed frames ran below 75 %.",
        "hw_thermal_slowdown (3)",
    ] {
        assert!(shown.contains(text), "{text} in {shown}");
    }
    assert!(!page(None).contains("State of the machine"));
}
