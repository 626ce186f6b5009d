//! What was typed ([`args`]) → what it means (one file a command) → an exit code.

pub mod args;
mod bench;
mod devices;
mod inspect;
mod output;
mod render;

use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Parser;

use crate::error::{Error, Result};
use crate::io::scene_file::{self, LoadedScene};
use crate::study::stage::DeviceChoice;
use args::{Args, Command, SceneArgs};

/// Set by the first Ctrl-C; long work looks at it between frames. The second one ends the process.
static STOP: AtomicBool = AtomicBool::new(false);

/// Parses the command line, runs the command, prints an error and gives the exit code.
pub fn main() -> ExitCode {
    let args = Args::parse();
    // Without a handler Ctrl-C still ends the program, only less cleanly.
    let _ = ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(Error::Interrupted.exit_code()));
        }
    });
    let done = match &args.command {
        Command::Render(a) => render::run(a),
        Command::Bench(a) => bench::run(a, &STOP),
        Command::Inspect(a) => inspect::run(a),
        Command::Devices(a) => devices::run(a),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::error(&error, args.color);
            ExitCode::from(error.exit_code())
        }
    }
}

/// Loads a scene with all that was typed about it; prints what is allowed but hardly meant.
fn load(path: &Path, args: &SceneArgs) -> Result<LoadedScene> {
    let mut overrides = args.set.clone();
    if let Some((width, height)) = args.size {
        overrides.push(format!("film.width={width}"));
        overrides.push(format!("film.height={height}"));
    }
    let loaded = scene_file::load(path, &overrides, args.seed)?;
    if !args.quiet {
        for warning in &loaded.warnings {
            eprintln!("warning: {warning}");
        }
    }
    Ok(loaded)
}

fn device_choice(args: &SceneArgs) -> DeviceChoice {
    DeviceChoice { device: args.device.clone(), shaders: args.shaders.clone(), validation: args.validation }
}

/// A result that exists is not replaced unless asked for.
fn refuse_existing(path: &Path, force: bool) -> Result<()> {
    if !force && path.symlink_metadata().is_ok() {
        return Err(Error::io(path, "exists; --force replaces it"));
    }
    Ok(())
}
