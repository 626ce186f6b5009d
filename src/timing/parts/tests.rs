use std::collections::BTreeMap;

use serde_json::json;

use super::*;
use crate::gpu::PassTimes;
use crate::io::result_folder::Existing;
use crate::measure::stats::Summary;
use crate::timing::json::ResultFile;
use crate::timing::machine::{Cpu, Device};
use crate::timing::names::Setting;
use crate::timing::records::Measured;
use crate::timing::results::{open_results, write_results};
use crate::timing::state::{CaseState, RunState};

const LOOPS: [&str; 2] = ["serial", "parallel"];
const N_WARM_UP: usize = 1;
const N_FRAMES: usize = 2;
const N_ROUNDS: usize = 2;

fn mode(threading: &str, p50_ms: f64) -> Mode {
    let of = Summary::of(&[p50_ms]);
    let mode = json!({
        "threading": threading, "skip": true, "simulate": "gpu", "frames": N_ROUNDS * N_FRAMES,
        "warm_up": N_WARM_UP, "blocks": N_ROUNDS, "impostors_reused": 0, "passes": [],
        "image_hash": "ab".repeat(32),
    });
    let mode: Mode = serde_json::from_value(mode).unwrap();
    Mode { frame_ms: of.map(|of| Measured { of, p50_low: None, p50_high: None }), ..mode }
}

fn sweep(k: usize) -> Vec<Setting> {
    vec![Setting { key: "draw.cutoff".to_owned(), value: k.to_string() }]
}

/// Case `k` with frame time `ms`.
fn case(k: usize, ms: f64) -> Case {
    Case {
        phase: None,
        sweep: sweep(k),
        scene_hash: format!("{k:064}"),
        particles: 554,
        width: 8,
        height: 6,
        modes: LOOPS.map(|threading| mode(threading, ms)).to_vec(),
        ratio: None,
        overlap: None,
        skipping: None,
        counts: None,
        figure: None,
        check: None,
        state: None,
        invocations: None,
        precision: None,
    }
}

/// The time of case `k` in the part from `first` on. That of the first case identifies the part.
fn ms(k: usize, first: usize) -> f64 {
    10.0 + k as f64 + if k == 0 { first as f64 / 10.0 } else { 0.0 }
}

fn row(k: usize, threading: &str, block: u32, frame: usize, ms: f64) -> FrameRow {
    FrameRow {
        phase: String::new(),
        sweep: sweep_text(&sweep(k)),
        threading: threading.to_owned(),
        skip: true,
        block,
        frame: frame as u32,
        time_s: 0.0,
        warm_up: frame < N_WARM_UP,
        frame_ms: ms,
        game_ms: 0.25,
        record_ms: 0.125,
        submit_ms: 0.125,
        wait_ms: 0.5,
        gpu_ms: None,
        latency_ms: 1.0,
        queue_depth: 1,
        n_drawn: 7,
        ran: "sort".to_owned(),
        pass_ms: vec![Some(0.5)],
        image_hash: None,
        end_s: None,
        throttled: None,
        discarded: false,
    }
}

/// The part that `nimbus bench --part` writes for a sweep of draw.cutoff=0,1,2,….
fn part(range: Range<usize>) -> Part {
    let (numbers, first) = (numbers(&range), range.start);
    let mut block_order = Vec::new();
    for round in 0..N_ROUNDS {
        let blocks = (0..numbers.len()).flat_map(|case| {
            LOOPS.map(|of| Block { case, threading: of.to_owned(), skip: true, start: 0 })
        });
        let mut blocks: Vec<Block> = blocks.collect();
        if round % 2 == 1 {
            blocks.reverse();
        }
        block_order.extend(blocks);
    }
    let rows = block_order.iter().enumerate().flat_map(|(block, of)| {
        let (k, threading) = (numbers[of.case], of.threading.clone());
        (0..N_WARM_UP + N_FRAMES)
            .map(move |frame| row(k, &threading, block as u32, frame, ms(k, first)))
    });
    let rows = rows.collect();
    // A reading before the blocks, and one in each.
    let reading = |block: Option<u32>| StateRow {
        block,
        gpu_mhz: block.map(|block| f64::from(100 * first as u32 + block)),
        ..StateRow::default()
    };
    let blocks = (0..block_order.len() as u32).map(Some);
    let state = [None].into_iter().chain(blocks).map(reading).collect();
    let run = json!({
        "schema": Run::SCHEMA, "nimbus": "0.1.0", "revision": "0123456789ab",
        "date": "2024-02-29T12:34:56Z", "command": ["nimbus", "bench", "a.toml"],
        "scene_hash": "ab".repeat(32), "scene": {},
        "device": {
            "name": "llvmpipe", "driver": "Mesa", "api": "1.3.230", "type": "cpu",
            "uuid": "00".repeat(16),
        },
        "cpu": { "model": "a processor", "logical_cores": 2 },
        "environment": { "LP_NUM_THREADS": "1" },
        "clocks": {
            "resolution_ns": 1.0, "overhead_ns": 20.0 + first as f64,
            "timestamp_period_ns": null, "timestamp_overhead_ns": null,
        },
        "block_order": [], "cases": [], "interrupted": false,
    });
    let run: Run = serde_json::from_value(run).unwrap();
    let cases: Vec<Case> = numbers.iter().map(|k| case(*k, ms(*k, first))).collect();
    let text = |case: &Case| {
        if cases.len() > 1 { format!("{}: path", case.name()) } else { "path".to_owned() }
    };
    let chosen = cases.iter().map(text).collect();
    let pictures = (0..cases.len()).map(picture_file).collect();
    Part {
        name: format!("shard {first}"),
        node: format!("node-{first}"),
        range,
        run: Run { block_order, cases, chosen, ..run },
        table: FrameTable { pass_names: vec!["sort".to_owned()], rows },
        state,
        pictures,
    }
}

fn three() -> Vec<Part> {
    [0..1, 1..4, 4..6].map(part).to_vec()
}

#[test]
fn a_part_has_the_first_case_once() {
    assert_eq!(
        (numbers(&(0..3)), numbers(&(3..5)), numbers(&(0..1))),
        (vec![0, 1, 2], vec![0, 3, 4], vec![0])
    );
}

#[test]
fn parts_together_are_the_whole() {
    let whole = part(0..6);
    let Joined { run, table: FrameTable { pass_names, rows }, pictures, .. } =
        join(&three()).unwrap();
    assert_eq!(run.cases, whole.run.cases);
    assert_eq!((pass_names, &run.chosen), (whole.table.pass_names, &whole.run.chosen));
    // The same blocks and rows, in another order; every row belongs to the block that it names.
    let blocks = |run: &Run| {
        let mut all: Vec<_> =
            run.block_order.iter().map(|b| (b.case, b.threading.clone(), b.skip)).collect();
        all.sort();
        all
    };
    assert_eq!(blocks(&run), blocks(&whole.run));
    assert!(rows.iter().all(|row| is_of_its_block(row, &run)));
    let sorted = |rows: &[FrameRow]| {
        let mut all: Vec<String> =
            rows.iter().map(|row| format!("{:?}", FrameRow { block: 0, ..row.clone() })).collect();
        all.sort();
        all
    };
    assert_eq!(sorted(&rows), sorted(&whole.table.rows));
    let numbers: Vec<usize> = rows.iter().map(|row| row.block as usize).collect();
    assert!(
        numbers.is_sorted() && numbers.last() == Some(&(run.block_order.len() - 1)),
        "{numbers:?}"
    );
    // Each block keeps its number of rows.
    for block in 0..run.block_order.len() {
        assert_eq!(numbers.iter().filter(|n| **n == block).count(), N_WARM_UP + N_FRAMES);
    }
    let of =
        |i_part, from, to| PictureCopy { i_part, from: picture_file(from), to: picture_file(to) };
    assert_eq!(
        pictures,
        [of(0, 0, 0), of(1, 1, 1), of(1, 2, 2), of(1, 3, 3), of(2, 1, 4), of(2, 2, 5)]
    );
    assert!(!run.interrupted);
}

#[test]
fn the_state_of_each_part_is_kept() {
    let mut parts = three();
    let with_load = |load: f64| Some(RunState { load_at_start: Some(load), ..RunState::default() });
    for (part, load) in parts.iter_mut().zip([1.0, 2.0, 3.0]) {
        part.run.state = with_load(load);
        for (case, n) in part.run.cases.iter_mut().zip(1..) {
            case.state =
                Some(CaseState { n_readings: 10 * load as usize + n, ..CaseState::default() });
        }
    }
    parts[1].state.clear(); // Results of an earlier version have no readings.
    let Joined { run, state, .. } = join(&parts).unwrap();
    assert_eq!(run.state, None);
    let of_parts: Vec<_> = run.parts.iter().map(|part| part.state.clone()).collect();
    assert_eq!(of_parts, [1.0, 2.0, 3.0].map(with_load));
    let of_cases: Vec<usize> =
        run.cases.iter().map(|case| case.state.as_ref().unwrap().n_readings).collect();
    assert_eq!(of_cases, [11, 22, 23, 24, 32, 33]);
    // One reading a block of the first and the third part, which name the blocks of the whole. The
    // third part's first case is that of the first part.
    let blocks: Vec<(u32, f64)> =
        state.iter().map(|row| (row.block.unwrap(), row.gpu_mhz.unwrap())).collect();
    assert_eq!(blocks.len(), 3 * LOOPS.len() * N_ROUNDS);
    for (block, mhz) in blocks {
        let part = &parts[if mhz >= 400.0 { 2 } else { 0 }];
        let own = &part.run.block_order[mhz as usize % 100];
        let whole = &run.block_order[block as usize];
        assert_eq!(numbers(&part.range)[own.case], whole.case);
        assert_eq!(own.threading, whole.threading);
    }
}

#[test]
fn the_joined_run_names_the_node_of_each_part() {
    let mut parts = three();
    parts[1].run.date = "2024-03-01T00:00:00Z".to_owned();
    let run = join(&parts).unwrap().run;
    let seen: Vec<_> =
        run.parts.iter().map(|p| (p.first, p.end, &p.node[..], p.clocks.overhead_ns)).collect();
    assert_eq!(seen, [(0, 1, "node-0", 20.0), (1, 4, "node-1", 21.0), (4, 6, "node-4", 24.0)]);
    assert_eq!(
        (&run.parts[1].date[..], &run.date[..]),
        ("2024-03-01T00:00:00Z", "2024-02-29T12:34:56Z")
    );
    let base: Vec<_> = run.parts[2].base.iter().map(|b| (&b.threading[..], b.p50_ms)).collect();
    assert_eq!(base, [("serial", Some(10.4)), ("parallel", Some(10.4))]);
    let spread = base_spread(&run.parts);
    assert_eq!(spread, [("serial".to_owned(), 1.04), ("parallel".to_owned(), 1.04)]);
    // One part has no spread, nor does a loop that was not measured.
    assert!(base_spread(&run.parts[..1]).is_empty() && base_spread(&[]).is_empty());
    parts[0].run.cases[0].modes[0].frame_ms = None;
    parts[1].run.cases[0].modes[0].frame_ms = None;
    assert_eq!(base_spread(&join(&parts).unwrap().run.parts), [("parallel".to_owned(), 1.04)]);
}

#[test]
fn a_joined_run_is_interrupted_if_a_part_was_and_lacks_the_pictures_that_parts_lack() {
    let mut parts = three();
    parts[1].run.interrupted = true;
    parts[1].pictures.remove(1);
    let Joined { run, pictures, .. } = join(&parts).unwrap();
    assert!(run.interrupted);
    assert_eq!(
        pictures.iter().map(|moved| &moved.to[..]).collect::<Vec<_>>(),
        ["case-0.png", "case-2.png", "case-3.png", "case-4.png", "case-5.png"]
    );
    assert!(join(&[]).is_none());
}

#[test]
fn a_choice_belongs_to_the_case_that_its_text_names() {
    let mut run = part(0..3).run;
    run.cases[1].phase = Some("a".to_owned());
    run.cases[2].phase = Some("a: b".to_owned());
    run.cases.iter_mut().for_each(|case| case.sweep.clear());
    run.cases[0].phase = Some("b".to_owned());
    run.chosen = ["a: path", "a: b: path", "b: a: path"].map(str::to_owned).to_vec();
    let of: Vec<usize> = chosen_by_case(&run, 3).iter().map(|(i, _)| *i).collect();
    assert_eq!(of, [1, 2, 0]);
}

/// The difference that is reported, and the change that causes it.
type Change = (&'static str, fn(&mut Part));

const CHANGES: [Change; 24] = [
    ("version: 0.1.0 of shard 0, 0.2.0 of shard 4", |p| p.run.nimbus = "0.2.0".to_owned()),
    ("build: 0123456789ab of shard 0, 0123456789ab-dirty of shard 4", |p| {
        p.run.revision += "-dirty"
    }),
    ("scene: ", |p| p.run.scene_hash = "cd".repeat(32)),
    ("device: llvmpipe (Mesa, ", |p| {
        p.run.device = Device { name: "another".to_owned(), ..p.run.device.clone() }
    }),
    ("device: ", |p| p.run.device.driver += " 2"),
    ("device: ", |p| p.run.device.api = "1.4.0".to_owned()),
    ("processor: ", |p| p.run.cpu = Cpu { model: "another".to_owned(), ..p.run.cpu.clone() }),
    ("processor: a processor, 2 cores of shard 0, a processor, 4 cores", |p| {
        p.run.cpu.logical_cores = 4
    }),
    ("environment: ", |p| p.run.environment = BTreeMap::new()),
    ("validation: false of shard 0, true", |p| p.run.command.push("--validation".to_owned())),
    ("times of passes: ", |p| p.run.clocks.pass_times = PassTimes::Overlapping),
    ("guard bands: ", |p| p.run.command.push("--guard".to_owned())),
    ("limit of a submission: default of shard 0, 20 of shard 4", |p| {
        p.run.command.extend(["--max-submit-ms".to_owned(), "20".to_owned()])
    }),
    ("limit of a submission: default of shard 0, 20 of shard 4", |p| {
        p.run.command.push("--max-submit-ms=20".to_owned())
    }),
    ("passes: sort of shard 0, cull", |p| p.table.pass_names = vec!["cull".to_owned()]),
    ("first case: draw.cutoff=0 of shard 0, draw.cutoff=9", |p| p.run.cases[0].sweep = sweep(9)),
    ("scene of the first case: ", |p| p.run.cases[0].scene_hash = "cd".repeat(32)),
    ("particles of the first case: 554 of shard 0, 555", |p| p.run.cases[0].particles += 1),
    ("size of the first case: 8x6 of shard 0, 8x7", |p| p.run.cases[0].height += 1),
    ("loops of the first case: ", |p| p.run.cases[0].modes[0].frames += 1),
    ("loops of the first case: ", |p| p.run.cases[0].modes[0].simulate = "cpu".to_owned()),
    ("last frames of the first case: ", |p| {
        p.run.cases[0].modes[1].image_hash = Some("ef".repeat(32))
    }),
    ("blocks of a loop: 2 of shard 0, 2 and 3", |p| p.run.cases[1].modes[0].blocks = 3),
    ("warm-up frames of a block: 1 of shard 0, 1 and 9", |p| p.run.cases[1].modes[0].warm_up = 9),
];

#[test]
fn every_difference_between_parts_is_listed() {
    assert_eq!(differences(&three()), [""; 0]);
    for (expected, change) in CHANGES {
        let mut parts = three();
        change(&mut parts[2]);
        let found = differences(&parts);
        assert!(found.len() == 1 && found[0].starts_with(expected), "{expected}: {found:?}");
    }
    // Loops of another number, order or kind.
    const OF_LOOPS: [fn(&mut Part); 3] = [
        |p| p.run.cases[0].modes.truncate(1),
        |p| p.run.cases[0].modes.reverse(),
        |p| p.run.cases[0].modes[0].skip = false,
    ];
    for change in OF_LOOPS {
        let mut parts = three();
        change(&mut parts[1]);
        assert!(
            differences(&parts).iter().any(|what| what.starts_with("loops of the first case: "))
        );
    }
    // Facts in which nodes may differ.
    let mut parts = three();
    parts[1].run.date = "2024-03-01T00:00:00Z".to_owned();
    parts[1].run.clocks.overhead_ns = 30.0;
    assert_eq!(differences(&parts), [""; 0]);
}

#[test]
fn a_missing_or_repeated_part_is_listed() {
    assert_eq!(differences(&[]), ["there is no part"]);
    assert_eq!(
        differences(&[part(0..2), part(4..6)]),
        ["cases: shard 4 begins with case 4, expected 2"]
    );
    assert_eq!(differences(&[part(1..2)]), ["cases: shard 1 begins with case 1, expected 0"]);
    assert_eq!(
        differences(&[part(0..2), part(1..2)]),
        ["cases: shard 1 begins with case 1, expected 2"]
    );
}

#[test]
fn a_part_is_read_as_it_was_written_and_checked_against_its_range() {
    let dir = tempfile::tempdir().unwrap();
    let Part { run, table, name, node, range, .. } = part(2..4);
    let write = |table: &FrameTable| {
        let mut folder = open_results(dir.path(), Existing::Extend, 0, false)?;
        write_results(&mut folder, &run, table, &Default::default())
    };
    let read = |range: Range<usize>| Part::read(dir.path(), name.clone(), node.clone(), range);
    write(&table).unwrap();
    std::fs::write(dir.path().join("case-1.png"), "a picture").unwrap();
    let found = read(range.clone()).unwrap();
    assert_eq!((&found.run, &found.table), (&run, &table));
    assert_eq!((found.pictures, found.range), (vec!["case-1.png".to_owned()], range.clone()));
    for other in [0..2, 2..5] {
        let message = read(other).unwrap_err().to_string();
        assert!(message.contains("3 cases; cases "), "{message}");
    }
    // Both ranges have three cases with the first; the caller compares their names.
    assert!(read(0..3).is_ok());
    for block in [1, 99] {
        let mut table = table.clone();
        table.rows[0].block = block;
        write(&table).unwrap();
        let message = read(range.clone()).unwrap_err().to_string();
        assert!(message.contains(&format!("a row is not of block {block}")), "{message}");
    }
}
