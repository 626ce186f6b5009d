//! Ctrl-C at generated moments of every long command: the command ends soon, its results are whole
//! or absent, and nothing temporary stays. `NIMBUS_TEST_MOMENTS` is the number of moments of each
//! command (2 by default).

use std::fs;
use std::path::Path;
use std::process::Stdio;

use crate::fixtures;
use crate::fixtures::{Fixtures, check_end};
use crate::signals::interrupt;

/// Most runs of a command in which no signal comes before the end: a busy machine may delay it.
const MOST_LATE: u64 = 20;

/// The commands, with the place of their results: OUT.
const COMMANDS: [&str; 14] = [
    "bench s.toml --frames 20000 --out OUT --set lighting.grid=24",
    "bench s.toml --frames 20000 --out OUT --force --sweep draw.cutoff=2,3 --threading serial",
    "bench s.toml --size 2048x2048 --frames 1000 --out OUT",
    "error s.toml --rounds 500 --frames 20 --out OUT",
    "ledger s.toml --size 160x120 --rounds 400 --frames 20 --out OUT",
    "ledger heavy.toml --pixels all --out OUT",
    "render heavy.toml --reference reflections=4 --samples 64 -o OUT.png",
    "render s.toml --size 2800x2800 -o OUT.exr",
    "inspect heavy.toml --facets --reference",
    "stress",
    "weather w.nc",
    "compare big.png big.png -o OUT.png",
    "farm calibrate s.toml --frames 500 -o OUT.json",
    "report run run run run -o OUT.html --force",
];

/// Numbers from 0 to 1, the same in every run.
fn uniform(i: u64) -> f64 {
    let mut x = i.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x >> 11) as f64 / (1u64 << 53) as f64
}

fn n_moments() -> u64 {
    std::env::var("NIMBUS_TEST_MOMENTS").map_or(2, |n| n.parse().expect("a number"))
}

fn prepared() -> Fixtures {
    let fixtures = Fixtures::with_results();
    let scene = fixtures::SCENE.replace("[2, 2]", "[24, 24]");
    let scene = scene.replace("width = 32\nheight = 24", "width = 256\nheight = 192");
    fs::write(fixtures.dir.path().join("heavy.toml"), scene).expect("room");
    let output = fixtures.run("render s.toml -o big.png --size 1600x1200 -q".split(' '));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    fixtures
}

#[test]
fn every_long_command_ends_soon_after_ctrl_c() {
    let fixtures = prepared();
    let names = |at: &Path| -> Vec<String> {
        let entries = fs::read_dir(at).expect("a folder").map(|e| e.expect("an entry"));
        entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect()
    };
    let before = names(fixtures.dir.path()).len();
    for (i, line) in COMMANDS.iter().enumerate() {
        let (mut k, mut n_interrupted) = (0, 0);
        while k < n_moments() || n_interrupted == 0 {
            assert!(k < n_moments() + MOST_LATE, "{line}: every run ends before its signal");
            // From 0.02 to 3 s, as many in each decade. Shorter commands are then interrupted at
            // their begin.
            let is_generated = k < n_moments();
            let share = uniform(k * 100 + i as u64);
            let after_s = if is_generated { 0.02 * 150f64.powf(share) } else { 0.0 };
            k += 1;
            let what = format!("{line} interrupted after {after_s:.2} s");
            let args = line.split(' ').map(|word| word.replace("OUT", "out"));
            let mut command = fixtures.command(args);
            // This test reads no pipe before the end, and a full one would stop the command.
            command.stdout(Stdio::null()).stderr(Stdio::piped());
            let (output, is_running) = interrupt(&mut command, |used_s| used_s >= after_s);
            check_end(&what, &output);
            let (code, errors) = (output.status.code(), String::from_utf8_lossy(&output.stderr));
            // A command may end by itself between the last look at it and the signal.
            let expected = if is_running { &[130, 0, 1][..] } else { &[0, 1] };
            assert!(code.is_some_and(|code| expected.contains(&code)), "{what}: {code:?} {errors}");
            n_interrupted += u64::from(code == Some(130));
            check_results(&fixtures, &what);
            assert_eq!(names(fixtures.dir.path()).len(), before, "{what}: something stays");
        }
    }
}

/// Checks that the results can be read or are absent, and removes them.
fn check_results(fixtures: &Fixtures, what: &str) {
    let at = |name: &str| fixtures.dir.path().join(name);
    let out = at("out");
    let is_empty = || fs::read_dir(&out).is_ok_and(|mut entries| entries.next().is_none());
    if out.exists() && !is_empty() {
        let output = fixtures.run("report out -o page.html".split(' '));
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{what}: {errors}");
        fs::remove_file(at("page.html")).expect("a page");
    }
    let _ = fs::remove_dir_all(&out);
    for name in ["out.png", "out.exr"] {
        if at(name).exists() {
            let read = nimbus::io::image::read(&at(name)).map(drop);
            assert!(read.is_ok(), "{what}: {read:?}");
            fs::remove_file(at(name)).expect("a picture");
        }
    }
    if let Ok(text) = fs::read_to_string(at("out.json")) {
        let read = serde_json::from_str::<serde_json::Value>(&text).map(drop);
        assert!(read.is_ok(), "{what}: {read:?}: {text}");
        fs::remove_file(at("out.json")).expect("a file");
    }
    if let Ok(page) = fs::read_to_string(at("out.html")) {
        assert!(page.trim_end().ends_with("</html>"), "{what}: half a page");
        fs::remove_file(at("out.html")).expect("a page");
    }
}

/// A farm keeps its finished items, and ends with 75 where another try goes on.
#[test]
fn a_farm_ends_soon_after_ctrl_c() {
    let fixtures = Fixtures::new();
    let mut n_tried_again = 0;
    for (k, plan) in [
        "farm plan s.toml -o frames --frames 0..5000 --shard-frames 5000",
        "farm plan s.toml -o reference --reference model --samples 65536 --size 256x192",
        "farm plan s.toml -o bench --bench -- --frames 20000",
    ]
    .iter()
    .enumerate()
    {
        let name = plan.split(' ').nth(4).expect("a name");
        let output = fixtures.run(plan.split(' '));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        for moment in 0..n_moments() {
            let after_s = 0.05 + uniform(moment * 10 + k as u64);
            for (run, code) in [("run --shard 0", 75), ("local", 130)] {
                let line = format!("farm {run} --plan {name}");
                let mut command = fixtures.command(line.split(' '));
                command.stdout(Stdio::null()).stderr(Stdio::piped());
                // A pool waits and uses no processor: it is interrupted at once.
                let after_s = if code == 75 && k < 2 { after_s } else { 0.0 };
                let records = || n_failed_records(&fixtures.dir.path().join(name));
                let n_before = records();
                let (output, _) = interrupt(&mut command, |used_s| used_s >= after_s);
                let what = format!("{line} interrupted after {after_s:.2} s");
                check_end(&what, &output);
                let errors = String::from_utf8_lossy(&output.stderr);
                let ended = output.status.code();
                // Before the plan is read there is nothing to keep.
                let expected = [Some(code), Some(130), Some(0)];
                assert!(expected.contains(&ended), "{what}: {ended:?} {errors}");
                if ended == Some(75) {
                    n_tried_again += 1;
                    assert!(records() > n_before, "{what}: the end is not recorded");
                }
            }
        }
        let status = fixtures.run(["farm", "status", "--plan", name]);
        assert!(status.status.success(), "{}", String::from_utf8_lossy(&status.stderr));
    }
    assert!(n_tried_again > 0, "no shard ends with 75");
}

/// Returns how many runs of a plan's shards are recorded as failed with exit code 75.
fn n_failed_records(plan: &Path) -> usize {
    let Ok(entries) = fs::read_dir(plan.join("attempts")) else { return 0 };
    let texts = entries.map(|e| fs::read_to_string(e.expect("an entry").path()).expect("records"));
    let is_failed = |line: &&str| line.contains("\"failed\"") && line.contains("\"exit_code\":75");
    texts.map(|text| text.lines().filter(is_failed).count()).sum()
}
