//! An editing session: the open file, unsaved changes, and the question before they are lost.
//!
//! (session, event) → (session, request). A request asks the window for a file or a dialog, and the
//! window answers with an event. [`perform`] carries out the requests that need no dialog.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::action::{Action, DragAction};
use super::document::{Document, are_same_boxes};
use super::state::Editor;
use crate::error::Error;
use crate::io::box_file;
use crate::model::boxes::CloudBox;

/// A document with its file.
#[derive(Debug, Clone)]
pub struct Session {
    editor: Editor,
    path: Option<PathBuf>,
    /// The document as saved; that of a new cloud is empty.
    saved: Arc<Document>,
    pending: Pending,
}

/// The step that follows the window's answer.
#[derive(Debug, Clone, Default)]
enum Pending {
    /// Nothing follows.
    #[default]
    Nothing,
    /// Asks whether to save before this.
    Question(Intent),
    /// Does this after a save.
    Save(Intent),
    /// Opens a file in place of this document.
    Open(Arc<Document>),
}

/// An action that would lose unsaved changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Intent {
    /// Begins a new cloud.
    New,
    /// Opens a file; without a path the user chooses one.
    Open(Option<PathBuf>),
    /// Closes the window.
    Quit,
}

/// An event of the session.
#[derive(Debug, Clone, PartialEq)]
pub enum SessionEvent {
    /// An action on the document.
    Act(Action),
    /// An action that may need a question first.
    Intend(Intent),
    /// The answer to the question.
    Answer(Answer),
    /// Saves to the file.
    Save,
    /// Saves to another file.
    SaveAs,
    /// A dialog's path; `None` where it was cancelled.
    ChosenToOpen(Option<PathBuf>),
    /// The path to save to; `None` where the dialog was cancelled.
    ChosenToSave(Option<PathBuf>),
    /// A file was read.
    Opened {
        /// The file.
        path: PathBuf,
        /// Its boxes.
        boxes: Vec<CloudBox>,
    },
    /// A file was written.
    Saved {
        /// The file.
        path: PathBuf,
        /// The document as written.
        document: Arc<Document>,
    },
    /// A file could not be opened or saved.
    Failed(Error),
}

/// An answer to [`Request::Ask`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    /// Saves to the file.
    Save,
    /// Loses the changes.
    Discard,
    /// Drops the intent.
    Cancel,
}

/// Work for the window.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// Asks whether to save changes, and answers by [`SessionEvent::Answer`].
    Ask(Intent),
    /// Asks for a file to open.
    ChooseToOpen,
    /// Asks for a file to save to.
    ChooseToSave,
    /// Reads a file.
    Open(PathBuf),
    /// Writes a file.
    Save {
        /// The file.
        path: PathBuf,
        /// The file that was opened. Boxes of it that were not edited keep its text.
        opened: PathBuf,
        /// The document as written.
        document: Arc<Document>,
    },
    /// Shows or hides the panels.
    TogglePanels,
    /// Closes the window.
    Quit,
}

impl Default for Session {
    /// Creates a new cloud without boxes and without a file.
    fn default() -> Self {
        Session::of(Editor::default(), None)
    }
}

impl Session {
    /// Creates a session whose document is saved.
    fn of(editor: Editor, path: Option<&Path>) -> Session {
        let (saved, path) = (editor.shared_document(), path.map(Path::to_owned));
        Session { saved, editor, path, pending: Pending::Nothing }
    }

    /// Creates a new cloud that will be saved as `path`.
    pub fn with_path(path: &Path) -> Session {
        Session::of(Editor::default(), Some(path))
    }

    /// Creates a session with the boxes read from `path`.
    pub fn from_file(path: &Path, boxes: Vec<CloudBox>) -> Session {
        Session::of(Editor::new(boxes), Some(path))
    }

    /// Returns the session with a scene's seed and an empty history.
    pub fn with_seed(self, seed: u32) -> Session {
        let document = Document { seed, ..self.editor.document().clone() };
        let editor = Editor::with_settings(document, *self.editor.settings());
        Session::of(editor, self.path())
    }

    /// Returns the editor's state.
    pub fn editor(&self) -> &Editor {
        &self.editor
    }

    /// Returns the file; `None` for a new cloud.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Returns whether the boxes differ, bitwise, from the saved ones.
    pub fn is_dirty(&self) -> bool {
        !are_same_boxes(self.editor.boxes(), &self.saved.boxes)
    }

    /// Returns the intent that the open question is about.
    pub fn question(&self) -> Option<&Intent> {
        if let Pending::Question(intent) = &self.pending { Some(intent) } else { None }
    }

    /// Returns the session after an event, and the work that it asks for.
    ///
    /// # Errors
    /// The editor rejects an action.
    pub fn after(&self, event: &SessionEvent) -> Result<(Session, Option<Request>), String> {
        let mut next = self.clone();
        if let SessionEvent::Act(action) = event {
            next.editor = self.editor.after(action)?;
            return Ok((next, None));
        }
        // A drag in progress ends where it is; undo takes it back.
        next.editor = self.editor.after(&Action::Drag(DragAction::End))?;
        let request = next.handle(event);
        Ok((next, request))
    }

    fn handle(&mut self, event: &SessionEvent) -> Option<Request> {
        let pending = std::mem::take(&mut self.pending);
        match event {
            SessionEvent::Act(_) | SessionEvent::Failed(_) => None,
            SessionEvent::Intend(intent) => self.intend(intent.clone()),
            SessionEvent::Answer(answer) => match (pending, answer) {
                (Pending::Question(_), Answer::Cancel) => None,
                (Pending::Question(intent), Answer::Discard) => self.proceed(intent),
                (Pending::Question(intent), Answer::Save) => {
                    self.pending = Pending::Save(intent);
                    Some(self.save())
                }
                (other, _) => {
                    self.pending = other;
                    None
                }
            },
            SessionEvent::Save => Some(self.save()),
            SessionEvent::SaveAs => Some(Request::ChooseToSave),
            SessionEvent::ChosenToSave(path) => {
                let path = path.clone()?;
                // The intent follows after the save.
                self.pending = pending;
                Some(self.save_as(path))
            }
            SessionEvent::Saved { path, document } => {
                self.path = Some(path.clone());
                self.saved = document.clone();
                // Changes made since the save began are asked about again.
                if let Pending::Save(intent) = pending { self.intend(intent) } else { None }
            }
            SessionEvent::ChosenToOpen(path) => {
                let path = path.clone()?;
                self.pending = pending;
                Some(Request::Open(path))
            }
            SessionEvent::Opened { path, boxes } => {
                // Changes made while the dialog was open have not been asked about.
                let is_agreed = matches!(pending, Pending::Open(document)
                    if self.editor.document().is_same(&document));
                if !is_agreed && self.is_dirty() {
                    return self.intend(Intent::Open(Some(path.clone())));
                }
                self.replace(Some(path), boxes.clone());
                None
            }
        }
    }

    fn intend(&mut self, intent: Intent) -> Option<Request> {
        if self.is_dirty() {
            self.pending = Pending::Question(intent.clone());
            return Some(Request::Ask(intent));
        }
        self.proceed(intent)
    }

    /// Carries out an intent. Unsaved changes are lost.
    fn proceed(&mut self, intent: Intent) -> Option<Request> {
        match intent {
            Intent::New => {
                self.replace(None, Vec::new());
                None
            }
            Intent::Quit => Some(Request::Quit),
            Intent::Open(path) => {
                self.pending = Pending::Open(self.editor.shared_document());
                Some(path.map_or(Request::ChooseToOpen, Request::Open))
            }
        }
    }

    fn save(&self) -> Request {
        self.path.clone().map_or(Request::ChooseToSave, |path| self.save_as(path))
    }

    fn save_as(&self, path: PathBuf) -> Request {
        let opened = self.path.clone().unwrap_or_else(|| path.clone());
        Request::Save { path, opened, document: self.editor.shared_document() }
    }

    /// Replaces the document. The scene's seed and the settings stay.
    fn replace(&mut self, path: Option<&Path>, boxes: Vec<CloudBox>) {
        let document = Document { boxes, seed: self.editor.document().seed };
        *self = Session::of(Editor::with_settings(document, *self.editor.settings()), path);
    }
}

/// Opens or saves a file. Returns `None` for a request that needs a dialog or ends the window.
pub fn perform(request: &Request) -> Option<SessionEvent> {
    let done = match request {
        Request::Open(path) => {
            box_file::read(path).map(|boxes| SessionEvent::Opened { path: path.clone(), boxes })
        }
        Request::Save { path, opened, document } => {
            box_file::write_like(path, opened, &document.boxes)
                .map(|()| SessionEvent::Saved { path: path.clone(), document: document.clone() })
        }
        Request::Ask(_)
        | Request::ChooseToOpen
        | Request::ChooseToSave
        | Request::TogglePanels
        | Request::Quit => return None,
    };
    Some(done.unwrap_or_else(SessionEvent::Failed))
}

#[cfg(test)]
mod tests;
