//! State that the editor's panels show.

use std::path::PathBuf;

use crate::viewer::editor::{BoxAcceptance, EditorController};

/// State that the editor's panels show.
pub struct PanelState<'a> {
    /// State of the editor.
    pub controller: &'a EditorController,
    /// Acceptance of each box; fewer where the device has not generated them yet.
    pub acceptances: &'a [BoxAcceptance],
    /// Recently opened files, newest first.
    pub recent: &'a [PathBuf],
    /// Whether panels are shown beside the picture.
    pub has_panels: bool,
    /// Why the picture does not show the document.
    pub failure: Option<&'a str>,
}
