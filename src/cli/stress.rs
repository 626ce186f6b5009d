//! `nimbus stress [CASE…]`.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::Serialize;
use serde_json::json;

use super::args::StressArgs;
use super::interrupt::{self, PATIENCE, graceful_stop};
use super::output::{self, header};
use super::progress::progress;
use crate::error::{Error, Result};
use crate::frame::DeviceChoice;
use crate::gpu::DeviceOptions;
use crate::io::suggestion;
use crate::stress::{Case, Outcome, StressContext, Verdict, Worst, cases};
use crate::timing::machine::{self, Device};

/// Version of the output of `--json`, which docs/reference/schemas/stress.schema.json describes.
const SCHEMA_VERSION: u32 = 1;

/// Runs `nimbus stress`.
///
/// # Errors
/// Fails if no case has such a name, the device fails, a case fails, or Ctrl-C came.
pub fn run(args: &StressArgs) -> Result<()> {
    let chosen = chosen(&args.cases)?;
    if args.list {
        return output::text(&list(args, &chosen));
    }
    let choice = DeviceChoice {
        device: args.device.clone(),
        shaders: args.shaders.clone(),
        validation: args.validation,
        options: DeviceOptions {
            limits: args.limits.clone(),
            guard: args.guard,
            max_submit_ms: args.max_submit_ms,
            ..DeviceOptions::default()
        },
    };
    let mut context = StressContext::open(&choice)?;
    let stop = graceful_stop();
    let bar = progress(chosen.len() as u64, "cases", args.quiet);
    let device = machine::device_record(context.device().info());
    let done = Arc::new(Mutex::new(Vec::<Outcome>::new()));
    let mut keeping = {
        let (args, device, done) = (args.clone(), device.clone(), done.clone());
        interrupt::keep(PATIENCE, move || {
            print(&args, &device, &lock(&done), true).err().unwrap_or(Error::Interrupted)
        })
    };
    for case in &chosen {
        if stop.load(Ordering::Relaxed) {
            break;
        }
        bar.set_name(case.name);
        let outcome = case.run(&mut context);
        lock(&done).push(outcome);
        bar.advance();
    }
    keeping.finish();
    drop(bar);
    let done = std::mem::take(&mut *lock(&done));
    let interrupted = done.len() < chosen.len();
    print(args, &device, &done, interrupted)?;
    context.close()?;
    if interrupted { Err(Error::Interrupted) } else { judged(&done) }
}

fn lock(done: &Mutex<Vec<Outcome>>) -> MutexGuard<'_, Vec<Outcome>> {
    done.lock().unwrap_or_else(PoisonError::into_inner)
}

fn print(args: &StressArgs, device: &Device, done: &[Outcome], interrupted: bool) -> Result<()> {
    output::text(&if args.json {
        output::json_text(&json!({
            "schema": SCHEMA_VERSION, "nimbus": env!("CARGO_PKG_VERSION"),
            "revision": machine::revision(), "date": machine::utc_now(), "device": device,
            "cpu": machine::cpu(), "interrupted": interrupted, "cases": done,
        }))?
    } else if args.csv {
        csv(done)?
    } else {
        text(device, done, interrupted)
    })
}

/// Returns the families with a line each, the cases of one family with a line each, or all about
/// single cases.
fn list(args: &StressArgs, chosen: &[Case]) -> String {
    let families: Vec<&[Case]> = chosen.chunk_by(|a, b| a.family() == b.family()).collect();
    if args.cases.is_empty() {
        let mut rows = header(["family", "cases", "for example"]);
        rows.extend(families.iter().filter_map(|cases| {
            let first = cases.first()?;
            let (family, n) = (first.family().to_owned(), cases.len().to_string());
            Some(vec![family, n, shortened(first.what, LINE)])
        }));
        let more = "`nimbus stress --list FAMILY` lists them, `nimbus stress FAMILY` runs them.";
        return format!("{}\n{} cases.\n{more}\n", left_aligned(&rows), chosen.len());
    }
    if chosen.len() > 1 {
        let rows: Vec<Vec<String>> =
            chosen.iter().map(|c| vec![c.name.to_owned(), shortened(c.what, LINE)]).collect();
        let more = "`nimbus stress --list CASE` shows all about a case and its bound.";
        return format!("{}\n{more}\n", left_aligned(&rows));
    }
    let text = |c: &Case| format!("{}\n    {}\n    allowed: {}\n", c.name, c.what, c.bound);
    chosen.iter().map(text).collect()
}

/// Characters of a description in a list, which leave a line of 80 its name.
const LINE: usize = 44;

/// Cuts a text at a word to at most `n` characters.
fn shortened(text: &str, n: usize) -> String {
    if text.chars().count() <= n {
        return text.to_owned();
    }
    let cut: String = text.chars().take(n - 1).collect();
    format!("{}…", cut.rsplit_once(' ').map_or(cut.as_str(), |(words, _)| words))
}

/// Returns rows as a table with all columns to the left.
fn left_aligned(rows: &[Vec<String>]) -> String {
    let width = |i: usize| rows.iter().filter_map(|r| r.get(i)).map(|t| t.chars().count()).max();
    let line = |row: &Vec<String>| {
        let cells = row.iter().enumerate();
        let cells = cells.map(|(i, text)| format!("{text:width$}", width = width(i).unwrap_or(0)));
        format!("{}\n", cells.collect::<Vec<_>>().join("  ").trim_end())
    };
    rows.iter().map(line).collect()
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
        let names: Vec<&str> = families.iter().copied().chain(all.iter().map(|c| c.name)).collect();
        let near = suggestion(unknown, &names);
        return Err(Error::usage(format!(
            "no case begins with \"{unknown}\"{near} expected one of `nimbus stress --list`, or \
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

fn csv(cases: &[Outcome]) -> Result<String> {
    let names = [
        "name", "verdict", "n", "n_beyond", "at", "value", "truth", "error", "bound", "remark",
        "seconds",
    ];
    output::csv_rows(&names, cases.iter().map(csv_row))
}

fn csv_row(o: &Outcome) -> impl Serialize {
    let worst = |value: fn(&Worst) -> f64| o.worst.as_ref().map(value);
    let at = o.worst.as_ref().map(|w| &w.at);
    let (value, truth) = (worst(|w| w.value), worst(|w| w.truth));
    let (error, bound) = (worst(|w| w.error), worst(|w| w.bound));
    let (name, remark) = (&o.name, &o.remark);
    (name, o.verdict, o.n, o.n_beyond, at, value, truth, error, bound, remark, o.seconds)
}

/// Returns the table for people.
fn text(device: &Device, cases: &[Outcome], interrupted: bool) -> String {
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
    rows.extend(cases.iter().map(of));
    let count = |verdict: Verdict| cases.iter().filter(|o| o.verdict == verdict).count();
    let mut out = format!("{} ({}), {}\n\n", device.name, device.driver, machine::cpu().model);
    out += &output::table(&rows);
    for o in cases.iter().filter(|o| o.verdict != Verdict::Passed || o.remark.is_some()) {
        let beyond: &str = &match (&o.worst, o.verdict) {
            (Some(w), Verdict::Failed) => {
                format!("{} of {} out of bound; at {}", o.n_beyond, o.n, w.at)
            }
            (None, Verdict::Failed) => "nothing was compared".to_owned(),
            _ => String::new(),
        };
        let mut words = [beyond, o.remark.as_deref().unwrap_or_default()].to_vec();
        words.retain(|w| !w.is_empty());
        out += &format!("\n{}: {}", o.name, words.join("; "));
    }
    let seconds: f64 = cases.iter().map(|o| o.seconds).sum();
    out += &format!(
        "\n\n{} passed, {} failed, {} broken, {} not on this device; {seconds:.1} s{}\n",
        count(Verdict::Passed),
        count(Verdict::Failed),
        count(Verdict::Broken),
        count(Verdict::NotHere),
        if interrupted { "; INTERRUPTED" } else { "" }
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
    let bad = cases.iter().filter(|o| o.verdict.is_bad());
    let bad: Vec<&str> = bad.map(|o| o.name.as_str()).collect();
    if bad.is_empty() {
        return Ok(());
    }
    Err(Error::Check {
        what: format!("{} of {} cases failed: {}", bad.len(), cases.len(), bad.join(", ")),
    })
}
