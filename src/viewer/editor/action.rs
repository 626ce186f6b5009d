//! Actions on the editor's state, as data.

use glam::DVec3;

use super::axis::Axis;
use super::grid_snap::GridSnap;
use super::handles::Handle;
use super::ray::Ray;
use super::selection::SelectionMode;
use super::settings::{DisplayMode, ScalingAnchor};
use crate::model::boxes::CloudBox;

/// An action on the editor's state.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Changes the document. The change, if any, is one step of the history.
    Edit(Edit),
    /// Changes the selection.
    Select(Select),
    /// Begins, continues or ends a drag.
    Drag(DragAction),
    /// Restores the state before the last step.
    Undo,
    /// Restores the state after the step that was undone last.
    Redo,
    /// Changes a setting.
    Set(Setting),
}

/// A change of the selected boxes, unless stated otherwise. Lengths are in scene units.
#[derive(Debug, Clone, PartialEq)]
pub enum Edit {
    /// Appends a box and selects it.
    Add(CloudBox),
    /// Appends copies at the same places and selects them.
    Duplicate,
    /// Removes the boxes.
    Delete,
    /// Sets the number of particles.
    Count(u32),
    /// Sets the number of particles to the nearest integer for this density, particles per cubic
    /// unit.
    Density(f64),
    /// Sets the length along an axis; [`ScalingAnchor`] says what stays in place.
    Extent(Axis, f64),
    /// Sets a coordinate of the centre.
    Center(Axis, f64),
    /// Sets the largest radius of the particles.
    Radius(f64),
    /// Moves the centres.
    MoveBy(DVec3),
    /// Mirrors the boxes across a plane.
    Mirror {
        /// Axis perpendicular to the plane.
        axis: Axis,
        /// Place of the plane.
        plane: MirrorPlane,
        /// Use of the images.
        result: MirrorResult,
    },
    /// Sets the cloud's seed, whatever is selected.
    Seed(u32),
}

/// The plane of a mirror.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MirrorPlane {
    /// Coordinate 0.
    Zero,
    /// The middle of the selected boxes' bounds.
    Middle,
}

/// The use of the mirror images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MirrorResult {
    /// Images replace the boxes.
    Move,
    /// Images are appended and selected. A box that is its own image is left out, because two
    /// boxes in one place would double its particles.
    Copy,
}

/// A change of the selection.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Select {
    /// The last of the boxes becomes active.
    Boxes {
        /// Indices of the boxes.
        boxes: Vec<usize>,
        /// Effect on the selection before.
        mode: SelectionMode,
    },
    /// Selects every box; the active box stays active.
    All,
    /// Selects no box.
    None,
    /// Selects the box after the active one alone. The list is cyclic; it starts with the first
    /// box.
    Next,
    /// Selects the box before the active one alone.
    Previous,
}

/// A part of a drag, which lasts from the press of a button to its release. A drag is one step of
/// the history.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DragAction {
    /// Takes hold of a handle.
    Begin {
        /// The handle under the pointer.
        handle: Handle,
        /// Ray through the pointer.
        ray: Ray,
        /// View direction of the camera, a unit vector.
        forward: DVec3,
    },
    /// Moves the pointer to `ray`.
    To {
        /// Ray through the pointer.
        ray: Ray,
        /// Keys that are held.
        modifiers: DragModifiers,
    },
    /// Restricts the drag to an axis; the same axis again lifts the restriction.
    Constrain(Axis),
    /// Ends the drag where it is.
    End,
    /// Restores the document.
    Cancel,
}

/// Settings that a held key inverts during a drag.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DragModifiers {
    /// Inverts snapping to the grid.
    pub snap: bool,
    /// Toggles the scaling anchor.
    pub anchor: bool,
}

/// A change of one setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Setting {
    /// Sets what is drawn.
    Display(DisplayMode),
    /// Sets the grid.
    Snap(GridSnap),
    /// Sets the anchor of scaling.
    Anchor(ScalingAnchor),
    /// Sets the axis of mirroring.
    Axis(Axis),
}

impl Edit {
    /// Returns the name of the step, as in "Undo …".
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
            Edit::Mirror { .. } => "mirror",
            Edit::Seed(_) => "set the seed",
        }
    }
}
