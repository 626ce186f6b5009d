//! A sweep in shards: what is merged is the bench that one process makes but for its times, and
//! times that cannot be compared are not merged.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use nimbus::timing::frame_rows::{FRAMES_FILE, FrameRow, FrameTable, parse_frames};
use nimbus::timing::parts::base_spread;
use nimbus::timing::records::Run;
use nimbus::timing::results::read_results;
use serde_json::Value;
use tempfile::TempDir;

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hello.toml");
const SIZE: [&str; 2] = ["--size", "40x30"];
/// 3 × 2 cases of two sizes.
const SWEEP: [&str; 10] = [
    "--sweep",
    "draw.cutoff=2,3,4",
    "--sweep",
    "size=40x30,48x36",
    "--frames",
    "3",
    "--warmup",
    "1",
    "--repeat",
    "2",
];

fn ran(args: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("nimbus"));
    let output =
        command.args(args).env_remove("NIMBUS_EXCLUSIVE").output().expect("the program runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

fn planned(dir: &TempDir, each: &str) -> PathBuf {
    let folder = dir.path().join("farm");
    let plan = ["farm", "plan", SCENE, "-o", text(&folder), "--bench", "--shard-cases", each];
    let (code, out, said) = ran(&[&plan, &SIZE[..], &["--"], &SWEEP].concat());
    assert_eq!((code, said.as_str()), (Some(0), ""), "{out}");
    assert!(out.starts_with("6 cases in "), "{out}");
    folder
}

fn rows(folder: &Path) -> FrameTable {
    let path = folder.join(FRAMES_FILE);
    parse_frames(&fs::read_to_string(&path).expect("rows"), &path).expect("rows")
}

fn names(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).expect("a folder").flatten();
    entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect()
}

/// What of a run's cases does not depend on the machine's mood.
fn exact(run: &Run) -> Vec<String> {
    let of = |c: &nimbus::timing::records::Case| {
        let modes = c.modes.iter().map(|m| {
            let hash = m.image_hash.as_deref().expect("a last frame");
            let passes: Vec<_> =
                m.passes.iter().map(|p| (&p.name, p.n_run, p.n_skipped, &p.reasons)).collect();
            let counts = (m.frames, m.warm_up, m.blocks, m.drawn);
            format!("{} {} {} {counts:?} {hash} {passes:?}", m.threading, m.skip, m.simulate)
        });
        let (modes, counts): (Vec<String>, _) = (modes.collect(), c.counts.expect("counts"));
        let (name, hash, size) = (c.name(), &c.scene_hash, (c.width, c.height));
        format!(
            "{name} {hash} {} {size:?} {counts:?} {:?} {modes:?}",
            c.particles,
            c.skipping.map(|s| s.same_bytes)
        )
    };
    run.cases.iter().map(of).collect()
}

/// A row without its times and its block.
fn place(row: &FrameRow) -> String {
    let FrameRow { phase, sweep, threading, skip, frame, time_s, warm_up, n_drawn, ran, .. } = row;
    format!("{phase} {sweep} {threading} {skip} {frame} {time_s} {warm_up} {n_drawn} {ran}")
}

#[test]
fn parts_together_are_the_bench_of_one_process() {
    let dir = tempfile::tempdir().expect("a folder");
    let farm = planned(&dir, "2");
    let (code, out, said) = ran(&["farm", "local", "--plan", text(&farm)]);
    assert_eq!((code, said.as_str()), (Some(0), ""), "{out}");
    assert!(out.starts_with("3 shards are done"), "{out}");
    let (code, out, _) = ran(&["farm", "status", "--plan", text(&farm)]);
    assert!(code == Some(0) && out.starts_with("3 of 3 shards are done"), "{out}");
    let merged = dir.path().join("merged");
    let (code, out, said) = ran(&["farm", "merge", "--plan", text(&farm), "-o", text(&merged)]);
    assert_eq!((code, said.as_str()), (Some(0), ""), "{out}");
    let expected = format!(
        "6 cases in {}\nthe first case, timed in each of 3 shards on 1 node: ",
        text(&merged)
    );
    assert!(out.starts_with(&expected), "{out}");
    let alone = dir.path().join("alone");
    let (code, _, said) =
        ran(&[&["bench", SCENE, "--out", text(&alone), "-q"], &SIZE[..], &SWEEP].concat());
    assert_eq!(code, Some(0), "{said}");

    // Readers check that rows and records fit.
    let [ours, theirs] = [&merged, &alone].map(|folder| read_results(folder).expect("results"));
    assert_eq!(exact(&ours.run), exact(&theirs.run));
    let modes = |of: &nimbus::timing::results::BenchResults| -> Vec<_> {
        of.modes.iter().map(|m| (m.name.clone(), m.frames.clone(), m.blocks.len())).collect()
    };
    assert_eq!((modes(&ours), ours.modes.len()), (modes(&theirs), 18));
    let (ours, theirs) = (ours.run, theirs.run);
    assert_eq!(
        (ours.schema, &ours.scene_hash, &ours.scene),
        (theirs.schema, &theirs.scene_hash, &theirs.scene)
    );
    assert_eq!(
        (&ours.device, &ours.cpu, &ours.environment),
        (&theirs.device, &theirs.cpu, &theirs.environment)
    );
    assert!(!ours.interrupted && theirs.parts.is_empty());
    // The same rows in the same columns; in each block as many as it had.
    let FrameTable { pass_names: columns, rows: of_ours } = rows(&merged);
    let FrameTable { pass_names: their_columns, rows: of_theirs } = rows(&alone);
    assert_eq!(columns, their_columns);
    let sorted = |rows: &[FrameRow]| {
        let mut all: Vec<String> = rows.iter().map(place).collect();
        all.sort();
        all
    };
    assert_eq!(sorted(&of_ours), sorted(&of_theirs));
    assert_eq!(of_ours.len(), 6 * 3 * 2 * 4);
    assert_eq!((ours.block_order.len(), theirs.block_order.len()), (36, 36));
    for (block, about) in (0u32..).zip(&ours.block_order) {
        let of_block: Vec<&FrameRow> = of_ours.iter().filter(|row| row.block == block).collect();
        assert_eq!(of_block.len(), 4);
        let name = ours.cases[about.case].name();
        assert!(
            of_block
                .iter()
                .all(|r| (&r.sweep, &r.threading, r.skip) == (&name, &about.threading, about.skip))
        );
    }
    // The same files, and pictures to the byte.
    assert_eq!(names(&merged), names(&alone));
    for picture in (0..6).map(|i| format!("case-{i}.png")) {
        let [a, b] =
            [&merged, &alone].map(|folder| fs::read(folder.join(&picture)).expect("a picture"));
        assert!(a == b, "{picture}");
    }
    who_timed_what(&farm, &ours);
    readers(&dir, &merged, &alone);
}

/// What `run.json` says of the parts is what the shards' own say.
fn who_timed_what(farm: &Path, merged: &Run) {
    let plan: Value =
        serde_json::from_slice(&fs::read(farm.join("plan.json")).expect("a plan")).expect("JSON");
    assert_eq!(
        merged.parts.iter().map(|p| (p.first, p.end)).collect::<Vec<_>>(),
        [(0, 2), (2, 4), (4, 6)]
    );
    for (i, part) in merged.parts.iter().enumerate() {
        let place = farm.join("shards").join(plan["shards"][i]["key"].as_str().expect("a key"));
        let run = read_results(&place).expect("results").run;
        let first = &run.cases[0];
        assert_eq!(
            (run.cases.len(), first.name()),
            (if i == 0 { 2 } else { 3 }, merged.cases[0].name())
        );
        assert_eq!((&part.date, part.clocks, part.base.len()), (&run.date, run.clocks, 3));
        for (base, mode) in part.base.iter().zip(&first.modes) {
            assert_eq!((&base.threading, base.skip), (&mode.threading, mode.skip));
            assert!(base.p50_ms.is_some() && base.p50_ms == mode.frame_ms.map(|m| m.of.p50));
        }
        // The first part's is the one that stays.
        assert_eq!(merged.cases[0] == *first, i == 0);
        assert!(!part.node.is_empty());
    }
    let spread = base_spread(&merged.parts);
    assert!(spread.len() == 3 && spread.iter().all(|(_, by)| *by >= 1.0), "{spread:?}");
}

fn readers(dir: &TempDir, merged: &Path, alone: &Path) {
    let page = dir.path().join("page.html");
    let (code, _, said) = ran(&["report", text(merged), "-o", text(&page)]);
    assert_eq!(code, Some(0), "{said}");
    let page = fs::read_to_string(page).expect("a page");
    assert!(page.contains("The nodes that timed the cases") && page.contains("2..4"));
    let (code, out, said) = ran(&["compare", text(alone), text(merged)]);
    assert!(code == Some(0) && out.contains("draw.cutoff=4, size=48x36"), "{out}{said}");
    let value: Value =
        serde_json::from_slice(&fs::read(merged.join("run.json")).expect("a run")).expect("JSON");
    let schema: Value =
        serde_json::from_str(include_str!("../docs/reference/schemas/run.schema.json"))
            .expect("the schema");
    let validator = jsonschema::draft202012::new(&schema).expect("a schema");
    assert_eq!(validator.iter_errors(&value).map(|e| e.to_string()).collect::<Vec<_>>(), [""; 0]);
}

/// Changes `file` of the shard in `place`, and its record with it, as if its node had written it
/// so; and says that the node was its own.
fn change(place: &Path, file: &str, from: &str, to: &str) {
    let before = fs::read_to_string(place.join(file)).expect("a file");
    assert!(before.contains(from), "{from}");
    let after = before.replace(from, to);
    fs::write(place.join(file), &after).expect("room");
    let path = place.join("shard.json");
    let mut manifest: Value = serde_json::from_slice(&fs::read(&path).expect("it")).expect("JSON");
    manifest["exclusive"] = true.into();
    for record in manifest["files"].as_array_mut().expect("files") {
        if record["name"] == file {
            let hash = format!("{:x}", <sha2::Sha256 as sha2::Digest>::digest(after.as_bytes()));
            (record["sha256"], record["bytes"]) = (hash.into(), after.len().into());
        }
    }
    fs::write(&path, manifest.to_string()).expect("room");
}

#[test]
fn times_that_cannot_be_compared_are_refused_with_a_list() {
    let dir = tempfile::tempdir().expect("a folder");
    let farm = planned(&dir, "3");
    // Started by hand nobody says that the node was theirs alone.
    let (code, _, said) = ran(&["farm", "run", "--plan", text(&farm), "--shard", "1"]);
    assert_eq!(code, Some(0), "{said}");
    let merged = dir.path().join("merged");
    let merge = ["farm", "merge", "--plan", text(&farm), "-o", text(&merged)];
    let (code, _, said) = ran(&merge);
    assert!(
        code == Some(1) && said.contains("1 of 2 shards are done") && said.contains("to do: 0"),
        "{said}"
    );
    assert_eq!(ran(&["farm", "local", "--plan", text(&farm)]).0, Some(0));
    let (code, _, said) = ran(&merge);
    assert!(code == Some(1) && said.contains("NIMBUS_EXCLUSIVE=1 says so): shards 1"), "{said}");
    assert!(!merged.exists());

    let plan: Value =
        serde_json::from_slice(&fs::read(farm.join("plan.json")).expect("a plan")).expect("JSON");
    let place = farm.join("shards").join(plan["shards"][1]["key"].as_str().expect("a key"));
    let device = read_results(&place).expect("results").run.device;
    for (what, from, to) in [
        ("device", &device.name, "another device"),
        ("device", &device.driver, "another driver 1.0"),
        ("processor", &"\"logical_cores\": ".to_owned(), "\"logical_cores\": 9"),
    ] {
        change(&place, "run.json", from, to);
        let (code, _, said) = ran(&merge);
        assert!(code == Some(1) && said.contains(&format!("\n  {what}: ")), "{said}");
        assert!(
            said.contains(to.rsplit(' ').next().expect("a word")) && !said.contains("EXCLUSIVE"),
            "{said}"
        );
        assert!(!merged.exists());
        change(&place, "run.json", to, from);
    }
    assert_eq!(ran(&merge).0, Some(0));
}

#[test]
fn a_part_is_the_first_case_and_its_own() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("out");
    let bench = |more: &[&str]| {
        ran(&[&["bench", SCENE, "-q", "--force"], &SIZE[..], &SWEEP, more].concat())
    };
    let (code, _, said) = bench(&["--out", text(&out), "--part", "3..4"]);
    assert_eq!(code, Some(0), "{said}");
    let run = read_results(&out).expect("results").run;
    let names: Vec<String> = run.cases.iter().map(|case| case.name()).collect();
    assert_eq!(names, ["draw.cutoff=2, size=40x30", "draw.cutoff=3, size=48x36"]);
    assert!(out.join("case-1.png").exists() && !out.join("case-2.png").exists());
    for (more, expected) in [
        (&["--part", "4..7"][..], "--part 4..7: expected a part of cases 0..6"),
        (&["--part", "6..7"], "expected a part of cases 0..6"),
        (&["--part", "3..3"], "there is nothing in it"),
        (&["--part", "0..1", SCENE], "--part takes one scene"),
    ] {
        let (code, _, said) = bench(&[&["--out", text(&out)], more].concat());
        assert!(code == Some(2) && said.contains(expected), "{more:?} {said}");
    }
    let (code, _, said) = bench(&["--part", "0..1"]);
    assert!(code == Some(2) && said.contains("--out"), "{said}");
}

#[test]
fn what_a_farm_decides_itself_is_refused_among_a_sweep_s_arguments() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = dir.path().join("farm");
    let plan = |sweep: &[&str]| {
        let begin = ["farm", "plan", SCENE, "-o", text(&folder), "--bench", "--"];
        ran(&[&begin[..], sweep].concat())
    };
    for (sweep, expected) in [
        (&["--out", "a"][..], "expected no other scene, --out"),
        (&["--out=a"], "expected no other scene, --out"),
        (&[SCENE], "expected no other scene"),
        (&["--set", "draw.cutoff=2"], "stand before it"),
        (&["--seed", "2"], "stand before it"),
        (&["--size", "8x8"], "stand before it"),
        (&["--device", "0"], "--device"),
        (&["--validation"], "--validation"),
        (&["--part", "0..1"], "--part"),
        (&["--plot"], "--plot"),
        (&["--json"], "--json"),
        (&["--force"], "--force"),
        (&["--trace", "a.json"], "--trace"),
        (&["--shaders", "a"], "--shaders"),
        (&["--sweep", "draw.cutoff=-1"], "draw.cutoff"),
        (&["--sweep", "draw.cutoff"], "no `=`"),
        (&["--nonsense"], "--nonsense"),
    ] {
        let (code, _, said) = plan(sweep);
        assert!(code == Some(2) && said.contains(expected), "{sweep:?} {said}");
        assert!(!folder.exists());
    }
    // One of the two, or neither.
    let begin = ["farm", "plan", SCENE, "-o", text(&folder)];
    assert_eq!(ran(&[&begin[..], &["--bench", "--error"]].concat()).0, Some(2));
    assert_eq!(ran(&[&begin[..], &["--", "--frames", "2"]].concat()).0, Some(2));
    assert_eq!(ran(&[&begin[..], &["--bench", "--frames", "2"]].concat()).0, Some(2));
    assert!(!folder.exists());
}

#[test]
fn a_part_that_fails_for_good_is_said_to_and_a_job_has_its_node_alone() {
    let dir = tempfile::tempdir().expect("a folder");
    let farm = planned(&dir, "6");
    let run = ["farm", "run", "--plan", text(&farm), "--shard", "0", "--device", "no such device"];
    let (code, _, said) = ran(&run);
    assert!(
        code == Some(2) && said.contains("nimbus bench ended with exit code 2"),
        "{code:?} {said}"
    );
    assert!(said.contains("no such device"), "{said}");
    let (_, out, _) = ran(&["farm", "status", "--plan", text(&farm)]);
    assert!(
        out.contains("failed") && out.contains("cases 0..6") && out.contains("to do: 0"),
        "{out}"
    );
    let (code, out, said) = ran(&["farm", "gc", "--plan", text(&farm), "--idle", "0.000001"]);
    assert!(code == Some(0) && out.contains("1 folders") && out.contains("removed"), "{out}{said}");
    let (code, out, said) = ran(&["farm", "emit", "slurm", "--plan", text(&farm)]);
    assert_eq!(code, Some(0), "{out}{said}");
    let script = fs::read_to_string(farm.join("slurm/shard.sh")).expect("a script");
    assert!(script.contains("--exclusive") && script.contains("NIMBUS_EXCLUSIVE=1"), "{script}");
}

#[test]
fn a_part_that_is_ended_is_worth_another_try_and_leaves_no_result() {
    let dir = tempfile::tempdir().expect("a folder");
    let farm = dir.path().join("farm");
    // Minutes, unless it is ended.
    let plan = ["farm", "plan", SCENE, "-o", text(&farm), "--bench", "--", "--repeat", "10000"];
    assert_eq!(ran(&plan).0, Some(0));
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("nimbus"));
    command.args(["farm", "run", "--quiet", "--plan", text(&farm), "--shard", "0"]);
    let mut child = command.stderr(Stdio::piped()).spawn().expect("the program runs");
    let shards = farm.join("shards");
    // Its folder is made once the device is open.
    let is_timing = || {
        let entries = fs::read_dir(&shards).into_iter().flatten().flatten();
        entries.map(|entry| entry.path().join("part")).any(|part| part.exists())
    };
    let begin = Instant::now();
    while !is_timing() && begin.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(child.try_wait().expect("a child").is_none(), "it is at work");
    let ended =
        Command::new("kill").args(["-TERM", &child.id().to_string()]).status().expect("kill");
    assert!(ended.success());
    assert_eq!(child.wait().expect("it ends").code(), Some(75));
    let (_, out, _) = ran(&["farm", "status", "--plan", text(&farm)]);
    assert!(
        out.contains("transient") && out.contains("1 unfinished") && out.contains("0 of 1 shards"),
        "{out}"
    );
    let (code, _, said) =
        ran(&["farm", "merge", "--plan", text(&farm), "-o", text(&dir.path().join("merged"))]);
    assert!(code == Some(1) && said.contains("to do: 0"), "{said}");
}
