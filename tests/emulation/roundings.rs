//! Rounding constants of the emulation's error analysis.

/// Unit round-off of f32.
pub const U: f64 = 1.0 / 16_777_216.0;
/// Roundings of a product of some ten factors, each a sum of a few terms.
pub const ROUNDINGS: f64 = 16.0;
/// Distances below this are dominated by the positions' rounding.
pub const MIN_DISTANCE: f64 = 1e-12;
/// Relative error of an optical depth, in u: samples of a density that may double within a cell, at
/// places off by their rounding in cells, deposited by some hundreds of blobs in f32.
pub const MARCH: f64 = 256.0;
