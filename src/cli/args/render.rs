//! The arguments of `nimbus render`.

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::farm_plan::{FormatArg, Span, parse_span};
use super::scene::{BudgetArgs, SceneArgs};
use super::values::{parse_positive, parse_samples};
use crate::reference::picture::ReferenceKind;

/// Arguments of `nimbus render`.
#[derive(Debug, ClapArgs)]
#[command(after_help = "The errors of the sprites against two references:\n  \
    nimbus render scenes/cubes-554.toml --size 200x150 -o drawn.exr\n  \
    nimbus render scenes/cubes-554.toml --size 200x150 --reference thin \\\n      \
    -o thin.exr\n  \
    nimbus render scenes/cubes-554.toml --size 200x150 --reference volume \\\n      \
    --set 'cloud.0.texture=\"none\"' -o volume.exr\n  \
    nimbus compare thin.exr drawn.exr\n  nimbus compare volume.exr thin.exr\n\n\
    Light in the cloud by random paths, until the mean is known to 1 %:\n  \
    nimbus render scenes/study-cloud.toml --size 80x60 --reference transport \\\n      \
    --error 0.01 -o transport.exr\n\n\
    The picture of a device and of its reference, layer by layer:\n  \
    nimbus render scenes/hello.toml --layers -o layers.exr\n  \
    nimbus render scenes/hello.toml --layers --reference thin -o f64.exr\n\n\
    The first frames of a scene:\n  \
    nimbus render scenes/hello.toml --frames 0..12 -o frames\n\n\
    The second reflection of a reference is integrated over areas, which takes minutes for \
    hundreds of facets. \
    --set 'lighting.mode=\"first\"' leaves it out.")]
pub struct RenderArgs {
    /// Scene file
    pub scene: PathBuf,
    /// Picture: .png (tone-mapped, over background or sky) or .exr (linear RGBA, premultiplied);
    /// with --frames a folder of pictures, or a clip .mp4, which ffmpeg encodes
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Frame number
    #[arg(long, value_name = "N", default_value_t = 0, conflicts_with = "time")]
    pub frame: u32,
    /// Frames to draw: FIRST..END (without END), or their number from 0
    #[arg(long, value_name = "FIRST..END", value_parser = parse_span)]
    #[arg(conflicts_with_all = ["frame", "time", "reference", "layers", "capture"])]
    pub frames: Option<Span>,
    /// Format of the pictures of --frames [default: png]
    #[arg(long, value_enum, requires = "frames")]
    pub format: Option<FormatArg>,
    /// Time in seconds, in place of a frame number
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub time: Option<f64>,
    /// Draw a reference in f64 instead of the device's picture: thin, slices, volume, model,
    /// reflections=K or transport
    #[arg(long, value_name = "WHICH")]
    #[arg(conflicts_with_all = ["device", "shaders", "validation", "guard", "max_submit_ms"])]
    #[arg(conflicts_with_all = ["limits", "no_skip"])]
    pub reference: Option<ReferenceKind>,
    /// Samples of every pixel of a reference: the first through its centre, the others spread over
    /// it [default: 1, and 64 random paths of "transport"]
    #[arg(long, value_name = "N", requires = "reference", value_parser = parse_samples)]
    pub samples: Option<u32>,
    /// Trace random paths of "transport" until the standard error of the picture's mean is this
    /// share of it. A pixel has at most 2^20 of them, or as many as fit in memory. Paths are kept
    /// in references/ of NIMBUS_CACHE_DIR, at most 256 MiB a picture, and counted again here
    #[arg(
        long,
        value_name = "SHARE",
        requires = "reference",
        conflicts_with_all = ["samples", "layers"],
        value_parser = parse_positive
    )]
    pub error: Option<f64>,
    /// Write named layers to the EXR file, too: depth, optical depth, number of particles, and the
    /// picture of each reflection alone; of "transport" its light by how often it was scattered,
    /// and its standard error (docs/reference/files.md)
    #[arg(long)]
    pub layers: bool,
    /// Have RenderDoc capture the frame; nimbus must have been started under RenderDoc
    #[arg(long, conflicts_with = "reference")]
    pub capture: bool,
    /// Replace an existing file
    #[arg(long)]
    pub force: bool,
    /// Print JSON: hash of the picture, device and passes, or the reference and its error
    #[arg(long)]
    pub json: bool,
    /// Budget of the light.
    #[command(flatten)]
    pub budget: BudgetArgs,
    /// Arguments of every command with a scene.
    #[command(flatten)]
    pub options: SceneArgs,
}
