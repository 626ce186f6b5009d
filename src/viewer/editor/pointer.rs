//! The pointer over the picture: picking, dragging, selecting, and moving the camera.

use glam::{DVec2, DVec3};

use super::action::{Action, DragAction, Select};
use super::handles::{Handle, pick_handle};
use super::input::{Button, ModifierKeys};
use super::selection::SelectionMode;
use super::state::Editor;
use super::viewport::{Viewport, bounds, framing, pick_all, pick_rectangle};
use crate::model::boxes::CloudBox;
use crate::viewer::fly_camera::{FlyCamera, Motion};

/// The part of the window that the picture fills.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureArea {
    /// Width and height in pixels.
    pub size_px: DVec2,
    /// Pixels per logical point.
    pub px_per_point: f64,
    /// Vertical field of view, rad.
    pub fov_y_rad: f64,
}

/// The operation that the pointer is engaged in.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Gesture {
    /// No operation.
    #[default]
    None,
    /// A press on a handle. It is a click until the pointer has moved far enough.
    Handle {
        from: DVec2,
        keys: ModifierKeys,
        has_moved: bool,
    },
    /// A drag that a key began, without a button.
    KeyDrag,
    Rectangle {
        from: DVec2,
        to: DVec2,
        keys: ModifierKeys,
    },
    /// A movement of the camera with this button.
    Camera {
        button: Button,
        at: DVec2,
        pans: bool,
    },
}

impl Gesture {
    /// Returns whether boxes are dragged.
    pub fn is_drag(self) -> bool {
        matches!(self, Gesture::Handle { .. } | Gesture::KeyDrag)
    }
}

/// Largest distance between press and release of a click, points: a hand moves a little in a click,
/// and an intended drag goes further.
const CLICK_POINTS: f64 = 3.0;
/// Angle that the camera turns when the pointer crosses the picture, rad: one stroke shows a box
/// from the opposite side.
const TURN: f64 = std::f64::consts::PI;

/// The pointer and the camera.
#[derive(Debug, Clone)]
pub struct Pointer {
    /// The camera.
    pub camera: FlyCamera,
    /// The part of the window that the picture fills.
    pub area: PictureArea,
    /// The operation in progress.
    pub gesture: Gesture,
    /// `None` outside of the picture.
    pub pixel: Option<DVec2>,
    /// Place of the last click. Another click there selects the box behind.
    last_click: Option<DVec2>,
}

impl Pointer {
    /// Creates a pointer outside of the picture.
    pub fn new(camera: FlyCamera, area: PictureArea) -> Pointer {
        Pointer { camera, area, gesture: Gesture::None, pixel: None, last_click: None }
    }

    /// Returns the viewport of the camera.
    pub fn viewport(&self) -> Viewport {
        let PictureArea { size_px, px_per_point, fov_y_rad } = self.area;
        Viewport { pose: self.camera.pose(), fov_y_rad, size_px, px_per_point }
    }

    /// Returns the handle that a press would drag.
    pub fn hovered(&self, editor: &Editor) -> Option<Handle> {
        let (pixel, view) = (self.pixel?, self.viewport());
        let is_free = self.gesture == Gesture::None;
        is_free.then(|| pick_handle(&editor.handles(&view), &view, pixel)).flatten()
    }

    /// Handles a movement of the pointer.
    pub fn moved(&mut self, pixel: DVec2, keys: ModifierKeys) -> Option<Action> {
        if !pixel.is_finite() {
            return None;
        }
        self.pixel = Some(pixel);
        let px_per_point = self.area.px_per_point;
        match &mut self.gesture {
            Gesture::None => return None,
            Gesture::Rectangle { to, .. } => {
                *to = pixel;
                return None;
            }
            Gesture::Camera { at, pans, .. } => {
                let (offset, pans) = (pixel - std::mem::replace(at, pixel), *pans);
                self.move_camera(offset, pans);
                return None;
            }
            Gesture::Handle { from, has_moved, .. } => {
                *has_moved |= !is_near(*from, pixel, px_per_point);
                if !*has_moved {
                    return None;
                }
            }
            Gesture::KeyDrag => {}
        }
        let (ray, modifiers) = (self.viewport().ray(pixel), keys.drag_modifiers());
        Some(Action::Drag(DragAction::To { ray, modifiers }))
    }

    /// Handles the press of a button.
    pub fn pressed(
        &mut self,
        editor: &Editor,
        button: Button,
        keys: ModifierKeys,
    ) -> Option<Action> {
        match (self.gesture, button) {
            (Gesture::KeyDrag, Button::Left) => return Some(Action::Drag(DragAction::End)),
            (Gesture::KeyDrag, Button::Right) => return Some(Action::Drag(DragAction::Cancel)),
            (Gesture::None, _) => {}
            // Another button is held.
            _ => return None,
        }
        let pixel = self.pixel?;
        if button != Button::Left {
            self.gesture = Gesture::Camera { button, at: pixel, pans: keys.shift };
            return None;
        }
        if let Some(handle) = self.hovered(editor) {
            self.gesture = Gesture::Handle { from: pixel, keys, has_moved: false };
            return Some(self.begin(handle, pixel));
        }
        let clicked = self.click(editor, pixel, keys);
        if clicked.is_none() {
            self.gesture = Gesture::Rectangle { from: pixel, to: pixel, keys };
        }
        clicked
    }

    /// Handles the release of a button.
    pub fn released(&mut self, editor: &Editor, button: Button) -> Vec<Action> {
        let gesture = self.gesture;
        match gesture {
            Gesture::Handle { .. } | Gesture::Rectangle { .. } if button == Button::Left => {}
            Gesture::Camera { button: held, .. } if held == button => {}
            _ => return vec![],
        }
        self.gesture = Gesture::None;
        match gesture {
            Gesture::Handle { has_moved: true, .. } => vec![Action::Drag(DragAction::End)],
            Gesture::Handle { from, keys, .. } => {
                let click = self.click(editor, from, keys);
                [Action::Drag(DragAction::Cancel)].into_iter().chain(click).collect()
            }
            Gesture::Rectangle { from, to, keys } => {
                let mode = keys.selection_mode();
                if !is_near(from, to, self.area.px_per_point) {
                    let boxes = pick_rectangle(editor.boxes(), &self.viewport(), from, to);
                    vec![Action::Select(Select::Boxes { boxes, mode })]
                } else if mode == SelectionMode::Replace {
                    vec![Action::Select(Select::None)]
                } else {
                    vec![]
                }
            }
            Gesture::None | Gesture::KeyDrag | Gesture::Camera { .. } => vec![],
        }
    }

    /// Selects the nearest box at a pixel, or, at the place of the last click, the box behind the
    /// active one. `None` where there is no box.
    fn click(&mut self, editor: &Editor, pixel: DVec2, keys: ModifierKeys) -> Option<Action> {
        let hits = pick_all(editor.boxes(), &self.viewport().ray(pixel));
        let mode = keys.selection_mode();
        let is_repeated =
            self.last_click.is_some_and(|at| is_near(at, pixel, self.area.px_per_point))
                && mode == SelectionMode::Replace;
        self.last_click = Some(pixel);
        let active = editor.selection().active().filter(|_| is_repeated);
        let i_active = active.and_then(|active| hits.iter().position(|i| *i == active));
        let i_next = i_active.map_or(0, |i| (i + 1) % hits.len());
        let boxes = vec![*hits.get(i_next)?];
        Some(Action::Select(Select::Boxes { boxes, mode }))
    }

    /// Begins a drag without a button.
    pub fn begin_key_drag(&mut self, handle: Handle) -> Action {
        if self.gesture == Gesture::None {
            self.gesture = Gesture::KeyDrag;
        }
        self.begin(handle, self.pixel.unwrap_or(0.5 * self.area.size_px))
    }

    fn begin(&self, handle: Handle, pixel: DVec2) -> Action {
        let view = self.viewport();
        let (ray, forward) = (view.ray(pixel), view.pose.forward);
        Action::Drag(DragAction::Begin { handle, ray, forward })
    }

    /// Ends the present gesture where it is.
    pub fn release_all(&mut self) -> Option<Action> {
        self.pixel = None;
        let gesture = std::mem::take(&mut self.gesture);
        gesture.is_drag().then_some(Action::Drag(DragAction::End))
    }

    /// Orbits or pans the camera after the pointer has moved by `offset`, right and down.
    fn move_camera(&mut self, offset: DVec2, pans: bool) {
        let motion = if pans {
            // The target stays under the pointer.
            let view = self.viewport();
            let units = offset * view.units_per_point(self.camera.target()) / view.px_per_point;
            let along = DVec3::new(-units.x, units.y, 0.0).normalize_or_zero();
            Motion::Fly { along, seconds: units.length() / self.camera.speed() }
        } else {
            let turn = offset * TURN / self.area.size_px.x;
            Motion::Orbit { right: -turn.x, upward: turn.y }
        };
        self.camera = self.camera.after(motion);
    }

    /// Moves the camera toward its target, except during a drag.
    pub fn approach(&mut self, notches: f64) {
        if !self.gesture.is_drag() {
            self.camera = self.camera.after(Motion::Approach { notches });
        }
    }

    /// Moves the camera so that everything between `low` and `high` is in view.
    pub fn frame(&mut self, low: DVec3, high: DVec3) {
        let (forward, area) = (self.camera.pose().forward, self.area);
        let aspect = area.size_px.x / area.size_px.y;
        let (position, target) = framing(low, high, forward, area.fov_y_rad, aspect);
        self.camera = self.camera.placed(position, target);
    }

    /// Returns the place for a new box, and the height of the view there, scene units.
    ///
    /// It is the point that the middle of the picture looks at: on the nearest box there, or else
    /// as far away as the middle of the cloud; in an empty cloud the camera's target.
    pub fn place_for_new(&self, boxes: &[CloudBox]) -> (DVec3, f64) {
        let view = self.viewport();
        let ray = view.ray(0.5 * view.size_px);
        let hit = boxes.iter().filter_map(|b| ray.hit(b)).min_by(f64::total_cmp);
        let to_cloud = || {
            let (low, high) = bounds(boxes)?;
            let distance = (0.5 * (low + high) - ray.origin).dot(ray.direction);
            (distance > 0.0).then_some(distance)
        };
        let place = hit.or_else(to_cloud).map_or(self.camera.target(), |t| ray.at(t));
        (place, view.units_per_point(place) * view.size_px.y / view.px_per_point)
    }
}

fn is_near(a: DVec2, b: DVec2, px_per_point: f64) -> bool {
    a.distance(b) <= CLICK_POINTS * px_per_point
}
