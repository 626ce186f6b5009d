//! The arguments of `nimbus bench`.

use std::path::PathBuf;

use clap::{Args as ClapArgs, ValueEnum};

use super::farm_plan::{Span, parse_span};
use super::scene::SceneArgs;
use super::values::limited;
use crate::timing::limits::{MOST_BLOCKS, MOST_FRAMES};

/// Why frames have a limit.
const FRAMES: &str = "the records of all frames are kept in memory";

/// Arguments of `nimbus bench`.
#[derive(Debug, Clone, ClapArgs)]
#[command(after_help = "Time against particles and picture size:\n  \
    nimbus bench scenes/threads.toml --sweep draw.particles=500,5000,50000 \\\n      \
    --sweep size=800x600,1024x768\n\n\
    Where nothing moves, the loops that skip draw nothing. The loop without skipping is then timed \
    in any case, and its time is the figure.\n\n\
    Draw the frame times here, and as SVG files beside the results:\n  \
    nimbus bench scenes/threads.toml --plot --out run\n\n\
    Each [[phase]] of a scene is timed by itself; --set and --sweep apply to all of them.\n\n\
    Exit codes: 0 done; 1 the device's picture is wrong; 2 bad input; 3 device or driver; \
    130 interrupted, what was finished is kept.")]
pub struct BenchArgs {
    /// Scene files, timed one after the other
    #[arg(required = true)]
    pub scenes: Vec<PathBuf>,
    /// Which loops to time; "both" runs them in alternating blocks. A phase that sets threads.mode
    /// is timed in that loop only
    #[arg(long, value_enum, default_value = "both")]
    pub threading: ThreadingArg,
    /// Time the scene at each of these values of a key, e.g. draw.cutoff=2,3 or
    /// size=800x600,1024x768 (repeatable: all combinations)
    #[arg(long, value_name = "KEY=VALUE,…")]
    pub sweep: Vec<String>,
    /// Timed frames in a block [default: the scene's, or the phase's]
    #[arg(long, value_name = "N", value_parser = limited(1, MOST_FRAMES as u32, FRAMES))]
    pub frames: Option<u32>,
    /// Warm-up frames at the start of every block, which are not counted
    #[arg(
        long,
        value_name = "N",
        default_value_t = 10,
        value_parser = limited(0, MOST_FRAMES as u32, FRAMES)
    )]
    pub warmup: u32,
    /// Do not time the loop without skipping, unless nothing moves: takes less time, but `saved`
    /// stays unknown
    #[arg(long, conflicts_with = "no_skip")]
    pub no_saved: bool,
    /// Blocks of each loop, in the order A B, B A, …; with an even number a steady drift cancels
    #[arg(
        long,
        value_name = "N",
        default_value_t = 2,
        value_parser = limited(1, MOST_BLOCKS as u32, "run.json lists every block")
    )]
    pub repeat: u32,
    /// Time only these cases, counted from 0, after the first of all; for the nodes of a farm (one
    /// scene)
    #[arg(
        long,
        value_name = "FIRST..END",
        value_parser = parse_span,
        requires = "out",
        hide_short_help = true
    )]
    pub part: Option<Span>,
    /// Folder for run.json, frames.csv and the last frame of every case as a PNG (with several
    /// scenes: a folder each in it)
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Draw the frame times below the table; with --out also as frames.svg, and the passes' times
    /// as passes.svg
    #[arg(long)]
    pub plot: bool,
    /// Write every frame's image hash to frames.csv; reading the frames back disturbs the times
    #[arg(long, requires = "out")]
    pub hash_frames: bool,
    /// Time line of every step and pass, for Perfetto or chrome://tracing (one scene)
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// Replace existing results
    #[arg(long)]
    pub force: bool,
    /// Do not check whether the device's pictures are right; the results then say so
    #[arg(long)]
    pub no_check: bool,
    /// Count what each pass invokes: shaders, and triangles before and after clipping. One more
    /// frame of each case counts them after its timed frames, so that no time changes
    #[arg(long)]
    pub invocations: bool,
    /// Have RenderDoc capture this frame, counted from 0 over all frames of the command, warm-up
    /// included; nimbus must have been started under RenderDoc, and times then mean little
    #[arg(long, value_name = "N")]
    pub capture: Option<u32>,
    /// Print run.json instead of the table
    #[arg(long)]
    pub json: bool,
    /// Arguments of every command with a scene.
    #[command(flatten)]
    pub options: SceneArgs,
}

/// The loops that a bench times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ThreadingArg {
    /// One thread: the game step, then the render step
    Serial,
    /// Two threads: the game step of the next frame beside the render step
    Parallel,
    /// Both, in alternating blocks
    Both,
}
