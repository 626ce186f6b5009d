//! The arguments of `nimbus bench`.

use std::path::PathBuf;

use clap::{Args as ClapArgs, ValueEnum};

use super::farm_plan::{Span, parse_span};
use super::scene::{BudgetArgs, SceneArgs};
use super::values::{limited, parse_precision, parse_time_limit};
use crate::timing::limits::{MOST_BLOCKS, MOST_FRAMES};

/// Why frames have a limit.
const FRAMES: &str = "the records of all frames are kept in memory";

/// Most processes of `--starts`.
const MOST_STARTS: u32 = 100;

/// Arguments of `nimbus bench`.
#[derive(Debug, Clone, ClapArgs)]
#[command(after_help = "Time against particles and picture size:\n  \
    nimbus bench scenes/threads.toml --sweep draw.particles=500,5000,50000 \\\n      \
    --sweep size=800x600,1024x768\n\n\
    Where nothing moves, the loops that skip draw nothing. The loop without skipping is then timed \
    in any case, and its time is the figure.\n\n\
    Draw the frame times here, and as SVG files beside the results:\n  \
    nimbus bench scenes/threads.toml --plot --out run\n\n\
    As many blocks as intervals of ±2 % need:\n  \
    nimbus bench scenes/threads.toml --precision 2%\n\n\
    The times of passes whose data comes from memory and not from a cache:\n  \
    nimbus bench scenes/threads.toml --cold --out cold\n\n\
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
    /// Warm-up frames at the start of every block, which are not counted [default: 10; with
    /// --precision, whose blocks are short, 4]
    #[arg(long, value_name = "N", value_parser = limited(0, MOST_FRAMES as u32, FRAMES))]
    pub warmup: Option<u32>,
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
    /// Add blocks until every 95 % interval reaches at most this far to each side: of the median
    /// frame time of every loop, and of the ratio of the threadings. Blocks have a part of the
    /// frames, in random order
    #[arg(
        long,
        value_name = "PERCENT",
        value_parser = parse_precision,
        allow_hyphen_values = true,
        conflicts_with_all = ["repeat", "part"]
    )]
    pub precision: Option<f64>,
    /// Seconds after which --precision gives up, and says so; eight rounds are run in any case
    #[arg(
        long,
        value_name = "S",
        default_value_t = 600.0,
        requires = "precision",
        value_parser = parse_time_limit
    )]
    pub time_limit: f64,
    /// Seed of the order of blocks with --precision
    #[arg(long, value_name = "N", default_value_t = 0, requires = "precision")]
    pub order_seed: u64,
    /// Run the bench in this many processes, one after the other, and compare their times: one
    /// start of a program differs from the next by more than its frames tell. Intervals need three
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1,
        conflicts_with_all = ["part", "trace", "capture"],
        value_parser = limited(1, MOST_STARTS, "their frames are kept in memory together")
    )]
    pub starts: u32,
    /// Folder of a start's results, which the process of `--starts` reads; replaces --out
    #[arg(long, value_name = "DIR", hide = true)]
    pub as_start: Option<PathBuf>,
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
    /// Make caches cold before each pass: the device writes MIB MiB, outside of the pass's time.
    /// By default it writes as much as its last cache level holds (256 MiB on a GPU, a bound).
    /// Passes then find their data in memory. Times of frames contain the writes and are no figure
    #[arg(
        long,
        value_name = "MIB",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "0",
        value_parser = parse_cold
    )]
    pub cold: Option<u32>,
    /// Do not check whether the device's pictures are right; the results then say so
    #[arg(long)]
    pub no_check: bool,
    /// Leave frames out of the statistics that ran below 75 % of the run's median clock, or while
    /// heat held the clock down; frames.csv keeps them
    #[arg(long)]
    pub discard_throttled: bool,
    /// Do not read clocks, heat and load beside the frames
    #[arg(long, conflicts_with = "discard_throttled", hide_short_help = true)]
    pub no_state: bool,
    /// Count what each pass invokes: shaders, and triangles before and after clipping. One more
    /// frame of each case counts them after its timed frames, so that no time changes
    #[arg(long)]
    pub invocations: bool,
    /// Have RenderDoc capture this frame, counted from 0 over all frames of the command, warm-up
    /// included; nimbus must have been started under RenderDoc, and times then mean little
    #[arg(long, value_name = "N", value_parser = limited(0, u32::MAX, "frames have 32 bits"))]
    pub capture: Option<u32>,
    /// Print run.json instead of the table
    #[arg(long)]
    pub json: bool,
    /// Budget of the light.
    #[command(flatten)]
    pub budget: BudgetArgs,
    /// Arguments of every command with a scene.
    #[command(flatten)]
    pub options: SceneArgs,
}

/// Warm-up frames of a block of all frames of a case.
const WARM_UP: u32 = 10;
/// Warm-up frames of a block of 12 frames or more. The block before was mostly of the same case, so
/// that only the loop has to find its pace: two frames are on their way in the parallel loop.
const WARM_UP_SHORT: u32 = 4;

impl BenchArgs {
    /// Returns the warm-up frames of every block.
    pub fn n_warm_up(&self) -> u32 {
        let default = if self.precision.is_some() { WARM_UP_SHORT } else { WARM_UP };
        self.warmup.unwrap_or(default)
    }
}

/// Parses the MiB of `--cold`; 0 stands for the size of the last cache level.
fn parse_cold(text: &str) -> Result<u32, String> {
    limited(0, 4096, "the device writes them before each pass; 0: as the last cache level holds")(
        text,
    )
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
