//! Arguments of `nimbus farm plan` and `nimbus farm calibrate`.

use std::path::PathBuf;

use clap::{Args as ClapArgs, ValueEnum};

use super::values::{at_least_one, limited, parse_size};
use crate::io::image::ImageKind;
use crate::reference::picture::{MAX_SAMPLES, ReferenceKind};

/// Arguments of `nimbus farm plan`.
#[derive(Debug, ClapArgs)]
pub struct PlanArgs {
    /// Scene file, which every node has to see under the same path
    pub scene: PathBuf,
    /// Folder of the plan and its results, which every node has to see
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Frames: FIRST..END (without END), or their number from 0 [default: the scene's]
    #[arg(long, value_name = "FIRST..END", value_parser = parse_span)]
    pub frames: Option<Span>,
    /// Plan the configurations of an error study in place of frames. The arguments after "--" are
    /// those of `nimbus error`
    #[arg(long, group = "told-more", conflicts_with_all = ["frames", "shard_frames", "format"])]
    pub error: bool,
    /// Plan the cases of a bench in place of frames. The arguments after "--" are those of `nimbus
    /// bench`
    #[arg(long, group = "told-more", conflicts_with_all = ["frames", "shard_frames", "format"])]
    pub bench: bool,
    /// Plan a picture in f64 in place of frames, as `nimbus render --reference` draws it: thin,
    /// slices, volume, model, reflections=K or transport
    #[arg(
        long,
        value_name = "WHICH",
        conflicts_with_all = ["frames", "shard_frames", "error", "bench"]
    )]
    pub reference: Option<ReferenceKind>,
    /// Frame of the reference
    #[arg(long, value_name = "N", default_value_t = 0, requires = "reference")]
    pub frame: u32,
    /// Samples of every pixel of the reference [default: 1, and 64 random paths of "transport"]
    #[arg(
        long,
        value_name = "N",
        requires = "reference",
        value_parser = super::values::parse_samples
    )]
    pub samples: Option<u32>,
    /// Size of the reference's tiles, pixels [default: 256x256, or by --model]
    #[arg(long, value_name = "WxH", requires = "reference", value_parser = parse_size)]
    pub tile: Option<(u32, u32)>,
    /// Samples of a shard: a power of two, with which the sums of all shards have the bits of a
    /// single machine's [default: 16, or by --model]
    #[arg(long, value_name = "N", requires = "reference", value_parser = parse_power)]
    pub shard_samples: Option<u32>,
    /// Configurations of a shard, with --error [default: 8, or by --model]. Each shard also times
    /// the base configuration
    #[arg(long, value_name = "N", requires = "error", value_parser = at_least_one())]
    pub shard_configurations: Option<u32>,
    /// Cases of a shard, with --bench [default: 8, or by --model]. Each shard also times the first
    /// case of all
    #[arg(long, value_name = "N", requires = "bench", value_parser = at_least_one())]
    pub shard_cases: Option<u32>,
    /// Frames of a shard [default: 16, or by --model]. Each shard opens the device and fills its
    /// buffers once, which takes time; a killed run of a long shard delays the others more
    #[arg(long, value_name = "N", value_parser = at_least_one())]
    pub shard_frames: Option<u32>,
    /// Cost model from `nimbus farm calibrate`: shards are cut to take 1 to 10 minutes, and the
    /// duration and price of all of them are printed
    #[arg(long, value_name = "FILE", help_heading = "Cost")]
    pub model: Option<PathBuf>,
    /// Nodes that share the work, by --model [default: 4]
    #[arg(
        long,
        value_name = "N",
        requires = "model",
        value_parser = limited(1, 10_000, "shards are assigned to each of them"),
        help_heading = "Cost"
    )]
    pub nodes: Option<u32>,
    /// The least and the greatest duration of a shard, seconds, by --model [default: 60,600]
    #[arg(
        long,
        value_name = "LEAST,MOST",
        requires = "model",
        conflicts_with_all = ["shard_frames", "shard_configurations", "shard_cases"],
        value_parser = parse_lengths,
        help_heading = "Cost"
    )]
    pub shard_seconds: Option<(f64, f64)>,
    /// Price of a node for the period --quantum, in any currency
    #[arg(long, value_name = "PRICE", requires = "model", help_heading = "Cost")]
    pub rate: Option<f64>,
    /// Period that is paid for as a whole, seconds [default: 3600]
    #[arg(long, value_name = "S", requires = "rate", help_heading = "Cost")]
    pub quantum: Option<f64>,
    /// Share of attempts that fail and are repeated, from 0 to below 1 [default: 0.02]
    #[arg(long, value_name = "SHARE", requires = "rate", help_heading = "Cost")]
    pub retries: Option<f64>,
    /// Format of pictures [default: png for frames, exr for a reference]
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
    /// Vulkan device of every run, by index or part of its name. Runs fail on a node without it;
    /// `farm run --device` comes before it
    #[arg(long, value_name = "INDEX|NAME", conflicts_with = "reference", help_heading = "Device")]
    pub device: Option<String>,
    /// Print the plan as JSON, with each shard's arguments and outputs
    #[arg(long)]
    pub json: bool,
    /// Print no warnings
    #[arg(short, long)]
    pub quiet: bool,
    /// Arguments of `nimbus error` or `nimbus bench`, except for scene, results and device
    #[arg(last = true, requires = "told-more", value_name = "ARGUMENTS")]
    pub told: Vec<String>,
}

impl PlanArgs {
    /// Returns the number of nodes that share the work.
    pub fn n_nodes(&self) -> usize {
        self.nodes.map_or(4, |n| n as usize)
    }
}

/// A range of frames, configurations or cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span {
    /// The first of them.
    pub first: u32,
    /// The one after the last.
    pub end: u32,
}

/// Formats of pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FormatArg {
    /// 8-bit sRGB, tone-mapped, over the background
    Png,
    /// Linear premultiplied RGBA
    Exr,
}

impl From<FormatArg> for ImageKind {
    fn from(format: FormatArg) -> ImageKind {
        match format {
            FormatArg::Png => ImageKind::Png,
            FormatArg::Exr => ImageKind::Exr,
        }
    }
}

/// Arguments of `nimbus farm calibrate`.
#[derive(Debug, ClapArgs)]
pub struct CalibrateArgs {
    /// Scene files whose frames are timed
    #[arg(required_unless_present = "farm", conflicts_with = "farm", value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,
    /// Fit to the shards of a finished farm (repeatable). Models of studies, benches and references
    /// are made so
    #[arg(long, value_name = "DIR", conflicts_with_all = ["frames", "set", "device"])]
    pub farm: Vec<PathBuf>,
    /// File for the model
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Replace an existing file
    #[arg(long)]
    pub force: bool,
    /// Frames of the longer runs
    #[arg(
        long,
        value_name = "N",
        default_value_t = 12,
        value_parser = limited(2, 10_000, "calibration takes seconds, not days")
    )]
    pub frames: u32,
    /// Set any key of the scenes (repeatable)
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Vulkan device, by index or part of its name
    #[arg(long, value_name = "INDEX|NAME")]
    pub device: Option<String>,
    /// Print the file's content
    #[arg(long)]
    pub json: bool,
    /// Print no progress
    #[arg(short, long)]
    pub quiet: bool,
}

/// Parses FIRST..END, or the number of items from 0.
pub(super) fn parse_span(text: &str) -> Result<Span, String> {
    let wrong = || format!("expected FIRST..END such as 0..240, or a number, found \"{text}\"");
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
    let number = |t: &str| t.trim().parse::<f64>().ok().filter(|v| v.is_finite() && *v >= 0.0);
    text.split_once(',')
        .and_then(|(least, most)| Some((number(least)?, number(most)?)))
        .filter(|(least, most)| least <= most && *most > 0.0)
        .ok_or_else(|| {
            format!(
                "expected LEAST,MOST such as 60,600, seconds from 0 and in this order, found \
                 \"{text}\""
            )
        })
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[test]
    fn spans_are_parsed() {
        assert_eq!(parse_span("3..10"), Ok(Span { first: 3, end: 10 }));
        assert_eq!(parse_span("240"), Ok(Span { first: 0, end: 240 }));
        for wrong in ["", "0", "5..5", "7..2", "a..3", "1..", "-1..3", "1..99999999999", "1...3"] {
            assert!(parse_span(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn options_without_effect_are_refused() {
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
            let error = plan(wrong).unwrap_err();
            assert!(error.contains(missing), "{wrong}: {error}");
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
    fn lengths_are_parsed() {
        assert_eq!(parse_lengths("60,600"), Ok((60.0, 600.0)));
        for wrong in ["", "60", "600,60", "-1,5", "0,0", "a,b", "1,inf", "nan,3"] {
            assert!(parse_lengths(wrong).is_err(), "{wrong}");
        }
    }
}
