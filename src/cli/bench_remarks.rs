//! The remarks above and below the tables of `nimbus bench`.

use super::output::or_dash;
use crate::gpu::PassTimes;
use crate::measure::blocked::N_STARTS_NEEDED;
use crate::measure::figure::Figure;
use crate::measure::stats::extremes;
use crate::timing::N_FRAMES_NEEDED;
use crate::timing::check::{Bounded, CheckVerdict};
use crate::timing::machine::Clocks;
use crate::timing::overlap::Overlap;
use crate::timing::precision::{Limit, PrecisionRecord};
use crate::timing::records::{Case, Mode, Run, Skipping};
use crate::timing::state::{remark_lines, run_line};
use crate::timing::still::{NO_RATIO, StillRemark, empty_frames_text};

/// Returns a time in ms with three decimals.
pub fn ms(value: f64) -> String {
    format!("{value:.3}")
}

/// Returns the frame time of a perfect overlap, and the share of that gain which was reached.
pub fn overlap_lines(o: &Overlap, case: &Case) -> String {
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
                    overlapped, too, or the machine changed from block to block\n";
        }
        if r.share < 0.9 {
            out += &slowed_line(o, case).unwrap_or_default();
        }
    } else if o.parallel_ms.is_some() {
        out += "that is too little, or too uncertain, for a share of it\n";
    }
    out
}

/// Returns a remark if the steps slow each other down, so that overlap gains less than it could.
fn slowed_line(o: &Overlap, case: &Case) -> Option<String> {
    let skip = case.modes.iter().any(|m| m.skip);
    let parallel = case.modes.iter().find(|m| m.threading == "parallel" && m.skip == skip)?;
    let (game, render) = (parallel.game_ms?.of.p50, parallel.render_ms?.of.p50);
    // Smaller changes are within the intervals of short runs.
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

/// Returns remarks on loops whose blocks differ as much as the two loops do, or by a tenth.
pub fn spread_lines(case: &Case) -> String {
    let effect = case.ratio.map_or(f64::INFINITY, |r| r.parallel_by_serial.ln().abs());
    let of = |m: &Mode| {
        let spread = m.block_spread.filter(|s| s.ln() >= effect || *s >= 1.1)?;
        Some(format!(
            "{}: blocks lie a factor of {spread:.3} apart: the machine was not steady\n",
            m.name()
        ))
    };
    case.modes.iter().filter_map(of).collect()
}

/// Returns the latency of both loops, which is the cost of overlap.
pub fn latency_line(case: &Case) -> Option<String> {
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

/// Returns the number of particles drawn, if a frame left some out.
pub fn drawn_line(case: &Case) -> Option<String> {
    let [least, mean, most] = case.modes.iter().find(|m| m.skip)?.drawn?;
    let n = case.particles;
    (mean < n as f64)
        .then(|| format!("drawn: {mean:.0} of {n} particles a frame, {least:.0} to {most:.0}\n"))
}

/// Returns what skipping saved.
pub fn skipping_line(s: &Skipping) -> String {
    let bytes = match s.same_bytes {
        Some(true) => "; same bytes",
        Some(false) => "; NOT THE SAME BYTES",
        None => "",
    };
    let (with, without) = (ms(s.gpu_ms), ms(s.gpu_no_skip_ms));
    let saved = s.gpu_no_skip_ms - s.gpu_ms;
    if saved <= 0.0 {
        return format!(
            "skipping saves no GPU time here: {with} ms a frame with it, {without} without{bytes}\n"
        );
    }
    let times = if s.gpu_ms > 0.0 {
        format!("{:.1} times less", s.gpu_no_skip_ms / s.gpu_ms)
    } else {
        "nothing is left to do".to_owned()
    };
    format!("skipping saves {} of {without} ms of GPU time a frame ({times}){bytes}\n", ms(saved))
}

/// Returns the precision of the clocks: a time of about this size means little.
pub fn clocks_line(clocks: &Clocks) -> String {
    let device =
        clocks.timestamp_period_ns.map_or("none".to_owned(), |ns| format!("{ns} ns a tick"));
    let empty = clocks
        .timestamp_overhead_ns
        .map_or(String::new(), |ns| format!(", {ns:.0} ns for an empty pass"));
    let (resolution, overhead) = (clocks.resolution_ns, clocks.overhead_ns);
    format!(
        "host clock: resolution {resolution} ns, {overhead:.0} ns a reading; device timestamps: \
         {device}{empty}\npasses: {}\n",
        pass_times_text(clocks.pass_times)
    )
}

/// Returns how passes were timed, and what that costs or hides.
pub fn pass_times_text(how: PassTimes) -> &'static str {
    match how {
        PassTimes::Drained => {
            "timed one by one, the device idles between two (--pass-times drained)"
        }
        PassTimes::Overlapping => {
            "timed without waits between them, their times may overlap (--pass-times overlapping)"
        }
        PassTimes::Off => "not timed (--pass-times off)",
    }
}

/// Returns what disturbed the times; with `verbose` also the readings of the machine's state.
pub fn state_lines(run: &Run, verbose: bool) -> String {
    let Some(state) = &run.state else { return String::new() };
    let readings = if verbose { run_line(state) } else { String::new() };
    readings + &remark_lines(state)
}

/// Returns the lines that come before all tables if nothing moves in a case.
pub fn still_lines(run: &Run) -> String {
    let Some(remark) = StillRemark::of(run) else { return String::new() };
    let StillRemark { scope, reason, figure, advice } = remark;
    format!("NOTHING MOVES{scope}: {reason}\n{figure}\n{advice}\n\n")
}

/// Returns why a case that stands still has no ratio of its loops.
pub fn still_line(case: &Case) -> String {
    case.ratio.map_or(String::new(), |_| format!("parallel / serial is not given: {NO_RATIO}\n"))
}

/// Returns how many frames drew nothing, if some did but less than half.
pub fn empty_line(case: &Case) -> Option<String> {
    let text = empty_frames_text(case).filter(|_| !case.is_still())?;
    Some(format!("{text}: nothing moved in them\n"))
}

/// Returns a line for each kind of figure that a table shows as "-", with the reason.
pub fn missing_lines(run: &Run) -> String {
    let mut lines: Vec<String> = Vec::new();
    let mut add = |line: String| {
        if !lines.contains(&line) {
            lines.push(line);
        }
    };
    let lacks_interval = |m: &Mode| m.frame_ms.is_some_and(|m| m.p50_low.is_none());
    let few = run.modes().filter(|(_, m)| lacks_interval(m) && m.frames < N_FRAMES_NEEDED);
    if let Some(least) = few.map(|(_, m)| m.frames).min() {
        add(format!(
            "low, high: - : an interval needs {N_FRAMES_NEEDED} timed frames of a loop, found \
             {least}; --frames or --repeat gives more"
        ));
    }
    for (case, mode) in run.modes() {
        if mode.frames == 0 {
            let why = match case.state.as_ref().map_or(0, |state| state.n_discarded) {
                0 => "the run ended before",
                _ => "the device was throttled in all of them (--discard-throttled)",
            };
            add(format!("{}: no timed frame: {why}", mode.name_in(case)));
        } else if lacks_interval(mode) && mode.frames >= N_FRAMES_NEEDED {
            let n_starts = run.n_starts();
            let why = if (2..N_STARTS_NEEDED).contains(&n_starts) {
                format!("an interval over starts needs {N_STARTS_NEEDED}, found {n_starts}")
            } else {
                "the times differ too much for an interval".to_owned()
            };
            add(format!("low, high: - : {why}"));
        }
        if mode.frames > 0 && mode.gpu_ms.is_none() {
            let why = match run.clocks.pass_times {
                PassTimes::Off => "passes are not timed (--pass-times off)",
                _ => "this device has no timestamps",
            };
            add(format!("gpu, passes: - : {why}"));
        }
    }
    let has_saved = run.cases.iter().any(|c| c.modes.iter().any(|m| !m.skip));
    if !has_saved {
        add("saved: - : the loop without skipping was not timed (--no-saved)".to_owned());
    }
    lines.into_iter().map(|line| line + "\n").collect()
}

/// Returns how narrow the intervals are, if a precision was asked for.
pub fn precision_lines(run: &Run) -> String {
    let Some(PrecisionRecord { wanted, limit_s, .. }) = run.precision else { return String::new() };
    let percent = |share: f64| format!("±{:.2} %", 100.0 * share);
    let asked = percent(wanted);
    let cases = || run.cases.iter().filter_map(|case| Some((case, case.precision?)));
    let mut out = String::new();
    for (case, reached) in cases().filter(|(_, reached)| reached.ended_by.is_some()) {
        let name =
            if case.name().is_empty() { String::new() } else { format!("{}: ", case.name()) };
        let (found, rounds) = (or_dash(reached.reach, percent), reached.rounds);
        let why = match reached.ended_by {
            Some(Limit::Memory) => "more frames would not fit in memory".to_owned(),
            _ => format!("further rounds would take longer than --time-limit {limit_s}"),
        };
        out += &format!(
            "{name}PRECISION NOT REACHED: {found} after {rounds} rounds, {asked} wanted; {why}\n"
        );
    }
    let reached = cases().filter(|(_, reached)| reached.ended_by.is_none());
    let widest = reached.clone().filter_map(|(_, r)| r.reach).reduce(f64::max);
    if let Some(widest) = widest {
        let rounds = reached.map(|(_, r)| r.rounds);
        let rounds = match extremes(rounds.map(f64::from)) {
            Some((least, most)) if least < most => format!("{least} to {most} rounds"),
            Some((_, most)) => format!("{most} rounds"),
            None => "no round".to_owned(),
        };
        let widest = percent(widest);
        out +=
            &format!("precision: intervals of {widest} at most after {rounds}, {asked} wanted\n");
    }
    out
}

/// Returns an RMSE with its interval.
fn rmse_text(rmse: Figure) -> String {
    let interval = rmse.low.zip(rmse.high);
    let interval = interval.map(|(low, high)| format!(" ({low:.1e} to {high:.1e})"));
    format!("{:.2e}{}", rmse.value, interval.unwrap_or_default())
}

/// Returns two lines about the error of a case's picture: how far it is from its reference, and
/// whether that is right. `failed` are the stages that the device computes wrongly.
pub fn error_lines(case: &Case, failed: &[String]) -> String {
    let Some(check) = &case.check else { return String::new() };
    let reason = check.reason.as_deref().unwrap_or_default();
    if check.verdict == CheckVerdict::NotChecked {
        return format!("error: NOT CHECKED against f64: {reason}\n");
    }
    let settings = check.settings_rms.filter(|rms| *rms > 0.0);
    let settings = settings.map(|rms| format!("; the settings of `draw` make {rms:.1e} of it"));
    let out = format!(
        "error: RMSE {} against f64, at most {}, over {} pixels of frame {}{}\n",
        or_dash(check.rmse, rmse_text),
        or_dash(check.max, |max| format!("{max:.1e}")),
        check.n_pixels,
        or_dash(check.frame, |frame| frame.to_string()),
        settings.unwrap_or_default(),
    );
    if check.is_wrong() {
        return out + &format!("THE PICTURE IS WRONG: {reason}\n");
    }
    let drawing = check.drawing.map(|d| {
        let (rms, n, most) = (d.rms, d.n_beyond, d.most_beyond);
        format!("drawing off by {rms:.1e}, {n} pixels beyond rounding of {most} allowed")
    });
    let light = check
        .light
        .map(|Bounded { rms, bound }| format!("light off by {rms:.1e} of {bound:.1e} allowed"));
    let reason = Some(reason.to_owned()).filter(|reason| !reason.is_empty());
    let parts: Vec<String> = [drawing, light, reason].into_iter().flatten().collect();
    let verdict = match failed {
        [] => "the picture is right".to_owned(),
        _ => format!(
            "THE DEVICE IS WRONG in {}; the picture is within its bounds",
            failed.join(", ")
        ),
    };
    out + &format!("{verdict}: {}\n", parts.join("; "))
}
