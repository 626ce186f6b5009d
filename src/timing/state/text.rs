//! The state of the machine in words.

use super::record::{CaseState, RunState, Spread, ThrottleCount};
use super::rules::{LEAST_CLOCK, MOST_LOAD, MOST_OTHERS, is_slowdown};

/// Returns sentences about what may have disturbed the times of `n_frames` timed frames.
pub(super) fn remarks(run: &RunState, n_frames: usize, n_cores: usize) -> Vec<String> {
    let all = &run.all;
    let mut out = Vec::new();
    if all.n_slow_clock > 0 {
        let clock = if run.clock == "cpu" { all.cpu_mhz } else { all.gpu_mhz };
        let median = clock.map_or(String::new(), |c| format!(" of {:.0} MHz", c.median));
        out.push(format!(
            "{} of {n_frames} timed frames ran below {:.0} % of the run's median clock{median}",
            all.n_slow_clock,
            100.0 * LEAST_CLOCK,
        ));
    }
    let named = |is_of: fn(&str) -> bool| {
        let counts: &[ThrottleCount] = all.throttle.as_deref().unwrap_or_default();
        let names = counts.iter().map(|c| c.reason.as_str()).filter(|reason| is_of(reason));
        names.collect::<Vec<_>>().join(", ")
    };
    if all.n_slowdown > 0 {
        out.push(format!(
            "heat or a fault of the power supply held the clock down in {} of {n_frames} timed \
             frames ({})",
            all.n_slowdown,
            named(is_slowdown),
        ));
    }
    if all.n_discarded > 0 {
        out.push(format!(
            "{} of {n_frames} timed frames are in no statistic (--discard-throttled)",
            all.n_discarded
        ));
    } else if all.n_slow_clock + all.n_slowdown > 0 {
        out.push("these frames are in the statistics; --discard-throttled leaves them out".into());
    }
    if all.n_limited > 0 {
        out.push(format!(
            "a limit of power or current held the clock down in {} of {n_frames} timed frames ({})",
            all.n_limited,
            named(|reason| !is_slowdown(reason)),
        ));
    }
    if let Some(drift) = run.drift.filter(|drift| drift.drifts) {
        out.push(format!(
            "the clock drifts: in the last third of the run it is {:.3} of that in the first third \
             (95 % interval {:.3} to {:.3})",
            drift.last_by_first, drift.low, drift.high
        ));
    }
    if let Some(n) = run.cpu_throttles.filter(|n| *n > 0) {
        out.push(format!("heat held the processor's clock down {n} times during the run"));
    }
    if let Some(share) = all.others_share.filter(|share| *share > MOST_OTHERS) {
        let percent = 100.0 * share;
        out.push(format!("other processes took {percent:.0} % of the processors' time"));
    }
    if let Some(load) = run.load_at_start.filter(|load| *load > MOST_LOAD * n_cores as f64) {
        out.push(format!("the load was {load:.1} on {n_cores} cores when the run began"));
    }
    if let Some(governor) = run.governor.as_ref().filter(|name| *name != "performance") {
        out.push(format!(
            "the processors' governor is {governor}, not performance: their clock follows the load"
        ));
    }
    out
}

/// Returns a line for each remark on a run; empty if there is nothing to say.
pub fn remark_lines(run: &RunState) -> String {
    run.remarks.iter().map(|remark| format!("state: {remark}\n")).collect()
}

/// Returns a line with the readings of a run.
pub fn run_line(run: &RunState) -> String {
    let mut parts = vec![format!("{} readings", run.all.n_readings)];
    if !run.sources.is_empty() {
        parts[0] += &format!(" from {}", run.sources.join(", "));
    }
    parts.extend(readings(&run.all));
    parts.extend(run.governor.as_ref().map(|governor| format!("governor {governor}")));
    parts.extend(run.turbo.map(|on| format!("turbo {}", if on { "on" } else { "off" })));
    parts.extend(run.load_at_start.map(|load| format!("load {load:.2} at the start")));
    format!("state: {}\n", parts.join("; "))
}

/// Returns a line with the readings of a case; none without a reading.
pub fn case_line(case: &CaseState) -> Option<String> {
    let parts = readings(case);
    (!parts.is_empty()).then(|| format!("state: {}\n", parts.join("; ")))
}

/// Returns phrases with what was read.
fn readings(case: &CaseState) -> Vec<String> {
    let of = |what: &str, spread: Option<Spread>, unit: &str| {
        let Spread { median, min, max } = spread?;
        let range = if min < max { format!(" ({min:.0} to {max:.0})") } else { String::new() };
        Some(format!("{what}{median:.0}{range} {unit}"))
    };
    let mib = |bytes: u64| format!("{:.0} MiB", bytes as f64 / f64::from(1 << 20));
    let own = case.peak_own_bytes.map(|bytes| format!("{} of nimbus", mib(bytes)));
    let process = case.peak_process_bytes.map(|bytes| format!("{} of the process", mib(bytes)));
    let memory: Vec<String> = own.into_iter().chain(process).collect();
    let memory = (!memory.is_empty()).then(|| format!("device memory {}", memory.join(", ")));
    let reason = |count: &ThrottleCount| format!("{} in {} readings", count.reason, count.n);
    let throttle = case.throttle.as_ref().map(|reasons| match &reasons[..] {
        [] => "never throttled".to_owned(),
        reasons => {
            format!("throttled by {}", reasons.iter().map(reason).collect::<Vec<_>>().join(", "))
        }
    });
    let others = case
        .others_share
        .map(|share| format!("other processes {:.1} % of the time", 100.0 * share));
    [
        of("GPU ", case.gpu_mhz, "MHz"),
        of("its memory ", case.gpu_memory_mhz, "MHz"),
        of("", case.gpu_c, "°C"),
        of("", case.gpu_w, "W"),
        of("processor ", case.cpu_mhz, "MHz"),
        throttle,
        memory,
        others,
    ]
    .into_iter()
    .flatten()
    .collect()
}
