//! The editor's controller: (state, input) → (state, requests).
//!
//! Pointer, keys and typed numbers become events of the session, or motions of the camera. The
//! window passes its input on, draws the state, and carries out the requests.

use glam::DVec2;

use super::action::{Action, Edit, Setting};
use super::grid_snap::GridSnap;
use super::handles::Handle;
use super::input::{Field, Input};
use super::numbers;
use super::pointer::{Gesture, PictureArea, Pointer};
use super::session::{Answer, Intent, Request, Session, SessionEvent};
use super::shortcuts::{Chord, Command, Key, command};
use super::state::Editor;
use super::viewport::Viewport;
use crate::viewer::fly_camera::FlyCamera;

/// The state of the editor's window.
#[derive(Debug, Clone)]
pub struct EditorController {
    session: Session,
    pointer: Pointer,
    /// Length of a scene unit, m.
    metres_per_unit: f64,
    shows_help: bool,
    message: Option<String>,
}

/// Feedback on the pointer that is drawn over the picture.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PointerFeedback {
    /// The handle that a press would drag.
    pub hovered: Option<Handle>,
    /// Corners of the selection rectangle.
    pub rectangle: Option<[DVec2; 2]>,
}

impl EditorController {
    /// Creates a controller with the given camera. A scene unit has `metres_per_unit` metres.
    pub fn new(
        session: Session,
        camera: FlyCamera,
        area: PictureArea,
        metres_per_unit: f64,
    ) -> EditorController {
        let pointer = Pointer::new(camera, area);
        EditorController { session, pointer, metres_per_unit, shows_help: false, message: None }
    }

    /// Handles an input. Returns the work for the window. A rejected input changes nothing but the
    /// message.
    pub fn handle(&mut self, input: &Input) -> Option<Request> {
        let request = self.dispatch(input);
        // The editor may have refused the drag, or an event of the session may have ended it.
        if self.pointer.gesture.is_drag() && self.editor().dragged_handle().is_none() {
            self.pointer.gesture = Gesture::None;
        }
        request
    }

    fn dispatch(&mut self, input: &Input) -> Option<Request> {
        match input {
            Input::PointerMoved { pixel, keys } => {
                if let Some(action) = self.pointer.moved(*pixel, *keys) {
                    self.message = None;
                    self.act([action]);
                }
            }
            Input::PointerLeft => self.pointer.pixel = None,
            Input::Button { button, is_down: false, .. } => {
                let actions = self.pointer.released(self.session.editor(), *button);
                self.act(actions);
            }
            Input::Resized { size_px, px_per_point } => {
                // A minimized window has no size.
                if size_px.min_element() > 0.0 && *px_per_point > 0.0 {
                    let (size_px, px_per_point) = (*size_px, *px_per_point);
                    let area = self.pointer.area;
                    self.pointer.area = PictureArea { size_px, px_per_point, ..area };
                }
            }
            Input::FocusLost => {
                let action = self.pointer.release_all();
                self.act(action);
            }
            Input::Event(event) => return self.event(event),
            // An open question takes no other input.
            Input::Chord(Chord { key: Key::Escape, .. }) if self.session.question().is_some() => {
                return self.send(&SessionEvent::Answer(Answer::Cancel));
            }
            _ if self.session.question().is_some() => {}
            Input::Button { button, keys, .. } => {
                self.message = None;
                let action = self.pointer.pressed(self.session.editor(), *button, *keys);
                self.act(action);
            }
            Input::Wheel(notches) => self.pointer.approach(*notches),
            Input::Chord(chord) => return self.command(command(*chord)?),
            Input::Command(command) => return self.command(*command),
            Input::Typed { field, text } => {
                self.message = None;
                match self.typed(*field, text) {
                    Ok(action) => self.act([action]),
                    Err(why) => self.message = Some(why),
                }
            }
        }
        None
    }

    fn send(&mut self, event: &SessionEvent) -> Option<Request> {
        match self.session.after(event) {
            Ok((session, request)) => {
                self.session = session;
                request
            }
            Err(why) => {
                self.message = Some(why);
                None
            }
        }
    }

    fn act(&mut self, actions: impl IntoIterator<Item = Action>) {
        for action in actions {
            // An action makes no request.
            self.send(&SessionEvent::Act(action));
        }
    }

    fn event(&mut self, event: &SessionEvent) -> Option<Request> {
        let before = self.editor().shared_document();
        if matches!(event, SessionEvent::Act(_)) {
            self.message = None;
        }
        let request = self.send(event);
        match event {
            SessionEvent::Failed(error) => self.message = Some(error.to_string()),
            SessionEvent::Saved { path, .. } => {
                self.message = Some(format!("saved {}", path.display()));
            }
            // The session asks first where the opened file would replace unsaved changes.
            SessionEvent::Opened { .. }
                if self.session.question().is_none()
                    && !self.editor().document().is_same(&before) =>
            {
                self.message = None;
                self.frame();
            }
            _ => {}
        }
        request
    }

    fn command(&mut self, command: Command) -> Option<Request> {
        self.message = None;
        let event = match command {
            Command::New => SessionEvent::Intend(Intent::New),
            Command::Open => SessionEvent::Intend(Intent::Open(None)),
            Command::Quit => SessionEvent::Intend(Intent::Quit),
            Command::Save => SessionEvent::Save,
            Command::SaveAs => SessionEvent::SaveAs,
            Command::Help => {
                self.shows_help = !self.shows_help;
                return None;
            }
            Command::TogglePanels => return Some(Request::TogglePanels),
            Command::Cancel if self.shows_help => {
                self.shows_help = false;
                return None;
            }
            Command::Cancel if matches!(self.pointer.gesture, Gesture::Rectangle { .. }) => {
                self.pointer.gesture = Gesture::None;
                return None;
            }
            Command::Frame => {
                if !self.pointer.gesture.is_drag() && !self.frame() {
                    self.message = Some("there is no box to look at".to_owned());
                }
                return None;
            }
            Command::Add => {
                let (place, view_height) = self.pointer.place_for_new(self.editor().boxes());
                let new = self.editor().new_box(place, view_height);
                SessionEvent::Act(Action::Edit(Edit::Add(new)))
            }
            Command::Move => SessionEvent::Act(self.pointer.begin_key_drag(Handle::MoveView)),
            Command::Scale => SessionEvent::Act(self.pointer.begin_key_drag(Handle::ScaleAll)),
            _ => SessionEvent::Act(command.action(self.editor())?),
        };
        self.send(&event)
    }

    fn typed(&self, field: Field, text: &str) -> Result<Action, String> {
        let is_of_boxes = !matches!(field, Field::Seed | Field::SnapStep);
        if is_of_boxes && self.editor().selection().is_empty() {
            return Err("nothing is selected".to_owned());
        }
        let length = || numbers::length(text, self.metres_per_unit);
        Ok(Action::Edit(match field {
            Field::Count => Edit::Count(numbers::count(text)?),
            Field::Density => Edit::Density(numbers::density(text, self.metres_per_unit)?),
            Field::Extent(axis) => Edit::Extent(axis, length()?),
            Field::Center(axis) => Edit::Center(axis, length()?),
            Field::Radius => Edit::Radius(length()?),
            Field::Seed => Edit::Seed(numbers::count(text)?),
            Field::SnapStep => {
                let snap = GridSnap { step: length()?, ..self.editor().settings().snap };
                return Ok(Action::Set(Setting::Snap(snap)));
            }
        }))
    }

    /// Moves the camera to the selection, or to all boxes. Returns false where there is no box.
    fn frame(&mut self) -> bool {
        let bounds = self.editor().bounds();
        bounds.into_iter().for_each(|(low, high)| self.pointer.frame(low, high));
        bounds.is_some()
    }

    /// Returns the session.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Returns the editor's state.
    pub fn editor(&self) -> &Editor {
        self.session.editor()
    }

    /// Returns the camera.
    pub fn camera(&self) -> &FlyCamera {
        &self.pointer.camera
    }

    /// Returns the viewport of the camera.
    pub fn viewport(&self) -> Viewport {
        self.pointer.viewport()
    }

    /// Returns what is drawn for the pointer.
    pub fn feedback(&self) -> PointerFeedback {
        let is_free = self.session.question().is_none();
        let hovered = is_free.then(|| self.pointer.hovered(self.editor())).flatten();
        let rectangle = match self.pointer.gesture {
            Gesture::Rectangle { from, to, .. } => Some([from, to]),
            _ => None,
        };
        PointerFeedback { hovered, rectangle }
    }

    /// Returns whether the list of keys is shown.
    pub fn shows_help(&self) -> bool {
        self.shows_help
    }

    /// Returns the last message, for the status line.
    pub fn message(&self) -> Option<&str> {
        self.message.as_deref()
    }
}

#[cfg(test)]
mod tests;
