//! The command line: every command, its arguments and their help.

mod bench;
mod export;
mod farm;
mod farm_plan;
mod inspect;
mod render;
mod results;
mod scene;
mod stress;
mod study;
mod values;
#[cfg(feature = "window")]
mod view;
mod weather;

use clap::{ColorChoice, Parser, Subcommand};

pub use bench::{BenchArgs, ThreadingArg};
pub use export::ExportArgs;
pub use farm::{
    EmitArgs, EngineArg, FarmArgs, FarmCommand, GcArgs, JobArgs, LocalArgs, MergeArgs, RunArgs,
    StatusArgs, SubmitArg, SubmitArgs,
};
pub use farm_plan::{CalibrateArgs, FormatArg, PlanArgs, Span};
pub use inspect::{BasisArg, InspectArgs};
pub use render::RenderArgs;
pub use results::{CompareArgs, HistoryArgs, ReportArgs};
pub use scene::{DevicesArgs, SceneArgs};
pub use stress::StressArgs;
pub use study::{ErrorArgs, LedgerArgs};
#[cfg(feature = "window")]
pub use view::{EditArgs, ViewArgs};
pub use weather::WeatherArgs;

/// A Vulkan testbed for cloud particles: how much error does a millisecond buy?
#[derive(Debug, Parser)]
#[command(version, propagate_version = true, max_term_width = 100)]
#[command(after_help = "Start with:\n  nimbus render scenes/hello.toml -o hello.png\n  \
    nimbus bench scenes/threads.toml --out before\n  \
    nimbus bench scenes/threads.toml --set lighting.grid=32 --out after\n  \
    nimbus compare before after --allow scene\n  nimbus report before after -o report.html\n  \
    nimbus inspect scenes/cubes-554.toml\n  nimbus weather scenes/weather/katrina.nc\n  nimbus \
    devices\n\n\
    Exit codes: 0 done; 1 a check failed; 2 bad input or usage; 3 device or driver;\n  70 farm \
    results that differ; 75 another run writes there, or another try may succeed;\n  101 \
    a fault of nimbus itself; 130 interrupted.\n\n\
    Environment: NIMBUS_CACHE_DIR has shaders, references and roofs (~/.cache/nimbus).\n  \
    NIMBUS_PROGRESS_S is the time between lines of progress in a log (15 s; 0: none).")]
pub struct Args {
    /// The command.
    #[command(subcommand)]
    pub command: Command,
    /// When to colour messages
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto")]
    pub color: ColorChoice,
}

impl Command {
    /// Makes settings of the scene from a budget of the light.
    pub fn set_budget(&mut self) {
        let (budget, options) = match self {
            Command::Render(of) => (&of.budget, &mut of.options),
            Command::Bench(of) => (&of.budget, &mut of.options),
            #[cfg(feature = "window")]
            Command::View(of) => (&of.budget, &mut of.options),
            _ => return,
        };
        budget.put_before(&mut options.set);
    }
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Draw one frame to a PNG or EXR file
    ///
    /// With --reference the frame is drawn in f64 on the processor, without a Vulkan device and
    /// without shaders (docs/explanation/model.md §9). There are six references, each without an
    /// approximation of the one before it.
    ///
    /// "thin" draws the same sprites as the device, sorted by exact depth; it differs from the
    /// device by arithmetic alone. "slices" draws the same blobs composed by slices (draw.overlap).
    /// "volume" integrates light through the overlapping blobs, to about a millionth of the
    /// brightest. "model" also computes the light on the blobs by the model itself, and the light
    /// on surfaces pixel by pixel. "reflections=K" computes K reflections. "transport" traces
    /// random paths of light through the blobs (docs/explanation/transport.md).
    ///
    /// --samples takes the mean over each pixel's area, and more random paths, instead of the value
    /// at its centre.
    Render(RenderArgs),
    /// Time a scene in the serial and the parallel loop
    ///
    /// Each case (a phase of the scene at one point of the sweep) is timed in blocks of frames. The
    /// blocks of all cases and loops alternate, so that a drift affects all alike. A third loop
    /// skips nothing; it measures what skipping saves.
    ///
    /// In the table of passes, `saved` is the device time a frame that skipping this pass saved:
    /// its median time in the loop without skipping, times the share of frames that skipped it.
    Bench(BenchArgs),
    /// Compare two results of bench, or two pictures
    ///
    /// For two results folders: the medians of A and B, their ratio B / A with a 95 % interval, and
    /// a verdict, for every loop that both ran and for frame, game step, render step, GPU and each
    /// pass. The errors of pictures and device memory are compared, too. For more than two folders:
    /// a matrix of the frame times, each run against each.
    ///
    /// "the same" means that the whole interval lies within --margin. "faster" and "slower" mean
    /// that it lies beyond. "undecided" means that it crosses an end of the margin; the table says
    /// how many more frames would decide.
    ///
    /// Only `frame` is the headline. The other rows are not corrected for many comparisons: of
    /// twenty, one will be beyond its interval.
    ///
    /// Intervals compare blocks of frames where there are eight or more (bench --precision, or
    /// --repeat 8), and else runs of √n neighbouring frames (block bootstrap). They cover the noise
    /// within the runs. They cover what changes from one start to the next, such as other programs
    /// on the machine, only where both have several starts (bench --starts).
    ///
    /// For two pictures of one size and kind (.exr or .png), A being the reference: RMSE, greatest
    /// difference, relMSE and PSNR of the stored numbers (linear in an EXR, sRGB in 0..1 in a PNG),
    /// and SSIM and FLIP of the displayed pictures (an EXR over black, through the default tone
    /// map). Pixels that are not finite in either picture are counted and left out; for SSIM and
    /// FLIP they are black in both.
    Compare(CompareArgs),
    /// Find where frame times or errors changed in a series of results
    ///
    /// The runs are ordered by the revisions that they measured. A change is a step of the median
    /// frame time, or of the error, beyond the noise between runs. It has three runs or more on
    /// each side. A series without a change shows such a step once in a thousand. Each change has
    /// an interval of its size, and the runs that it may lie between. One slow run is no change.
    /// Where runs differ by 0.5 %, the third run after a step of 3 % shows it in 98 of 100 series.
    History(HistoryArgs),
    /// Measure run time against error over a scene's knobs: how much error does a millisecond buy?
    ///
    /// Every configuration of the knobs is drawn once and compared with a reference in f64. All are
    /// timed in alternating blocks with the unchanged scene. The table is sorted by time; "*"
    /// marks the front: no other configuration is at least as fast and as exact, and better in one
    /// of the two. "~" marks configurations that others beat, but none that is faster beyond the
    /// 95 % intervals.
    ///
    /// References (--against), each without an approximation of the one before it: "thin", the
    /// sprites in f64, uncut, in the scene's own light; "slices", the same blobs by slices;
    /// "volume", the integral over the overlapping blobs in that light; "model", in light without
    /// density grid, facet groups, basis and pairs; "reflections=K", with K reflections, those
    /// beyond the second by random paths; "transport", radiative transfer by random paths
    /// (docs/explanation/transport.md). For knobs of lighting use one of the last three.
    ///
    /// Frames are timed as if everything moved in each, except for what a run makes only once
    /// (particles of boxes, textures). --as-played times the scene's own frames. An "auto" in the
    /// scene's drawing takes the setting that changes no picture.
    Error(ErrorArgs),
    /// List the error of every approximation, each against the next better picture
    ///
    /// The pictures form a chain from the one that is drawn to the whole model with further
    /// reflections. Each has one approximation less than the one before it, and a row shows the
    /// error between the two. The device draws the first ones, which are also timed in alternating
    /// blocks; the others are computed in f64. By the triangle inequality the sum of the rows is at
    /// least the total; exit code 1 says that it is not.
    Ledger(LedgerArgs),
    /// Test whether the device computes extreme cases within the error bounds
    ///
    /// Functions, particles, light, layers, far places and late times are computed with extreme
    /// inputs and compared with f64, or with exact results. The bounds follow from the precision
    /// that Vulkan guarantees (docs/explanation/stability.md). A row a case shows the value that is
    /// furthest off relative to its bound: the device's, the reference's, error and bound. Exit
    /// code 1 says that an error is beyond its bound.
    Stress(StressArgs),
    /// Make one HTML page of results: conditions, plots, tables, pictures
    ///
    /// Each folder of bench, error or ledger becomes a section with its conditions, every figure in
    /// tables, charts, and its pictures. If there are two or more benches or studies, the later
    /// ones are compared with the first: ratios with their intervals, and pictures behind a slider.
    ///
    /// The page is one file and loads nothing: it can be mailed, kept beside the results, or
    /// printed.
    Report(ReportArgs),
    /// Print the contents of a stage's buffer, or its reference in f64
    Inspect(InspectArgs),
    /// List Vulkan devices, their limits, and which one nimbus uses
    Devices(DevicesArgs),
    /// Show a scene in a window: fly through it, change its settings, read frame times
    ///
    /// "?" lists the keys in the window. Frames run in one of the two loops that bench times; "t"
    /// switches between them. The title shows the frame time, and statistics of both loops are
    /// printed when the window is closed. "i" prints and copies the render command for the present
    /// view.
    ///
    /// Panels ("h") show times, passes, the plan and every setting. "m" keeps the settings as B, to
    /// compare with later ones; "j" measures the error of both against the f64 reference while the
    /// camera and the frame stand still. "F12" saves the picture and "F10" the scene, to the folder
    /// of --captures. The scene, its files and the shaders of --shaders are loaded again when they
    /// change; an error is shown over the last good picture.
    ///
    /// Panels and text have the scale of the display. WINIT_X11_SCALE_FACTOR=2 sets another.
    #[cfg(feature = "window")]
    View(ViewArgs),
    /// Shape a cloud by hand from boxes that are filled with particles
    ///
    /// Boxes are added, moved, scaled, mirrored and numbered with the mouse, with keys (listed by
    /// "?") and by typing numbers with units. The cloud is drawn meanwhile; only the particles of
    /// changed boxes are generated again. The editor saves a box file, as scenes name it, and
    /// `nimbus render` draws it in the same way.
    #[cfg(feature = "window")]
    Edit(EditArgs),
    /// Print what a weather file contains, and the clouds in it
    ///
    /// Reads output of WRF as NetCDF of every kind (classic, 64-bit offset, CDF-5, NetCDF-4).
    /// Prints the variables, the steps with their times, the map, and the clouds of every step:
    /// number of cells, greatest extinction, greatest vertical optical depth, base and top. Needs
    /// no Vulkan device.
    ///
    /// Extinction is 3/2 q ρ/(ρ_x r_x), summed over cloud water (10 µm droplets), ice (30 µm) and
    /// snow (100 µm), without rain and graupel. If a file has none of the three, clouds are
    /// diagnosed from relative humidity, and the output says so (docs/explanation/model.md §15).
    ///
    /// P, PB, T, PH, PHB and the attributes DX and DY are required; notes name what else is
    /// missing. Mixing ratios that are negative, NaN or a fill value are counted and taken as 0; in
    /// other variables they are an error.
    Weather(WeatherArgs),
    /// Write a scene for another renderer, which can check the reference "transport"
    ///
    /// --mitsuba writes the scene for Mitsuba 3 (scalar_rgb, volpath): the blobs as extinction on a
    /// grid, surfaces, ground, lights and camera. Lobes, spot lights and textures are refused:
    /// Mitsuba has none as nimbus has them (docs/explanation/transport.md). Ellipsoids whose axes
    /// are turned are refused, too.
    Export(ExportArgs),
    /// Distribute frames, studies, sweeps or reference pictures over machines that share a folder
    ///
    /// `plan` divides the work into shards, each with a key that follows from scene, shaders, build
    /// and range. `run` computes one shard; an engine (Slurm, another one, or `local`, a pool of
    /// processes on one machine) starts it on any node, any number of times. A result appears
    /// complete or not at all and is verified by its content; frames that a killed process has
    /// finished are kept. `status` lists what is missing, `merge` joins all results, `gc` removes
    /// what failed attempts have left.
    #[command(subcommand_required = true)]
    Farm(FarmArgs),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_declaration_is_consistent() {
        use clap::CommandFactory;
        Args::command().debug_assert();
    }
}
