//! `nimbus bench --starts N`: the bench in several processes, one after the other.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use clap::ColorChoice;
use tempfile::TempDir;

use super::args::BenchArgs;
use super::bench::{self, Context, out_dirs};
use super::bench_cases::bench_cases;
use super::bench_record::print_json;
use super::interrupt::{self, PATIENCE_WITH_CHILDREN};
use super::output::{self, wrote_folder};
use super::progress::progress;
use super::{bench_plot, bench_table};
use crate::error::{Error, Result};
use crate::farm::process::{self, IDLE_LIMIT};
use crate::io::console::say;
use crate::io::process_info::command_line;
use crate::io::result_folder::{Existing, ResultFolder};
use crate::io::text_file::{TABLE_LIMIT, read_result};
use crate::timing::attachments::{Attachments, picture_file};
use crate::timing::frame_rows::{FRAMES_FILE, parse_frames};
use crate::timing::json;
use crate::timing::results::{open_results, write_results};
use crate::timing::starts::{Start, join};
use crate::timing::state::{STATE_FILE, parse_rows, rows_text};

/// Runs `nimbus bench`, in this process or in those of `--starts`.
///
/// # Errors
/// Fails as [`bench::run`] does, or if a process fails.
pub fn run(args: &BenchArgs, context: &Context<'_>) -> Result<()> {
    match &args.as_start {
        Some(folder) => bench::run(&of_start(args, folder), context),
        None if args.starts > 1 => run_starts(args, context),
        None => bench::run(args, context),
    }
}

/// Returns the arguments of the process of one start, whose results go to `folder`.
fn of_start(args: &BenchArgs, folder: &Path) -> BenchArgs {
    let mut args = args.clone();
    args.out = Some(folder.to_owned());
    (args.starts, args.force, args.plot, args.json) = (1, false, false, false);
    args
}

/// Runs the bench of a scene in `--starts` processes.
///
/// # Errors
/// Fails if the arguments or the scene are faulty, a process fails, or Ctrl-C came. Starts that
/// ended before are kept.
fn run_starts(args: &BenchArgs, context: &Context<'_>) -> Result<()> {
    if args.scenes.len() > 1 {
        let n = args.scenes.len();
        return Err(Error::usage(format!("--starts takes one scene, found {n}")));
    }
    let out = out_dirs(args)?.into_iter().next().flatten();
    let mut quiet = args.options.clone();
    (quiet.quiet, quiet.verbose) = (true, false);
    let n_cases = bench_cases(args, &args.scenes[0], &quiet)?.cases.len();
    let folder = out
        .map(|dir| open_results(&dir, Existing::new(args.force), n_cases, args.plot))
        .transpose()?;
    let places = tempfile::tempdir().map_err(|cause| Error::io(Path::new("--starts"), cause))?;
    let path = places.path().to_owned();
    let (args, color) = (args.clone(), context.color);
    let ended = Ended { args, color, n_cases, places, folder, starts: vec![] };
    let (n_starts, is_quiet) = (ended.args.starts, ended.args.options.quiet);
    let ended = Arc::new(Mutex::new(Some(ended)));
    let mut keeping = {
        let ended = ended.clone();
        interrupt::keep(PATIENCE_WITH_CHILDREN, move || {
            let kept = lock(&ended).take().map_or(Ok(()), |ended| ended.record(true));
            kept.err().unwrap_or(Error::Interrupted)
        })
    };
    let bar = progress(u64::from(n_starts), "starts", is_quiet);
    let (begin, mut outcome) = (Instant::now(), Ok(()));
    for i in 0..n_starts {
        let place = path.join(i.to_string());
        let begin_s = begin.elapsed().as_secs_f64();
        outcome = start(&place, context, i == 0 && !is_quiet);
        if let Some(ended) = lock(&ended).as_mut() {
            // A start that was cut short has other frames than the others.
            if is_whole(&outcome) || ended.starts.is_empty() {
                ended.starts.extend(read(&place, begin_s)?);
            }
        }
        if outcome.is_err() {
            break;
        }
        bar.advance();
    }
    drop(bar);
    keeping.finish();
    let Some(ended) = lock(&ended).take() else { return outcome };
    let is_cut = !is_whole(&outcome);
    if is_cut && ended.starts.is_empty() && outcome == Err(Error::Interrupted) {
        say!("no frame was finished, nothing is kept");
    }
    if ended.starts.is_empty() { outcome } else { ended.record(is_cut).and(outcome) }
}

/// Whether a start has run all its frames. A wrong picture takes none away.
fn is_whole(outcome: &Result<()>) -> bool {
    matches!(outcome, Ok(()) | Err(Error::Check { .. }))
}

/// The starts that have ended, and where their results go.
struct Ended {
    args: BenchArgs,
    color: ColorChoice,
    n_cases: usize,
    /// The folders of the starts, by their numbers.
    places: TempDir,
    folder: Option<ResultFolder>,
    starts: Vec<Start>,
}

fn lock(ended: &Mutex<Option<Ended>>) -> MutexGuard<'_, Option<Ended>> {
    ended.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Ended {
    /// Writes and prints the results of the starts that have ended; `is_cut` if others are missing.
    fn record(self, is_cut: bool) -> Result<()> {
        let Ended { args, color, n_cases, places, mut folder, starts } = self;
        if starts.is_empty() {
            say!("no start was finished, nothing is kept");
            return Ok(());
        }
        let mut joined = join(&starts)?;
        joined.run.command = command_line();
        joined.run.interrupted |= is_cut;
        let Start { run, table, readings, .. } = joined;
        let written = folder.as_mut().map_or(Ok(()), |folder| {
            let charts = if args.plot { bench_plot::files(&run, &table.rows)? } else { vec![] };
            let copy = |i: usize| {
                let from = places.path().join("0").join(picture_file(i));
                from.exists().then(|| (picture_file(i), from))
            };
            let copies = (0..n_cases).filter_map(copy).collect();
            let mut tables = vec![];
            if !readings.is_empty() {
                tables.push((STATE_FILE.to_owned(), rows_text(&readings)?));
            }
            let attachments = Attachments { charts, copies, tables, ..Attachments::default() };
            write_results(folder, &run, &table, &attachments)
        });
        // The tables appear even where the files cannot be written.
        if !args.json {
            let same: Vec<Option<bool>> = (0..n_cases).map(|i| same_pictures(&starts, i)).collect();
            let text = bench_table::report(&args.scenes[0], &run, &same, args.options.verbose);
            output::text(&text)?;
            if args.plot {
                output::painted(&bench_plot::text(&run, &table.rows, color)?)?;
            }
        }
        written?;
        if let Some(folder) = &folder {
            wrote_folder(folder, !run.interrupted, args.options.quiet);
        }
        print_json(&args, &Arc::new(Mutex::new(vec![run])))
    }
}

/// Returns whether the last frames of a case are the same in all loops and starts; None if fewer
/// than two are known. With impostors only equal loops of the starts are compared.
fn same_pictures(starts: &[Start], i_case: usize) -> Option<bool> {
    let of = |start: &Start| -> Vec<Option<String>> {
        start.run.cases[i_case].modes.iter().map(|mode| mode.image_hash.clone()).collect()
    };
    let all: Vec<Vec<Option<String>>> = starts.iter().map(of).collect();
    let n_known = all.iter().flatten().flatten().count();
    (n_known > 1).then(|| all.windows(2).all(|w| w[0] == w[1]))
}

/// Runs one start. It has the arguments of this process, and one more after the command's name: the
/// folder of its results. Its messages are printed if `is_told`.
fn start(place: &Path, context: &Context<'_>, is_told: bool) -> Result<()> {
    let program = process::program()?;
    let mut command = process::quiet(&program);
    command.args(words(std::env::args_os().skip(1), place));
    // Into a file: a pipe that nobody reads would hold the process up.
    let log = place.with_extension("log");
    let file = fs::File::create(&log).map_err(|cause| Error::io(&log, cause))?;
    command.stderr(file).env("NIMBUS_PROGRESS_S", "0");
    let child = command.spawn().map_err(|cause| Error::of_io(Path::new("nimbus"), &cause));
    let failed = |cause| Error::io(Path::new("nimbus bench"), cause);
    let status = process::wait(&mut child?, context.stop, IDLE_LIMIT).map_err(failed)?;
    let text = fs::read(&log).map_err(|cause| Error::io(&log, cause))?;
    let text = String::from_utf8_lossy(&text);
    if context.stop.load(Ordering::Relaxed) {
        return Err(Error::Interrupted);
    }
    match status.code() {
        Some(0) => {
            // All starts give the same messages about the scene; those of the first are printed.
            if is_told {
                text.lines().for_each(|line| say!("{line}"));
            }
            Ok(())
        }
        code => Err(error(code, &text)),
    }
}

/// Returns the error of a process that failed, with its own exit code.
fn error(code: Option<i32>, text: &str) -> Error {
    let what = text.trim().strip_prefix("error: ").unwrap_or(text.trim()).to_owned();
    match code {
        Some(1) => Error::Check { what },
        Some(2) => Error::usage(what),
        Some(75) => Error::Transient { what },
        Some(130) => Error::Interrupted,
        _ => Error::Vulkan { call: "nimbus bench".to_owned(), what },
    }
}

/// Returns the arguments of this process with the place of a start after the command's name.
fn words(own: impl Iterator<Item = OsString>, place: &Path) -> Vec<OsString> {
    let mut words: Vec<OsString> = own.collect();
    let at = words.iter().position(|word| word == OsStr::new("bench")).map_or(0, |i| i + 1);
    let more = [OsString::from("--as-start"), place.as_os_str().to_owned()];
    words.splice(at..at, more);
    words
}

/// Reads what a start wrote; none if it has written nothing.
fn read(place: &Path, begin_s: f64) -> Result<Option<Start>> {
    let path = place.join(FRAMES_FILE);
    if !path.exists() {
        return Ok(None);
    }
    let table = parse_frames(&read_result(&path, TABLE_LIMIT)?, &path)?;
    let path = place.join(STATE_FILE);
    let readings = match path.exists() {
        true => parse_rows(&read_result(&path, TABLE_LIMIT)?, &path)?,
        false => vec![],
    };
    Ok(Some(Start { run: json::read(place)?, table, readings, begin_s }))
}
