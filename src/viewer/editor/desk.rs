//! What hands do at the window, and what comes of it: (desk, input) → (desk, requests). Pointer and
//! keys become the session's events here, and motions of the camera; a window has only to tell what
//! happened, to draw what the desk holds, and to do what is asked of it. [`hand`] is what the
//! pointer does.

mod hand;

use glam::{DVec2, DVec3};

use super::action::{Action, DragAction, Edit, Refusal, Setting};
use super::document::Touched;
use super::handles::{self, Handle};
use super::session::{Answer, Event, Request, Session, Wish};
use super::shortcuts::{Chord, Command, Key, command};
use super::sketch::Pointing;
use super::snap::Snap;
use super::viewport::{Viewport, framing};
use super::{Axis, Editor, numbers};
use crate::model::camera::Pose;
use crate::viewer::fly_camera::{FlyCamera, Motion};
use hand::Hold;

#[derive(Debug, Clone)]
pub struct Desk {
    session: Session,
    flight: FlyCamera,
    /// What the camera keeps up.
    up: DVec3,
    screen: Screen,
    /// Of the scene: units of what is typed.
    metres_per_unit: f64,
    /// None where it is not over the picture.
    pointer: Option<DVec2>,
    hold: Hold,
    /// Where the last click went: another one there takes what lies behind.
    clicked: Option<DVec2>,
    shows_help: bool,
    said: Option<String>,
}

/// The part of the window that the picture fills.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Screen {
    pub size_px: DVec2,
    /// Pixels in a logical point.
    pub px_per_point: f64,
    pub fov_y_rad: f64,
}

/// What happened at the window. Pixels are counted from the picture's upper left corner, as
/// [`Viewport`] has them.
#[derive(Debug, Clone, PartialEq)]
pub enum Input {
    PointerMoved {
        pixel: DVec2,
        held: Held,
    },
    /// What it holds it keeps.
    PointerLeft,
    /// Of the mouse; releases also where the pointer is elsewhere by then.
    Button {
        which: Button,
        is_down: bool,
        held: Held,
    },
    /// Notches of the wheel away from the hand.
    Wheel(f64),
    Chord(Chord),
    Resized {
        size_px: DVec2,
        px_per_point: f64,
    },
    FocusLost,
    /// Into a field of a panel, and Enter.
    Typed {
        field: Field,
        text: String,
    },
    /// From a dialog or a file, or of a panel's button.
    Event(Event),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Button {
    Left,
    Middle,
    Right,
}

/// Keys that are held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Held {
    /// Command on a Mac.
    pub ctrl: bool,
    pub shift: bool,
}

/// Numbers of a panel: of all selected boxes, but for the last two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Field {
    Count,
    Density,
    Extent(Axis),
    Center(Axis),
    Radius,
    /// Of the cloud.
    Seed,
    /// Of the grid that drags snap to.
    SnapStep,
}

/// What the mouse does, for the list of keys.
pub const MOUSE: [(&str, &str); 8] = [
    ("Left", "select a box; again at the same place: what lies behind it"),
    ("Shift+Left", "select it, too"),
    ("Ctrl+Left", "select it, or no longer"),
    ("Left on a handle", "move or scale; held Ctrl: the grid, Shift: one side or both"),
    ("Left beside boxes", "a rectangle selects what is in it"),
    ("Middle, Right", "go around; right ends a move by key as it was"),
    ("Shift+Middle", "go along with the picture"),
    ("Wheel", "nearer, farther"),
];

/// What an input led to.
#[derive(Debug, Clone)]
pub struct Turn {
    pub desk: Desk,
    pub touched: Touched,
    /// What the window has to do, in this order.
    pub requests: Vec<Request>,
}

impl Desk {
    /// With the camera at `pose`, which turns about `target` and keeps `up` up.
    pub fn new(
        session: Session,
        (pose, up, target): (&Pose, DVec3, DVec3),
        screen: Screen,
        metres_per_unit: f64,
    ) -> Desk {
        Desk {
            session,
            flight: FlyCamera::new(pose, up, target),
            up: up.normalize_or(DVec3::Y),
            screen,
            metres_per_unit,
            pointer: None,
            hold: Hold::Nothing,
            clicked: None,
            shows_help: false,
            said: None,
        }
    }

    /// The desk after an input. What cannot be done changes nothing, and is told by [`Desk::said`].
    pub fn after(&self, input: &Input) -> Turn {
        let mut desk = self.clone();
        let mut requests = vec![];
        desk.take(input, &mut requests);
        // Files and questions let go of what the hand held.
        if desk.hold.is_drag() && desk.editor().dragged_handle().is_none() {
            desk.hold = Hold::Nothing;
        }
        let touched = Touched::between(self.editor().document(), desk.editor().document());
        Turn { desk, touched, requests }
    }

    fn take(&mut self, input: &Input, requests: &mut Vec<Request>) {
        match input {
            Input::PointerMoved { pixel, held } => self.moved(*pixel, *held),
            Input::PointerLeft => self.pointer = None,
            Input::Button { which, is_down: false, .. } => self.released(*which),
            Input::Resized { size_px, px_per_point } => {
                // Of a window that has no pixels nothing can be said.
                if size_px.min_element() > 0.0 && *px_per_point > 0.0 {
                    self.screen =
                        Screen { size_px: *size_px, px_per_point: *px_per_point, ..self.screen };
                }
            }
            Input::FocusLost => self.let_go(),
            Input::Event(event) => self.told(event, requests),
            // While a question stands nothing else is answered.
            Input::Chord(chord) if self.session.asked().is_some() => {
                if chord.key == Key::Escape {
                    self.event(&Event::Answer(Answer::Cancel), requests);
                }
            }
            _ if self.session.asked().is_some() => {}
            Input::Button { which, held, .. } => {
                self.said = None;
                self.pressed(*which, *held);
            }
            Input::Wheel(notches) => {
                // What is dragged goes by where the eye was.
                if !self.hold.is_drag() {
                    self.flight = self.flight.after(Motion::Approach { notches: *notches });
                }
            }
            Input::Chord(chord) => {
                if let Some(command) = command(*chord) {
                    self.said = None;
                    self.command(command, requests);
                }
            }
            Input::Typed { field, text } => {
                self.said = None;
                match self.typed(*field, text) {
                    Ok(action) => self.act(action),
                    Err(Refusal(why)) => self.said = Some(why),
                }
            }
        }
    }

    fn event(&mut self, event: &Event, requests: &mut Vec<Request>) {
        match self.session.after(event) {
            Ok(turn) => {
                self.session = turn.session;
                requests.extend(turn.request);
            }
            Err(Refusal(why)) => self.said = Some(why),
        }
    }

    fn act(&mut self, action: Action) {
        // An action asks for nothing.
        self.event(&Event::Act(action), &mut vec![]);
    }

    fn told(&mut self, event: &Event, requests: &mut Vec<Request>) {
        let before = self.editor().shared_document();
        if matches!(event, Event::Act(_)) {
            self.said = None;
        }
        self.event(event, requests);
        match event {
            Event::Failed(error) => self.said = Some(error.to_string()),
            Event::Saved { path, .. } => self.said = Some(format!("saved {}", path.display())),
            // Refused where something would be lost by it.
            Event::Opened { .. }
                if self.session.asked().is_none() && !self.editor().document().is_same(&before) =>
            {
                self.said = None;
                self.frame();
            }
            _ => {}
        }
    }

    fn command(&mut self, command: Command, requests: &mut Vec<Request>) {
        match command {
            Command::New => self.event(&Event::Wish(Wish::New), requests),
            Command::Open => self.event(&Event::Wish(Wish::Open(None)), requests),
            Command::Save => self.event(&Event::Save, requests),
            Command::SaveAs => self.event(&Event::SaveAs, requests),
            Command::Quit => self.event(&Event::Wish(Wish::Quit), requests),
            Command::Help => self.shows_help = !self.shows_help,
            Command::Cancel if self.shows_help => self.shows_help = false,
            Command::Cancel if matches!(self.hold, Hold::Rectangle { .. }) => {
                self.hold = Hold::Nothing
            }
            Command::Frame if self.hold.is_drag() => {}
            Command::Frame => {
                if !self.frame() {
                    self.said = Some("there is no box to look at".to_owned());
                }
            }
            Command::Add => {
                self.act(Action::Edit(Edit::Add(self.editor().new_box(self.place_for_new()))))
            }
            Command::Move => self.begin_by_key(Handle::MoveView),
            Command::Scale => self.begin_by_key(Handle::ScaleAll),
            _ => {
                if let Some(action) = command.action(self.editor()) {
                    self.act(action);
                }
            }
        }
    }

    fn typed(&self, field: Field, text: &str) -> Result<Action, Refusal> {
        let is_of_boxes = !matches!(field, Field::Seed | Field::SnapStep);
        if is_of_boxes && self.editor().selection().is_empty() {
            return Err(Refusal("nothing is selected".to_owned()));
        }
        let length = |text| numbers::length(text, self.metres_per_unit);
        Ok(Action::Edit(match field {
            Field::Count => Edit::Count(numbers::count(text)?),
            Field::Density => Edit::Density(numbers::density(text, self.metres_per_unit)?),
            Field::Extent(axis) => Edit::Extent(axis, length(text)?),
            Field::Center(axis) => Edit::Center(axis, length(text)?),
            Field::Radius => Edit::Radius(length(text)?),
            Field::Seed => Edit::Seed(numbers::count(text)?),
            Field::SnapStep => {
                let snap = Snap { step: length(text)?, ..self.editor().settings().snap };
                return Ok(Action::Set(Setting::Snap(snap)));
            }
        }))
    }

    /// Under the pointer, as far off as what the camera turns about; there where the pointer says
    /// nothing.
    fn place_for_new(&self) -> DVec3 {
        let view = self.viewport();
        let under = self
            .pointer
            .and_then(|pixel| view.ray(pixel).on_plane(self.flight.target(), view.pose.forward));
        under.unwrap_or_else(|| self.flight.target())
    }

    /// The camera goes where the selection fills the picture, or everything; false where there is
    /// nothing.
    fn frame(&mut self) -> bool {
        let Some((low, high)) = self.editor().bounds() else { return false };
        let (pose, Screen { size_px, fov_y_rad, .. }) = (self.flight.pose(), self.screen);
        let (position, target) = framing(low, high, pose.forward, fov_y_rad, size_px.x / size_px.y);
        self.flight = FlyCamera::new(&Pose { position, ..pose }, self.up, target);
        true
    }

    /// Whatever the hand holds, where it is: undo takes it back.
    fn let_go(&mut self) {
        if self.hold.is_drag() {
            self.act(Action::Drag(DragAction::End));
        }
        (self.hold, self.pointer) = (Hold::Nothing, None);
    }
}

/// What is to be shown.
impl Desk {
    pub fn session(&self) -> &Session {
        &self.session
    }

    pub fn editor(&self) -> &Editor {
        self.session.editor()
    }

    pub fn flight(&self) -> &FlyCamera {
        &self.flight
    }

    pub fn viewport(&self) -> Viewport {
        let Screen { size_px, px_per_point, fov_y_rad } = self.screen;
        Viewport { pose: self.flight.pose(), fov_y_rad, size_px, px_per_point }
    }

    /// The handle that a press would take hold of.
    pub fn hovered(&self) -> Option<Handle> {
        let (pixel, view) = (self.pointer?, self.viewport());
        let is_free = self.hold == Hold::Nothing && self.session.asked().is_none();
        is_free.then(|| handles::pick(&self.editor().handles(&view), &view, pixel)).flatten()
    }

    /// What is drawn of the pointer's doings.
    pub fn pointing(&self) -> Pointing {
        Pointing { hovered: self.hovered(), rectangle: self.rectangle() }
    }

    /// Corners of the rectangle that is drawn to select by.
    pub fn rectangle(&self) -> Option<[DVec2; 2]> {
        match self.hold {
            Hold::Rectangle { from, to, .. } => Some([from, to]),
            _ => None,
        }
    }

    pub fn shows_help(&self) -> bool {
        self.shows_help
    }

    /// The last message, for a status line.
    pub fn said(&self) -> Option<&str> {
        self.said.as_deref()
    }
}

#[cfg(test)]
mod tests;
