//! `nimbus edit FILE`.

use std::io::ErrorKind;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use super::args::EditArgs;
use super::interrupt;
use super::scene::{device_choice, load};
use crate::error::{Error, Result};
use crate::io::box_file;
use crate::viewer::edit_window::{self, Options};
use crate::viewer::editor::{EditedScene, Session};

/// Size of the window by default, pixels: that of the paper's pictures.
const SIZE: (u32, u32) = (800, 600);

/// Runs `nimbus edit`.
///
/// # Errors
/// Fails if a file is faulty, or no window or device can be opened.
pub fn run(args: &EditArgs, stop: &'static AtomicBool) -> Result<()> {
    let session = session_of(args.file.as_deref())?;
    let scene = match &args.scene {
        Some(scene) => EditedScene::new(load(scene, &args.options)?.scene)?,
        None if args.options.set.is_empty() => EditedScene::default_scene()?,
        None => return Err(Error::usage("--set: expected --scene SCENE, whose keys it sets")),
    };
    let session = match (&args.scene, args.options.seed) {
        (Some(_), _) => session.with_seed(scene.document().seed),
        (None, Some(seed)) => session.with_seed(seed),
        (None, None) => session,
    };
    let (width, height) = args.options.size.unwrap_or(SIZE);
    let choice = device_choice(&args.options);
    // Unsaved changes are written to a file first.
    let does = "keeps unsaved changes in a file and closes the window";
    let _keeping = interrupt::keep_by_itself(does);
    edit_window::run(Options { session, scene, choice, size: [width, height], stop })
}

/// Returns a session with the boxes of a file, or a new cloud where the file does not exist.
fn session_of(path: Option<&Path>) -> Result<Session> {
    let Some(path) = path else { return Ok(Session::default()) };
    // Any other error is reported by reading.
    if path.symlink_metadata().is_err_and(|e| e.kind() == ErrorKind::NotFound) {
        return Ok(Session::with_path(path));
    }
    Ok(Session::from_file(path, box_file::read(path)?))
}
