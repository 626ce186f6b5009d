//! The scene file behind a window: it is read again when a file changes, and the view is saved as
//! a new scene.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::view_state::ViewState;
use crate::error::Result;
use crate::io::{scene_file, scene_view};
use crate::model::scene::Scene;

/// A scene file with the overrides it is read with.
pub struct SceneSource {
    /// The scene's file.
    pub path: PathBuf,
    /// Overrides of the command line: `--set` and `--size`.
    pub overrides: Vec<String>,
    /// Seed of the first cloud, if `--seed` gives it.
    pub seed: Option<u32>,
    /// The scene as last read, before any knob was changed.
    pub first: Arc<Scene>,
    /// The scene's file and the files that it names.
    pub files: Vec<PathBuf>,
}

impl SceneSource {
    /// Reads the scene again, with the knobs of `state`. The list of files is updated also where
    /// reading fails.
    ///
    /// # Errors
    /// A file cannot be read, or its content is not valid.
    pub fn read(&mut self, state: &ViewState) -> Result<Arc<Scene>> {
        let (loaded, files) = scene_file::load_and_list(&self.path, &self.overrides, self.seed);
        self.files = files;
        let changed = state.changed_knobs(&self.first);
        let first = Arc::new(loaded?.scene);
        let scene = if changed.is_empty() {
            first.clone()
        } else {
            let overrides = [&self.overrides[..], &changed].concat();
            Arc::new(scene_file::load(&self.path, &overrides, self.seed)?.scene)
        };
        self.first = first;
        Ok(scene)
    }

    /// Returns the text of a scene file at `to` that draws the view. The folder of `to` must exist.
    ///
    /// # Errors
    /// The scene cannot be read.
    pub fn text_of_view(&self, state: &ViewState, to: &Path) -> Result<String> {
        let overrides = [self.overrides.clone(), state.overrides(&self.first)].concat();
        scene_view::text_of(&self.path, to, &overrides, self.seed)
    }
}
