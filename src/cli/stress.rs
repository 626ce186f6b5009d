//! `nimbus stress [CASE…]`.

use std::sync::atomic::Ordering;

use serde::Serialize;

use super::args::StressArgs;
use super::interrupt::graceful_stop;
use super::output::{self, header};
use super::progress::progress;
use crate::error::{Error, Result};
use crate::frame::DeviceChoice;
use crate::stress::{Case, Outcome, StressContext, Verdict, cases};
use crate::timing::machine::{self, Cpu, Device};

/// The output of `--json`, which docs/reference/schemas/stress.schema.json describes.
#[derive(Debug, Serialize)]
struct Report {
    schema: u32,
    nimbus: &'static str,
    revision: &'static str,
    date: String,
    device: Device,
    cpu: Cpu,
    interrupted: bool,
    cases: Vec<Outcome>,
}

const SCHEMA_VERSION: u32 = 1;

/// Runs `nimbus stress`.
///
/// # Errors
/// Fails if no case has such a name, the device fails, a case fails, or Ctrl-C came.
pub fn run(args: &StressArgs) -> Result<()> {
    let chosen = chosen(&args.cases)?;
    if args.list {
        let text = |c: &Case| format!("{}\n    {}\n    allowed: {}\n", c.name, c.what, c.bound);
        return output::text(&chosen.iter().map(text).collect::<String>());
    }
    let choice = DeviceChoice {
        device: args.device.clone(),
        shaders: args.shaders.clone(),
        validation: args.validation,
        poison: false,
    };
    let mut context = StressContext::open(&choice)?;
    let stop = graceful_stop();
    let bar = progress(chosen.len() as u64, "cases", args.quiet);
    let mut done: Vec<Outcome> = Vec::new();
    for case in &chosen {
        if stop.load(Ordering::Relaxed) {
            break;
        }
        bar.set_message(case.name);
        done.push(case.run(&mut context));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let interrupted = done.len() < chosen.len();
    let info = context.device().info().clone();
    let report = Report {
        schema: SCHEMA_VERSION,
        nimbus: env!("CARGO_PKG_VERSION"),
        revision: machine::revision(),
        date: machine::utc_now(),
        device: machine::device_record(&info),
        cpu: machine::cpu(),
        interrupted,
        cases: done,
    };
    match (args.json, args.csv) {
        (true, _) => output::object(&report)?,
        (_, true) => {
            let rows: Vec<_> = report.cases.iter().map(row).collect();
            output::text(&output::rows(&rows, false)?)?;
        }
        _ => output::text(&text(&report))?,
    }
    context.close()?;
    if interrupted { Err(Error::Interrupted) } else { judged(&report.cases) }
}

/// Returns the cases whose names begin with one of `names`; all cases if there are none.
fn chosen(names: &[String]) -> Result<Vec<Case>> {
    let all = cases();
    if let Some(unknown) = names
        .iter()
        .find(|name| name.is_empty() || !all.iter().any(|c| c.name.starts_with(name.as_str())))
    {
        let mut families: Vec<&str> = all.iter().map(Case::family).collect();
        families.dedup();
        return Err(Error::usage(format!(
            "no case begins with \"{unknown}\"; expected one of `nimbus stress --list`, or \
             a family: {}",
            families.join(", ")
        )));
    }
    // A complete name means that case alone, even if other names begin with it.
    let is_whole = |name: &String| all.iter().any(|c| c.name == name);
    let is_meant = |c: &Case| {
        names.iter().any(|n| if is_whole(n) { c.name == n } else { c.name.starts_with(n.as_str()) })
    };
    Ok(all.iter().copied().filter(|c| names.is_empty() || is_meant(c)).collect())
}

/// An outcome as a row of CSV.
#[derive(Debug, Serialize)]
struct CsvRow<'a> {
    name: &'a str,
    verdict: Verdict,
    n: usize,
    n_beyond: usize,
    at: Option<&'a str>,
    value: Option<f64>,
    truth: Option<f64>,
    error: Option<f64>,
    bound: Option<f64>,
    remark: Option<&'a str>,
    seconds: f64,
}

fn row(o: &Outcome) -> CsvRow<'_> {
    let worst = o.worst.as_ref();
    CsvRow {
        name: &o.name,
        verdict: o.verdict,
        n: o.n,
        n_beyond: o.n_beyond,
        at: worst.map(|w| w.at.as_str()),
        value: worst.map(|w| w.value),
        truth: worst.map(|w| w.truth),
        error: worst.map(|w| w.error),
        bound: worst.map(|w| w.bound),
        remark: o.remark.as_deref(),
        seconds: o.seconds,
    }
}

/// Returns the table for people.
fn text(report: &Report) -> String {
    let number = |v: f64| if v == 0.0 { "0".to_owned() } else { format!("{v:.3e}") };
    let of = |o: &Outcome| {
        let worst = o.worst.as_ref().map(|w| {
            let share = if w.error == 0.0 { "0".to_owned() } else { format!("{:.2}", w.share()) };
            [number(w.value), number(w.truth), number(w.error), number(w.bound), share]
        });
        let worst = worst.unwrap_or([const { String::new() }; 5]);
        [vec![o.name.clone(), word(o.verdict).to_owned(), o.n.to_string()], worst.to_vec()].concat()
    };
    let mut rows = header([
        "case",
        "verdict",
        "compared",
        "device",
        "reference",
        "error",
        "bound",
        "error/bound",
    ]);
    rows.extend(report.cases.iter().map(of));
    let count = |verdict: Verdict| report.cases.iter().filter(|o| o.verdict == verdict).count();
    let mut out =
        format!("{} ({}), {}\n\n", report.device.name, report.device.driver, report.cpu.model);
    out += &output::table(&rows);
    for o in report.cases.iter().filter(|o| o.verdict != Verdict::Passed || o.remark.is_some()) {
        let beyond = match (&o.worst, o.verdict) {
            (Some(w), Verdict::Failed) => {
                format!("{} of {} out of bound; at {}", o.n_beyond, o.n, w.at)
            }
            (None, Verdict::Failed) => "nothing was compared".to_owned(),
            _ => String::new(),
        };
        let words: Vec<&str> = [beyond.as_str(), o.remark.as_deref().unwrap_or("")]
            .into_iter()
            .filter(|w| !w.is_empty())
            .collect();
        out += &format!("\n{}: {}", o.name, words.join("; "));
    }
    let seconds: f64 = report.cases.iter().map(|o| o.seconds).sum();
    out += &format!(
        "\n\n{} passed, {} failed, {} broken, {} not on this device; {seconds:.1} s{}\n",
        count(Verdict::Passed),
        count(Verdict::Failed),
        count(Verdict::Broken),
        count(Verdict::NotHere),
        if report.interrupted { "; INTERRUPTED" } else { "" }
    );
    out
}

fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Passed => "passed",
        Verdict::Failed => "FAILED",
        Verdict::Broken => "BROKEN",
        Verdict::NotHere => "not here",
    }
}

/// Fails if a case failed.
fn judged(cases: &[Outcome]) -> Result<()> {
    let bad: Vec<&str> = cases
        .iter()
        .filter(|o| matches!(o.verdict, Verdict::Failed | Verdict::Broken))
        .map(|o| o.name.as_str())
        .collect();
    if bad.is_empty() {
        return Ok(());
    }
    Err(Error::Check {
        what: format!("{} of {} cases failed: {}", bad.len(), cases.len(), bad.join(", ")),
    })
}
