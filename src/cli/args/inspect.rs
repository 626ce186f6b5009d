//! The arguments of `nimbus inspect`.

use std::path::PathBuf;

use clap::{Args as ClapArgs, ValueEnum};

use super::scene::SceneArgs;

/// Arguments of `nimbus inspect`.
#[derive(Debug, ClapArgs)]
#[command(after_help = "The particles of a frame, as a file that scenes can read:\n  \
    nimbus inspect scenes/cubes-554.toml --particles -o cubes.ply")]
#[command(group = clap::ArgGroup::new("what")
    .args(["boxes", "particles", "facets", "plan", "basis"]))]
pub struct InspectArgs {
    /// Scene file
    pub scene: PathBuf,
    /// Every box: particles, attempts, acceptance rate, folded (the default)
    #[arg(long)]
    pub boxes: bool,
    /// Every particle, in the scene's coordinates
    #[arg(long)]
    pub particles: bool,
    /// With --particles: write them to a PLY file (binary, f64), which scenes can read
    #[arg(short, long, value_name = "FILE.ply", requires = "particles", conflicts_with = "json")]
    pub output: Option<PathBuf>,
    /// With --output: replace an existing file
    #[arg(long, requires = "output")]
    pub force: bool,
    /// Every lighting facet: place, normal, area, irradiance, radiance
    #[arg(long)]
    pub facets: bool,
    /// With --facets: print the area means of every surface instead of its facets, without clouds
    #[arg(long, requires = "facets")]
    pub per_surface: bool,
    /// The passes that the first frames run and skip, with the reasons
    #[arg(long)]
    pub plan: bool,
    /// The BRDF basis of the scene; needs no device. --json prints all three tables
    #[arg(long, value_enum, value_name = "WHAT", num_args = 0..=1, default_missing_value = "table")]
    #[arg(conflicts_with_all = ["reference", "frame"])]
    pub basis: Option<BasisArg>,
    /// The scene's air: humidity, dew point and cloud bases; needs no device
    #[arg(
        long,
        conflicts_with_all = ["boxes", "particles", "facets", "plan", "basis", "reference"]
    )]
    pub air: bool,
    /// Print the values of the reference in f64 instead of the device's
    #[arg(long, conflicts_with = "plan")]
    pub reference: bool,
    /// Frame number (with --plan: the number of frames, default 3)
    #[arg(long, value_name = "N")]
    pub frame: Option<u32>,
    /// Print JSON instead of CSV
    #[arg(long)]
    pub json: bool,
    /// Arguments of every command with a scene.
    #[command(flatten)]
    pub options: SceneArgs,
}

/// The tables of `--basis`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BasisArg {
    /// Every basis function over γ, node by node (the default)
    Table,
    /// The singular values, and which were kept
    Values,
    /// The relative error over the range of exponents, and of every glossy material
    Errors,
}
