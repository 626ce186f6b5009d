//! The same equations by elimination, without iterations: the truth for the cycles.

use glam::DVec3;

use super::system::{System, next};

/// Returns φ of each cell. The equations are banded and symmetric; memory is cells times the cells
/// of a layer, so small grids alone are meant.
pub fn solve(system: &System) -> Vec<DVec3> {
    let channels = [0, 1, 2].map(|k| of_channel(system, k));
    (0..system.sink.len()).map(|c| DVec3::from([0, 1, 2].map(|k: usize| channels[k][c]))).collect()
}

/// Cholesky's factors of a band, and both substitutions.
fn of_channel(system: &System, k: usize) -> Vec<f64> {
    let n = system.sink.len();
    let width = system.n_cells.x * system.n_cells.y;
    // Row c has the factors of cells c − width to c.
    let mut rows = vec![vec![0.0; width + 1]; n];
    for c in 0..n {
        rows[c][width] = system.diagonal(c)[k];
        for axis in 0..3 {
            if let Some(after) = next(system.n_cells, c, axis) {
                rows[after][width - (after - c)] = -system.next[c][axis][k];
            }
        }
    }
    for c in 0..n {
        let first = c.saturating_sub(width);
        for d in first..=c {
            let from = first.max(d.saturating_sub(width));
            let known: f64 =
                (from..d).map(|e| rows[c][width + e - c] * rows[d][width + e - d]).sum();
            let left = rows[c][width + d - c] - known;
            rows[c][width + d - c] = if d == c { left.sqrt() } else { left / rows[d][width] };
        }
    }
    let mut x: Vec<f64> = system.source.iter().map(|s| s[k]).collect();
    for c in 0..n {
        let first = c.saturating_sub(width);
        let known: f64 = (first..c).map(|d| rows[c][width + d - c] * x[d]).sum();
        x[c] = (x[c] - known) / rows[c][width];
    }
    for c in (0..n).rev() {
        let last = (c + width).min(n - 1);
        let known: f64 = (c + 1..=last).map(|d| rows[d][width + c - d] * x[d]).sum();
        x[c] = (x[c] - known) / rows[c][width];
    }
    x
}
