//! The arguments of the commands that open a window: `view` and `edit`.

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::scene::{BudgetArgs, SceneArgs};
use super::values::{at_least_one, limited};
use crate::gpu::PresentMode;

/// Arguments of `nimbus view`.
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "Exit codes: 0 the window was closed, also by Ctrl-C; 2 bad input; 3 device \
    or driver;\n  130 Ctrl-C before the window was open, or twice."
)]
pub struct ViewArgs {
    /// Scene file (TOML)
    pub scene: PathBuf,
    /// When pictures are presented
    #[arg(long, value_name = "MODE", default_value = "fifo")]
    pub present: PresentMode,
    /// Close the window after this many frames
    #[arg(long, value_name = "N", value_parser = at_least_one())]
    pub frames: Option<u32>,
    /// Begin without panels (h shows them); a window below 600 pixels of width does so, too
    #[arg(long)]
    pub no_panels: bool,
    /// Folder that F10, F11 and F12 save to; it is made when needed, and no file is replaced
    #[arg(long, value_name = "DIR", default_value = "captures")]
    pub captures: PathBuf,
    /// Have RenderDoc capture this frame, counted from 0; nimbus must have been started under
    /// RenderDoc
    #[arg(long, value_name = "N", value_parser = limited(0, u32::MAX, "frames have 32 bits"))]
    pub capture: Option<u32>,
    /// Print the times of the loops that ran as JSON when the window is closed
    #[arg(long)]
    pub json: bool,
    /// Budget of the light.
    #[command(flatten)]
    pub budget: BudgetArgs,
    /// Arguments of every command with a scene.
    #[command(flatten)]
    pub options: SceneArgs,
}

/// Arguments of `nimbus edit`.
#[derive(Debug, ClapArgs)]
#[command(after_help = "Exit codes: 0 the window was closed, also by Ctrl-C, which keeps unsaved \
    boxes beside the file;\n  2 bad input; 3 device or driver; 130 Ctrl-C before the window was \
    open, or twice.")]
pub struct EditArgs {
    /// Box file, which need not exist yet [default: a new cloud without a file]
    pub file: Option<PathBuf>,
    /// Scene around the cloud; the edited cloud replaces its first cloud made from boxes
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Arguments of every command with a scene.
    #[command(flatten)]
    pub options: SceneArgs,
}
