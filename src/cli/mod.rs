//! The command line: [`args`] declares what can be typed, one file a command runs it, and [`main`]
//! returns the exit code.

pub mod args;
mod attach;
mod bench;
mod bench_cases;
mod bench_plot;
mod bench_remarks;
mod bench_table;
mod compare;
mod compare_pictures;
mod devices;
#[cfg(feature = "window")]
mod edit;
mod error;
mod error_configurations;
mod error_table;
mod farm;
mod farm_jobs;
mod farm_plan;
mod farm_told;
mod inspect;
mod ledger;
mod output;
mod progress;
mod render;
mod render_reference;
mod report;
mod scene;
mod stress;
#[cfg(feature = "window")]
mod view;
mod weather;

use std::process::ExitCode;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Parser;

use crate::error::Error;
use crate::io::atomic;
use args::{Args, Command};

/// Set by Ctrl-C if [`GRACEFUL`] is set; commands check it between frames.
static STOP: AtomicBool = AtomicBool::new(false);
/// Whether the command saves what it has finished, so that only a second Ctrl-C ends the process at
/// once.
static GRACEFUL: AtomicBool = AtomicBool::new(false);

/// Parses the command line, runs the command, prints its error and returns the exit code.
pub fn main() -> ExitCode {
    let args = Args::parse();
    // If no handler can be set, Ctrl-C still ends the program, but leaves temporary files.
    let _ = ctrlc::set_handler(interrupted);
    let zones = attach::attach(matches!(&args.command, Command::Bench(a) if a.trace.is_some()));
    let done = match &args.command {
        Command::Render(a) => render::run(a),
        Command::Bench(a) => {
            GRACEFUL.store(true, Ordering::Relaxed);
            let context = bench::Context { color: args.color, stop: &STOP, zones: zones.as_ref() };
            bench::run(a, &context)
        }
        Command::Compare(a) => compare::run(a),
        Command::Error(a) => error::run(a, args.color, &STOP, &GRACEFUL),
        Command::Ledger(a) => ledger::run(a, &STOP, &GRACEFUL),
        Command::Report(a) => report::run(a),
        Command::Stress(a) => stress::run(a, &STOP, &GRACEFUL),
        Command::Inspect(a) => inspect::run(a),
        Command::Devices(a) => devices::run(a),
        #[cfg(feature = "window")]
        Command::View(a) => {
            GRACEFUL.store(true, Ordering::Relaxed);
            view::run(a, &STOP)
        }
        #[cfg(feature = "window")]
        Command::Edit(a) => {
            GRACEFUL.store(true, Ordering::Relaxed);
            edit::run(a, &STOP)
        }
        Command::Weather(a) => weather::run(a),
        Command::Farm(a) => farm::run(a, &STOP, &GRACEFUL),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::error(&error, args.color);
            ExitCode::from(error.exit_code())
        }
    }
}

/// Signals within this time count as one: a job engine signals a script and its children, and the
/// script signals the children again.
const ONE_SIGNAL: Duration = Duration::from_secs(1);

/// Handles Ctrl-C, on a thread of its own.
fn interrupted() {
    static FIRST: OnceLock<Instant> = OnceLock::new();
    if GRACEFUL.load(Ordering::Relaxed) {
        if !STOP.swap(true, Ordering::Relaxed) {
            FIRST.get_or_init(Instant::now);
            eprintln!(
                "interrupted: finishes this frame and keeps what is done; once more ends at once"
            );
            return;
        }
        if FIRST.get().is_some_and(|first| first.elapsed() < ONE_SIGNAL) {
            return;
        }
    }
    atomic::abandon();
    // std::process::exit would run exit handlers of the driver, which other threads are still
    // using.
    unsafe extern "C" {
        fn _exit(code: std::ffi::c_int) -> !;
    }
    // SAFETY: ends the process; nothing after it runs.
    unsafe { _exit(i32::from(Error::Interrupted.exit_code())) }
}
