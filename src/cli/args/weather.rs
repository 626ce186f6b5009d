//! The arguments of `nimbus weather`.

use std::path::PathBuf;

use clap::Args as ClapArgs;

/// Arguments of `nimbus weather`.
#[derive(Debug, ClapArgs)]
#[command(after_help = "The contents of a file, and one of its steps alone:\n  \
    nimbus weather scenes/weather/katrina.nc\n  nimbus weather scenes/weather/supercell.nc --step \
    2\n\n\
    The same for programs, with the greatest optical depth of every step:\n  \
    nimbus weather scenes/weather/katrina.nc --json\n\n\
    Exit codes: 0 done; 2 no such file, or none that clouds can be made of.")]
pub struct WeatherArgs {
    /// Weather file: output of WRF (wrfout_d01_…)
    pub file: PathBuf,
    /// Read the clouds of this step only, counted from 0
    #[arg(long, value_name = "N")]
    pub step: Option<usize>,
    /// Compare the file's clouds with those that would be diagnosed from humidity without them
    #[arg(long)]
    pub diagnosed: bool,
    /// Print JSON instead of the tables
    #[arg(long)]
    pub json: bool,
    /// No notes, no progress
    #[arg(short, long)]
    pub quiet: bool,
}
