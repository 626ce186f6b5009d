//! What a scene says of a bound below which something is left out of the picture.

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cutoff {
    /// What is below this is left out; 0: nothing.
    At(f64),
    /// Whatever is the fastest at the scene's first frame of what changes it little enough.
    Auto,
}

impl Cutoff {
    pub const NONE: Cutoff = Cutoff::At(0.0);

    /// The bound; 0 where it is not chosen yet.
    pub fn bound(self) -> f64 {
        match self {
            Cutoff::At(bound) => bound,
            Cutoff::Auto => 0.0,
        }
    }

    /// Whether something may be left out.
    pub fn is_active(self) -> bool {
        self.bound() > 0.0
    }
}
