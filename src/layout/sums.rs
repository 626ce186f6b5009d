//! How sums are formed, as shaders are told: macros of `include/sum.glsl`.

use crate::model::sums::{Precision, Summation, Sums};

/// PLAIN, KAHAN and PAIRWISE of `include/sum.glsl`.
pub const PLAIN: u32 = 0;
pub const KAHAN: u32 = 1;
pub const PAIRWISE: u32 = 2;

/// Of a kernel whose sums can be formed otherwise; plain sums of floats by default.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SumMacros([(&'static str, u32); 2]);

impl SumMacros {
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
