//! The axes of the scene.

use glam::DVec3;

/// An axis of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Axis {
    /// The first axis, to the right.
    #[default]
    X,
    /// The second axis, upward.
    Y,
    /// The third axis, toward the default camera.
    Z,
}

impl Axis {
    /// All axes, in the order of a vector's components.
    pub const ALL: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

    /// Returns the index of the axis among a vector's components.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Returns the unit vector along the axis.
    pub fn unit(self) -> DVec3 {
        DVec3::AXES[self.index()]
    }

    /// Returns the axis's name, a lower-case letter.
    pub fn name(self) -> &'static str {
        ["x", "y", "z"][self.index()]
    }
}
