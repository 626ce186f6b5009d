//! The summations and their error.

#![allow(dead_code, reason = "each test binary uses its own part")]

use nimbus::model::sums::{Precision, Summation, Sums};

pub const PLAIN: Sums = Sums { summation: Summation::Plain, precision: Precision::F32 };
pub const KAHAN: Sums = Sums { summation: Summation::Kahan, precision: Precision::F32 };
pub const PAIRWISE: Sums = Sums { summation: Summation::Pairwise, precision: Precision::F32 };

/// Plain f32 sums first.
pub fn every_way() -> Vec<Sums> {
    let in_numbers =
        |precision| Summation::NAMES.map(|(_, summation)| Sums { summation, precision });
    Precision::NAMES.iter().flat_map(|(_, precision)| in_numbers(*precision)).collect()
}
