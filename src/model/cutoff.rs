//! Bounds below which particles or layers are left out of the picture.

/// A bound below which something is left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cutoff {
    /// Leaves out whatever is below this value; 0 leaves out nothing.
    At(f64),
    /// Chosen at the scene's first frame: the fastest value whose change to the picture is small
    /// enough.
    Auto,
}

impl Cutoff {
    /// Leaves out nothing.
    pub const NONE: Cutoff = Cutoff::At(0.0);

    /// Returns the bound; 0 if it is not chosen yet.
    pub fn bound(self) -> f64 {
        match self {
            Cutoff::At(bound) => bound,
            Cutoff::Auto => 0.0,
        }
    }

    /// Returns whether something may be left out.
    pub fn is_active(self) -> bool {
        self.bound() > 0.0
    }
}
