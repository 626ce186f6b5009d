//! A process that is killed, at whatever moment, while it replaces results leaves the old ones or
//! the new ones, whole, and what else lies in their folder.

#[path = "harness/results.rs"]
mod results;

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use nimbus::io::result_folder::Existing;
use nimbus::measure::stats::Summary;
use nimbus::timing::attachments::Attachments;
use nimbus::timing::frame_rows::{FRAMES_FILE, FrameRow, FrameTable, write_frames};
use nimbus::timing::json;
use nimbus::timing::records::{Measured, Mode, Run};
use nimbus::timing::results::{RUN_FILE, open_results, read_results, write_results};
use serde_json::json;

/// Names the folder in which this program is to replace results without end.
const WRITER_FOLDER: &str = "NIMBUS_TEST_WRITER_FOLDER";
/// Where set: it replaces one file after the other, and pauses so long between them.
const PAUSE_US: &str = "NIMBUS_TEST_WRITER_PAUSE_US";
const N_KILLS: u32 = 100;

/// Rows of generation `k`: their number differs from one generation to the next, and every one
/// carries k.
fn table(k: u32) -> FrameTable {
    let row = |i: u32| FrameRow { frame_ms: f64::from(k), ..results::row("serial", i) };
    FrameTable { pass_names: Vec::new(), rows: (0..n_rows(k)).map(row).collect() }
}

fn n_rows(k: u32) -> u32 {
    100 + k % 7
}

fn run(k: u32) -> Run {
    let frame_ms =
        Summary::of(&[f64::from(k)]).map(|of| Measured { of, p50_low: None, p50_high: None });
    let mode = Mode { frame_ms, ..results::mode("serial", n_rows(k) as usize, 0) };
    Run { scene: json!({ "generation": k }), ..results::run(vec![mode]) }
}

/// Writes generation `k` as `nimbus bench --force` does.
fn write(folder: &Path, k: u32) -> nimbus::error::Result<()> {
    let mut folder = open_results(folder, Existing::Replace, 1, true)?;
    write_results(&mut folder, &run(k), &table(k), &Attachments::default())
}

/// Not a test of its own: what the killed process does.
#[test]
fn writer() {
    let Ok(folder) = std::env::var(WRITER_FOLDER) else { return };
    let folder = Path::new(&folder);
    let pause =
        std::env::var(PAUSE_US).ok().map(|us| Duration::from_micros(us.parse().expect("a number")));
    for k in generation(folder).expect("results to begin with") + 1.. {
        let written = match pause {
            None => write(folder, k),
            // Each file is whole at every moment, and the two are not replaced together.
            Some(pause) => write_frames(&folder.join(FRAMES_FILE), &table(k)).and_then(|()| {
                std::thread::sleep(pause);
                json::write(&folder.join(RUN_FILE), &run(k))
            }),
        };
        written.expect("written");
    }
}

/// Which generation `folder` holds; an error where it is none, or not whole, or of two.
fn generation(folder: &Path) -> Result<u32, String> {
    let recorded = read_results(folder).map_err(|e| e.to_string())?;
    let k = recorded.run.scene["generation"].as_u64().ok_or("no generation")? as u32;
    if recorded.run != run(k) {
        return Err(format!("run.json is not that of generation {k}"));
    }
    let times = recorded.modes[0].measures[0].ms();
    match times.iter().find(|ms| **ms != f64::from(k)) {
        Some(other) => Err(format!("run.json of generation {k} beside frames of {other}")),
        None if times.len() == n_rows(k) as usize => Ok(k),
        None => Err(format!("{} frames of generation {k}", times.len())),
    }
}

fn prepared() -> (tempfile::TempDir, std::path::PathBuf) {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = dir.path().join("run");
    write(&folder, 1).expect("results");
    fs::write(folder.join("notes.txt"), "mine").expect("a file");
    fs::write(folder.join("a.png"), "picture").expect("a file");
    (dir, folder)
}

/// Starts the writer, lets it replace generation `k`, and kills it a few replacements later: 0 to 8
/// ms by `i`, in steps of the golden ratio.
fn write_and_kill(folder: &Path, k: u32, i: u32, pause_us: Option<u32>) {
    let mut command = Command::new(std::env::current_exe().expect("this program"));
    command.args(["--exact", "writer"]).env(WRITER_FOLDER, folder).stdout(Stdio::null());
    command.envs(pause_us.map(|us| (PAUSE_US, us.to_string())));
    let mut child = command.spawn().expect("a child");
    let begin = Instant::now();
    while generation(folder).is_ok_and(|now| now <= k) {
        assert!(begin.elapsed() < Duration::from_secs(60), "the child never writes");
    }
    std::thread::sleep(Duration::from_secs_f64(8e-3 * (f64::from(i) * 0.618_033_988_75).fract()));
    child.kill().expect("killed");
    child.wait().expect("ended");
}

#[test]
fn a_process_killed_at_any_moment_leaves_results_of_one_run() {
    let (dir, folder) = prepared();
    // A claim that a killed process leaves is of no account.
    let is_folder = |entry: &fs::DirEntry| entry.path().is_dir();
    let n_left = || {
        let entries = fs::read_dir(dir.path()).expect("a folder").flatten();
        entries.filter(is_folder).count() - 1
    };
    let (mut k, mut n_kills) = (1, 0);
    // Kills that meet a replacement at work leave its temporary folder; where none did, nothing was
    // tested. A machine that is busy may need more kills.
    while n_kills < N_KILLS || n_left() == 0 {
        let i = n_kills;
        n_kills += 1;
        assert!(n_kills < 100 * N_KILLS, "no kill meets a replacement");
        write_and_kill(&folder, k, i, None);
        let found = generation(&folder).unwrap_or_else(|what| panic!("after kill {i}: {what}"));
        assert!(found > k, "generation {found} after {k}");
        k = found;
        let text = |name: &str| {
            fs::read_to_string(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
        };
        assert_eq!(
            (text("notes.txt").as_str(), text("a.png").as_str()),
            ("mine", "picture"),
            "after kill {i}"
        );
        assert_eq!(
            fs::read_dir(&folder).expect("the folder").count(),
            5,
            "nothing else after kill {i}"
        );
    }
    let n_left = n_left();
    println!("{n_kills} kills in {} replacements; {n_left} left a temporary folder", k - 1);
}

/// Files that are replaced one after the other do not stand this.
#[test]
fn the_kills_find_a_mixture_of_two_runs() {
    let (_dir, folder) = prepared();
    let mut k = 1;
    for i in 0..N_KILLS {
        write_and_kill(&folder, k, i, Some(1000));
        match generation(&folder) {
            Ok(found) => k = found,
            Err(what) => return println!("kill {i}: {what}"),
        }
    }
    panic!("{N_KILLS} kills found none");
}

#[test]
fn a_mixture_of_two_runs_is_rejected() {
    let (_dir, folder) = prepared();
    assert_eq!(generation(&folder), Ok(1));
    // As many rows: only the times tell.
    write_frames(&folder.join(FRAMES_FILE), &table(8)).expect("frames");
    assert!(generation(&folder).expect_err("a mixture").contains("beside frames of 8"));
    write_frames(&folder.join(FRAMES_FILE), &table(2)).expect("frames");
    assert!(generation(&folder).expect_err("a mixture").contains("cut off, or another run's"));
}
