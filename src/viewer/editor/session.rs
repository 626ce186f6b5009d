//! The file around the editor: what is open, what of it is saved, and the question that stands
//! between unsaved changes and their loss. (session, event) → (session, request): what has to be
//! done with files and dialogs is asked of the window, which answers with an event; [`perform`]
//! does what needs no dialog.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::action::{Action, DragAction, Refusal};
use super::document::{Document, Touched, same_boxes};
use super::state::Editor;
use crate::error::Error;
use crate::io::box_file;
use crate::model::boxes::CloudBox;

#[derive(Debug, Clone)]
pub struct Session {
    editor: Editor,
    path: Option<PathBuf>,
    /// The boxes as the file has them; none of a new cloud.
    saved: Arc<Document>,
    waiting: Waiting,
}

/// What is to go on when the window has answered.
#[derive(Debug, Clone, Default)]
enum Waiting {
    #[default]
    Nothing,
    /// Whether to save before this.
    Answer(Wish),
    /// A save, and then this.
    Save(Wish),
    /// A file, in place of this document.
    File(Arc<Document>),
}

/// What would lose unsaved changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Wish {
    New,
    /// A file, or one that is to be chosen.
    Open(Option<PathBuf>),
    Quit,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    Act(Action),
    Wish(Wish),
    Answer(Answer),
    Save,
    SaveAs,
    /// From a dialog; none where it was cancelled.
    ChosenToOpen(Option<PathBuf>),
    ChosenToSave(Option<PathBuf>),
    Opened {
        path: PathBuf,
        boxes: Vec<CloudBox>,
    },
    Saved {
        path: PathBuf,
        document: Arc<Document>,
    },
    /// Opening or saving; all is as it was.
    Failed(Error),
}

/// To [`Request::Ask`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    Save,
    Discard,
    Cancel,
}

/// What the window has to do next.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// "Save changes before …?", answered by [`Event::Answer`].
    Ask(Wish),
    ChooseToOpen,
    ChooseToSave,
    Open(PathBuf),
    Save {
        path: PathBuf,
        document: Arc<Document>,
    },
    Quit,
}

/// What an event led to.
#[derive(Debug, Clone)]
pub struct Turn {
    pub session: Session,
    pub touched: Touched,
    pub request: Option<Request>,
}

impl Session {
    /// A new cloud without boxes and without a file.
    pub fn new() -> Session {
        Session::of(Vec::new(), None)
    }

    /// A new cloud that is to be saved as `path`.
    pub fn begun(path: &Path) -> Session {
        Session::of(Vec::new(), Some(path.to_owned()))
    }

    /// Boxes as they were read from `path`.
    pub fn opened(path: &Path, boxes: Vec<CloudBox>) -> Session {
        Session::of(boxes, Some(path.to_owned()))
    }

    fn of(boxes: Vec<CloudBox>, path: Option<PathBuf>) -> Session {
        let editor = Editor::new(boxes);
        Session { saved: editor.shared_document(), editor, path, waiting: Waiting::Nothing }
    }

    /// The same with a scene's seed, before anything is done to it.
    pub fn seeded(self, seed: u32) -> Session {
        let document = Document { seed, ..self.editor.document().clone() };
        let editor = Editor::of(document, *self.editor.settings());
        Session { saved: editor.shared_document(), editor, ..self }
    }

    pub fn editor(&self) -> &Editor {
        &self.editor
    }

    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Whether the boxes are others than the file's, to the bit: what is undone to what was saved
    /// is not.
    pub fn is_dirty(&self) -> bool {
        !same_boxes(self.editor.boxes(), &self.saved.boxes)
    }

    /// What a question stands about.
    pub fn asked(&self) -> Option<&Wish> {
        if let Waiting::Answer(wish) = &self.waiting { Some(wish) } else { None }
    }

    /// An error changes nothing, and is a sentence to show.
    pub fn after(&self, event: &Event) -> Result<Turn, Refusal> {
        if let Event::Act(action) = event {
            let (editor, touched) = self.editor.after(action)?;
            return Ok(Turn {
                session: Session { editor, ..self.clone() },
                touched,
                request: None,
            });
        }
        let mut session = self.clone();
        // What the hand holds is let go where it is: undo takes it back.
        session.editor = session.editor.after(&Action::Drag(DragAction::End))?.0;
        let request = session.turn(event);
        let touched = Touched::between(self.editor.document(), session.editor.document());
        Ok(Turn { session, touched, request })
    }

    fn turn(&mut self, event: &Event) -> Option<Request> {
        let waiting = std::mem::take(&mut self.waiting);
        match event {
            Event::Act(_) => {
                self.waiting = waiting;
                None
            }
            Event::Wish(wish) => self.wish(wish.clone()),
            Event::Answer(answer) => {
                let Waiting::Answer(wish) = waiting else {
                    self.waiting = waiting;
                    return None;
                };
                match answer {
                    Answer::Cancel => None,
                    Answer::Discard => self.go(wish),
                    Answer::Save => {
                        self.waiting = Waiting::Save(wish);
                        Some(self.save())
                    }
                }
            }
            Event::Save => Some(self.save()),
            Event::SaveAs => Some(Request::ChooseToSave),
            Event::ChosenToSave(path) => {
                let path = path.clone()?;
                // Still to be gone on with after the save.
                self.waiting = waiting;
                Some(Request::Save { path, document: self.editor.shared_document() })
            }
            Event::Saved { path, document } => {
                self.path = Some(path.clone());
                self.saved = document.clone();
                // Asked again where there were changes since.
                if let Waiting::Save(wish) = waiting { self.wish(wish) } else { None }
            }
            Event::ChosenToOpen(path) => {
                let path = path.clone()?;
                self.waiting = waiting;
                Some(Request::Open(path))
            }
            Event::Opened { path, boxes } => self.open(path, boxes, &waiting),
            Event::Failed(_) => None,
        }
    }

    fn wish(&mut self, wish: Wish) -> Option<Request> {
        if self.is_dirty() {
            self.waiting = Waiting::Answer(wish.clone());
            return Some(Request::Ask(wish));
        }
        self.go(wish)
    }

    /// Whatever is lost.
    fn go(&mut self, wish: Wish) -> Option<Request> {
        match wish {
            Wish::New => {
                self.replace(None, Vec::new());
                None
            }
            Wish::Quit => Some(Request::Quit),
            Wish::Open(path) => {
                self.waiting = Waiting::File(self.editor.shared_document());
                Some(path.map_or(Request::ChooseToOpen, Request::Open))
            }
        }
    }

    fn save(&self) -> Request {
        let document = self.editor.shared_document();
        self.path.clone().map_or(Request::ChooseToSave, |path| Request::Save { path, document })
    }

    fn open(&mut self, path: &Path, boxes: &[CloudBox], waiting: &Waiting) -> Option<Request> {
        // What changed while a dialog was open nobody has been asked about.
        let is_agreed =
            matches!(waiting, Waiting::File(document) if self.editor.document().is_same(document));
        if !is_agreed && self.is_dirty() {
            return self.wish(Wish::Open(Some(path.to_owned())));
        }
        self.replace(Some(path), boxes.to_vec());
        None
    }

    /// The seed and the settings are the scene's and the hand's, and stay.
    fn replace(&mut self, path: Option<&Path>, boxes: Vec<CloudBox>) {
        let document = Document { boxes, seed: self.editor.document().seed };
        self.editor = Editor::of(document, *self.editor.settings());
        self.saved = self.editor.shared_document();
        self.path = path.map(Path::to_owned);
    }
}

impl Default for Session {
    fn default() -> Self {
        Session::new()
    }
}

/// Opens and saves; none of what takes a dialog, or ends the window.
pub fn perform(request: &Request) -> Option<Event> {
    match request {
        Request::Open(path) => Some(match box_file::read(path) {
            Ok(boxes) => Event::Opened { path: path.clone(), boxes },
            Err(error) => Event::Failed(error),
        }),
        Request::Save { path, document } => Some(match box_file::write(path, &document.boxes) {
            Ok(()) => Event::Saved { path: path.clone(), document: document.clone() },
            Err(error) => Event::Failed(error),
        }),
        Request::Ask(_) | Request::ChooseToOpen | Request::ChooseToSave | Request::Quit => None,
    }
}

#[cfg(test)]
mod tests;
