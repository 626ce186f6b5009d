//! Unsaved changes of a window that ends without a question: by Ctrl-C, a lost device, or a lost
//! display.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use crate::io::box_file;
use crate::io::console::say;
use crate::viewer::editor::{Document, Session};
use crate::viewer::free_path::free_path;
use crate::viewer::sync::lock;

/// A changed document, and the file that it is not saved to.
type Unsaved = (PathBuf, Arc<Document>);

/// The unsaved changes of a window, shared with whatever ends it.
#[derive(Clone, Default)]
pub struct Rescue(Arc<Mutex<Option<Unsaved>>>);

impl Rescue {
    /// Takes the changes that `session` has not saved.
    pub fn update(&self, session: &Session) {
        let path = session.path().unwrap_or(Path::new("cloud.dat")).to_owned();
        let document = session.editor().shared_document();
        *lock(&self.0) = session.is_dirty().then_some((path, document));
    }

    /// Drops the changes: the user has decided about them.
    pub fn clear(&self) {
        *lock(&self.0) = None;
    }

    /// Writes the changes beside their file, and drops them.
    pub fn write(&self) {
        let Some((path, document)) = lock(&self.0).take() else { return };
        let path = free_path(|n| path.with_extension(format!("unsaved-{n}.dat")));
        match box_file::write(&path, &document.boxes) {
            Ok(()) => say!("unsaved changes were written to {}", path.display()),
            Err(error) => say!("unsaved changes are lost: {error}"),
        }
    }
}
