//! `nimbus farm` with the cases of a bench: except for times, the merged bench is that of one
//! process, and times that cannot be compared are not merged.

use std::fs;
use std::path::Path;

use crate::farm::{Farm, fail, json, names, path_text, ran, signal, succeed, wait_for};
use nimbus::timing::frame_rows::{FRAMES_FILE, FrameRow, FrameTable, parse_frames};
use nimbus::timing::parts::base_spread;
use nimbus::timing::records::Run;
use nimbus::timing::results::read_results;
use serde_json::Value;

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

/// Plans the bench, so many cases a shard.
fn planned(each: &str) -> Farm {
    let plan = ["--bench", "--shard-cases", each];
    Farm::of(SCENE, &[&SIZE, &plan[..], &["--"], &SWEEP].concat())
}

fn rows(folder: &Path) -> FrameTable {
    let path = folder.join(FRAMES_FILE);
    parse_frames(&fs::read_to_string(&path).expect("rows"), &path).expect("rows")
}

/// Everything of a run's cases that does not depend on how fast the machine is.
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

/// A row of frames.csv without its times and its block.
fn place(row: &FrameRow) -> String {
    let FrameRow { phase, sweep, threading, skip, frame, time_s, warm_up, n_drawn, ran, .. } = row;
    format!("{phase} {sweep} {threading} {skip} {frame} {time_s} {warm_up} {n_drawn} {ran}")
}

#[test]
fn the_merged_bench_is_that_of_one_process() {
    let farm = planned("2");
    let out = farm.local();
    assert!(out.starts_with("3 shards are done"), "{out}");
    let out = succeed(&["farm", "status", "--plan", farm.path()]);
    assert!(out.starts_with("3 of 3 shards are done"), "{out}");
    let (merged, alone) = (farm.merged(), farm.beside("alone"));
    let (code, out, errors) = farm.merge();
    assert_eq!((code, errors.as_str()), (Some(0), ""), "{out}");
    let expected = "the first case, timed in each of 3 shards on 1 node: ";
    assert!(out.starts_with("6 cases in ") && out.contains(expected), "{out}");
    succeed(&[&["bench", SCENE, "--out", path_text(&alone), "-q"], &SIZE[..], &SWEEP].concat());

    // Readers check that rows and records fit.
    let [ours, theirs] = [&merged, &alone].map(|folder| read_results(folder).expect("results"));
    assert_eq!(exact(&ours.run), exact(&theirs.run));
    let modes = |of: &nimbus::timing::results::BenchResults| -> Vec<_> {
        of.modes
            .iter()
            .map(|m| (m.name.clone(), m.frames.clone(), m.times("frame").len()))
            .collect()
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
    assert_parts_match_shards(&farm, &ours);
    assert_readers_accept(&farm, &merged, &alone);
}

/// Compares the parts in `run.json` with the results of the shards.
fn assert_parts_match_shards(farm: &Farm, merged: &Run) {
    assert_eq!(
        merged.parts.iter().map(|p| (p.first, p.end)).collect::<Vec<_>>(),
        [(0, 2), (2, 4), (4, 6)]
    );
    for (i, part) in merged.parts.iter().enumerate() {
        let run = read_results(&farm.place(i)).expect("results").run;
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
        // The merged run has the first case of the first part.
        assert_eq!(merged.cases[0] == *first, i == 0);
        assert!(!part.node.is_empty());
    }
    let spread = base_spread(&merged.parts);
    assert!(spread.len() == 3 && spread.iter().all(|(_, by)| *by >= 1.0), "{spread:?}");
}

/// Checks that `report`, `compare` and the schema take a merged bench.
fn assert_readers_accept(farm: &Farm, merged: &Path, alone: &Path) {
    let page = farm.beside("page.html");
    succeed(&["report", path_text(merged), "-o", path_text(&page)]);
    let page = fs::read_to_string(page).expect("a page");
    assert!(page.contains("The nodes that timed the cases") && page.contains("2..4"));
    let (code, out, errors) = ran(&["compare", path_text(alone), path_text(merged)]);
    assert!(code == Some(0) && out.contains("draw.cutoff=4, size=48x36"), "{out}{errors}");
    let value = json(&merged.join("run.json"));
    let schema: Value =
        serde_json::from_str(include_str!("../../docs/reference/schemas/run.schema.json"))
            .expect("the schema");
    let validator = jsonschema::draft202012::new(&schema).expect("a schema");
    assert_eq!(validator.iter_errors(&value).map(|e| e.to_string()).collect::<Vec<_>>(), [""; 0]);
}

#[test]
fn times_that_cannot_be_compared_are_refused_with_a_list() {
    let farm = planned("3");
    // A run that is started by hand may share its node.
    assert_eq!(farm.run(1).0, Some(0));
    let (code, _, errors) = farm.merge();
    assert!(code == Some(1) && errors.contains("1 of 2 shards are done"), "{errors}");
    assert!(errors.contains("to do: 0"), "{errors}");
    farm.local();
    let (code, _, errors) = farm.merge();
    let expected = "NIMBUS_EXCLUSIVE=1 says so): shards 1";
    assert!(code == Some(1) && errors.contains(expected), "{errors}");
    assert!(!farm.merged().exists());

    let device = read_results(&farm.place(1)).expect("results").run.device;
    for (what, from, to) in [
        ("device", &device.name, "another device"),
        ("device", &device.driver, "another driver 1.0"),
        ("processor", &"\"logical_cores\": ".to_owned(), "\"logical_cores\": 9"),
    ] {
        farm.change_file(1, "run.json", from, to);
        let (code, _, errors) = farm.merge();
        assert!(code == Some(1) && errors.contains(&format!("\n  {what}: ")), "{errors}");
        assert!(errors.contains(to.rsplit(' ').next().expect("a word")), "{errors}");
        assert!(!errors.contains("EXCLUSIVE") && !farm.merged().exists(), "{errors}");
        farm.change_file(1, "run.json", to, from);
    }
    assert_eq!(farm.merge().0, Some(0));
}

#[test]
fn a_part_has_the_first_case_and_its_own() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("out");
    let bench = |more: &[&str]| {
        ran(&[&["bench", SCENE, "-q", "--force"], &SIZE[..], &SWEEP, more].concat())
    };
    let (code, _, errors) = bench(&["--out", path_text(&out), "--part", "3..4"]);
    assert_eq!(code, Some(0), "{errors}");
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
        let (code, _, errors) = bench(&[&["--out", path_text(&out)], more].concat());
        assert!(code == Some(2) && errors.contains(expected), "{more:?} {errors}");
    }
    let (code, _, errors) = bench(&["--part", "0..1"]);
    assert!(code == Some(2) && errors.contains("--out"), "{errors}");
}

#[test]
fn arguments_that_the_plan_determines_are_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = dir.path().join("farm");
    let plan = |more: &[&str]| {
        fail(2, &[&["farm", "plan", SCENE, "-o", path_text(&folder)], more].concat())
    };
    for (arguments, expected) in [
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
        let errors = plan(&[&["--bench", "--"], arguments].concat());
        assert!(errors.contains(expected), "{arguments:?} {errors}");
    }
    // Either kind of work, and not without its arguments.
    plan(&["--bench", "--error"]);
    plan(&["--", "--frames", "2"]);
    plan(&["--bench", "--frames", "2"]);
    assert!(!folder.exists());
}

#[test]
fn a_part_that_fails_for_good_is_reported() {
    let farm = planned("6");
    let run = ["farm", "run", "--plan", farm.path(), "--shard", "0", "--device", "no such device"];
    let errors = fail(2, &run);
    assert!(errors.contains("nimbus bench ended with exit code 2"), "{errors}");
    assert!(errors.contains("no such device"), "{errors}");
    let out = succeed(&["farm", "status", "--plan", farm.path()]);
    for expected in ["failed", "cases 0..6", "to do: 0"] {
        assert!(out.contains(expected), "{out}");
    }
    let out = succeed(&["farm", "gc", "--plan", farm.path(), "--idle", "0.000001"]);
    assert!(out.contains("1 folders") && out.contains("removed"), "{out}");
}

#[test]
fn jobs_of_a_bench_have_their_node_to_themselves() {
    let farm = planned("6");
    succeed(&["farm", "emit", "slurm", "--plan", farm.path()]);
    let script = fs::read_to_string(farm.folder.join("slurm/shard.sh")).expect("a script");
    assert!(script.contains("--exclusive") && script.contains("NIMBUS_EXCLUSIVE=1"), "{script}");
}

#[test]
fn a_part_that_is_ended_leaves_no_result_and_may_be_tried_again() {
    // Some ten minutes or more, unless it is ended.
    let farm = Farm::of(SCENE, &["--bench", "--", "--repeat", "500"]);
    let mut run = farm.command(0).arg("--quiet").spawn().expect("the program runs");
    // The folder of its results is made once the device is open.
    wait_for("the part's folder", || {
        farm.leftovers(0, "tmp").iter().any(|folder| folder.join("part").exists())
    });
    assert!(run.try_wait().expect("a child").is_none(), "it is at work");
    signal("-TERM", &run);
    assert_eq!(run.wait().expect("it ends").code(), Some(75));
    let out = succeed(&["farm", "status", "--plan", farm.path()]);
    for expected in ["transient", "1 unfinished", "0 of 1 shards"] {
        assert!(out.contains(expected), "{out}");
    }
    let (code, _, errors) = farm.merge();
    assert!(code == Some(1) && errors.contains("to do: 0"), "{errors}");
}
