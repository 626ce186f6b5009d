//! What can be done to the state, as data.

use std::fmt;

use glam::DVec3;

use super::Axis;
use super::handles::Handle;
use super::mirror::{Outcome, Plane};
use super::ray::Ray;
use super::selection::How;
use super::snap::Snap;
use super::state::{Scaling, View};
use crate::model::boxes::CloudBox;

#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Of the boxes or the seed: one step to undo, if it changes anything.
    Edit(Edit),
    Select(Select),
    Drag(DragAction),
    Undo,
    Redo,
    Set(Setting),
}

/// What is done to all selected boxes, where it does not say otherwise. Lengths are in scene units.
#[derive(Debug, Clone, PartialEq)]
pub enum Edit {
    /// A box at the end of the list, which is selected then.
    Add(CloudBox),
    /// Copies at the end of the list, in the places of their originals; they are selected then.
    Duplicate,
    Delete,
    Count(u32),
    /// Particles in a cubic unit: sets the count to the nearest whole number.
    Density(f64),
    /// The edge along an axis; [`Scaling`] says what stays where it is.
    Extent(Axis, f64),
    /// The centre's coordinate.
    Center(Axis, f64),
    Radius(f64),
    MoveBy(DVec3),
    /// Places and edges times these, about the selection's middle; counts and radii stay.
    ScaleBy(DVec3),
    Mirror {
        axis: Axis,
        plane: Plane,
        outcome: Outcome,
    },
    /// Centres and edges to the nearest grid places, edges to a step at least.
    SnapToGrid,
    /// The cloud's seed; whatever is selected.
    Seed(u32),
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Select {
    /// As found by [`super::viewport::pick`] or [`super::viewport::pick_rectangle`]; the last one
    /// becomes active.
    Boxes {
        boxes: Vec<usize>,
        how: How,
    },
    All,
    None,
    /// The box after the active one in the list alone, the first where none is; the last is
    /// followed by the first.
    Next,
    Previous,
}

/// From the press of a button to its release; all of it is one step to undo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DragAction {
    /// `forward`: which way the camera looks, a unit vector.
    Begin {
        handle: Handle,
        ray: Ray,
        forward: DVec3,
    },
    /// The pointer is at `ray` now.
    To {
        ray: Ray,
        modifiers: Modifiers,
    },
    /// Moves or scales along this axis only; the same once more takes that back.
    Constrain(Axis),
    End,
    /// All is as it was before.
    Cancel,
}

/// Keys held while dragging: each turns the setting of its name around.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Modifiers {
    pub snap: bool,
    pub scaling: bool,
}

/// What is no part of the document and is not undone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Setting {
    View(View),
    Snap(Snap),
    Scaling(Scaling),
    /// What mirroring goes by, and what is drawn as chosen.
    Axis(Axis),
}

impl Edit {
    /// As in "Undo …".
    pub fn label(&self) -> &'static str {
        match self {
            Edit::Add(_) => "add a box",
            Edit::Duplicate => "duplicate",
            Edit::Delete => "delete",
            Edit::Count(_) => "set the number of particles",
            Edit::Density(_) => "set the density",
            Edit::Extent(..) => "set an extent",
            Edit::Center(..) => "set a place",
            Edit::Radius(_) => "set the radius",
            Edit::MoveBy(_) => "move",
            Edit::ScaleBy(_) => "scale",
            Edit::Mirror { .. } => "mirror",
            Edit::SnapToGrid => "snap to the grid",
            Edit::Seed(_) => "set the seed",
        }
    }
}

/// Why an action was not taken; nothing has changed. One sentence for a status line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal(pub String);

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Refusal {}
