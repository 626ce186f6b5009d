//! `nimbus edit FILE`.

use std::sync::atomic::AtomicBool;

use super::args::EditArgs;
use super::{device_choice, load};
use crate::error::{Error, Result};
use crate::viewer::edit_window::{self, Options, session_of};
use crate::viewer::editor::scenery::Scenery;

/// Of the window, where nobody says: the paper's pictures.
const SIZE: (u32, u32) = (800, 600);

pub fn run(args: &EditArgs, stop: &'static AtomicBool) -> Result<()> {
    let session = session_of(args.file.as_deref())?;
    let scenery = match &args.scene {
        Some(scene) => Scenery::of(load(scene, &args.options)?.scene)?,
        None if args.options.set.is_empty() => Scenery::plain()?,
        None => return Err(Error::usage("--set: expected --scene SCENE, whose keys it sets")),
    };
    let session = match (&args.scene, args.options.seed) {
        (Some(_), _) => session.seeded(scenery.document().seed),
        (None, Some(seed)) => session.seeded(seed),
        (None, None) => session,
    };
    let (width, height) = args.options.size.unwrap_or(SIZE);
    let choice = device_choice(&args.options);
    edit_window::run(Options { session, scenery, choice, size: [width, height], stop })
}
