//! Opaque columns of a weather file. Blobs may change between them: from above nobody sees it.

use super::grid::Shape;

/// Vertical optical depth of a column that more or less extinction hardly changes: 0.2 % of the
/// light pass.
const OPAQUE: f64 = 6.0;

/// The bit of a column's own in what [`open_columns`] returns.
const OWN: u16 = 1 << 4;

/// Returns for every opaque column which of those around it are opaque, too; its own is one of
/// them, whatever it is.
pub fn open_columns(shape: Shape, depths: &[f64]) -> Vec<u16> {
    let Shape { nx, ny, .. } = shape;
    let n_columns = shape.n_columns();
    let mut of_columns = vec![0.0; n_columns];
    depths.iter().enumerate().for_each(|(i, depth)| of_columns[i % n_columns] += depth);
    let of = |i: usize| {
        let (x, y) = (i % nx, i / nx);
        let is_open = |bit: usize| {
            // Rows run north, and z points south.
            let other = (x + bit / 3).checked_sub(1).zip((y + 1).checked_sub(bit % 3));
            other.is_some_and(|(x, y)| {
                x < nx && y < ny && of_columns[x + nx * y].min(of_columns[i]) >= OPAQUE
            })
        };
        (0..9).filter(|bit| is_open(*bit)).fold(OWN, |open, bit| open | 1 << bit)
    };
    (0..n_columns).map(of).collect()
}
