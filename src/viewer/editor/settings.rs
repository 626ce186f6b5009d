//! Settings of the editor. They are no part of the document, and undo does not change them.

use super::axis::Axis;
use super::grid_snap::GridSnap;

/// Settings of the editor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Settings {
    /// The parts of the document that are drawn.
    pub display: DisplayMode,
    /// The grid that drags snap to.
    pub snap: GridSnap,
    /// The point that stays in place in scaling.
    pub anchor: ScalingAnchor,
    /// The axis that mirroring reverses.
    pub axis: Axis,
}

/// The parts of the document that are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum DisplayMode {
    /// Boxes alone (P, Figs. 3 and 5).
    #[default]
    Boxes,
    /// The cloud alone (P, Figs. 4 and 6).
    Cloud,
    /// Cloud and edges of the boxes.
    Both,
}

/// The point that stays in place when an edge changes its length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ScalingAnchor {
    /// The centre of the box.
    #[default]
    Center,
    /// The opposite face; the low face where a length is typed.
    OppositeFace,
}

impl ScalingAnchor {
    /// Returns the other anchor.
    pub fn toggled(self) -> ScalingAnchor {
        match self {
            ScalingAnchor::Center => ScalingAnchor::OppositeFace,
            ScalingAnchor::OppositeFace => ScalingAnchor::Center,
        }
    }
}
