//! The macros of `include/sum.glsl`, which choose how shaders form sums.

use crate::model::sums::{Precision, Summation, Sums};

/// `SUMMATION` of plain sums.
pub const PLAIN: u32 = 0;
/// `SUMMATION` of compensated sums.
pub const KAHAN: u32 = 1;
/// `SUMMATION` of pairwise sums.
pub const PAIRWISE: u32 = 2;

/// The macros of a kernel with long sums; plain sums of floats by default.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SumMacros([(&'static str, u32); 2]);

impl SumMacros {
    /// Returns names and values.
    pub fn list(&self) -> &[(&'static str, u32)] {
        &self.0
    }
}

impl From<Sums> for SumMacros {
    fn from(sums: Sums) -> SumMacros {
        let summation = match sums.summation {
            Summation::Plain => PLAIN,
            Summation::Kahan => KAHAN,
            Summation::Pairwise => PAIRWISE,
        };
        SumMacros([
            ("SUMMATION", summation),
            ("DOUBLE", u32::from(sums.precision == Precision::F64)),
        ])
    }
}

impl Default for SumMacros {
    fn default() -> SumMacros {
        Sums::default().into()
    }
}
