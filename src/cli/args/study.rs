//! What `nimbus error` and `nimbus ledger` take.

use std::path::PathBuf;

use clap::{Args as ClapArgs, ValueEnum};

use super::{SceneArgs, parse_positive};
use crate::reference::picture::ReferenceKind;

#[derive(Debug, ClapArgs)]
#[command(after_help = "Examples:\n  \
    nimbus error scenes/study-cloud.toml\n  \
    nimbus error scenes/study-light.toml --knob lighting.bases=2,4,8,16 --knob \
    lighting.theta=0.2,0.4,0.8 --grid\n  \
    nimbus error scenes/study-cloud.toml --out cloud --budget-ms 5 --budget-error 0.01\n  \
    nimbus error scenes/study-cloud.toml --out cloud --resume --knob draw.cutoff=2.2,2.7\n\n\
    Exit codes: 0 done; 2 bad input; 3 device or driver; 130 interrupted, what was finished is \
    kept in --out.")]
pub struct ErrorArgs {
    /// Scene file
    pub scene: PathBuf,
    /// Values of a key, e.g. draw.cutoff=2,3 or 'surface.*.subdivide=[4,4],[8,8]' (repeatable)
    /// [default: every knob that can change the scene]
    #[arg(long, value_name = "KEY=VALUE,…", help_heading = "Knobs")]
    pub knob: Vec<String>,
    /// All combinations of the knobs; else each value alone, then what saves time for little error
    /// put together
    #[arg(long, requires = "knob", help_heading = "Knobs")]
    pub grid: bool,
    /// What pictures are compared with: thin, volume, model or reflections=K
    #[arg(long, value_name = "WHAT", default_value = "model", help_heading = "Error")]
    pub against: ReferenceKind,
    /// Draw every cloud without its texture, which no volume and no light knows
    #[arg(long, help_heading = "Error")]
    pub plain: bool,
    /// The error that decides who is on the front
    #[arg(long, value_enum, default_value = "rmse", help_heading = "Error")]
    pub metric: MetricArg,
    /// The reference is computed at so many pixels at most, spread over the picture; "all" for
    /// every one
    #[arg(long, value_name = "N", default_value = "16384", value_parser = parse_pixels, help_heading = "Error")]
    pub pixels: usize,
    /// The frame that is drawn and compared, and the first that is timed
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Error")]
    pub frame: u32,
    /// The time that decides [default: gpu where the device has timestamps]
    #[arg(long, value_enum, help_heading = "Time")]
    pub time: Option<TimeArg>,
    /// Turns of each configuration
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..), help_heading = "Time")]
    pub rounds: u32,
    /// Timed frames of a turn
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..), help_heading = "Time")]
    pub frames: u32,
    /// Time what the scene's own frames leave to be done
    #[arg(long, help_heading = "Time")]
    pub as_played: bool,
    /// Say what is the most exact within so many ms a frame (repeatable)
    #[arg(long, value_name = "MS", value_parser = parse_positive, help_heading = "Budgets")]
    pub budget_ms: Vec<f64>,
    /// Say what is the fastest within such an error (repeatable)
    #[arg(long, value_name = "ERROR", value_parser = parse_positive, help_heading = "Budgets")]
    pub budget_error: Vec<f64>,
    /// Only these of the configurations, counted from 0, and the scene as it stands; nothing is put
    /// together. What the nodes of a farm run
    #[arg(long, value_name = "FIRST..END", value_parser = super::farm_plan::parse_span, requires = "out", hide_short_help = true)]
    pub part: Option<super::Span>,
    /// Folder for study.json, configurations.csv, times.csv, front.svg and pictures
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Go on with the study in --out: what it has is kept and not run again
    #[arg(long, requires = "out", conflicts_with = "force")]
    pub resume: bool,
    /// Replace existing results
    #[arg(long)]
    pub force: bool,
    /// Draw time against error in the terminal, too
    #[arg(long)]
    pub plot: bool,
    /// Print study.json in place of the table
    #[arg(long, conflicts_with = "csv")]
    pub json: bool,
    /// Print configurations.csv in place of the table
    #[arg(long)]
    pub csv: bool,
    #[command(flatten)]
    pub options: SceneArgs,
}

#[derive(Debug, ClapArgs)]
#[command(after_help = "Examples:\n  \
    nimbus ledger scenes/study-both.toml\n  \
    nimbus ledger scenes/cubes-554.toml --plain --size 200x150 --out ledger\n\n\
    Exit codes: 0 done; 1 the rows do not sum up; 2 bad input; 3 device or driver; 130 \
    interrupted, what was finished is kept.")]
pub struct LedgerArgs {
    /// Scene file
    pub scene: PathBuf,
    /// Draw every cloud without its texture, which no volume and no light knows
    #[arg(long)]
    pub plain: bool,
    /// Pictures are compared at so many pixels at most, spread over them; "all" for every one
    #[arg(long, value_name = "N", default_value = "8192", value_parser = parse_pixels)]
    pub pixels: usize,
    /// The frame
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub frame: u32,
    /// Reflections of the last row
    #[arg(long, value_name = "K", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=64))]
    pub reflections: u32,
    /// Turns of each picture that the device draws
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..))]
    pub rounds: u32,
    /// Timed frames of a turn
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: u32,
    /// Folder for ledger.json and ledger.svg
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace existing results
    #[arg(long)]
    pub force: bool,
    /// Print ledger.json in place of the table
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub options: SceneArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum MetricArg {
    /// Root mean square over premultiplied linear red, green, blue and alpha
    Rmse,
    /// The greatest difference at the pixels that are compared
    Max,
    /// Mean square relative to the reference's
    Relmse,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum TimeArg {
    /// Device time of all passes
    Gpu,
    /// From the begin of the game step to the finished picture
    Frame,
}

fn parse_pixels(text: &str) -> Result<usize, String> {
    if text == "all" {
        return Ok(usize::MAX);
    }
    let n = text.parse().ok().filter(|n| *n > 0);
    n.ok_or_else(|| format!("expected a number of pixels above 0, or all, found \"{text}\""))
}
