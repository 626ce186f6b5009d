//! How the long sums of light are formed (model.md §11 "sums").

/// In what order, and whether what is lost is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Summation {
    /// One term after the other.
    #[default]
    Plain,
    /// One after the other, and what each addition loses is added with the next.
    Kahan,
    /// By blocks, and these two by two.
    Pairwise,
}

impl Summation {
    pub const NAMES: [(&'static str, Summation); 3] = [
        ("plain", Summation::Plain),
        ("kahan", Summation::Kahan),
        ("pairwise", Summation::Pairwise),
    ];
}

/// In which numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precision {
    #[default]
    F32,
    /// Needs a device with `shaderFloat64`.
    F64,
}

impl Precision {
    pub const NAMES: [(&'static str, Precision); 2] =
        [("f32", Precision::F32), ("f64", Precision::F64)];
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Sums {
    pub summation: Summation,
    pub precision: Precision,
}
