//! The arguments of the commands that read results: `compare` and `report`.

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::values::{parse_density, parse_limit, parse_margin};
use crate::timing::difference::Condition;

/// Arguments of `nimbus compare`.
#[derive(Debug, ClapArgs)]
#[command(after_help = "Two settings of a scene:\n  \
    nimbus bench scenes/threads.toml --out before\n  \
    nimbus bench scenes/threads.toml --set lighting.grid=32 --out after\n  \
    nimbus compare before after --allow scene\n\n\
    --allow build compares the results of two builds, --allow device those of two devices.\n\n\
    Several runs, each with each, where differences up to 3 % do not matter:\n  \
    nimbus bench scenes/threads.toml --set lighting.grid=16 --out coarse\n  \
    nimbus compare before after coarse --allow scene --margin 3%\n\n\
    Two pictures:\n  \
    nimbus render scenes/hello.toml --reference thin -o thin.exr\n  \
    nimbus render scenes/hello.toml -o drawn.exr\n  \
    nimbus compare thin.exr drawn.exr --fail-above rmse=0.1 \\\n      \
    --fail-below ssim=0.9\n\n\
    Exit codes: 0 compared, whatever the verdict; 1 a metric is beyond --fail-above or \
    --fail-below;\n  \
    2 not comparable, or neither results of nimbus bench nor pictures.")]
pub struct CompareArgs {
    /// Results folder (`nimbus bench --out DIR`) or picture that serves as the reference
    pub a: PathBuf,
    /// Results folder or picture that is compared with A
    pub b: PathBuf,
    /// Further results folders: every run is then compared with every other
    pub more: Vec<PathBuf>,
    /// Difference that does not matter: within it B is the same, beyond it faster or slower
    #[arg(
        long,
        value_name = "PERCENT",
        default_value = "1%",
        value_parser = parse_margin,
        allow_hyphen_values = true,
        help_heading = "Results"
    )]
    pub margin: f64,
    /// Conditions that may differ between A and B; any other difference is refused
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        value_name = "WHAT,…",
        help_heading = "Results"
    )]
    pub allow: Vec<Condition>,
    /// Write the FLIP error of every pixel as a picture, dark for no error
    #[arg(short, long, value_name = "FILE.png", help_heading = "Pictures")]
    pub output: Option<PathBuf>,
    /// Replace an existing file
    #[arg(long, requires = "output", help_heading = "Pictures")]
    pub force: bool,
    /// Pixels a degree of the field of view, for FLIP [default: 67]
    #[arg(long, value_name = "N", value_parser = parse_density, help_heading = "Pictures")]
    pub pixels_per_degree: Option<f64>,
    /// Exit with 1 if a metric is greater: rmse, max, relmse, flip, alpha_rmse, alpha_max or
    /// not_finite (repeatable)
    #[arg(long, value_name = "METRIC=VALUE", value_parser = parse_limit, help_heading = "Pictures")]
    pub fail_above: Vec<(String, f64)>,
    /// Exit with 1 if a metric is less: psnr or ssim (repeatable)
    #[arg(long, value_name = "METRIC=VALUE", value_parser = parse_limit, help_heading = "Pictures")]
    pub fail_below: Vec<(String, f64)>,
    /// Print JSON instead of the table
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `nimbus report`.
#[derive(Debug, ClapArgs)]
#[command(after_help = "One run:\n  \
    nimbus bench scenes/threads.toml --out run\n  \
    nimbus report run -o run.html\n\n\
    Before and after, compared:\n  \
    nimbus bench scenes/threads.toml --out before\n  \
    nimbus bench scenes/threads.toml --set lighting.grid=32 --out after\n  \
    nimbus report before after -o change.html\n\n\
    Exit codes: 0 written; 2 a folder without results, results of another schema, or a page that \
    exists already.")]
pub struct ReportArgs {
    /// Folders of results, or run.json, study.json or ledger.json in one
    #[arg(required = true, value_name = "RUN")]
    pub runs: Vec<PathBuf>,
    /// The page: .html
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Replace an existing file
    #[arg(long)]
    pub force: bool,
    /// No progress, and no line about what was written
    #[arg(short, long)]
    pub quiet: bool,
}

/// Arguments of `nimbus history`.
#[derive(Debug, ClapArgs)]
#[command(after_help = "Three nights and a page of them:\n  \
    nimbus bench scenes/threads.toml --out night-1\n  \
    nimbus bench scenes/threads.toml --out night-2\n  \
    nimbus bench scenes/threads.toml --out night-3\n  \
    nimbus history night-1 night-2 night-3 -o history.html\n\n\
    A change is found once there are three runs before it and three after it.\n\n\
    Which revision brought the last change:\n  \
    nimbus history night-1 night-2 night-3 --bisect --repo .\n\n\
    Exit codes: 0 read, whatever was found; 2 not comparable, or no results of nimbus bench.")]
pub struct HistoryArgs {
    /// Results folders (`nimbus bench --out DIR`)
    #[arg(required = true, value_name = "DIR")]
    pub runs: Vec<PathBuf>,
    /// Conditions that may differ between runs, besides the build
    #[arg(long, value_enum, value_delimiter = ',', value_name = "WHAT,…")]
    pub allow: Vec<Condition>,
    /// Git checkout of the builds: orders the runs by revision. Without one that has all revisions
    /// they are ordered by date [default: the present folder]
    #[arg(long, value_name = "DIR")]
    pub repo: Option<PathBuf>,
    /// Say which revision to measure next, to find the one that brought the last change of a frame
    /// time
    #[arg(long)]
    pub bisect: bool,
    /// Page with charts: .html
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Replace an existing file
    #[arg(long, requires = "output")]
    pub force: bool,
    /// Print JSON instead of the table
    #[arg(long)]
    pub json: bool,
    /// No line about what was written
    #[arg(short, long)]
    pub quiet: bool,
}
