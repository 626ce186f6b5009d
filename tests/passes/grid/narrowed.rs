//! Bounds of blobs that are deposited narrower than they are, and blurred.

use glam::DVec3;

use nimbus::model::grid::{FIRST_BLUR, GridSpec, NARROW_BELOW, NARROW_SIGMA, blurs};
use nimbus::reference::Blob;
use nimbus::reference::deposit::blurred;
use nimbus::reference::rounding::U_F32;

const U: f64 = U_F32;

/// Relative roundings. The mass has 7 (6 products, a constant), the quanta of a mass 2, their
/// product with the share 1, the share 4 (three products, and 1 less `more`), and ½ added before
/// the cut to whole quanta 1. The sum has 6: two words to f32, their sum, the density of a quantum
/// (one more for the cells' shape), and the product.
const ROUNDINGS: f64 = 21.0;

/// Roundings of a blur: of a neighbour's product, the two neighbours' sum and three sums 5, of 1/96
/// and its product 2.
const BLUR_ROUNDINGS: f64 = 7.0;

/// Returns whether rounding leaves open neither if a blob is deposited narrower than it is.
pub fn is_decided(spec: &GridSpec, blob: &Blob) -> bool {
    let across = blob.sigma / spec.cell;
    [NARROW_SIGMA, NARROW_BELOW].iter().all(|limit| (across / limit - 1.0).abs() > 1e-5)
}

/// Returns the bound of every cell's density.
pub fn bounds(spec: &GridSpec, heaviest: f64, n_blurs: u32, blobs: &[Blob]) -> Vec<f64> {
    let (n, volume) = (spec.n_cells, spec.cell_volume());
    let n_cells = spec.n_total() as usize;
    let quantum = heaviest / 2f64.powi(31) / volume;
    // By number of blurs: the density that is deposited, and its bound.
    let mut by_step = vec![[vec![0.0; n_cells], vec![0.0; n_cells]]; n_blurs as usize + 2];
    for blob in blobs {
        let density = blob.mass() / volume;
        let at = (blob.position - spec.low) / spec.edges();
        let own = at.floor();
        // The difference, 1/h, the shape, and two products.
        let off = 5.0 * U * at;
        let weights = [0, 1, 2].map(|axis| {
            let x = at[axis] - own[axis] - 0.5;
            // A weight's slope is at most 1. Three roundings of at most 0.75.
            let error = off[axis] + 3.0 * U;
            [0.5 * (x - 0.5).powi(2), 0.75 - x * x, 0.5 * (x + 0.5).powi(2)].map(|w| (w, error))
        });
        let across = blob.sigma / spec.cell;
        let steps = blurs(across);
        // σ in cells has two roundings, its square's product one, the constant and the difference.
        let error = U * (10.0 * across * across + 1.0 + steps);
        let (step, more) = (steps as usize, steps.fract());
        let mut shares = vec![(step, 1.0 - more), (step + 1, more)];
        // It may count as one step less or more, of which it then has next to nothing.
        if more < error {
            shares.push((step - 1, 0.0));
        }
        if more > 1.0 - error {
            shares.push((step + 2, 0.0));
        }
        for (step, share) in shares {
            let [values, bounds] = &mut by_step[step];
            for k in 0..27 {
                let of = [k % 3, k / 3 % 3, k / 9];
                let cell = own + DVec3::from(of.map(|i| i as f64 - 1.0));
                let n = n.as_dvec3();
                let cell = (cell.x + n.x * (cell.y + n.y * cell.z)) as usize;
                let each = |f: fn((f64, f64)) -> f64| -> f64 {
                    (0..3).map(|axis| f(weights[axis][of[axis]])).product()
                };
                let exact = share * each(|(w, _)| w);
                let most = (share + error) * each(|(w, e)| w + e);
                values[cell] += density * exact;
                bounds[cell] += density * (most * (1.0 + ROUNDINGS * U) - exact) + 0.5 * quantum;
            }
        }
    }
    let (mut values, mut bounds) = (vec![0.0; n_cells], vec![0.0; n_cells]);
    for (step, [own, own_bounds]) in by_step.iter().enumerate().skip(1).rev() {
        assert!(step + 1 >= FIRST_BLUR as usize || own.iter().all(|v| *v == 0.0));
        for i in 0..n_cells {
            values[i] += own[i];
            bounds[i] += own_bounds[i];
            bounds[i] += U * (values[i] + bounds[i]);
        }
        for axis in 0..3 {
            (values, bounds) = (blurred(&values, n, axis), blurred(&bounds, n, axis));
            for i in 0..n_cells {
                bounds[i] += BLUR_ROUNDINGS * U * (values[i] + bounds[i]);
            }
        }
    }
    bounds
}
