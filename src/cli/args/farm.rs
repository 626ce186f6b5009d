//! Arguments of `nimbus farm`.

use std::path::PathBuf;

use clap::{Args as ClapArgs, Subcommand, ValueEnum};

use super::farm_plan::{CalibrateArgs, PlanArgs};
use super::values::{at_least_one, limited};

/// Arguments of `nimbus farm`.
#[derive(Debug, ClapArgs)]
pub struct FarmArgs {
    /// The command.
    #[command(subcommand)]
    pub command: FarmCommand,
}

/// The commands of `nimbus farm`.
#[derive(Debug, Subcommand)]
pub enum FarmCommand {
    /// Cut the frames of an animation, the configurations of an error study, the cases of a bench,
    /// or a reference picture into shards
    #[command(after_help = "An animation on this machine:\n  \
        nimbus farm plan scenes/flyby.toml --frames 0..240 --size 320x240 -o fly\n  \
        nimbus farm local --plan fly\n  nimbus farm merge --plan fly -o frames\n\n\
        An error study of 60 configurations, as `nimbus error` measures them:\n  \
        nimbus farm plan scenes/study-cloud.toml -o study --error -- --grid \\\n      \
        --knob draw.cutoff=2,2.5,3,3.5,4 --knob lighting.step=1,0.75,0.5 \\\n      \
        --knob lighting.grid=16,24,32,48\n\n\
        A bench of 12 cases, as `nimbus bench` times them:\n  \
        nimbus farm plan scenes/threads.toml -o times --bench --shard-cases 4 \\\n      \
        -- --repeat 4 --sweep draw.particles=500,5000,50000 \\\n      \
        --sweep size=400x300,800x600,1024x768,1600x1200\n\n\
        A picture in f64 of 64 samples a pixel, as `nimbus render --reference` draws it:\n  \
        nimbus farm plan scenes/study-light.toml -o picture --reference model \\\n      \
        --samples 64 --tile 80x60")]
    Plan(Box<PlanArgs>),
    /// Time a few frames of scenes on this machine and fit a cost model, by which `plan` predicts
    ///
    /// t = setup + d · steps + a · particles · steps + g · cells of the density grid + b · layers
    /// of pixels + c · facet pairs + e · textures. The coefficients are the non-negative least
    /// squares of relative errors over runs of one frame and of several at three sizes. The model
    /// holds for this class of devices, and best for scenes like those given. The error for unseen
    /// runs is printed: each run is left out in turn.
    Calibrate(CalibrateArgs),
    /// Do one shard, unless it is done
    ///
    /// Exit codes: 0 the shard is done; 75 a failure that another try may not meet (full disk, lost
    /// device, a signal); 70 the result differs from one that is there; others as everywhere: no
    /// try helps.
    Run(RunArgs),
    /// Do all shards that are not done on this machine, some processes at a time
    Local(LocalArgs),
    /// Print which shards are done. Reads and verifies every result, and asks Slurm for 10 s at
    /// most
    Status(StatusArgs),
    /// Put all results together, as one machine would have made them
    ///
    /// Every result is verified before, and every copy after. Where a shard is missing, it is named
    /// and nothing is written.
    Merge(MergeArgs),
    /// Remove what ended runs have left behind
    Gc(GcArgs),
    /// Write job scripts for the shards that are not done, and for the merge after them
    Emit(EmitArgs),
    /// Submit the shards that are not done to Slurm, and the merge after them. Prints the jobs'
    /// ids; `status` follows them
    Submit(SubmitArgs),
}

/// Arguments of `nimbus farm run`.
#[derive(Debug, ClapArgs)]
pub struct RunArgs {
    /// The plan's folder
    #[arg(long, value_name = "DIR")]
    pub plan: PathBuf,
    /// Vulkan device, by its index in `nimbus devices` (digits) or a part of its name
    #[arg(long, value_name = "INDEX|NAME")]
    pub device: Option<String>,
    /// Run with the validation layers; any message fails the shard
    #[arg(long)]
    pub validation: bool,
    /// Print nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
    /// End with 1 in place of 75 after so many failures of the same Slurm task in a row that
    /// finished nothing
    #[arg(long, value_name = "N", value_parser = at_least_one())]
    pub tries: Option<u32>,
    /// Number of the shard, from 0
    #[arg(long, value_name = "I")]
    pub shard: usize,
}

/// Arguments of `nimbus farm local`.
#[derive(Debug, ClapArgs)]
pub struct LocalArgs {
    /// The plan's folder
    #[arg(long, value_name = "DIR")]
    pub plan: PathBuf,
    /// Processes at a time. One is enough for a device; a software device uses all cores
    #[arg(
        short,
        long,
        value_name = "N",
        default_value_t = 1,
        value_parser = limited(1, 1024, "a thread waits for each")
    )]
    pub jobs: u32,
    /// Tries of a shard that fails in a way that another try may not
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = at_least_one())]
    pub tries: u32,
    /// Vulkan device, by index or part of its name
    #[arg(long, value_name = "INDEX|NAME")]
    pub device: Option<String>,
    /// Print no progress
    #[arg(short, long)]
    pub quiet: bool,
}

/// Arguments of `nimbus farm status`.
#[derive(Debug, ClapArgs)]
pub struct StatusArgs {
    /// The plan's folder
    #[arg(long, value_name = "DIR")]
    pub plan: PathBuf,
    /// Print only the shards that are not done, as Slurm's --array takes them: 0,3-5
    #[arg(long, conflicts_with = "json")]
    pub missing: bool,
    /// Print every shard as JSON
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `nimbus farm merge`.
#[derive(Debug, ClapArgs)]
pub struct MergeArgs {
    /// The plan's folder
    #[arg(long, value_name = "DIR")]
    pub plan: PathBuf,
    /// Folder for the merged result
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Replace results in an existing folder; its other files stay
    #[arg(long)]
    pub force: bool,
    /// Merge pictures even if several devices, drivers or processors drew them
    #[arg(long)]
    pub mixed: bool,
}

/// Arguments of `nimbus farm gc`.
#[derive(Debug, ClapArgs)]
pub struct GcArgs {
    /// The plan's folder
    #[arg(long, value_name = "DIR")]
    pub plan: PathBuf,
    /// Also remove unfinished folders of open shards after so many hours without a change
    #[arg(
        long,
        value_name = "HOURS",
        default_value_t = 24.0,
        value_parser = super::values::parse_positive
    )]
    pub idle: f64,
    /// Also remove broken results, and those that differ from the one in place
    #[arg(long)]
    pub all: bool,
    /// Only print what would be removed
    #[arg(short = 'n', long)]
    pub dry_run: bool,
}

/// Engines that job scripts are written for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum EngineArg {
    /// shard.sh for a task of an array, and merge.sh
    Slurm,
    /// local.sh: all shards on one machine, then the merge
    Local,
}

/// Engines that jobs are submitted to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SubmitArg {
    /// An array of tasks, and a job for the merge
    Slurm,
}

/// Arguments on jobs.
#[derive(Debug, ClapArgs)]
pub struct JobArgs {
    /// The plan's folder
    #[arg(long, value_name = "DIR")]
    pub plan: PathBuf,
    /// Folder for the merged result [default: "merged" in the plan's folder]. Results of an earlier
    /// merge in it are replaced (jobs merge with --force)
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Tries of a shard, or of the merge, that fails in a way that another try may not. With Slurm
    /// a shard's failures count in a row, up to one that finished frames; nodes that die count for
    /// the merge alone
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = at_least_one())]
    pub tries: u32,
    /// Option for sbatch of the shards, e.g. --sbatch=--gres=gpu:1 (repeatable). The merge gets
    /// --account, --partition, --qos and --reservation, too
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    pub sbatch: Vec<String>,
    /// Option for sbatch of the merge, after those (repeatable)
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    pub sbatch_merge: Vec<String>,
}

/// Arguments of `nimbus farm emit`.
#[derive(Debug, ClapArgs)]
pub struct EmitArgs {
    /// Where the jobs run
    #[arg(value_enum)]
    pub engine: EngineArg,
    /// Folder for the scripts [default: the engine's name in the plan's folder]
    #[arg(long, value_name = "DIR")]
    pub files: Option<PathBuf>,
    /// Arguments on jobs.
    #[command(flatten)]
    pub job: JobArgs,
}

/// Arguments of `nimbus farm submit`.
#[derive(Debug, ClapArgs)]
pub struct SubmitArgs {
    /// Where the jobs run
    #[arg(value_enum)]
    pub engine: SubmitArg,
    /// Print the ids as JSON
    #[arg(long)]
    pub json: bool,
    /// Arguments on jobs.
    #[command(flatten)]
    pub job: JobArgs,
}
