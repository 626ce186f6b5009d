//! The arguments of the studies: `error` and `ledger`.

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::farm_plan::{Span, parse_span};
use super::scene::SceneArgs;
use super::values::{parse_block, parse_positive, parse_rounds};
use crate::reference::picture::{MAX_SAMPLES, ReferenceKind};
use crate::studies::error::blocks::TimeKind;
use crate::studies::error::front::Metric;

/// Arguments of `nimbus error`.
#[derive(Debug, Clone, ClapArgs)]
#[command(after_help = "Examples:\n  \
    nimbus error scenes/study-cloud.toml\n  \
    nimbus error scenes/study-light.toml --knob lighting.bases=2,4,8,16 \\\n      \
    --knob lighting.theta=0.2,0.4,0.8 --grid\n  \
    nimbus error scenes/study-cloud.toml --out cloud --budget-ms 5 \\\n      \
    --budget-error 0.01\n  \
    nimbus error scenes/study-cloud.toml --out cloud --resume \\\n      \
    --knob draw.cutoff=2.2,2.7\n\n\
    Exit codes: 0 done; 2 bad input; 3 device or driver; 130 interrupted, what was finished is \
    kept in --out.")]
pub struct ErrorArgs {
    /// Scene file
    pub scene: PathBuf,
    /// Values of a key, e.g. draw.cutoff=2,3 or 'surface.*.subdivide=[4,4],[8,8]' (repeatable)
    /// [default: every knob that can change the scene]
    #[arg(long, value_name = "KEY=VALUE,…", help_heading = "Knobs")]
    pub knob: Vec<String>,
    /// Run all combinations of the knobs [default: each value alone, then combinations of those
    /// that save time for little error]
    #[arg(long, requires = "knob", help_heading = "Knobs")]
    pub grid: bool,
    /// Reference of the pictures: thin, slices, volume, model, reflections=K or transport
    #[arg(long, value_name = "WHAT", default_value = "model", help_heading = "Error")]
    pub against: ReferenceKind,
    /// Trace random paths for --against transport until the error of a pixel of the reference is
    /// this share of the picture's root mean square [default: 0.01]. Paths are kept with the other
    /// references, and a smaller share goes on from them
    #[arg(long, value_name = "SHARE", value_parser = parse_positive, help_heading = "Error")]
    pub reference_error: Option<f64>,
    /// Most random paths of a pixel for --against transport [default: 4096]
    #[arg(
        long,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(2..=i64::from(MAX_SAMPLES)),
        help_heading = "Error"
    )]
    pub paths: Option<u32>,
    /// Draw every cloud without its texture, which the references but thin and slices do not have
    #[arg(long, help_heading = "Error")]
    pub plain: bool,
    /// The error that decides which configurations are on the front
    #[arg(long, value_enum, default_value = "rmse", help_heading = "Error")]
    pub metric: Metric,
    /// Most pixels that the reference is computed at, spread over the picture; or "all"
    #[arg(
        long,
        value_name = "N",
        default_value = "16384",
        value_parser = parse_pixels,
        help_heading = "Error"
    )]
    pub pixels: usize,
    /// Number of the frame that is drawn and compared, and the first that is timed
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Error")]
    pub frame: u32,
    /// The time that decides [default: gpu where the device has timestamps]
    #[arg(long, value_enum, help_heading = "Time")]
    pub time: Option<TimeKind>,
    /// Timed blocks of each configuration
    #[arg(
        long,
        value_name = "N",
        default_value_t = 10,
        value_parser = parse_rounds,
        help_heading = "Time"
    )]
    pub rounds: u32,
    /// Timed frames of a block
    #[arg(
        long,
        value_name = "N",
        default_value_t = 3,
        value_parser = parse_block,
        help_heading = "Time"
    )]
    pub frames: u32,
    /// Let frames skip the work that the scene lets them skip
    #[arg(long, help_heading = "Time")]
    pub as_played: bool,
    /// Print the most exact configuration within this time of a frame (repeatable)
    #[arg(long, value_name = "MS", value_parser = parse_positive, help_heading = "Budgets")]
    pub budget_ms: Vec<f64>,
    /// Print the fastest configuration within this error (repeatable)
    #[arg(long, value_name = "ERROR", value_parser = parse_positive, help_heading = "Budgets")]
    pub budget_error: Vec<f64>,
    /// Run only these configurations, counted from 0, and the unchanged scene, without
    /// combinations; for the nodes of a farm
    #[arg(
        long,
        value_name = "FIRST..END",
        value_parser = parse_span,
        requires = "out",
        hide_short_help = true
    )]
    pub part: Option<Span>,
    /// Folder for study.json, configurations.csv, times.csv, front.svg and pictures
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Resume the study in --out: its results are kept and not measured again
    #[arg(long, requires = "out", conflicts_with = "force")]
    pub resume: bool,
    /// Replace existing results
    #[arg(long)]
    pub force: bool,
    /// Also draw time against error in the terminal
    #[arg(long)]
    pub plot: bool,
    /// Print study.json instead of the table
    #[arg(long, conflicts_with = "csv")]
    pub json: bool,
    /// Print configurations.csv instead of the table
    #[arg(long)]
    pub csv: bool,
    /// Arguments of every command with a scene.
    #[command(flatten)]
    pub options: SceneArgs,
}

/// Arguments of `nimbus ledger`.
#[derive(Debug, Clone, ClapArgs)]
#[command(after_help = "Examples:\n  \
    nimbus ledger scenes/study-both.toml\n  \
    nimbus ledger scenes/cubes-554.toml --plain --size 200x150 --out ledger\n\n\
    Exit codes: 0 done; 1 the rows do not sum up; 2 bad input; 3 device or driver; 130 \
    interrupted, what was finished is kept.")]
pub struct LedgerArgs {
    /// Scene file
    pub scene: PathBuf,
    /// Draw every cloud without its texture, which the references but thin and slices do not have
    #[arg(long)]
    pub plain: bool,
    /// Most pixels that pictures are compared at, spread over them; or "all"
    #[arg(long, value_name = "N", default_value = "8192", value_parser = parse_pixels)]
    pub pixels: usize,
    /// Frame number
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub frame: u32,
    /// Reflections of the last row by the model
    #[arg(
        long,
        value_name = "K",
        default_value_t = 4,
        value_parser = clap::value_parser!(u32).range(1..=64)
    )]
    pub reflections: u32,
    /// Most random paths of a pixel in the row "model", which compares with radiative transfer
    /// (docs/explanation/transport.md); 0 leaves it out. Fewer do where they resolve the row
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1024,
        value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_SAMPLES))
    )]
    pub paths: u32,
    /// Timed blocks of each picture that the device draws
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = parse_rounds)]
    pub rounds: u32,
    /// Timed frames of a block
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = parse_block)]
    pub frames: u32,
    /// Folder for ledger.json and ledger.svg
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace existing results
    #[arg(long)]
    pub force: bool,
    /// Print ledger.json instead of the table
    #[arg(long)]
    pub json: bool,
    /// Arguments of every command with a scene.
    #[command(flatten)]
    pub options: SceneArgs,
}

fn parse_pixels(text: &str) -> Result<usize, String> {
    if text == "all" {
        return Ok(usize::MAX);
    }
    let n = text.parse().ok().filter(|n| *n > 0);
    n.ok_or_else(|| format!("expected a number of pixels above 0, or all, found \"{text}\""))
}
