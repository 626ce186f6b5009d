//! The arguments of every command with a scene, and of `nimbus devices`.

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::values::{parse_limits, parse_positive, parse_size};
use crate::gpu::{LoweredLimits, PassTimes};

/// Arguments of every command with a scene.
#[derive(Debug, Clone, ClapArgs)]
pub struct SceneArgs {
    /// Vulkan device, by its index in `nimbus devices` (digits) or a part of its name
    #[arg(long, value_name = "INDEX|NAME", help_heading = "Device")]
    pub device: Option<String>,
    /// Folder with shaders that replace those built in
    #[arg(long, value_name = "DIR", help_heading = "Device")]
    pub shaders: Option<PathBuf>,
    /// Run with the validation layers; any message fails the command
    #[arg(long, help_heading = "Device")]
    pub validation: bool,
    /// Fill every new buffer with NaN, and check a pattern behind its end after each pass; a pass
    /// that writes there fails the command, and the pictures are the same
    #[arg(long, help_heading = "Device")]
    pub guard: bool,
    /// Submit work in parts that are predicted to take at most MS milliseconds each: the system may
    /// take a busy GPU for hung [default: 500 on a GPU, no limit on a CPU]
    #[arg(long, value_name = "MS", value_parser = parse_positive, help_heading = "Device")]
    pub max_submit_ms: Option<f64>,
    /// Take the times of passes in this way
    #[arg(
        long,
        value_enum,
        value_name = "HOW",
        default_value = "drained",
        help_heading = "Device"
    )]
    pub pass_times: PassTimes,
    /// Run as a device of these lower limits would: a TOML file, such as
    /// tests/data/limits/mali-g78.toml
    #[arg(long, value_name = "FILE", value_parser = parse_limits, help_heading = "Device")]
    pub limits: Option<LoweredLimits>,
    /// Seed of the first cloud; each further cloud has the next number
    #[arg(long, value_name = "N", help_heading = "Scene")]
    pub seed: Option<u32>,
    /// Set any key of the scene, e.g. --set lighting.grid=128 or --set cloud.0.seed=7 (repeatable)
    #[arg(long, value_name = "KEY=VALUE", help_heading = "Scene")]
    pub set: Vec<String>,
    /// Picture size in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size, help_heading = "Scene")]
    pub size: Option<(u32, u32)>,
    /// Run every pass in every frame; the pictures are the same, to the byte
    #[arg(long, help_heading = "Scene")]
    pub no_skip: bool,
    /// No warnings, no progress, no line about what was written
    #[arg(short, long)]
    pub quiet: bool,
    /// Print device, sizes and passes
    #[arg(short, long, conflicts_with = "quiet")]
    pub verbose: bool,
}

/// Budget of the light, of the commands that draw.
#[derive(Debug, Clone, ClapArgs)]
pub struct BudgetArgs {
    /// Light clouds as near to transport as a frame of MS milliseconds of device time allows:
    /// lighting.mode = "auto" with lighting.budget_ms
    #[arg(long, value_name = "MS", value_parser = parse_positive, help_heading = "Scene")]
    pub budget_ms: Option<f64>,
    /// Light clouds by the fastest way whose error against transport is at most this share of their
    /// light: lighting.mode = "auto" with lighting.budget_error
    #[arg(long, value_name = "SHARE", value_parser = parse_positive, help_heading = "Scene")]
    pub budget_error: Option<f64>,
}

impl BudgetArgs {
    /// Puts the budget before other settings, which may replace it.
    pub fn put_before(&self, set: &mut Vec<String>) {
        let ms = self.budget_ms.map(|ms| format!("lighting.budget_ms={ms}"));
        let error = self.budget_error.map(|error| format!("lighting.budget_error={error}"));
        let budget: Vec<String> = ms.into_iter().chain(error).collect();
        if !budget.is_empty() {
            let all = std::iter::once("lighting.mode=\"auto\"".to_owned()).chain(budget);
            set.splice(0..0, all);
        }
    }
}

/// Arguments of `nimbus devices`.
#[derive(Debug, ClapArgs)]
#[command(after_help = "All devices, and what the driver's compiler makes of two scenes:\n  \
    nimbus devices\n  nimbus devices --kernels scenes/hello.toml scenes/ground.toml\n\n\
    The commands that lock clocks before a benchmark:\n  nimbus devices --lock\n\n\
    What the device can do at most, and how near to it passes are:\n  nimbus devices --roof\n  \
    nimbus bench scenes/threads.toml -v")]
pub struct DevicesArgs {
    /// The device to mark as used, by index or part of its name
    #[arg(long, value_name = "INDEX|NAME")]
    pub device: Option<String>,
    /// Make every pipeline of these scenes without running any, and print what the driver's
    /// compiler says of them: registers, spills, memory, occupancy, code
    #[arg(long, value_name = "SCENE", num_args = 1.., help_heading = "Kernels")]
    pub kernels: Vec<PathBuf>,
    /// Set any key of the scenes (repeatable)
    #[arg(long, value_name = "KEY=VALUE", requires = "kernels", help_heading = "Kernels")]
    pub set: Vec<String>,
    /// Folder with shaders that replace those built in
    #[arg(long, value_name = "DIR", requires = "kernels", help_heading = "Kernels")]
    pub shaders: Option<PathBuf>,
    /// Make them as a device of these lower limits would
    #[arg(long, value_name = "FILE", value_parser = parse_limits, requires = "kernels")]
    #[arg(help_heading = "Kernels")]
    pub limits: Option<LoweredLimits>,
    /// Print the commands that hold each device's clocks at one speed while it is timed, and those
    /// that undo it; nothing is changed
    #[arg(long, conflicts_with_all = ["kernels", "json"])]
    pub lock: bool,
    /// Measure what the device can do at most: bandwidth by the size of the data, arithmetic of
    /// each kind of number, and atomics, in less than 30 s. The roofs are kept, and bench shows
    /// which share of them each pass reaches
    #[arg(long, conflicts_with_all = ["kernels", "lock"])]
    pub roof: bool,
    /// Keep the submissions that measure below MS milliseconds [default: 500 on a GPU, no limit on
    /// a CPU]
    #[arg(long, value_name = "MS", value_parser = parse_positive, requires = "roof")]
    pub max_submit_ms: Option<f64>,
    /// Print JSON instead of the table
    #[arg(long)]
    pub json: bool,
    /// List the devices under the validation layers; any message fails the command
    #[arg(long)]
    pub validation: bool,
    /// No warnings
    #[arg(short, long)]
    pub quiet: bool,
    /// Print which device is used, and why
    #[arg(short, long, conflicts_with = "quiet")]
    pub verbose: bool,
}
