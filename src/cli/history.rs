//! `nimbus history DIR…`: a series of results, and where it changes.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde_json::json;

use super::args::HistoryArgs;
use super::compare_sides::{line, side};
use super::output::{self, claim_file, interval, or_dash, wrote};
use super::revisions::{Repository, Revision, next_to_measure};
use crate::error::{Error, Result};
use crate::io::atomic;
use crate::report::pages::{HistoryRun, history_page};
use crate::timing::compare::HEADLINE;
use crate::timing::difference::{Condition, differences, wrong_text};
use crate::timing::history::{LEAST_RUNS, NamedFigure, Series, SeriesChange, figures, history};
use crate::timing::records::Run;
use crate::timing::results::{BenchResults, read_results};

/// Version of the output of `--json`. A change of a key or of its meaning raises it.
const REPORT_SCHEMA: u32 = 1;
/// Most runs: five years of nights.
const MOST_RUNS: usize = 2000;

/// A run of the series.
struct Entry {
    folder: PathBuf,
    run: Run,
    figures: Vec<NamedFigure>,
}

/// Runs `nimbus history`.
///
/// # Errors
/// Fails if results cannot be read, differ in a condition that is not allowed, the page cannot be
/// written, or nothing can be bisected.
pub fn run(args: &HistoryArgs) -> Result<()> {
    if args.runs.len() > MOST_RUNS {
        let n = args.runs.len();
        return Err(Error::limit(format!("{n} results, expected at most {MOST_RUNS}")));
    }
    let page = args.output.as_ref();
    if let Some(path) = page.filter(|path| path.extension().is_none_or(|e| e != "html")) {
        let path = path.display();
        return Err(Error::usage(format!("{path}: expected a file name that ends in .html")));
    }
    check_folders(&args.runs)?;
    let repository = Repository::new(args.repo.as_deref().unwrap_or(Path::new(".")));
    if args.repo.is_some() {
        repository.check()?;
    }
    let _claim = page.map(|path| claim_file(path, args.force)).transpose()?;
    let mut entries = Vec::new();
    for folder in &args.runs {
        let results = read_results(folder)?;
        // The frames of all runs together may not fit in memory, and are not needed.
        let figures = figures(&results);
        let BenchResults { run, .. } = results;
        entries.push(Entry { folder: folder.clone(), run, figures });
    }
    check_conditions(args, &entries)?;
    let by_revision = sort(&mut entries, &repository);
    let all: Vec<Vec<NamedFigure>> = entries.iter().map(|e| e.figures.clone()).collect();
    let series = history(&all);
    let next = if args.bisect { Some(bisect(&entries, &series, &repository)?) } else { None };
    if let Some(path) = page {
        let runs: Vec<HistoryRun> = entries.iter().map(history_run).collect();
        let text = history_page(&runs, &series)?;
        atomic::write_atomic(path, |file| file.write_all(text.as_bytes()))?;
        wrote(path, &format!("{} runs on one page", runs.len()), args.quiet);
    }
    if args.json {
        let sides: Vec<_> = entries.iter().map(|e| side(&e.folder, &e.run)).collect();
        return output::object(&json!({
            "schema": REPORT_SCHEMA, "runs": sides,
            "order": if by_revision { "revision" } else { "date" },
            "remarks": remarks(&entries), "series": series,
            "next": next.map(|next| next.json()),
        }));
    }
    let mut out = runs_text(&entries, by_revision);
    remarks(&entries).iter().for_each(|remark| out += &format!("{remark}\n"));
    for of in &series {
        out += &format!("\n{}", series_text(of, &entries));
    }
    out += &next.map_or(String::new(), |next| format!("\n{}", next.text()));
    output::text(&out)
}

/// Refuses a folder that is named twice: its run would count as two that agree.
fn check_folders(folders: &[PathBuf]) -> Result<()> {
    let mut known: BTreeMap<PathBuf, &Path> = BTreeMap::new();
    for folder in folders {
        // A folder that is not there is reported when it is read.
        let Ok(place) = folder.canonicalize() else { continue };
        if let Some(other) = known.insert(place, folder) {
            let (a, b) = (other.display(), folder.display());
            let what = format!("{a} and {b} are one folder; name each run once");
            return Err(Error::usage(what));
        }
    }
    Ok(())
}

/// Returns sentences about runs that may mislead.
fn remarks(entries: &[Entry]) -> Vec<String> {
    let of = |(i, entry): (usize, &Entry)| {
        let run = &entry.run;
        let cut = run.interrupted.then(|| "interrupted: its last block is incomplete".to_owned());
        let cold =
            run.cold_bytes.map(|_| "cold caches, so its frame times are left out".to_owned());
        let all = [cut, cold, wrong_text(run)].into_iter().flatten();
        all.map(move |text| format!("run {i}: {text}")).collect::<Vec<String>>()
    };
    entries.iter().enumerate().flat_map(of).collect()
}

/// Refuses runs whose times cannot be compared. Builds differ in a history.
fn check_conditions(args: &HistoryArgs, entries: &[Entry]) -> Result<()> {
    let Some((first, others)) = entries.split_first() else { return Ok(()) };
    for other in others {
        let found = differences(&first.run, &other.run);
        let refused: Vec<String> = found
            .iter()
            .filter(|d| d.kind != Condition::Build && !args.allow.contains(&d.kind))
            .map(|d| format!("\n  {}", line(d)))
            .collect();
        if !refused.is_empty() {
            let (a, b) = (first.folder.display(), other.folder.display());
            return Err(Error::usage(format!(
                "{a} and {b} were measured under different conditions; leave one out, or --allow \
                 device,scene takes all{}",
                refused.concat()
            )));
        }
    }
    Ok(())
}

/// Sorts the runs by revision, and those of one revision by date. Returns whether the revisions are
/// known; otherwise the order is that of dates.
fn sort(entries: &mut Vec<Entry>, repository: &Repository) -> bool {
    let revisions: Vec<&str> = entries.iter().map(|e| e.run.revision.as_str()).collect();
    let places = repository.places(&revisions);
    let is_known = places.is_some();
    let places = places.unwrap_or_else(|| vec![0; entries.len()]);
    let mut placed: Vec<(usize, Entry)> = places.into_iter().zip(entries.drain(..)).collect();
    placed.sort_by(|(i, a), (j, b)| (i, &a.run.date).cmp(&(j, &b.run.date)));
    entries.extend(placed.into_iter().map(|(_, entry)| entry));
    is_known
}

fn history_run(entry: &Entry) -> HistoryRun {
    HistoryRun {
        folder: entry.folder.display().to_string(),
        date: entry.run.date.clone(),
        revision: entry.run.revision.clone(),
    }
}

fn runs_text(entries: &[Entry], by_revision: bool) -> String {
    let mut rows = output::header(["run", "revision", "date", "folder"]);
    for (i, entry) in entries.iter().enumerate() {
        let folder = entry.folder.display().to_string();
        rows.push(vec![i.to_string(), entry.run.revision.clone(), entry.run.date.clone(), folder]);
    }
    let order = if by_revision {
        "in the order of revisions"
    } else {
        "in the order of dates; --repo names a checkout that has all revisions"
    };
    let n = entries.len();
    let runs = if n == 1 { "run" } else { "runs" };
    format!("{n} {runs} {order}\n{}", output::table(&rows))
}

/// Returns the table of a series, with its changes between its runs.
fn series_text(of: &Series, entries: &[Entry]) -> String {
    let title = [of.quantity, of.unit, &of.name].into_iter().filter(|text| !text.is_empty());
    let title = title.collect::<Vec<_>>().join(" ");
    let number = |value: f64| match of.unit {
        "" => output::scientific(value),
        _ => format!("{value:.3}"),
    };
    let mut rows = vec![vec![
        title,
        "value".to_owned(),
        "95 % within the run".to_owned(),
        "level".to_owned(),
        "change".to_owned(),
    ]];
    for point in &of.points {
        let change = of.changes.iter().find(|change| change.run == point.run);
        rows.push(vec![
            point.run.to_string(),
            number(point.figure.value),
            interval(Some(point.figure), number),
            number(point.level),
            or_dash(change, |change| change_text(change, entries)),
        ]);
    }
    let mut out = output::table(&rows);
    let n = of.points.len();
    if n < LEAST_RUNS {
        out += &format!("{n} of the {LEAST_RUNS} runs that a change needs to be found\n");
    } else if of.changes.is_empty() {
        out += "no change beyond the noise\n";
    }
    out
}

fn change_text(change: &SeriesChange, entries: &[Entry]) -> String {
    let by = change.by;
    let [first, last] = change.runs;
    let place = if first == last {
        format!("at {}", entries[first].run.revision)
    } else {
        format!("between run {} and run {last}", first.saturating_sub(1))
    };
    format!("× {:.3} ({:.3} to {:.3}) {place}", by.estimate, by.low, by.high)
}

/// What a bisection says.
enum Next {
    /// No frame time changed.
    NoChange,
    /// The revision to measure next, with the number of those that are left.
    Measure { revision: Revision, n_left: usize, name: String },
    /// The revision that brought the change.
    Found { revision: Revision, name: String },
}

impl Next {
    fn text(&self) -> String {
        match self {
            Next::NoChange => "bisect: no frame time has changed\n".to_owned(),
            Next::Measure { revision: Revision { hash, subject }, n_left, name } => format!(
                "bisect: measure {hash} next ({subject})\nit lies in the middle of {n_left} \
                 revisions that may have brought the last change of {name}\ncheck it out, build, \
                 run the bench of the others into a folder of its own, and add that folder here\n"
            ),
            Next::Found { revision: Revision { hash, subject }, name } => format!(
                "bisect: {hash} brought the last change of {name} ({subject}); no revision \
                 between the runs is left\n"
            ),
        }
    }

    fn json(&self) -> serde_json::Value {
        match self {
            Next::NoChange => json!({ "found": false }),
            Next::Measure { revision, n_left, name } => json!({
                "found": false, "series": name, "measure": revision.hash,
                "subject": revision.subject, "n_left": n_left,
            }),
            Next::Found { revision, name } => json!({
                "found": true, "series": name, "revision": revision.hash,
                "subject": revision.subject,
            }),
        }
    }
}

/// Returns what to measure next to find the revision of the last change of a frame time; of several
/// at the same run, the most certain one.
fn bisect(entries: &[Entry], series: &[Series], repository: &Repository) -> Result<Next> {
    let changes = series.iter().filter(|of| of.quantity == HEADLINE);
    let changes = changes.flat_map(|of| of.changes.iter().map(move |change| (of, change)));
    let last = changes.max_by(|(_, a), (_, b)| a.run.cmp(&b.run).then_with(|| b.p.total_cmp(&a.p)));
    let Some((of, change)) = last else { return Ok(Next::NoChange) };
    let revision = |run: usize| entries[run].run.revision.as_str();
    let between = repository.between(revision(change.after), revision(change.run))?;
    let measured: Vec<&str> = entries.iter().map(|e| e.run.revision.as_str()).collect();
    let name = of.name.clone();
    match next_to_measure(&between, &measured) {
        Ok(next) => {
            let n_left = between.len();
            Ok(Next::Measure { revision: next.clone(), n_left, name })
        }
        Err(Some(found)) => Ok(Next::Found { revision: found.clone(), name }),
        Err(None) => Err(Error::usage(format!(
            "the runs before and after the last change of {name} measured one revision, {}: the \
             machine changed, not the program",
            revision(change.run)
        ))),
    }
}
