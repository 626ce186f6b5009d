//! The command line: [`args`] declares what can be typed, one file a command runs it, and [`main`]
//! returns the exit code.

pub mod args;
mod attach;
mod bench;
mod bench_cases;
mod bench_check;
mod bench_invocations;
mod bench_plot;
mod bench_record;
mod bench_remarks;
mod bench_roofs;
mod bench_stages;
mod bench_starts;
mod bench_table;
mod capture_note;
mod clock_locks;
mod compare;
mod compare_matrix;
mod compare_pictures;
mod compare_sides;
mod devices;
#[cfg(feature = "window")]
mod edit;
mod error;
mod error_configurations;
mod error_table;
mod export;
mod farm;
mod farm_jobs;
mod farm_plan;
mod farm_told;
mod history;
mod inspect;
mod interrupt;
mod kernels;
mod ledger;
mod output;
mod progress;
mod render;
mod render_frames;
mod render_layers;
mod render_reference;
mod report;
mod revisions;
mod roof;
mod scene;
mod stress;
#[cfg(feature = "window")]
mod view;
mod weather;

use std::io::Write;
use std::process::ExitCode;

use clap::{ColorChoice, Parser};

use crate::error::{Error, Result};
use crate::io::plain_text::plain;
use crate::measure::zones::Zones;
use args::{Args, Command};
use interrupt::graceful_stop;

/// Returns what clap shows, with arguments that have no characters that a terminal would obey.
fn with_plain_words(shown: clap::Error) -> clap::Error {
    let typed = std::env::args_os().map(|word| plain(&word.to_string_lossy()).into_owned());
    Args::try_parse_from(typed).err().unwrap_or(shown)
}

/// Parses the command line, runs the command, prints its error and returns the exit code.
pub fn main() -> ExitCode {
    let mut args = match Args::try_parse() {
        Ok(args) => args,
        Err(shown) => return usage(&with_plain_words(shown)),
    };
    args.command.set_budget();
    // If no handler can be set, Ctrl-C still ends the program, but leaves temporary files.
    let _ = ctrlc::set_handler(interrupt::handle);
    let zones = attach::attach(matches!(&args.command, Command::Bench(a) if a.trace.is_some()));
    let done = run(&args, zones.as_ref());
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::error(&error, args.color);
            ExitCode::from(error.exit_code())
        }
    }
}

/// Prints the help that was asked for, or what is wrong with the command line.
fn usage(shown: &clap::Error) -> ExitCode {
    let printed = shown.print().and_then(|()| std::io::stdout().flush());
    match printed {
        _ if shown.use_stderr() => ExitCode::from(Error::usage("").exit_code()),
        Err(cause) if cause.kind() != std::io::ErrorKind::BrokenPipe => {
            let error = Error::io("stdout".as_ref(), cause);
            output::error(&error, ColorChoice::Never);
            ExitCode::from(error.exit_code())
        }
        _ => ExitCode::SUCCESS,
    }
}

fn run(args: &Args, zones: Option<&Zones>) -> Result<()> {
    match &args.command {
        Command::Render(a) => render::run(a),
        Command::Bench(a) => {
            let (color, stop) = (args.color, graceful_stop());
            bench_starts::run(a, &bench::Context { color, stop, zones })
        }
        Command::Compare(a) => compare::run(a),
        Command::History(a) => history::run(a),
        Command::Error(a) => error::run(a, args.color),
        Command::Ledger(a) => ledger::run(a),
        Command::Report(a) => report::run(a),
        Command::Stress(a) => stress::run(a),
        Command::Inspect(a) => inspect::run(a),
        Command::Devices(a) => devices::run(a),
        #[cfg(feature = "window")]
        Command::View(a) => view::run(a, graceful_stop()),
        #[cfg(feature = "window")]
        Command::Edit(a) => edit::run(a, graceful_stop()),
        Command::Weather(a) => weather::run(a),
        Command::Export(a) => export::run(a),
        Command::Farm(a) => farm::run(a),
    }
}
