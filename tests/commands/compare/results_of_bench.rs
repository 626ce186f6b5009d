//! Comparisons of what `bench` wrote, and the help.

use super::*;

#[test]
fn results_of_bench_are_read_back_and_do_not_differ_from_themselves() {
    let dir = temp();
    let out = dir.path().join("run");
    let mut bench = Command::cargo_bin("nimbus").expect("the program is built");
    bench.args([
        "bench",
        "scenes/hello.toml",
        "--size",
        "64x48",
        "--frames",
        "16",
        "--warmup",
        "2",
        "--repeat",
        "2",
    ]);
    bench.arg("--out").arg(&out).assert().success();
    let recorded = read_results(&out).expect("results");
    let order: Vec<(&str, bool)> =
        recorded.run.block_order.iter().map(|b| (&b.threading[..], b.skip)).collect();
    let there = [("serial", true), ("parallel", true), ("serial", false)];
    let back = there.iter().rev();
    assert_eq!(order, there.iter().chain(back).copied().collect::<Vec<_>>());
    let modes = &recorded.run.cases[0].modes;
    assert_eq!((recorded.modes.len(), modes.len()), (3, 3));
    for (timed, mode) in recorded.modes.iter().zip(modes) {
        let name =
            if mode.skip { mode.threading.clone() } else { format!("{} no-skip", mode.threading) };
        assert_eq!((&timed.name, timed.frames.len()), (&name, 32));
        // Every summary can be computed again from the frames.
        let summaries =
            [mode.frame_ms, mode.game_ms, mode.render_ms, mode.gpu_ms].map(|m| m.map(|m| m.of));
        for (measure, summary) in timed.measures.iter().zip(summaries) {
            assert_eq!(Summary::of(&measure.ms()), summary, "{}", measure.name);
        }
    }
    let out = out.to_str().expect("a UTF-8 path");
    let (code, table, _) = compare(&[out, out]);
    // Nothing moves in this scene: the loops that skip draw nothing and have no verdict.
    assert!(code == 0 && table.matches("frame: B takes 1.000 of A's time").count() == 1, "{table}");
    assert!(table.contains("serial no-skip frame: B takes 1.000 of A's time"), "{table}");
    assert!(!table.contains("slower") && !table.contains("faster"), "{table}");
}

#[test]
fn help_explains_intervals_and_shows_examples() {
    let (code, help, _) = compare(&["--help"]);
    assert_eq!(code, 0);
    for word in [
        "95 % interval",
        "twenty",
        "--allow",
        "bench scenes/threads.toml --out before",
        "Exit codes",
        "undecided",
    ] {
        assert!(help.contains(word), "{word} in\n{help}");
    }
}
