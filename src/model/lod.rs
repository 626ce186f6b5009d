//! One blob in place of many that lie close together (passes.md "lod"): which ones do.

/// Places of the order of keys that a run lies in: one blob stands for so many at most.
pub const RUN: u32 = 256;
/// Classes of σ in an octave.
pub const CLASSES_PER_OCTAVE: f64 = 4.0;
/// Classes of σ from the greatest down. Smaller blobs stay alone.
pub const N_CLASSES: i32 = 31;
/// Cells along an axis, about the lighting origin. Blobs outside stay alone.
pub const CELLS_PER_AXIS: u32 = 512;

/// Returns the class of a σ above 0.
pub fn class_of(sigma: f64) -> i32 {
    (CLASSES_PER_OCTAVE * sigma.log2()).floor() as i32
}

/// Returns the edge of the cells of a class where they are `lod` of its least σ.
pub fn edge_of(class: i32, lod: f64) -> f64 {
    lod * (f64::from(class) / CLASSES_PER_OCTAVE).exp2()
}

/// Returns a bound of σ of a blob that stands for others of at most `sigma`. Places in a cell have
/// variances of at most a quarter of its edge squared along each axis.
pub fn widened(sigma: f64, lod: f64) -> f64 {
    sigma * (1.0 + 0.25 * lod * lod).sqrt()
}

/// Greatest change of the optical depth along a ray by sizes of one class, over a run's greatest:
/// where half of the mass has either extreme.
const SIZES: f64 = 0.031;

/// Returns a bound, of second order in `lod`, of the change of the optical depth along any ray,
/// over the greatest of each run's (passes.md "lod").
pub fn depth_error(lod: f64) -> f64 {
    0.25 * lod * lod + SIZES
}
