//! What is typed after `nimbus farm`.

use std::path::PathBuf;

use clap::{Args as ClapArgs, Subcommand, ValueEnum};

use super::parse_size;
use crate::reference::picture::{MAX_SAMPLES, ReferenceKind};

#[derive(Debug, ClapArgs)]
pub struct FarmArgs {
    #[command(subcommand)]
    pub command: FarmCommand,
}

#[derive(Debug, Subcommand)]
pub enum FarmCommand {
    /// Cut the frames of an animation, the configurations of an error study, the cases of a sweep,
    /// or a reference picture into shards
    #[command(after_help = "An animation on this machine:\n  \
        nimbus farm plan scenes/flyby.toml --frames 0..240 --size 320x240 -o farm\n  \
        nimbus farm local --plan farm\n  nimbus farm merge --plan farm -o frames\n\n\
        A study of 60 configurations, as `nimbus error` makes it:\n  \
        nimbus farm plan scenes/study-cloud.toml -o farm --error -- --grid --knob \
        draw.cutoff=2,2.5,3,3.5,4 \\\n      \
        --knob lighting.grid=16,24,32,48 --knob lighting.step=1,0.75,0.5\n\n\
        A sweep of 12 cases, as `nimbus bench` times it:\n  \
        nimbus farm plan scenes/cubes-554.toml -o farm --bench --shard-cases 4 -- --repeat \
        4 \\\n      \
        --sweep draw.particles=500,5000,50000 --sweep size=400x300,800x600,1024x768,1600x1200\n\n\
        A picture in f64 of 64 samples a pixel, as `nimbus render --reference` draws it:\n  \
        nimbus farm plan scenes/study-light.toml -o farm --reference model --samples 64 \
        --tile 80x60")]
    Plan(Box<PlanArgs>),
    /// Time a few frames of scenes here and fit the cost model that plans are made with
    ///
    /// t = setup + d · steps + a · particles · steps + g · cells of the density grid + b · layers
    /// of pixels + c · facet pairs + e · textures, by non-negative least squares of relative errors
    /// over runs of one frame and of several at three sizes, each timed as a shard is. It is for
    /// this class of devices; scenes like those to come make it good. What it is off by for runs
    /// that it has not seen is said (each left out in turn).
    Calibrate(CalibrateArgs),
    /// Do one shard, unless it is done
    ///
    /// Exit codes: 0 done, by whomever; 75 it went wrong in a way that may pass (full disk, lost
    /// device, a signal): another try may go well; 70 the result differs from one that is there;
    /// others as everywhere: another try is of no use.
    Run(RunArgs),
    /// Do all shards that are not done, here, some processes at a time
    Local(LocalArgs),
    /// Say what is done and what is not; reads and verifies every result, and asks the engine for
    /// 10 s at most
    Status(StatusArgs),
    /// Put all results together, as one machine would have made them
    ///
    /// Every result is verified before and every copy after. Where a shard is missing nothing is
    /// written, and it is named.
    Merge(MergeArgs),
    /// Remove what attempts have left behind
    Gc(GcArgs),
    /// Write job files for an engine: a task for every shard that is not done, and the merge after
    /// them
    Emit(EmitArgs),
    /// Hand all shards that are not done to an engine, and the merge after them; prints its ids,
    /// and `status` follows them
    Submit(SubmitArgs),
}

#[derive(Debug, ClapArgs)]
pub struct PlanArgs {
    /// Scene file; every node has to see it under the same path
    pub scene: PathBuf,
    /// Folder of the plan and of its results, which every node has to see
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Frames: FIRST..END (END is not drawn) or how many from 0 [default: the scene's]
    #[arg(long, value_name = "FIRST..END", value_parser = parse_span)]
    pub frames: Option<Span>,
    /// The configurations of an error study in place of frames; what follows "--" is what `nimbus
    /// error` takes
    #[arg(long, group = "told-more", conflicts_with_all = ["frames", "shard_frames", "format"])]
    pub error: bool,
    /// The cases of a sweep in place of frames; what follows "--" is what `nimbus bench` takes
    #[arg(long, group = "told-more", conflicts_with_all = ["frames", "shard_frames", "format"])]
    pub bench: bool,
    /// A picture in f64 in place of frames, as `nimbus render --reference` draws it: thin, volume,
    /// model or reflections=K
    #[arg(long, value_name = "WHICH", conflicts_with_all = ["frames", "shard_frames", "error", "bench"])]
    pub reference: Option<ReferenceKind>,
    /// The reference's frame
    #[arg(long, value_name = "N", default_value_t = 0, requires = "reference")]
    pub frame: u32,
    /// The reference's samples of every pixel
    #[arg(long, value_name = "N", default_value_t = 1, requires = "reference", value_parser = super::parse_samples)]
    pub samples: u32,
    /// Size of its tiles, pixels [default: 256x256, or by --model]
    #[arg(long, value_name = "WxH", requires = "reference", value_parser = parse_size)]
    pub tile: Option<(u32, u32)>,
    /// Samples of a shard, a power of two: then all shards' sums are the bits of one machine's
    /// [default: 16, or by --model]
    #[arg(long, value_name = "N", requires = "reference", value_parser = parse_power)]
    pub shard_samples: Option<u32>,
    /// Configurations of a shard, with --error [default: 8, or by --model]. Each shard times the
    /// scene as it stands as well
    #[arg(long, value_name = "N", requires = "error", value_parser = clap::value_parser!(u32).range(1..))]
    pub shard_configurations: Option<u32>,
    /// Cases of a shard, with --bench [default: 8, or by --model]. Each shard times the first case
    /// of all as well
    #[arg(long, value_name = "N", requires = "bench", value_parser = clap::value_parser!(u32).range(1..))]
    pub shard_cases: Option<u32>,
    /// Frames of a shard [default: 16, or by --model]. A run opens the device and fills its buffers
    /// once a shard: few make it slow, many lose more when it is killed
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub shard_frames: Option<u32>,
    /// What `nimbus farm calibrate` wrote: shards are cut to take 1 to 10 minutes, and what all of
    /// them will take and cost is said
    #[arg(long, value_name = "FILE", help_heading = "Cost")]
    pub model: Option<PathBuf>,
    /// Nodes that are to share the work, by --model [default: 4]
    #[arg(
        long,
        value_name = "N",
        requires = "model",
        value_parser = clap::value_parser!(u32).range(1..),
        help_heading = "Cost"
    )]
    pub nodes: Option<u32>,
    /// A shard's least and greatest length, seconds, by --model [default: 60,600]
    #[arg(
        long,
        value_name = "LEAST,MOST",
        requires = "model",
        conflicts_with_all = ["shard_frames", "shard_configurations", "shard_cases"],
        value_parser = parse_lengths,
        help_heading = "Cost"
    )]
    pub shard_seconds: Option<(f64, f64)>,
    /// What a node costs in every piece of time that it is paid for by, in any money
    #[arg(long, value_name = "PRICE", requires = "model", help_heading = "Cost")]
    pub rate: Option<f64>,
    /// That piece, seconds: each is paid for whole [default: 3600]
    #[arg(long, value_name = "S", requires = "rate", help_heading = "Cost")]
    pub quantum: Option<f64>,
    /// The share of attempts that fail and are repeated, from 0 to below 1 [default: 0.02]
    #[arg(long, value_name = "SHARE", requires = "rate", help_heading = "Cost")]
    pub retries: Option<f64>,
    /// What pictures are written as [default: png of frames, exr of a reference]
    #[arg(long, value_enum)]
    pub format: Option<FormatArg>,
    /// Seed of the first cloud; the others count on from it
    #[arg(long, value_name = "N", help_heading = "Scene")]
    pub seed: Option<u32>,
    /// Set any key of the scene, e.g. --set lighting.grid=128 (repeatable)
    #[arg(long, value_name = "KEY=VALUE", help_heading = "Scene")]
    pub set: Vec<String>,
    /// Picture size in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size, help_heading = "Scene")]
    pub size: Option<(u32, u32)>,
    /// Folder with shaders that replace those built in
    #[arg(long, value_name = "DIR", help_heading = "Device")]
    pub shaders: Option<PathBuf>,
    /// Vulkan device of every run, by index or part of its name: a node without it refuses the
    /// work. `farm run --device` says otherwise for one
    #[arg(long, value_name = "INDEX|NAME", conflicts_with = "reference", help_heading = "Device")]
    pub device: Option<String>,
    /// Print the plan as JSON, with each shard's arguments and outputs
    #[arg(long)]
    pub json: bool,
    /// No warnings
    #[arg(short, long)]
    pub quiet: bool,
    /// Arguments of `nimbus error` or `nimbus bench`, without scene, results and device
    #[arg(last = true, requires = "told-more", value_name = "ARGUMENTS")]
    pub told: Vec<String>,
}

impl PlanArgs {
    pub fn n_nodes(&self) -> usize {
        self.nodes.map_or(4, |n| n as usize)
    }

    /// A shard's least and greatest length, s.
    pub fn lengths(&self) -> (f64, f64) {
        self.shard_seconds.unwrap_or((60.0, 600.0))
    }
}

/// Frames, configurations or cases from `first`, `end` not counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span {
    pub first: u32,
    pub end: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FormatArg {
    /// 8-bit sRGB, tone-mapped, over the background
    Png,
    /// Linear premultiplied RGBA
    Exr,
}

#[derive(Debug, ClapArgs)]
pub struct CalibrateArgs {
    /// Scene files whose frames are timed
    #[arg(required_unless_present = "farm", conflicts_with = "farm", value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,
    /// Fit to the shards of a farm that is done (repeatable): the way to a model of studies,
    /// benches and references
    #[arg(long, value_name = "DIR", conflicts_with_all = ["frames", "set", "device"])]
    pub farm: Vec<PathBuf>,
    /// File for the model
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Replace an existing file
    #[arg(long)]
    pub force: bool,
    /// Frames of the longer runs
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u32).range(2..))]
    pub frames: u32,
    /// Set any key of the scenes (repeatable)
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Vulkan device, by index or part of its name
    #[arg(long, value_name = "INDEX|NAME")]
    pub device: Option<String>,
    /// Print what was written
    #[arg(long)]
    pub json: bool,
    /// No progress
    #[arg(short, long)]
    pub quiet: bool,
}

#[derive(Debug, ClapArgs)]
pub struct RunArgs {
    /// The plan's folder
    #[arg(long, value_name = "DIR")]
    pub plan: PathBuf,
    /// Vulkan device, by index or part of its name (see `nimbus devices`)
    #[arg(long, value_name = "INDEX|NAME")]
    pub device: Option<String>,
    /// Run with the validation layers; any message fails the shard
    #[arg(long)]
    pub validation: bool,
    /// Say nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
    /// In a task of Slurm: where it has failed so often in a row without finishing anything, it
    /// ends with 1 in place of 75
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub tries: Option<u32>,
    /// Which shard, from 0
    #[arg(long, value_name = "I")]
    pub shard: usize,
}

#[derive(Debug, ClapArgs)]
pub struct LocalArgs {
    /// The plan's folder
    #[arg(long, value_name = "DIR")]
    pub plan: PathBuf,
    /// Processes at a time. One fills a device; a software device fills all cores
    #[arg(short, long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub jobs: u32,
    /// So often a shard is tried that fails in a way that may pass
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    pub tries: u32,
    /// Vulkan device, by index or part of its name
    #[arg(long, value_name = "INDEX|NAME")]
    pub device: Option<String>,
    /// No progress
    #[arg(short, long)]
    pub quiet: bool,
}

#[derive(Debug, ClapArgs)]
pub struct StatusArgs {
    /// The plan's folder
    #[arg(long, value_name = "DIR")]
    pub plan: PathBuf,
    /// Print only the indices that are not done, as Slurm's --array takes them: 0,3-5
    #[arg(long, conflicts_with = "json")]
    pub missing: bool,
    /// Every shard as JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, ClapArgs)]
pub struct MergeArgs {
    /// The plan's folder
    #[arg(long, value_name = "DIR")]
    pub plan: PathBuf,
    /// Folder for the merged result
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Replace results in a folder that is there; what else lies in it stays
    #[arg(long)]
    pub force: bool,
    /// Merge pictures that several devices, drivers or processors drew, too
    #[arg(long)]
    pub mixed: bool,
}

#[derive(Debug, ClapArgs)]
pub struct GcArgs {
    /// The plan's folder
    #[arg(long, value_name = "DIR")]
    pub plan: PathBuf,
    /// Remove unfinished folders of shards that are not done, too, where nothing has happened for
    /// so many hours
    #[arg(long, value_name = "HOURS", default_value_t = 24.0, value_parser = super::parse_positive)]
    pub idle: f64,
    /// Also what was put aside: broken results, and those that differ from the one that is there
    #[arg(long)]
    pub all: bool,
    /// Only say what would be removed
    #[arg(short = 'n', long)]
    pub dry_run: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum EngineArg {
    /// shard.sh, an array's task, and merge.sh
    Slurm,
    /// shard.sh and submit.sh
    Hyperqueue,
    /// template.json, a job template of Open Job Description
    Openjd,
    /// local.sh: the pool of one machine, then the merge
    Local,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SubmitArg {
    Slurm,
}

#[derive(Debug, ClapArgs)]
pub struct JobArgs {
    /// The plan's folder
    #[arg(long, value_name = "DIR")]
    pub plan: PathBuf,
    /// Folder for the merged result [default: "merged" in the plan's folder]. What an earlier merge
    /// left there is replaced (jobs merge with --force)
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// So often a shard, or the merge, is tried that fails in a way that may pass. With Slurm a
    /// shard's failures count in a row, and one that finished frames ends the row; nodes that die
    /// do not count, but for the merge
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    pub tries: u32,
    /// An option for sbatch of the shards, e.g. --sbatch=--gres=gpu:1 (repeatable). The merge has
    /// those that say where and for whom (--account, --partition, --qos, --reservation), too
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    pub sbatch: Vec<String>,
    /// An option for sbatch of the merge, after those (repeatable)
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    pub sbatch_merge: Vec<String>,
}

#[derive(Debug, ClapArgs)]
pub struct EmitArgs {
    #[arg(value_enum)]
    pub engine: EngineArg,
    /// Folder for the files [default: the engine's name in the plan's folder]
    #[arg(long, value_name = "DIR")]
    pub files: Option<PathBuf>,
    #[command(flatten)]
    pub job: JobArgs,
}

#[derive(Debug, ClapArgs)]
pub struct SubmitArgs {
    #[arg(value_enum)]
    pub engine: SubmitArg,
    /// Print the ids as JSON
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub job: JobArgs,
}

pub(super) fn parse_span(text: &str) -> Result<Span, String> {
    let wrong = || format!("expected FIRST..END such as 0..240, or how many, found \"{text}\"");
    let number = |t: &str| t.parse::<u32>().map_err(|_| wrong());
    let span = match text.split_once("..") {
        Some((first, end)) => Span { first: number(first)?, end: number(end)? },
        None => Span { first: 0, end: number(text)? },
    };
    if span.first < span.end {
        Ok(span)
    } else {
        Err(format!("{}: there is nothing in it", wrong()))
    }
}

fn parse_power(text: &str) -> Result<u32, String> {
    let n = text.parse().ok().filter(|n: &u32| n.is_power_of_two() && *n <= MAX_SAMPLES);
    n.ok_or_else(|| {
        format!("expected a power of two such as 16, up to {MAX_SAMPLES}, found \"{text}\"")
    })
}

fn parse_lengths(text: &str) -> Result<(f64, f64), String> {
    let wrong = || {
        format!(
            "expected LEAST,MOST such as 60,600, seconds from 0 and in this order, found \"{text}\""
        )
    };
    let (least, most) = text.split_once(',').ok_or_else(wrong)?;
    let number = |t: &str| {
        t.trim().parse::<f64>().ok().filter(|v| v.is_finite() && *v >= 0.0).ok_or_else(wrong)
    };
    let (least, most) = (number(least)?, number(most)?);
    if least <= most && most > 0.0 { Ok((least, most)) } else { Err(wrong()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans() {
        assert_eq!(parse_span("3..10"), Ok(Span { first: 3, end: 10 }));
        assert_eq!(parse_span("240"), Ok(Span { first: 0, end: 240 }));
        for wrong in ["", "0", "5..5", "7..2", "a..3", "1..", "-1..3", "1..99999999999", "1...3"] {
            assert!(parse_span(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn what_would_be_of_no_effect_is_refused() {
        use clap::Parser;
        let plan = |more: &str| {
            let line = format!("nimbus farm plan a.toml -o b {more}");
            crate::cli::args::Args::try_parse_from(line.split_whitespace())
                .map_err(|cause| cause.to_string())
        };
        for (wrong, missing) in [
            ("--nodes 3", "--model"),
            ("--shard-seconds 1,2", "--model"),
            ("--model m --quantum 60", "--rate"),
            ("--model m --retries 0.1", "--rate"),
            ("--rate 2", "--model"),
            ("--shard-configurations 3", "--error"),
            ("--model m --shard-seconds 1,2 --shard-frames 3", "--shard-frames"),
        ] {
            let said = plan(wrong).unwrap_err();
            assert!(said.contains(missing), "{wrong}: {said}");
        }
        for right in [
            "",
            "--model m --nodes 3 --shard-seconds 1,2 --rate 2 --quantum 60 --retries 0.1",
            "--error -- --grid",
        ] {
            assert!(plan(right).is_ok(), "{right}");
        }
    }

    #[test]
    fn lengths() {
        assert_eq!(parse_lengths("60,600"), Ok((60.0, 600.0)));
        for wrong in ["", "60", "600,60", "-1,5", "0,0", "a,b", "1,inf", "nan,3"] {
            assert!(parse_lengths(wrong).is_err(), "{wrong}");
        }
    }
}
