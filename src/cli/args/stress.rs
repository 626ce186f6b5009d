//! The arguments of `nimbus stress`.

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::values::{parse_limits, parse_positive};
use crate::gpu::LoweredLimits;

/// Arguments of `nimbus stress`.
#[derive(Debug, Clone, ClapArgs)]
#[command(after_help = "The families of cases, the cases of one, and what one case checks:\n  \
    nimbus stress --list\n  nimbus stress --list functions\n  \
    nimbus stress --list functions/division\n\n\
    All cases, a family and a case, and a family with the shaders of a folder:\n  \
    nimbus stress\n  nimbus stress functions compositing/thin-tiles\n  \
    nimbus stress --json --validation functions\n  nimbus stress --shaders shaders functions")]
pub struct StressArgs {
    /// Cases to run, by the beginning of their names [default: all]
    #[arg(value_name = "CASE")]
    pub cases: Vec<String>,
    /// List the families without running them; with CASE, list these cases and their bounds
    #[arg(long, conflicts_with_all = ["json", "csv"])]
    pub list: bool,
    /// Print JSON instead of the table
    #[arg(long, conflicts_with = "csv")]
    pub json: bool,
    /// Print CSV instead of the table
    #[arg(long)]
    pub csv: bool,
    /// Vulkan device, by its index in `nimbus devices` (digits) or a part of its name
    #[arg(long, value_name = "INDEX|NAME")]
    pub device: Option<String>,
    /// Folder with shaders that replace those built in
    #[arg(long, value_name = "DIR")]
    pub shaders: Option<PathBuf>,
    /// Run with the validation layers; any message fails the command
    #[arg(long)]
    pub validation: bool,
    /// Fill every new buffer with NaN, and check a pattern behind its end after each pass; a pass
    /// that writes there breaks its case
    #[arg(long)]
    pub guard: bool,
    /// Submit work in parts that are predicted to take at most MS milliseconds each: the system may
    /// take a busy GPU for hung [default: 500 on a GPU, no limit on a CPU]
    #[arg(long, value_name = "MS", value_parser = parse_positive)]
    pub max_submit_ms: Option<f64>,
    /// Run as a device of these lower limits would: a TOML file, such as
    /// tests/data/limits/mali-g78.toml
    #[arg(long, value_name = "FILE", value_parser = parse_limits)]
    pub limits: Option<LoweredLimits>,
    /// No progress
    #[arg(short, long)]
    pub quiet: bool,
}
