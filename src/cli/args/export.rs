//! The arguments of `nimbus export`.

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::scene::SceneArgs;
use super::values::{parse_positive, parse_samples};

/// Arguments of `nimbus export`.
#[derive(Debug, ClapArgs)]
#[command(after_help = "A scene for Mitsuba 3:\n  \
    nimbus export scenes/study-cloud.toml --size 80x60 --mitsuba cloud\n\n\
    The same picture by nimbus, to compare with Mitsuba's:\n  \
    nimbus render scenes/study-cloud.toml --size 80x60 --reference transport \\\n      \
    -o transport.exr")]
pub struct ExportArgs {
    /// Scene file
    pub scene: PathBuf,
    /// Folder for scene.xml and the files that it names, for Mitsuba 3
    #[arg(long, value_name = "DIR")]
    #[arg(conflicts_with_all = ["device", "shaders", "validation", "guard", "max_submit_ms"])]
    #[arg(conflicts_with_all = ["limits", "no_skip"])]
    pub mitsuba: PathBuf,
    /// Width of the grid's cells, scene units. The default is a quarter of sigma of the blobs, but
    /// for the narrowest ones with 1 % of the mass. It is wider where that makes more than 16
    /// million cells
    #[arg(long, value_name = "UNITS", value_parser = parse_positive)]
    pub step: Option<f64>,
    /// Frame number
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub frame: u32,
    /// Samples of a pixel that the scene file asks for
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = parse_samples)]
    pub samples: u32,
    /// Replace an earlier export
    #[arg(long)]
    pub force: bool,
    /// Arguments of every command with a scene.
    #[command(flatten)]
    pub options: SceneArgs,
}
