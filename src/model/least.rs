//! What a scene says of a bound below which something is left out of the picture.

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Least {
    /// What is below this is left out; 0: nothing.
    Of(f64),
    /// Whatever is the fastest at the scene's first frame of what changes it little enough.
    Auto,
}

impl Least {
    pub const NOTHING: Least = Least::Of(0.0);

    /// The bound; 0 where it is not chosen yet.
    pub fn bound(self) -> f64 {
        match self {
            Least::Of(bound) => bound,
            Least::Auto => 0.0,
        }
    }

    /// Whether something may be left out.
    pub fn is_some(self) -> bool {
        self.bound() > 0.0
    }
}
