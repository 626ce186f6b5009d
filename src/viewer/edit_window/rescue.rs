//! Unsaved changes of a window that ends without a question: by Ctrl-C, a lost device, or a lost
//! display.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use crate::io::box_file;
use crate::io::console::say;
use crate::viewer::editor::{Document, Session};
use crate::viewer::free_path::write_free;
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

    /// Writes the changes beside their file, and drops them. When this returns, they are written,
    /// whichever thread has done so.
    pub fn write(&self) {
        // The lock is held to the end: a thread that finds no changes may end the process.
        let mut unsaved = lock(&self.0);
        let Some((path, document)) = unsaved.take() else { return };
        let name = |n| path.with_extension(format!("unsaved-{n}.dat"));
        match write_free(name, |to| box_file::write_like(to, &path, &document.boxes)) {
            Ok(path) => say!("unsaved changes were written to {}", path.display()),
            Err(error) => say!("unsaved changes are lost: {error}"),
        }
        drop(unsaved);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::boxes::CloudBox;
    use glam::DVec3;
    use std::fs;
    use std::sync::Barrier;

    /// Enough boxes that a write takes longer than a thread needs to find that nothing is left.
    const N_BOXES: usize = 20_000;
    const N_THREADS: usize = 4;

    #[test]
    fn no_thread_returns_before_the_changes_are_written() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cloud.dat");
        let mine = dir.path().join("cloud.unsaved-1.dat");
        fs::write(&mine, "mine").unwrap();
        let written = dir.path().join("cloud.unsaved-2.dat");
        let one = DVec3::ONE;
        let b = CloudBox { n_particles: 1, extent: one, center: one, radius_max: 1.0 };
        let document = Arc::new(Document::new(vec![b; N_BOXES]));
        let rescue = Rescue(Arc::new(Mutex::new(Some((path, document)))));
        let begin = Barrier::new(N_THREADS);
        std::thread::scope(|scope| {
            for _ in 0..N_THREADS {
                scope.spawn(|| {
                    begin.wait();
                    rescue.write();
                    assert_eq!(box_file::read(&written).unwrap().len(), N_BOXES);
                });
            }
        });
        assert_eq!(fs::read_to_string(mine).unwrap(), "mine");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2);
    }
}
