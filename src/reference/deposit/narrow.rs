//! Blobs of some cells that are deposited narrower than they are, and blurred (passes.md "grid").

use glam::{DVec3, UVec3};

use crate::model::grid::{GridSpec, LAST_BLUR, NARROW_BELOW, NARROW_SIGMA, blurs};
use crate::reference::Blob;

/// Returns whether a blob is narrow enough and wide enough for that, with a cell on each side.
pub fn is_narrowed(spec: &GridSpec, blob: &Blob) -> bool {
    let at = place(spec, blob);
    (NARROW_SIGMA..NARROW_BELOW).contains(&(blob.sigma / spec.cell))
        && at.cmpge(DVec3::ONE).all()
        && at.cmplt(spec.n_cells.as_dvec3() - 1.0).all()
}

/// Returns the place of a blob in cells from the grid's low corner.
fn place(spec: &GridSpec, blob: &Blob) -> DVec3 {
    (blob.position - spec.low) / spec.edges()
}

/// Returns the density that blobs give after all blurs.
///
/// Error: mass is kept. A blob's density differs by at most 9e-2 of its peak from the direct
/// deposit; from σ = 1.5 cells on by 2.2e-2, and from 1.75 on by 1.2e-2. Both have the same
/// variance v, in cells². Two numbers of blurs with variances v₁ and v₂ share the mass. A peak is
/// as v^(−3/2), so that the mean of both peaks is greater by (15/8)(v − v₁)(v₂ − v)/v²: at most
/// 5.2e-2, where v is 1.5 and the product 1/16. In three cells the spline has a third cumulant of
/// at most f/4 − f³ = 0.048. It changes the density by 1.38/6 of that over v^(3/2) of the peak,
/// 6e-3 on each axis. Its fourth, 1/16 − 3f²/2 + 3f⁴, changes the peak by an eighth of it over v²:
/// by at most 7e-3 on each axis where f is ½ and the third is 0, and 4e-3 where f is 0. A direct
/// deposit ends at 3σ, where a hundredth of the peak is left. The means over cells lower the peak
/// of the least σ by 9e-2.
pub fn deposit_narrow(spec: &GridSpec, blobs: &[Blob]) -> Vec<f64> {
    let n = spec.n_cells;
    let n_cells = n.as_usizevec3().element_product();
    let mut by_step = vec![Vec::new(); LAST_BLUR as usize + 1];
    for blob in blobs {
        let density = blob.mass() / spec.cell_volume();
        let steps = blurs(blob.sigma / spec.cell);
        let (step, more) = (steps as usize, steps.fract());
        for (step, share) in [(step, 1.0 - more), (step + 1, more)] {
            let cells = &mut by_step[step];
            cells.resize(n_cells, 0.0);
            each_share(spec, blob, |cell, weight| cells[cell] += density * share * weight);
        }
    }
    let mut cells = vec![0.0; n_cells];
    for step in (1..by_step.len()).rev() {
        cells.iter_mut().zip(&by_step[step]).for_each(|(cell, own)| *cell += own);
        cells = (0..3).fold(cells, |cells, axis| blurred(&cells, n, axis));
    }
    cells
}

/// Calls `f` with each cell and its share of a blob: the quadratic B-spline about its place.
pub(super) fn each_share(spec: &GridSpec, blob: &Blob, mut f: impl FnMut(usize, f64)) {
    let (at, n) = (place(spec, blob), spec.n_cells.as_usizevec3());
    let own = at.floor().as_usizevec3();
    // The spline about the middle of cell `own`, at −1, 0 and 1 from it.
    let weights = [0, 1, 2].map(|axis| {
        let x = at[axis] - own[axis] as f64 - 0.5;
        [0.5 * (x - 0.5).powi(2), 0.75 - x * x, 0.5 * (x + 0.5).powi(2)]
    });
    for (k, z) in weights[2].into_iter().enumerate() {
        for (j, y) in weights[1].into_iter().enumerate() {
            for (i, x) in weights[0].into_iter().enumerate() {
                let cell = own.x + i - 1 + n.x * (own.y + j - 1 + n.y * (own.z + k - 1));
                f(cell, x * y * z);
            }
        }
    }
}

/// Returns cells after a blur along an axis. Every cell keeps 54 of 96 shares and gives 20 and 1 to
/// the first and second on each side, mirrored at the ends. The variance is (2·20 + 2·4)/96 = ½,
/// and the fourth moment, (2·20 + 2·16)/96 = ¾, is that of a Gaussian.
pub fn blurred(cells: &[f64], n: UVec3, axis: usize) -> Vec<f64> {
    let (n_along, n) = (i64::from(n[axis]), n.as_usizevec3());
    let stride = [1, n.x, n.x * n.y][axis];
    let mut blurred = vec![0.0; cells.len()];
    for (c, value) in cells.iter().enumerate() {
        let i = (c / stride) as i64 % n_along;
        for (k, share) in (-2..=2).zip([1.0, 20.0, 54.0, 20.0, 1.0]) {
            let to = match i + k {
                beyond if beyond < 0 => -1 - beyond,
                beyond if beyond >= n_along => 2 * n_along - 1 - beyond,
                inside => inside,
            };
            blurred[c - i as usize * stride + to as usize * stride] += share / 96.0 * value;
        }
    }
    blurred
}
