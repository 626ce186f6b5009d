//! The arguments of `nimbus stress`.

use std::path::PathBuf;

use clap::Args as ClapArgs;

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
    /// No progress
    #[arg(short, long)]
    pub quiet: bool,
}
