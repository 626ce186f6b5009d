//! The summations and their error.

#![allow(dead_code, reason = "each test binary uses its own part")]

use nimbus::gpu::Device;
use nimbus::model::sums::{Precision, Summation, Sums};

pub const PLAIN: Sums = Sums { summation: Summation::Plain, precision: Precision::F32 };
pub const KAHAN: Sums = Sums { summation: Summation::Kahan, precision: Precision::F32 };
pub const PAIRWISE: Sums = Sums { summation: Summation::Pairwise, precision: Precision::F32 };

/// Returns the ways to sum that a device can run: without doubles the single-precision half of
/// them. A line in the test's output names the half that is not tested.
pub fn ways_of(device: &Device) -> Vec<Sums> {
    let mut ways = every_way();
    if !has_doubles(device) {
        ways.retain(|sums| sums.precision == Precision::F32);
    }
    ways
}

/// Whether shaders of a device can use doubles.
pub fn has_doubles(device: &Device) -> bool {
    let has = device.limits().has_float64;
    if !has {
        println!("{} has no doubles: sums of doubles are not tested", device.info().name);
    }
    has
}

/// Plain f32 sums first.
pub fn every_way() -> Vec<Sums> {
    let in_numbers =
        |precision| Summation::NAMES.map(|(_, summation)| Sums { summation, precision });
    Precision::NAMES.iter().flat_map(|(_, precision)| in_numbers(*precision)).collect()
}
