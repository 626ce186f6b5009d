//! What `nimbus bench` prints for people.

use std::path::Path;

use super::output;
use crate::measure::lows::fps;
use crate::timing::machine::Clocks;
use crate::timing::overlap::Overlap;
use crate::timing::records::{Block, Case, Measured, Mode, Ratio, Run, Skipping};

/// The whole of it. `same`: of each case whether all its last frames are the same, to the byte.
/// `verbose`: every table of every case.
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
    if run.cases.len() > 1 {
        for rows in [case_rows(run), pass_by_case_rows(run)] {
            out += &output::table(&rows);
            out.push('\n');
        }
    }
    for (case, same) in run.cases.iter().zip(same) {
        if run.cases.len() == 1 || verbose {
            out += &case_report(case, *same);
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
    out + &clocks_line(&run.clocks)
}

const DIFFER: &str = "THE LAST FRAMES DIFFER between the blocks\n";

/// All that is said of one case.
fn case_report(case: &Case, same: Option<bool>) -> String {
    let mut out = String::new();
    if !case.name().is_empty() {
        out += &format!("{}\n", case.name());
    }
    for rows in [time_rows(case), low_rows(case), pass_rows(case)] {
        out += &output::table(&rows);
        out.push('\n');
    }
    if let Some(ratio) = case.ratio {
        let interval = match ratio.low.zip(ratio.high) {
            Some((low, high)) => format!("95 % interval {low:.3} to {high:.3}"),
            None => "too few frames for an interval".to_owned(),
        };
        out += &format!("parallel / serial = {:.3} ({interval})\n", ratio.parallel_by_serial);
    }
    out += &spread_lines(case);
    out += &case.overlap.as_ref().map_or(String::new(), |overlap| overlap_lines(overlap, case));
    out += &latency_line(case).unwrap_or_default();
    out += &drawn_line(case).unwrap_or_default();
    out += &case.skipping.as_ref().map_or(String::new(), skipping_line);
    out += &case.counts.map_or(String::new(), |counts| format!("last frame: {}\n", counts.text()));
    out += match same {
        Some(true) => "the last frames of all blocks are the same, to the byte\n",
        Some(false) => DIFFER,
        None => "",
    };
    out
}

/// How the blocks took turns.
fn blocks_line(run: &Run) -> String {
    /// Two full turns show the pattern.
    const N_SHOWN: usize = 12;
    let order = &run.block_order;
    let mut kinds: Vec<&Block> = Vec::new();
    for block in order {
        if !kinds.contains(&block) {
            kinds.push(block);
        }
    }
    let n = order.len();
    let n_rounds = n / kinds.len().max(1);
    // There and back: a steady drift adds up to the same for all; of an odd number of rounds one is
    // left over.
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

fn loop_name(threading: &str, skip: bool) -> String {
    if skip { threading.to_owned() } else { format!("{threading} no-skip") }
}

fn name_of(mode: &Mode) -> String {
    loop_name(&mode.threading, mode.skip)
}

fn ratio_text(r: Ratio) -> String {
    let interval =
        r.low.zip(r.high).map_or(String::new(), |(low, high)| format!(" ({low:.3}-{high:.3})"));
    format!("{:.3}{interval}", r.parallel_by_serial)
}

/// What a case is called, in columns: its phase where there are phases, then the values of the
/// sweep's keys.
fn case_columns(run: &Run) -> (Vec<String>, impl Fn(&Case) -> Vec<String>) {
    let has_phases = run.cases.iter().any(|c| c.phase.is_some());
    let mut header: Vec<String> = if has_phases { vec!["phase".to_owned()] } else { vec![] };
    header.extend(
        run.cases.first().map_or(vec![], |c| c.sweep.iter().map(|s| s.key.clone()).collect()),
    );
    let of = move |case: &Case| {
        let mut row: Vec<String> =
            if has_phases { vec![case.phase.clone().unwrap_or_default()] } else { vec![] };
        row.extend(case.sweep.iter().map(|s| s.value.clone()));
        row
    };
    (header, of)
}

/// A row a case: the median of every pass that ran in some case, where nothing is skipped or else
/// in the first loop.
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
        row.push(case.modes.get(whole(case)).map_or("-".to_owned(), name_of));
        row.extend(ran.iter().map(|i| p50(case, *i).map_or("-".to_owned(), ms)));
        rows.push(row);
    }
    rows
}

/// A row a case and loop.
fn case_rows(run: &Run) -> Vec<Vec<String>> {
    let (mut header, columns) = case_columns(run);
    let figures = [
        "particles",
        "drawn",
        "pixels",
        "loop",
        "n",
        "frame p50",
        "low",
        "high",
        "fps",
        "game",
        "gpu",
        "latency",
    ];
    header.extend(figures.map(str::to_owned));
    header.extend(["parallel/serial", "reached", "gpu saved"].map(str::to_owned));
    let mut rows = vec![header];
    for case in &run.cases {
        let reached = case.overlap.and_then(|o| o.reached);
        let saved = case.skipping.map(|s| s.gpu_no_skip_ms - s.gpu_ms);
        for mode in case.modes.iter().filter(|m| m.frames > 0) {
            let is_parallel =
                mode.threading == "parallel" && case.modes.iter().all(|m| m.skip <= mode.skip);
            let mut row = columns(case);
            let p50 = |m: &Option<Measured>| m.map_or("-".to_owned(), |m| ms(m.of.p50));
            let end = |of: fn(&Measured) -> Option<f64>| {
                mode.frame_ms.as_ref().and_then(of).map_or("-".to_owned(), ms)
            };
            row.extend([
                case.particles.to_string(),
                mode.drawn.map_or("-".to_owned(), |[_, mean, _]| format!("{mean:.0}")),
                format!("{}x{}", case.width, case.height),
                name_of(mode),
                mode.frames.to_string(),
                p50(&mode.frame_ms),
                end(|m| m.p50_low),
                end(|m| m.p50_high),
                mode.frame_ms.map_or("-".to_owned(), |m| format!("{:.1}", fps(m.of.p50))),
                p50(&mode.game_ms),
                p50(&mode.gpu_ms),
                p50(&mode.latency_ms),
                if is_parallel {
                    case.ratio.map_or("-".to_owned(), ratio_text)
                } else {
                    "-".to_owned()
                },
                reached
                    .filter(|_| is_parallel)
                    .map_or("-".to_owned(), |r| format!("{:.0}%", 100.0 * r.share)),
                saved.filter(|_| !mode.skip).map_or("-".to_owned(), ms),
            ]);
            rows.push(row);
        }
    }
    rows
}

/// The bound of what overlap can do, and how near the parallel loop came.
fn overlap_lines(o: &Overlap, case: &Case) -> String {
    let (game, render, bound, serial) =
        (ms(o.game_ms), ms(o.render_ms), ms(o.bound_ms), ms(o.serial_ms));
    let share = o.bound_ms / o.serial_ms;
    let mut out = format!(
        "perfect overlap = max(game {game}, render {render}) = {bound} ms, {share:.3} of the \
         serial {serial} ms\n"
    );
    if let Some(r) = o.reached {
        let [share, low, high] = [r.share, r.low, r.high].map(|s| 100.0 * s);
        let possible = ms(o.serial_ms - o.bound_ms);
        out += &format!(
            "of the possible {possible} ms the parallel loop gained {share:.1} % (95 % interval \
             {low:.1} to {high:.1})\n"
        );
        if r.share > 1.0 {
            out += "that is more than overlapping game and render alone can give: recording \
                overlapped, too, or the \
                    machine changed from block to block\n";
        }
        if r.share < 0.9 {
            out += &slowed_line(o, case).unwrap_or_default();
        }
    } else if o.parallel_ms.is_some() {
        out += "that is next to nothing, or not certain: what share of it was reached \
            cannot be said\n";
    }
    out
}

/// Why overlap gains less than it could: steps that slow one another down.
fn slowed_line(o: &Overlap, case: &Case) -> Option<String> {
    let skip = case.modes.iter().any(|m| m.skip);
    let parallel = case.modes.iter().find(|m| m.threading == "parallel" && m.skip == skip)?;
    let (game, render) = (parallel.game_ms?.of.p50, parallel.render_ms?.of.p50);
    // As much as the intervals of short runs leave open says nothing.
    let is_slower = game > 1.05 * o.game_ms || render > 1.05 * o.render_ms;
    is_slower.then(|| {
        format!(
            "side by side the game step takes {} in place of {}, the render step {} in place of {} \
             ms: they share cores\n",
            ms(game),
            ms(o.game_ms),
            ms(render),
            ms(o.render_ms)
        )
    })
}

/// Where blocks of one loop lie as far apart as the two loops do, or a tenth.
fn spread_lines(case: &Case) -> String {
    let effect = case.ratio.map_or(f64::INFINITY, |r| r.parallel_by_serial.ln().abs());
    let of = |m: &Mode| {
        let spread = m.block_spread.filter(|s| s.ln() >= effect || *s >= 1.1)?;
        Some(format!(
            "{}: blocks lie a factor of {spread:.3} apart: the machine was not steady\n",
            name_of(m)
        ))
    };
    case.modes.iter().filter_map(of).collect()
}

/// What overlap costs: the picture's age.
fn latency_line(case: &Case) -> Option<String> {
    let skip = case.modes.iter().any(|m| m.skip);
    let of =
        |threading: &str| case.modes.iter().find(|m| m.threading == threading && m.skip == skip);
    let (serial, parallel) = (of("serial")?, of("parallel")?);
    let (a, b) = (serial.latency_ms?.of.p50, parallel.latency_ms?.of.p50);
    let frame = serial.frame_ms?.of.p50;
    let depth = parallel.queue_depth.map_or(String::new(), |n| format!(", {n:.2} frames queued"));
    Some(format!(
        "latency, game step to picture: serial {}, parallel {} ms: {:+.2} frames of the serial \
         loop{depth}\n",
        ms(a),
        ms(b),
        (b - a) / frame
    ))
}

/// How many particles were drawn, where that were not all in every frame.
fn drawn_line(case: &Case) -> Option<String> {
    let [least, mean, most] = case.modes.iter().find(|m| m.skip)?.drawn?;
    let n = case.particles;
    (mean < n as f64)
        .then(|| format!("drawn: {mean:.0} of {n} particles a frame, {least:.0} to {most:.0}\n"))
}

fn skipping_line(s: &Skipping) -> String {
    let saved = s.gpu_no_skip_ms - s.gpu_ms;
    let times = if s.gpu_ms > 0.0 {
        format!("{:.1} times less", s.gpu_no_skip_ms / s.gpu_ms)
    } else {
        "nothing is left to do".to_owned()
    };
    let bytes = match s.same_bytes {
        Some(true) => "; same bytes",
        Some(false) => "; NOT THE SAME BYTES",
        None => "",
    };
    format!(
        "skipping saves {} of {} ms of GPU time a frame ({times}){bytes}\n",
        ms(saved),
        ms(s.gpu_no_skip_ms)
    )
}

/// The host's clock and the device's: a time near these says nothing.
fn clocks_line(clocks: &Clocks) -> String {
    let device =
        clocks.timestamp_period_ns.map_or("none".to_owned(), |ns| format!("{ns} ns a tick"));
    let empty = clocks
        .timestamp_overhead_ns
        .map_or(String::new(), |ns| format!(", {ns:.0} ns for an empty pass"));
    format!(
        "host clock: resolution {} ns, {:.0} ns a reading; device timestamps: {device}{empty}\n",
        clocks.resolution_ns, clocks.overhead_ns
    )
}

/// Frame rates: the median's, and that of the slowest frames by each of the three definitions,
/// beside how much frame times vary.
fn low_rows(case: &Case) -> Vec<Vec<String>> {
    let header = [
        "fps",
        "loop",
        "p50",
        "1 % low: p99",
        "mean of slowest 1 %",
        "1 % of the time",
        "sd / mean",
    ];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    for mode in case.modes.iter() {
        let (Some(frame), Some(lows)) = (&mode.frame_ms, &mode.frame_lows) else { continue };
        let rates = [fps(frame.of.p50), lows.p99_fps, lows.slowest_mean_fps, lows.slowest_time_fps];
        let mut row = vec!["frame".to_owned(), name_of(mode)];
        row.extend(rates.map(|rate| format!("{rate:.1}")));
        row.push(
            frame.of.sd.map_or("-".to_owned(), |sd| format!("{:.1}%", 100.0 * sd / frame.of.mean)),
        );
        rows.push(row);
    }
    rows
}

/// The median of each time with its 95 % interval, and how the times spread.
fn time_rows(case: &Case) -> Vec<Vec<String>> {
    let header = [
        "ms", "loop", "n", "p50", "low", "high", "mean", "sd", "min", "p1", "p5", "p95", "p99",
        "max",
    ];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    for (what, of) in [
        ("frame", (|m| m.frame_ms.as_ref()) as fn(&Mode) -> Option<&Measured>),
        ("game", |m| m.game_ms.as_ref()),
        ("record", |m| m.record_ms.as_ref()),
        ("submit", |m| m.submit_ms.as_ref()),
        ("wait", |m| m.wait_ms.as_ref()),
        ("render", |m| m.render_ms.as_ref()),
        ("gpu", |m| m.gpu_ms.as_ref()),
        ("latency", |m| m.latency_ms.as_ref()),
    ] {
        // Of frames that skip nothing only what skipping is measured by.
        let is_shown = |m: &&Mode| {
            m.skip || what == "frame" || what == "gpu" || case.modes.iter().all(|m| !m.skip)
        };
        for mode in case.modes.iter().filter(is_shown) {
            let Some(m) = of(mode) else { continue };
            let s = &m.of;
            let mut row = vec![what.to_owned(), name_of(mode), s.n.to_string(), ms(s.p50)];
            row.extend([m.p50_low, m.p50_high].map(|end| end.map_or("-".to_owned(), ms)));
            let sd = s.sd.map_or("-".to_owned(), ms);
            row.extend([
                ms(s.mean),
                sd,
                ms(s.min),
                ms(s.p1),
                ms(s.p5),
                ms(s.p95),
                ms(s.p99),
                ms(s.max),
            ]);
            rows.push(row);
        }
    }
    rows
}

/// A row a pass: its median in every loop, and of the first loop how often it ran and why not.
fn pass_rows(case: &Case) -> Vec<Vec<String>> {
    let Some(first) = case.modes.first() else { return vec![] };
    let mut header = vec!["pass, p50 ms".to_owned()];
    header.extend(case.modes.iter().map(name_of));
    header.extend(["share", "run", "skipped", "saved", "why"].map(str::to_owned));
    let mut rows = vec![header];
    for (i, pass) in first.passes.iter().enumerate() {
        let share = pass
            .share
            .filter(|_| pass.n_run > 0)
            .map_or("-".to_owned(), |s| format!("{:.1}%", 100.0 * s));
        let mut row = vec![pass.name.clone()];
        row.extend(
            case.modes
                .iter()
                .map(|m| m.passes.get(i).and_then(|p| p.p50_ms).map_or("-".to_owned(), ms)),
        );
        row.extend([share, pass.n_run.to_string(), pass.n_skipped.to_string()]);
        row.extend([
            pass.saved_ms.map_or("-".to_owned(), ms),
            pass.reason.clone().unwrap_or_default(),
        ]);
        rows.push(row);
    }
    rows
}

fn ms(value: f64) -> String {
    format!("{value:.3}")
}
