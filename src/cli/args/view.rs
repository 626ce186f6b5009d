//! The arguments of the commands that open a window: `view` and `edit`.

use std::path::PathBuf;

use clap::{Args as ClapArgs, ValueEnum};

use super::scene::SceneArgs;
use super::values::at_least_one;

/// Arguments of `nimbus view`.
#[derive(Debug, ClapArgs)]
pub struct ViewArgs {
    /// Scene file (TOML)
    pub scene: PathBuf,
    /// When pictures are presented
    #[arg(long, value_name = "MODE", default_value = "fifo")]
    pub present: PresentArg,
    /// Close the window after this many frames
    #[arg(long, value_name = "N", value_parser = at_least_one())]
    pub frames: Option<u32>,
    /// Begin without panels (the key h shows them)
    #[arg(long)]
    pub no_panels: bool,
    /// Print the times of the loops that ran as JSON when the window is closed
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub options: SceneArgs,
}

/// Arguments of `nimbus edit`.
#[derive(Debug, ClapArgs)]
pub struct EditArgs {
    /// Box file, which need not exist yet [default: a new cloud without a file]
    pub file: Option<PathBuf>,
    /// Scene around the cloud; the edited cloud replaces its first cloud made from boxes
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    #[command(flatten)]
    pub options: SceneArgs,
}

/// The present modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PresentArg {
    /// In order, one at each refresh
    Fifo,
    /// The newest at each refresh
    Mailbox,
    /// At once
    Immediate,
}
