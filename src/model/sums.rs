//! Formation of the long sums of light (passes.md "sums").

use super::named::named;

named! {
    /// Order of a sum's terms and compensation of its rounding.
    #[derive(Default)]
    pub enum Summation {
        /// Term by term.
        #[default]
        Plain = "plain",
        /// Term by term, with each addition's rounding error added to the next term.
        Kahan = "kahan",
        /// Blocks term by term, then block sums in pairs.
        Pairwise = "pairwise",
    }
}

named! {
    /// Floating-point format of a sum.
    #[derive(Default)]
    pub enum Precision {
        /// Single precision.
        #[default]
        F32 = "f32",
        /// Double precision; it needs a device with `shaderFloat64`.
        F64 = "f64",
    }
}

/// Formation of a sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Sums {
    /// Order and compensation.
    pub summation: Summation,
    /// Format.
    pub precision: Precision,
}
