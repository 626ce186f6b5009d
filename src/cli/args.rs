//! The command line, as typed.

mod farm;
mod farm_plan;
mod results;
mod stress;
mod study;
#[cfg(feature = "window")]
mod view;
mod weather;

use std::path::PathBuf;

use clap::{Args as ClapArgs, ColorChoice, Parser, Subcommand, ValueEnum};

use crate::io::scene_file::MAX_SIDE;
use crate::reference::picture::{MAX_SAMPLES, ReferenceKind};
pub use farm::{
    EmitArgs, EngineArg, FarmArgs, FarmCommand, GcArgs, JobArgs, LocalArgs, MergeArgs, RunArgs,
    StatusArgs, SubmitArg, SubmitArgs,
};
pub use farm_plan::{CalibrateArgs, FormatArg, PlanArgs, Span};
pub use results::{CompareArgs, ReportArgs};
pub use stress::StressArgs;
pub use study::{ErrorArgs, LedgerArgs, MetricArg, TimeArg};
#[cfg(feature = "window")]
pub use view::{EditArgs, PresentArg, ViewArgs};
pub use weather::WeatherArgs;

/// A Vulkan testbed for cloud particles: how much error does a millisecond buy?
#[derive(Debug, Parser)]
#[command(version, propagate_version = true, max_term_width = 100)]
#[command(after_help = "Start with:\n  nimbus render scenes/hello.toml -o hello.png\n  \
    nimbus bench scenes/threads.toml\n  nimbus compare before after\n  nimbus report before after \
    -o report.html\n  \
    nimbus inspect scenes/cubes-554.toml\n  nimbus weather scenes/weather/katrina.nc\n  nimbus \
    devices\n\n\
    Exit codes: 0 done; 1 a check failed; 2 bad input or usage; 3 device or driver;\n  70, 75 of \
    `nimbus farm`; 101 a fault of nimbus itself; 130 interrupted.")]
pub struct Args {
    #[command(subcommand)]
    pub command: Command,
    /// When to colour messages
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto")]
    pub color: ColorChoice,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Draw one frame to a PNG or EXR file
    ///
    /// With --reference the frame is drawn in f64 on the processor, without a Vulkan device:
    /// particles, lighting and picture from the mathematics (docs/model.md §9) and from no shader.
    /// "thin" composes the sprites that nimbus draws, sorted by exact depth: what differs from it
    /// is arithmetic. "volume" integrates light through the overlapping blobs themselves, every
    /// pixel to about a millionth of the brightest: what differs from it is what sprites leave out.
    /// "model" lights them by the model itself, and surfaces pixel by pixel; "reflections=K" with
    /// as many reflections as K says. --samples takes the mean over each pixel's area, and more
    /// random paths, in place of what its centre shows.
    Render(RenderArgs),
    /// Time a scene, one thread against two
    Bench(BenchArgs),
    /// Say whether one bench's results are faster than another's, or how far two pictures are apart
    ///
    /// Of two results folders: for every loop that both ran, and for frame, game step, render step,
    /// GPU and each pass, the medians of A and B, their ratio B / A with a 95 % interval, and a
    /// verdict. "faster" and "slower" mean that the interval leaves out 1; "no difference found"
    /// means that it does not, which is not the same as "equal": more frames make it narrower.
    ///
    /// Only `frame` is the headline. The other rows are not corrected for many comparisons: of
    /// twenty that are equal, one will seem to differ.
    ///
    /// The interval (block bootstrap over the frames of frames.csv, runs of √n neighbours drawn
    /// together) knows the noise within the two runs, not what changes from one start to the next,
    /// such as who else uses the machine. Time A twice and compare the two to see that: what
    /// differs there is no difference.
    ///
    /// Of two pictures, both .exr or both .png and of one size: RMSE, the greatest difference,
    /// relMSE and PSNR of the numbers as they are stored (an EXR's are linear, a PNG's are sRGB in
    /// 0..1), and SSIM and FLIP of the pictures as they are shown: an EXR over black, through the
    /// default tone map. A is what is measured by. Pixels that are not finite in either picture are
    /// counted and left out; SSIM and FLIP take them for black in both.
    Compare(CompareArgs),
    /// Say how much error a millisecond buys: run time against error over a scene's knobs
    ///
    /// Every configuration of the knobs is drawn once and compared with a reference in f64, and all
    /// are timed in turn with the scene as it stands. What is printed is sorted by time; "*" marks
    /// the front: no other configuration is faster without being less exact. "~" marks what others
    /// beat, but none that is faster by more than the 95 % intervals.
    ///
    /// References (--against), each without something that the one before it shares with the
    /// device's picture: "thin", the sprites in f64, all and uncut, in the scene's own light;
    /// "volume", the integral over the overlapping blobs in that light; "model", that of light
    /// without density grid, groups, basis and pairs: closed forms, a facet a particle, areas
    /// integrated; "reflections=K", that with K reflections, those beyond the second by random
    /// paths. For knobs of light take the latter two.
    ///
    /// Frames are timed as if everything moved in each, but for what a run makes once (particles of
    /// boxes, textures); --as-played times what the scene's own frames leave to be done. Of "auto"
    /// in the scene's drawing what changes nothing is taken.
    Error(ErrorArgs),
    /// Say what every approximation is off by, each against the one below it
    ///
    /// A chain of pictures from the one that is drawn down to the whole model with further
    /// reflections; each has one approximation less than the one before it, and a row says how far
    /// the two are apart. The first ones are drawn by the device, and their times are taken in
    /// turn; the others are computed in f64. By the triangle inequality the rows' sum is at least
    /// the total, which is checked (exit code 1 where it is not so).
    Ledger(LedgerArgs),
    /// Say whether this device computes at the edges what nimbus claims
    ///
    /// Functions, particles, light, layers, far places and late times, each at the edge of what can
    /// be asked for, against f64 (or what must be exact), within a bound that is derived from the
    /// precision that Vulkan promises (docs/stability.md) and not tuned. A row a case: the number
    /// of the device that is the furthest off by its bound, what it should be, error and bound.
    /// Exit code 1 where one is beyond.
    Stress(StressArgs),
    /// Make one HTML page of results: where they were measured, plots, tables, pictures
    ///
    /// Of every folder that bench, error or ledger wrote: machine and provenance, every figure as a
    /// table, frame times and passes, time against error, the ledger, and the pictures in it. Where
    /// two benches or two studies are given, the later ones are compared with the first: ratios
    /// with their intervals, the pictures behind a slider, and where they differ.
    ///
    /// The page is one file and loads nothing: it can be mailed, kept beside the results, or
    /// printed.
    Report(ReportArgs),
    /// Print a stage's buffer, or what f64 says it should be
    Inspect(InspectArgs),
    /// List Vulkan devices, their limits, and which one nimbus uses
    Devices(DevicesArgs),
    /// Look at a scene in a window: fly, turn what is drawn and how, read frame times
    ///
    /// Keys and mouse are printed when it opens and by "?". The loops are those that bench times,
    /// one after the other or side by side, and "t" goes from one to the other; the window's title
    /// says how long their frames take, and when it is closed all of them are summed up. "i" prints
    /// and copies the render command that draws what is seen.
    ///
    /// Panels ("h") show times, passes, the plan and every setting. "m" keeps the settings as B, to
    /// compare with what is turned from then on; "j" measures both by the f64 reference while the
    /// eye and the frame stand still; "F10" saves what is seen as a scene. The scene, the files
    /// that it names and the shaders of --shaders are read again when they change.
    #[cfg(feature = "window")]
    View(ViewArgs),
    /// Shape a cloud by hand: boxes that are filled with particles
    ///
    /// Boxes are added, moved, scaled, mirrored and numbered with the mouse, keys (listed by "?")
    /// and typed numbers with units; the cloud that they make is drawn while they change, and only
    /// particles of a box that has changed are made anew. What is saved is the box file that scenes
    /// name: `nimbus render` draws it as the editor does.
    #[cfg(feature = "window")]
    Edit(EditArgs),
    /// Say what is in a weather file, and what clouds there are in it
    ///
    /// Reads output of WRF as NetCDF of every kind (classic, 64-bit offset, CDF-5, NetCDF-4) and
    /// prints variables, steps with their times, map, and of every step the clouds: how many cells
    /// have some, the greatest extinction and the greatest optical depth straight up, base and top.
    /// Needs no Vulkan device.
    ///
    /// Extinction is 3/2 q ρ/(ρ_x r_x), summed over cloud water (10 µm droplets), ice (30 µm) and
    /// snow (100 µm); rain and graupel are left out. Where a file has none of the three, clouds are
    /// diagnosed from relative humidity, and the output says so (docs/model.md §15).
    ///
    /// P, PB, T, PH, PHB and the attributes DX and DY are needed; what else is missing is told.
    /// What is negative, NaN or a fill value among mixing ratios is counted and taken for none;
    /// elsewhere it is an error.
    Weather(WeatherArgs),
    /// Spread frames, studies, sweeps or reference pictures over machines that share a folder
    ///
    /// `plan` cuts the work into shards, each with a key that follows from scene, shaders, build
    /// and range. `run` does one shard: it is what an engine (Slurm, another one, or `local`, the
    /// pool of one machine) starts, as often and on as many nodes as it likes. A result appears
    /// whole or not at all, is verified by its content before it counts, and frames that a killed
    /// run has finished are gone on with. `status` says what is missing, `merge` puts all together,
    /// `gc` clears away what attempts have left.
    #[command(subcommand_required = true)]
    Farm(FarmArgs),
}

/// What every command with a scene takes.
#[derive(Debug, Clone, ClapArgs)]
pub struct SceneArgs {
    /// Vulkan device, by index or part of its name (see `nimbus devices`)
    #[arg(long, value_name = "INDEX|NAME", help_heading = "Device")]
    pub device: Option<String>,
    /// Folder with shaders that replace those built in
    #[arg(long, value_name = "DIR", help_heading = "Device")]
    pub shaders: Option<PathBuf>,
    /// Run with the validation layers; any message fails the command
    #[arg(long, help_heading = "Device")]
    pub validation: bool,
    /// Fill every buffer with NaN when it is made, so that what is read before it is written shows;
    /// the pictures are the same
    #[arg(long, help_heading = "Device")]
    pub poison: bool,
    /// Seed of the first cloud; the others count on from it
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
    /// No warnings, no progress
    #[arg(short, long)]
    pub quiet: bool,
    /// Say more: device, sizes, passes
    #[arg(short, long, conflicts_with = "quiet")]
    pub verbose: bool,
}

#[derive(Debug, ClapArgs)]
#[command(after_help = "How far the sprites are from both truths:\n  \
    nimbus render scenes/cubes-554.toml --size 200x150 -o drawn.exr\n  \
    nimbus render scenes/cubes-554.toml --size 200x150 -o thin.exr --reference thin\n  \
    nimbus render scenes/cubes-554.toml --size 200x150 --set 'cloud.0.texture=\"none\"' -o \
    volume.exr --reference volume\n  \
    nimbus compare thin.exr drawn.exr\n  nimbus compare volume.exr thin.exr\n\n\
    The second reflection of a reference is integrated over areas: minutes for hundreds of facets. \
    With \
    --set 'lighting.mode=\"first\"' there is none.")]
pub struct RenderArgs {
    /// Scene file
    pub scene: PathBuf,
    /// Picture: .png (tone-mapped, over the background) or .exr (linear RGBA, premultiplied)
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Frame number
    #[arg(long, value_name = "N", default_value_t = 0, conflicts_with = "time")]
    pub frame: u32,
    /// Time in seconds, in place of a frame number
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub time: Option<f64>,
    /// Draw the f64 reference in place of the device's picture: thin (the same sprites), volume
    /// (what they stand for), model, or reflections=K
    #[arg(long, value_name = "WHICH")]
    #[arg(conflicts_with_all = ["device", "shaders", "validation", "no_skip"])]
    pub reference: Option<ReferenceKind>,
    /// Samples of every pixel of a reference: the first through its centre, the others spread over
    /// it
    #[arg(long, value_name = "N", default_value_t = 1, requires = "reference", value_parser = parse_samples)]
    pub samples: u32,
    /// Replace an existing file
    #[arg(long)]
    pub force: bool,
    /// Print what was drawn as JSON: hash of the picture, device and passes, or the reference and
    /// its error
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub options: SceneArgs,
}

#[derive(Debug, ClapArgs)]
#[command(after_help = "Time against particles and picture size:\n  \
    nimbus bench scenes/cubes-554.toml --sweep draw.particles=500,5000,50000 --sweep \
    size=800x600,1024x768\n\n\
    Draw the frame times here, and as SVG files beside the results:\n  \
    nimbus bench scenes/threads.toml --plot --out run\n\n\
    A scene's [[phase]] sections are timed one by one; --set and --sweep count for each of \
    them.\n\n\
    Exit codes: 0 done; 2 bad input; 3 device or driver; 130 interrupted, what was \
    finished is kept.")]
pub struct BenchArgs {
    /// Scene files, timed one after the other
    #[arg(required = true)]
    pub scenes: Vec<PathBuf>,
    /// Which loops to time; "both" runs them in alternating blocks. A phase that sets threads.mode
    /// has its own
    #[arg(long, value_enum, default_value = "both")]
    pub threading: ThreadingArg,
    /// Time the scene at each of these values of a key, e.g. draw.cutoff=2,3 or
    /// size=800x600,1024x768 (repeatable: all combinations)
    #[arg(long, value_name = "KEY=VALUE,…")]
    pub sweep: Vec<String>,
    /// Timed frames in a block [default: the scene's, or the phase's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: Option<u32>,
    /// Frames at the start of every block that are not counted
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub warmup: u32,
    /// Do not time blocks of frames that skip nothing: quicker, but what skipping saves is not
    /// known
    #[arg(long, conflicts_with = "no_skip")]
    pub no_saved: bool,
    /// Blocks of each loop, in the order A B B A …; with an even number a steady drift cancels
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..))]
    pub repeat: u32,
    /// Only these of the cases, counted from 0, after the first of all. What the nodes of a farm
    /// run (one scene)
    #[arg(long, value_name = "FIRST..END", value_parser = farm_plan::parse_span, requires = "out", hide_short_help = true)]
    pub part: Option<Span>,
    /// Folder for run.json, frames.csv and the last frame of every case as a PNG (with several
    /// scenes: a folder each in it)
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Draw the frame times below the table; with --out also as frames.svg, and the passes' times
    /// as passes.svg
    #[arg(long)]
    pub plot: bool,
    /// Write every frame's image hash to frames.csv; reading the frames back disturbs the times
    #[arg(long, requires = "out")]
    pub hash_frames: bool,
    /// Time line of every step and pass, for Perfetto or chrome://tracing (one scene)
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// Replace existing results
    #[arg(long)]
    pub force: bool,
    /// Print run.json in place of the table
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub options: SceneArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ThreadingArg {
    Serial,
    Parallel,
    Both,
}

#[derive(Debug, ClapArgs)]
#[command(group = clap::ArgGroup::new("what").args(["boxes", "particles", "facets", "plan", "basis"]))]
pub struct InspectArgs {
    /// Scene file
    pub scene: PathBuf,
    /// Every box: particles, attempts, acceptance rate, folded (the default)
    #[arg(long)]
    pub boxes: bool,
    /// Every particle, in the scene's coordinates
    #[arg(long)]
    pub particles: bool,
    /// Every lighting facet: place, normal, area, irradiance, radiance
    #[arg(long)]
    pub facets: bool,
    /// With --facets: the area means of every surface in place of its facets, and no clouds
    #[arg(long, requires = "facets")]
    pub per_surface: bool,
    /// What the first frames run and skip, and why
    #[arg(long)]
    pub plan: bool,
    /// The BRDF basis of the scene's settings; needs no device. All three come with --json
    #[arg(long, value_enum, value_name = "WHAT", num_args = 0..=1, default_missing_value = "table")]
    #[arg(conflicts_with_all = ["reference", "frame"])]
    pub basis: Option<BasisArg>,
    /// The scene's air: humidity, dew point, and where its clouds have their bases; needs no device
    #[arg(long, conflicts_with_all = ["boxes", "particles", "facets", "plan", "basis", "reference"])]
    pub air: bool,
    /// The f64 reference's values in place of the device's
    #[arg(long, conflicts_with = "plan")]
    pub reference: bool,
    /// Frame number (with --plan: the number of frames, default 3)
    #[arg(long, value_name = "N")]
    pub frame: Option<u32>,
    /// JSON in place of CSV
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub options: SceneArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BasisArg {
    /// Every basis function over γ, node by node (the default)
    Table,
    /// The singular values, and which were kept
    Values,
    /// The relative error over the range of exponents, and of every glossy material
    Errors,
}

#[derive(Debug, ClapArgs)]
pub struct DevicesArgs {
    /// The device to mark as used, by index or part of its name
    #[arg(long, value_name = "INDEX|NAME")]
    pub device: Option<String>,
    /// JSON in place of the table
    #[arg(long)]
    pub json: bool,
    /// List them under the validation layers; any message fails the command
    #[arg(long)]
    pub validation: bool,
    /// No warnings
    #[arg(short, long)]
    pub quiet: bool,
    /// Say more: which device is used, and why
    #[arg(short, long, conflicts_with = "quiet")]
    pub verbose: bool,
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let wrong = || {
        format!(
            "expected WIDTHxHEIGHT such as 800x600, each from 1 to {MAX_SIDE}, found \"{text}\""
        )
    };
    let (w, h) = text.split_once(['x', 'X', '×']).ok_or_else(wrong)?;
    let parse =
        |t: &str| t.parse::<u32>().ok().filter(|n| (1..=MAX_SIDE).contains(n)).ok_or_else(wrong);
    Ok((parse(w)?, parse(h)?))
}

fn parse_samples(text: &str) -> Result<u32, String> {
    let n = text.parse().ok().filter(|n| (1..=MAX_SAMPLES).contains(n));
    n.ok_or_else(|| {
        format!("expected a number of samples from 1 to {MAX_SAMPLES}, found \"{text}\"")
    })
}

fn parse_positive(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|v| v.is_finite() && *v > 0.0);
    value.ok_or_else(|| format!("expected a number above 0, found \"{text}\""))
}

fn parse_limit(text: &str) -> Result<(String, f64), String> {
    let wrong = || format!("expected METRIC=VALUE such as rmse=1e-3, found \"{text}\"");
    let (metric, value) = text.split_once('=').ok_or_else(wrong)?;
    Ok((metric.to_owned(), value.parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(wrong)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_declaration_is_consistent() {
        use clap::CommandFactory;
        Args::command().debug_assert();
    }

    #[test]
    fn sizes() {
        assert_eq!(parse_size("800x600"), Ok((800, 600)));
        assert_eq!(parse_size("16384x1"), Ok((16384, 1)));
        for wrong in ["800", "0x5", "ax3", "3x", "-1x2", "16385x1", "1x99999999999"] {
            assert!(parse_size(wrong).is_err(), "{wrong}");
        }
    }
}
