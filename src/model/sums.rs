//! Formation of the long sums of light (model.md §11 "sums").

/// Order of a sum's terms and compensation of its rounding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Summation {
    /// Term by term.
    #[default]
    Plain,
    /// Term by term, with each addition's rounding error added to the next term.
    Kahan,
    /// Blocks term by term, then block sums in pairs.
    Pairwise,
}

impl Summation {
    /// Names in scene files.
    pub const NAMES: [(&'static str, Summation); 3] = [
        ("plain", Summation::Plain),
        ("kahan", Summation::Kahan),
        ("pairwise", Summation::Pairwise),
    ];
}

/// Floating-point format of a sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precision {
    /// Single precision.
    #[default]
    F32,
    /// Double precision; it needs a device with `shaderFloat64`.
    F64,
}

impl Precision {
    /// Names in scene files.
    pub const NAMES: [(&'static str, Precision); 2] =
        [("f32", Precision::F32), ("f64", Precision::F64)];
}

/// Formation of a sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Sums {
    /// Order and compensation.
    pub summation: Summation,
    /// Format.
    pub precision: Precision,
}
