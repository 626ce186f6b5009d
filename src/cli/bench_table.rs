//! The tables that `nimbus bench` prints.

use std::path::Path;

use super::bench_invocations;
use super::bench_remarks::{
    clocks_line, drawn_line, empty_line, error_lines, latency_line, missing_lines, ms,
    overlap_lines, precision_lines, skipping_line, spread_lines, state_lines, still_line,
    still_lines,
};
use super::bench_roofs::{self, cold_line};
use super::output::{header, or_dash, table};
use crate::measure::lows::fps;
use crate::timing::N_FRAMES_NEEDED;
use crate::timing::names::loop_name;
use crate::timing::precision::PrecisionRecord;
use crate::timing::records::{Block, Case, Measured, Mode, Ratio, Run};
use crate::timing::state::case_line;
use crate::timing::still::skipped_text;

/// Returns the whole text. `same` says for each case whether the last frames of its blocks have the
/// same bytes; with `verbose` every table of every case is printed.
pub fn report(path: &Path, run: &Run, same: &[Option<bool>], verbose: bool) -> String {
    let threads = run
        .environment
        .get("LP_NUM_THREADS")
        .map_or(String::new(), |n| format!(", LP_NUM_THREADS={n}"));
    let mut out = format!(
        "{}\n{} ({}), {} ({} cores){threads}\n",
        path.display(),
        run.device.name,
        run.device.driver,
        run.cpu.model,
        run.cpu.logical_cores
    );
    let n_warm_up = run.cases.first().and_then(|c| c.modes.first()).map_or(0, |m| m.warm_up);
    out += &format!(
        "{}; the first {n_warm_up} frames of every block are not counted{}\n\n",
        blocks_line(run),
        if run.interrupted { "; INTERRUPTED: what was finished" } else { "" }
    );
    out += &cold_line(run);
    out += &still_lines(run);
    if run.cases.len() > 1 {
        out += &table(&case_rows(run));
        out += &skipped_text(run).map_or(String::new(), |text| text + "\n");
        out += &format!("\n{}\n", table(&pass_by_case_rows(run)));
    }
    let failed = run.stages.as_ref().map_or(&[][..], |stages| &stages.failed);
    for (case, same) in run.cases.iter().zip(same) {
        if run.cases.len() == 1 || verbose {
            out += &case_report(case, *same, failed);
            let state = case.state.as_ref().filter(|_| run.cases.len() > 1);
            out += &state.and_then(case_line).unwrap_or_default();
            if verbose {
                out += &bench_roofs::case_text(case);
            }
        } else if *same == Some(false) {
            out += &format!("{}: {DIFFER}", case.name());
        }
    }
    if run.cases.len() > 1 && !verbose {
        let n_same = same.iter().filter(|s| **s == Some(true)).count();
        let n_told = same.iter().flatten().count();
        out += &format!(
            "{n_same} of {n_told} cases gave the same last frame in all their blocks, to the byte\n"
        );
    }
    if verbose {
        out += &bench_roofs::missing_line(run);
    }
    out += &(precision_lines(run) + &missing_lines(run) + &clocks_line(&run.clocks));
    out + &state_lines(run, verbose)
}

const DIFFER: &str = "THE LAST FRAMES DIFFER between the blocks\n";

/// Returns the tables and remarks of one case; `failed` are the stages that the device computes
/// wrongly.
fn case_report(case: &Case, same: Option<bool>, failed: &[String]) -> String {
    let mut out = String::new();
    if !case.name().is_empty() {
        out += &format!("{}\n", case.name());
    }
    for rows in [time_rows(case), low_rows(case), pass_rows(case)] {
        out += &table(&rows);
        out.push('\n');
    }
    out += &bench_invocations::text(case);
    if case.is_still() {
        return out + &still_line(case) + &last_frame_lines(case, same, failed);
    }
    if let Some(ratio) = case.ratio {
        let interval = match ratio.low.zip(ratio.high) {
            Some((low, high)) => format!("95 % interval {low:.3} to {high:.3}"),
            None => format!("an interval needs {N_FRAMES_NEEDED} timed frames of each loop"),
        };
        out += &format!("parallel / serial = {:.3} ({interval})\n", ratio.parallel_by_serial);
    }
    out += &spread_lines(case);
    out += &case.overlap.as_ref().map_or(String::new(), |overlap| overlap_lines(overlap, case));
    out += &latency_line(case).unwrap_or_default();
    out += &drawn_line(case).unwrap_or_default();
    out += &empty_line(case).unwrap_or_default();
    out + &last_frame_lines(case, same, failed)
}

/// Returns what skipping saved, and the remarks on the last frames.
fn last_frame_lines(case: &Case, same: Option<bool>, failed: &[String]) -> String {
    let mut out = error_lines(case, failed);
    out += &case.skipping.as_ref().map_or(String::new(), skipping_line);
    out += &case.counts.map_or(String::new(), |counts| format!("last frame: {}\n", counts.text()));
    out += match same {
        Some(true) => "the last frames of all blocks are the same, to the byte\n",
        Some(false) => DIFFER,
        None => "",
    };
    out
}

/// Returns the order of the blocks in words.
fn blocks_line(run: &Run) -> String {
    /// Blocks that are shown: two rounds there and back of three loops.
    const N_SHOWN: usize = 12;
    let order = &run.block_order;
    let mut kinds: Vec<&Block> = Vec::new();
    for block in order {
        if !kinds.contains(&block) {
            kinds.push(block);
        }
    }
    let n = order.len();
    let cases = match run.cases.len() {
        0 | 1 => String::new(),
        n => format!("{n} cases, "),
    };
    let starts = match run.n_starts() {
        0 | 1 => String::new(),
        n => format!(" in {n} starts of the program"),
    };
    if let Some(PrecisionRecord { seed, .. }) = run.precision {
        let how = format!("in random order (--order-seed {seed}), a part of the frames each");
        return format!("{cases}{n} blocks{starts} {how}");
    }
    if !starts.is_empty() {
        return format!("{cases}{n} blocks{starts}");
    }
    let n_rounds = n / kinds.len().max(1);
    // A steady drift cancels over a round and its reverse; an odd number of rounds leaves one over.
    let is_balanced = n_rounds.is_multiple_of(2) && n == n_rounds * kinds.len();
    let balance = if is_balanced {
        ""
    } else {
        " (a steady drift does not cancel; with an even --repeat it does)"
    };
    match kinds[..] {
        [] => "no block was begun".to_owned(),
        [one] => format!("{n} blocks, all {}", loop_name(&one.threading, one.skip)),
        _ if run.cases.len() > 1 => {
            format!(
                "{} cases, {n} blocks, every second round in reverse order{balance}",
                run.cases.len()
            )
        }
        _ => {
            let letter = |block: &Block| {
                let i = kinds.iter().position(|kind| *kind == block).unwrap_or_default();
                char::from(b'A' + i as u8).to_string()
            };
            let shown: Vec<String> = order.iter().take(N_SHOWN).map(letter).collect();
            let more = if n > N_SHOWN { " …" } else { "" };
            let name = |kind: &&Block| {
                format!("{} = {}", letter(kind), loop_name(&kind.threading, kind.skip))
            };
            let names: Vec<String> = kinds.iter().map(name).collect();
            format!("{n} blocks, {}{more}, {}{balance}", shown.join(" "), names.join(", "))
        }
    }
}

fn ratio_text(r: Ratio) -> String {
    let interval =
        r.low.zip(r.high).map_or(String::new(), |(low, high)| format!(" ({low:.3}-{high:.3})"));
    format!("{:.3}{interval}", r.parallel_by_serial)
}

/// Returns the columns that name a case: its phase, if there are phases, and the values of the
/// sweep.
fn case_columns(run: &Run) -> (Vec<String>, impl Fn(&Case) -> Vec<String>) {
    let has_phases = run.cases.iter().any(|c| c.phase.is_some());
    let phase = move |name: &str| has_phases.then(|| name.to_owned()).into_iter();
    let swept = run.cases.iter().take(1).flat_map(|c| &c.sweep).map(|s| s.key.clone());
    let of = move |case: &Case| {
        let values = case.sweep.iter().map(|s| s.value.clone());
        phase(case.phase.as_deref().unwrap_or_default()).chain(values).collect()
    };
    (phase("phase").chain(swept).collect(), of)
}

/// Returns a row a case with the median of every pass that ran in some case, in the loop without
/// skipping, or else in the first loop.
fn pass_by_case_rows(run: &Run) -> Vec<Vec<String>> {
    let (mut header, columns) = case_columns(run);
    let whole = |case: &Case| case.modes.iter().position(|m| !m.skip).unwrap_or_default();
    let p50 = |case: &Case, i: usize| case.modes.get(whole(case))?.passes.get(i)?.p50_ms;
    let names: Vec<&String> = run
        .cases
        .iter()
        .find_map(|c| c.modes.first())
        .map_or(vec![], |m| m.passes.iter().map(|p| &p.name).collect());
    let ran: Vec<usize> =
        (0..names.len()).filter(|i| run.cases.iter().any(|c| p50(c, *i).is_some())).collect();
    header.push("p50 ms of".to_owned());
    header.extend(ran.iter().map(|i| names[*i].clone()));
    let mut rows = vec![header];
    for case in &run.cases {
        let mut row = columns(case);
        row.push(or_dash(case.modes.get(whole(case)), Mode::name));
        row.extend(ran.iter().map(|i| or_dash(p50(case, *i), ms)));
        rows.push(row);
    }
    rows
}

/// Returns a row a case and loop.
fn case_rows(run: &Run) -> Vec<Vec<String>> {
    let (mut header, columns) = case_columns(run);
    const FIGURES: [&str; 16] = [
        "particles",
        "drawn",
        "pixels",
        "loop",
        "n",
        "frame p50",
        "low",
        "high",
        "fps",
        "RMSE",
        "game",
        "gpu",
        "latency",
        "parallel/serial",
        "reached",
        "gpu saved",
    ];
    header.extend(FIGURES.map(str::to_owned));
    let mut rows = vec![header];
    for case in &run.cases {
        let reached = case.overlap.and_then(|o| o.reached);
        let saved = case.skipping.map(|s| s.gpu_no_skip_ms - s.gpu_ms);
        for mode in case.modes.iter().filter(|m| m.frames > 0 && !case.is_left_out(m)) {
            let is_parallel = mode.threading == "parallel"
                && !case.draws_nothing(mode)
                && case.modes.iter().all(|m| m.skip <= mode.skip);
            let mut row = columns(case);
            let p50 = |m: Option<Measured>| or_dash(m, |m| ms(m.of.p50));
            row.extend([
                case.particles.to_string(),
                or_dash(mode.drawn, |[_, mean, _]| format!("{mean:.0}")),
                format!("{}x{}", case.width, case.height),
                mode.name(),
                mode.frames.to_string(),
                p50(mode.frame_ms),
                or_dash(mode.frame_ms.and_then(|m| m.p50_low), ms),
                or_dash(mode.frame_ms.and_then(|m| m.p50_high), ms),
                or_dash(mode.frame_ms, |m| format!("{:.1}", fps(m.of.p50))),
                or_dash(case.check.as_ref().and_then(|c| c.rmse), |r| format!("{:.1e}", r.value)),
                p50(mode.game_ms),
                p50(mode.gpu_ms),
                p50(mode.latency_ms),
                or_dash(case.ratio.filter(|_| is_parallel), ratio_text),
                or_dash(reached.filter(|_| is_parallel), |r| format!("{:.0}%", 100.0 * r.share)),
                or_dash(saved.filter(|_| !mode.skip), ms),
            ]);
            rows.push(row);
        }
    }
    rows
}

/// Returns the frame rates of the median and of the slowest frames, by three definitions, and the
/// relative spread of frame times.
fn low_rows(case: &Case) -> Vec<Vec<String>> {
    let mut rows = header([
        "fps",
        "loop",
        "p50",
        "1 % low: p99",
        "mean of slowest 1 %",
        "1 % of the time",
        "sd / mean",
    ]);
    for mode in case.figure_first() {
        let (Some(frame), Some(lows)) = (&mode.frame_ms, &mode.frame_lows) else { continue };
        let rates = [fps(frame.of.p50), lows.p99_fps, lows.slowest_mean_fps, lows.slowest_time_fps];
        let mut row = vec!["frame".to_owned(), mode.name()];
        row.extend(rates.map(|rate| format!("{rate:.1}")));
        row.push(or_dash(frame.of.sd, |sd| format!("{:.1}%", 100.0 * sd / frame.of.mean)));
        rows.push(row);
    }
    rows
}

/// Returns the median of each time with its 95 % interval, and the spread of the times.
fn time_rows(case: &Case) -> Vec<Vec<String>> {
    let mut rows = header([
        "ms", "loop", "n", "p50", "low", "high", "mean", "sd", "min", "p1", "p5", "p95", "p99",
        "max",
    ]);
    for (what, of) in [
        ("frame", (|m| m.frame_ms) as fn(&Mode) -> Option<Measured>),
        ("game", |m| m.game_ms),
        ("record", |m| m.record_ms),
        ("submit", |m| m.submit_ms),
        ("wait", |m| m.wait_ms),
        ("render", |m| m.render_ms),
        ("gpu", |m| m.gpu_ms),
        ("latency", |m| m.latency_ms),
    ] {
        // The loop without skipping only shows the times that skipping is measured by, unless it is
        // the figure.
        let is_shown = |m: &&Mode| {
            m.skip
                || case.is_still()
                || what == "frame"
                || what == "gpu"
                || case.modes.iter().all(|m| !m.skip)
        };
        for mode in case.figure_first().filter(is_shown) {
            let Some(m) = of(mode) else { continue };
            let s = m.of;
            let mut row = vec![what.to_owned(), mode.name(), s.n.to_string(), ms(s.p50)];
            row.extend([m.p50_low, m.p50_high, Some(s.mean), s.sd].map(|time| or_dash(time, ms)));
            row.extend([s.min, s.p1, s.p5, s.p95, s.p99, s.max].map(ms));
            rows.push(row);
        }
    }
    rows
}

/// Returns a row a pass: its median in every loop, and, for the first loop, its share of the device
/// time, the frames that ran and skipped it, the device time a frame that skipping it saved, and
/// the reason of the last skip.
fn pass_rows(case: &Case) -> Vec<Vec<String>> {
    let Some(first) = case.modes.first() else { return vec![] };
    let mut header = vec!["pass, p50 ms".to_owned()];
    header.extend(case.modes.iter().map(Mode::name));
    header.extend(["share", "run", "skipped", "saved", "why"].map(str::to_owned));
    let mut rows = vec![header];
    for (i, pass) in first.passes.iter().enumerate() {
        let share = pass.share.filter(|_| pass.n_run > 0);
        let mut row = vec![pass.name.clone()];
        let in_loop = |m: &Mode| or_dash(m.passes.get(i).and_then(|p| p.p50_ms), ms);
        row.extend(case.modes.iter().map(in_loop));
        row.extend([
            or_dash(share, |s| format!("{:.1}%", 100.0 * s)),
            pass.n_run.to_string(),
            pass.n_skipped.to_string(),
            or_dash(pass.saved_ms, ms),
            pass.reason.clone().unwrap_or_default(),
        ]);
        rows.push(row);
    }
    rows
}
