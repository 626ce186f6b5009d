//! Non-negative least squares for few columns.

use nalgebra::{DMatrix, DVector};

/// The constant c of Householder's QR with m rows and k columns. Its solution is the exact one of a
/// problem whose columns and right-hand side differ by c m k ε of their lengths. Higham (2002,
/// theorem 20.3) leaves c open as "a small integer".
const HOUSEHOLDER_CONSTANT: f64 = 4.0;

/// Returns the x ≥ 0, one for each column, for which ‖Σ xⱼ columnⱼ − b‖ is least.
///
/// The unit of xⱼ is b's divided by the column's. The result is the unconstrained solution for the
/// set of columns that leaves the least distance without a negative coefficient. All sets are tried
/// except those of dependent columns, so that columns that add nothing get 0. All columns are as
/// long as b.
///
/// # Errors
/// When a number is not finite.
pub fn solve(columns: &[Vec<f64>], b: &[f64]) -> Result<Vec<f64>, String> {
    let (matrix, lengths) = scaled(columns, b.len())?;
    let b = DVector::from_column_slice(b);
    if b.iter().any(|value| !value.is_finite()) {
        return Err("least squares: expected finite numbers".to_owned());
    }
    if columns.is_empty() || b.is_empty() {
        return Ok(vec![0.0; columns.len()]);
    }
    let tolerance = tolerance(&matrix);
    // The same problem with as many rows as columns.
    let qr = matrix.qr();
    let (matrix, b) = (qr.r(), qr.q().tr_mul(&b));
    let candidate = |set: usize| {
        let members: Vec<usize> = (0..columns.len()).filter(|j| set >> j & 1 == 1).collect();
        let found = unconstrained(&matrix.select_columns(&members), &b, tolerance)?;
        let mut x = DVector::zeros(columns.len());
        members.iter().zip(found.iter()).for_each(|(j, value)| x[*j] = *value);
        found.iter().all(|value| *value >= 0.0).then(|| ((&matrix * &x - &b).norm(), x))
    };
    let candidates = (0..1 << columns.len()).filter_map(candidate);
    let best = candidates.min_by(|(distance, _), (other, _)| distance.total_cmp(other));
    let x = best.map_or_else(|| DVector::zeros(columns.len()), |(_, x)| x);
    Ok(x.iter().zip(lengths).map(|(value, length)| value / length).collect())
}

/// Returns for each column whether it is independent of the others, to rounding. The coefficient of
/// a dependent column is one of many that fit as well.
///
/// # Errors
/// As for [`solve`].
pub fn independent(columns: &[Vec<f64>]) -> Result<Vec<bool>, String> {
    let (matrix, _) = scaled(columns, columns.first().map_or(0, Vec::len))?;
    let tolerance = tolerance(&matrix);
    // nalgebra has no rank of a matrix without elements.
    let rank = |m: &DMatrix<f64>| if m.is_empty() { 0 } else { m.rank(tolerance) };
    let whole = rank(&matrix);
    Ok((0..columns.len()).map(|j| rank(&matrix.clone().remove_column(j)) < whole).collect())
}

/// Returns the matrix of the columns divided by their lengths, and those lengths. A column of zeros
/// stays as it is and counts as of length 1.
fn scaled(columns: &[Vec<f64>], n_rows: usize) -> Result<(DMatrix<f64>, Vec<f64>), String> {
    let values = columns.iter().flatten().copied();
    let mut matrix = DMatrix::from_iterator(n_rows, columns.len(), values);
    let mut lengths = Vec::new();
    for mut column in matrix.column_iter_mut() {
        let length = column.norm();
        if !length.is_finite() {
            return Err("least squares: expected finite numbers, up to 1e150".to_owned());
        }
        let length = if length > 0.0 { length } else { 1.0 };
        column /= length;
        lengths.push(length);
    }
    Ok((matrix, lengths))
}

/// A unit column that is no farther than this from the span of the others cannot be told from one
/// within it.
fn tolerance(matrix: &DMatrix<f64>) -> f64 {
    HOUSEHOLDER_CONSTANT * matrix.len() as f64 * f64::EPSILON
}

/// Returns the least-squares solution without bounds; none for dependent columns.
fn unconstrained(matrix: &DMatrix<f64>, b: &DVector<f64>, tolerance: f64) -> Option<DVector<f64>> {
    if matrix.ncols() == 0 {
        return Some(DVector::zeros(0));
    }
    if matrix.ncols() > matrix.nrows() {
        return None;
    }
    let qr = matrix.clone().qr();
    let r = qr.r();
    let is_independent = r.diagonal().iter().all(|value| value.abs() > tolerance);
    is_independent.then(|| r.solve_upper_triangular(&qr.q().tr_mul(b)))?
}

#[cfg(test)]
mod tests;
