//! The arguments of `nimbus stress`.

use std::path::PathBuf;

use clap::Args as ClapArgs;

/// Arguments of `nimbus stress`.
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "Examples:\n  nimbus stress\n  nimbus stress --list\n  nimbus stress functions \
        compositing/thin-tiles\n  \
    nimbus stress --json --validation > stress.json\n  nimbus stress --shaders my-shaders functions"
)]
pub struct StressArgs {
    /// Cases to run, by the beginning of their names [default: all]
    #[arg(value_name = "CASE")]
    pub cases: Vec<String>,
    /// List the cases and their bounds without running them
    #[arg(long, conflicts_with_all = ["json", "csv"])]
    pub list: bool,
    /// Print JSON instead of the table
    #[arg(long, conflicts_with = "csv")]
    pub json: bool,
    /// Print CSV instead of the table
    #[arg(long)]
    pub csv: bool,
    /// Vulkan device, by index or part of its name (see `nimbus devices`)
    #[arg(long, value_name = "INDEX|NAME")]
    pub device: Option<String>,
    /// Folder with shaders that replace those built in
    #[arg(long, value_name = "DIR")]
    pub shaders: Option<PathBuf>,
    /// Run with the validation layers; any message fails the command
    #[arg(long)]
    pub validation: bool,
    /// No progress
    #[arg(short, long)]
    pub quiet: bool,
}
