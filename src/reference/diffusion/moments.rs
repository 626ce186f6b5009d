//! φ and F of cells, and values between the cells' centres.

use glam::DVec3;

use super::sources::{DiffusionMedium, Moments, Sources};
use super::system::{before, next};
use crate::model::grid::GridSpec;

/// Returns φ with the flux F = q − D∇φ; at the faces of the box by one-sided differences.
pub(super) fn flux_of(
    of: &DiffusionMedium,
    grid: &GridSpec,
    cells: &[f64],
    sources: &Sources,
    phi: &[DVec3],
) -> Vec<Moments> {
    let (n, h) = (grid.n_cells.as_usizevec3(), grid.edges());
    let flux = |c: usize, axis: usize| {
        let (after, prior) = (next(n, c, axis), before(n, c, axis));
        let steps = f64::from(u8::from(after.is_some()) + u8::from(prior.is_some()));
        let rise = phi[after.unwrap_or(c)] - phi[prior.unwrap_or(c)];
        let slope = if steps > 0.0 { rise / (steps * h[axis]) } else { DVec3::ZERO };
        sources.carried[c][axis] - of.reach(cells[c]) * slope
    };
    (0..cells.len()).map(|c| [phi[c], flux(c, 0), flux(c, 1), flux(c, 2)]).collect()
}

/// Returns the 8 cells around `p` with their shares in a trilinear value; beyond the outermost
/// centres those of the nearest place on them.
pub(super) fn corners(spec: &GridSpec, p: DVec3) -> [(usize, f64); 8] {
    let n = spec.n_cells.as_usizevec3();
    let at = (p - spec.low) / spec.edges() - DVec3::splat(0.5);
    let at = at.max(DVec3::ZERO).min((n - 1).as_dvec3());
    let (base, part) = (at.floor().as_usizevec3(), at - at.floor());
    std::array::from_fn(|corner| {
        let (mut c, mut weight, mut stride) = (0, 1.0, 1);
        for axis in 0..3 {
            let is_next = corner >> axis & 1;
            weight *= if is_next == 1 { part[axis] } else { 1.0 - part[axis] };
            c += stride * (base[axis] + is_next).min(n[axis] - 1);
            stride *= n[axis];
        }
        (c, weight)
    })
}
