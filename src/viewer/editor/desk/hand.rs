//! What the pointer does: takes hold of handles and lets go of them, selects, turns the camera.

use glam::{DVec2, DVec3};

use super::{Button, Desk, Held};
use crate::viewer::editor::action::{Action, DragAction, Modifiers, Select};
use crate::viewer::editor::handles::Handle;
use crate::viewer::editor::selection::How;
use crate::viewer::editor::viewport::{pick_all, pick_rectangle};
use crate::viewer::fly_camera::Motion;

/// What the hand holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Hold {
    Nothing,
    /// A handle, with the left button; before it `is_pulled` it may still become a click.
    Handle {
        from: DVec2,
        held: Held,
        is_pulled: bool,
    },
    /// What a key began, without a button.
    ByKey,
    Rectangle {
        from: DVec2,
        to: DVec2,
        held: Held,
    },
    /// The camera, with this button.
    Eye {
        which: Button,
        at: DVec2,
        pans: bool,
    },
}

/// A press and a release no farther apart than this, in logical points, are a click.
const CLICK_POINTS: f64 = 3.0;
/// The camera turns so far, rad, where the pointer goes across the picture.
const TURN: f64 = std::f64::consts::PI;

impl Hold {
    pub fn is_drag(self) -> bool {
        matches!(self, Hold::Handle { .. } | Hold::ByKey)
    }
}

impl Held {
    /// What a click or a rectangle with these does to the selection.
    fn how(self) -> How {
        match (self.ctrl, self.shift) {
            (false, false) => How::Replace,
            (false, true) => How::Add,
            (true, false) => How::Toggle,
            (true, true) => How::Remove,
        }
    }

    /// Of a drag.
    fn modifiers(self) -> Modifiers {
        Modifiers { snap: self.ctrl, scaling: self.shift }
    }
}

impl Desk {
    pub(super) fn moved(&mut self, pixel: DVec2, held: Held) {
        if !pixel.is_finite() {
            return;
        }
        self.pointer = Some(pixel);
        match &mut self.hold {
            Hold::Nothing => {}
            Hold::Rectangle { to, .. } => *to = pixel,
            Hold::Eye { at, pans, .. } => {
                let (by, pans) = (pixel - std::mem::replace(at, pixel), *pans);
                self.turn_eye(by, pans);
            }
            Hold::Handle { is_pulled: false, from, .. }
                if is_near(*from, pixel, self.screen.px_per_point) => {}
            Hold::Handle { is_pulled, .. } => {
                *is_pulled = true;
                self.pull(pixel, held);
            }
            Hold::ByKey => self.pull(pixel, held),
        }
    }

    fn pull(&mut self, pixel: DVec2, held: Held) {
        let (ray, modifiers) = (self.viewport().ray(pixel), held.modifiers());
        self.said = None;
        self.act(Action::Drag(DragAction::To { ray, modifiers }));
    }

    pub(super) fn pressed(&mut self, which: Button, held: Held) {
        match (self.hold, which) {
            (Hold::ByKey, Button::Left) => self.act(Action::Drag(DragAction::End)),
            (Hold::ByKey, Button::Right) => self.act(Action::Drag(DragAction::Cancel)),
            (Hold::Nothing, _) => {
                let Some(pixel) = self.pointer else { return };
                if which == Button::Left {
                    self.take_hold(pixel, held);
                } else {
                    self.hold = Hold::Eye { which, at: pixel, pans: held.shift };
                }
            }
            // A further button while one is held.
            _ => {}
        }
    }

    fn take_hold(&mut self, pixel: DVec2, held: Held) {
        if let Some(handle) = self.hovered() {
            self.begin(handle, pixel);
            if self.editor().dragged_handle().is_some() {
                self.hold = Hold::Handle { from: pixel, held, is_pulled: false };
            }
        } else if !self.click(pixel, held) {
            self.hold = Hold::Rectangle { from: pixel, to: pixel, held };
        }
    }

    pub(super) fn released(&mut self, which: Button) {
        match self.hold {
            Hold::Handle { from, held, is_pulled } if which == Button::Left => {
                self.hold = Hold::Nothing;
                let ended = if is_pulled { DragAction::End } else { DragAction::Cancel };
                self.act(Action::Drag(ended));
                if !is_pulled {
                    self.click(from, held);
                }
            }
            Hold::Rectangle { from, to, held } if which == Button::Left => {
                self.hold = Hold::Nothing;
                let how = held.how();
                if !is_near(from, to, self.screen.px_per_point) {
                    let boxes = pick_rectangle(self.editor().boxes(), &self.viewport(), from, to);
                    self.act(Action::Select(Select::Boxes { boxes, how }));
                } else if how == How::Replace {
                    self.act(Action::Select(Select::None));
                }
            }
            Hold::Eye { which: held, .. } if held == which => self.hold = Hold::Nothing,
            _ => {}
        }
    }

    /// Selects what lies under a pixel: the nearest box, or where the last click was the one behind
    /// the active box. False where there is none.
    fn click(&mut self, pixel: DVec2, held: Held) -> bool {
        let (hits, how) =
            (pick_all(self.editor().boxes(), &self.viewport().ray(pixel)), held.how());
        let again = self.clicked.is_some_and(|at| is_near(at, pixel, self.screen.px_per_point))
            && how == How::Replace;
        self.clicked = Some(pixel);
        let active = self.editor().selection().active().filter(|_| again);
        let i_active = active.and_then(|active| hits.iter().position(|hit| hit.i_box == active));
        let i_next = i_active.map_or(0, |i| (i + 1) % hits.len());
        let Some(hit) = hits.get(i_next) else { return false };
        self.act(Action::Select(Select::Boxes { boxes: vec![hit.i_box], how }));
        true
    }

    /// What no button holds: the next press lets it go.
    pub(super) fn begin_by_key(&mut self, handle: Handle) {
        self.begin(handle, self.pointer.unwrap_or(0.5 * self.screen.size_px));
        if self.hold == Hold::Nothing && self.editor().dragged_handle().is_some() {
            self.hold = Hold::ByKey;
        }
    }

    fn begin(&mut self, handle: Handle, pixel: DVec2) {
        let view = self.viewport();
        self.act(Action::Drag(DragAction::Begin {
            handle,
            ray: view.ray(pixel),
            forward: view.pose.forward,
        }));
    }

    /// The pointer went so many pixels to the right and down.
    fn turn_eye(&mut self, by: DVec2, pans: bool) {
        if !pans {
            let turn = by * TURN / self.screen.size_px.x;
            self.flight = self.flight.after(Motion::Orbit { right: -turn.x, upward: turn.y });
            return;
        }
        let view = self.viewport();
        // What is turned about stays under the pointer.
        let units = by * view.units_per_point(self.flight.target()) / view.px_per_point;
        let seconds = units.length() / self.flight.speed();
        if seconds > 0.0 {
            let along = DVec3::new(-units.x, units.y, 0.0) / units.length();
            self.flight = self.flight.after(Motion::Fly { along, seconds });
        }
    }
}

fn is_near(a: DVec2, b: DVec2, px_per_point: f64) -> bool {
    a.distance(b) <= CLICK_POINTS * px_per_point
}
