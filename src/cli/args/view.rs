//! `nimbus view` and `nimbus edit`: what opens a window.

use std::path::PathBuf;

use clap::{Args as ClapArgs, ValueEnum};

use super::SceneArgs;

#[derive(Debug, ClapArgs)]
pub struct ViewArgs {
    /// Scene file (TOML)
    pub scene: PathBuf,
    /// When pictures are shown: at the next refresh in order, at the next refresh the newest, at
    /// once
    #[arg(long, value_name = "MODE", default_value = "fifo")]
    pub present: PresentArg,
    /// Close the window after so many frames
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
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

#[derive(Debug, ClapArgs)]
pub struct EditArgs {
    /// Box file, which need not exist yet; a new cloud without a file when left out
    pub file: Option<PathBuf>,
    /// Scene around the cloud, of which the first cloud made from boxes gives way to the file's
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    #[command(flatten)]
    pub options: SceneArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PresentArg {
    Fifo,
    Mailbox,
    Immediate,
}
