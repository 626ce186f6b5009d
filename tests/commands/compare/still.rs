//! Comparisons of scenes in which nothing moves: the loops that skip draw nothing.

use super::*;
use nimbus::timing::records::Mode;

/// Returns a run in which `n_empty` of the frames of the loops that skip draw nothing.
fn still_run(n_empty: usize, has_whole: bool) -> Run {
    let n = N_FRAMES as usize;
    let skipping = ["serial", "parallel"]
        .map(|of| Mode { empty_frames: Some(n_empty), ..results::mode(of, n, 2) });
    let whole = has_whole.then(|| Mode { skip: false, ..results::mode("serial", n, 2) });
    results::run(skipping.into_iter().chain(whole).collect())
}

fn write_still(dir: &tempfile::TempDir, name: &str, n_empty: usize, has_whole: bool) -> String {
    let folder = dir.path().join(name);
    fs::create_dir(&folder).expect("a folder");
    let mut all = [rows("serial", 0.1), rows("parallel", 0.1)].concat();
    let whole = |row: FrameRow| FrameRow { skip: false, ..row };
    all.extend(rows("serial", 10.0).into_iter().map(whole).filter(|_| has_whole));
    write(&folder, &still_run(n_empty, has_whole), all);
    folder.to_str().expect("a UTF-8 path").to_owned()
}

fn names(args: &[&str]) -> Vec<String> {
    let (code, text, stderr) = compare(&[args, &["--json"]].concat());
    assert_eq!(code, 0, "{stderr}");
    let json: Value = serde_json::from_str(&text).expect("JSON");
    let modes = json["modes"].as_array().expect("modes");
    modes.iter().map(|mode| mode["name"].as_str().expect("a name").to_owned()).collect()
}

#[test]
fn loops_that_draw_nothing_have_no_verdict() {
    let dir = temp();
    let n = N_FRAMES as usize;
    let still = write_still(&dir, "still", n, true);
    let half = write_still(&dir, "half", n / 2, true);
    let moving = write_still(&dir, "moving", n / 2 - 1, true);
    let all = ["serial", "parallel", "serial no-skip"];
    assert_eq!(names(&[&moving, &moving]), all);
    for (a, b) in [(&still, &still), (&half, &half), (&still, &moving), (&moving, &still)] {
        assert_eq!(names(&[a, b]), ["serial no-skip"], "{a} {b}");
        let (_, table, _) = compare(&[a, b]);
        let note = "note: nothing moves in 1 of 1 cases: loops that draw nothing are left out, and \
            the figure is the loop serial no-skip\n";
        assert_eq!(table.matches(note).count(), 1, "{table}");
        assert!(!table.contains("parallel") && !table.contains("serial frame"), "{table}");
        assert!(table.contains("serial no-skip frame: B takes 1.000 of A's time"), "{table}");
    }
    assert!(!compare(&[&moving, &moving]).1.contains("nothing moves"));
    // Without a loop that skips nothing there is only the time of empty frames, which is said.
    let bare = write_still(&dir, "bare", n, false);
    assert_eq!(names(&[&bare, &still]), ["serial", "parallel"]);
    let (_, table, _) = compare(&[&bare, &still]);
    assert!(table.contains("the times are of frames that draw nothing"), "{table}");
}
