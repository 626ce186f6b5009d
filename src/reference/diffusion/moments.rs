//! φ and F of cells, and values between the cells' centres.

use glam::DVec3;

use super::sources::{DiffusionMedium, Moments, Sources};
use super::system::{AtFaces, before, next};
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

/// Returns φ with the mean F of what flows through the two faces of a cell along each axis. Faces
/// on the box do not count.
pub(super) fn flux_through_faces(
    of: &DiffusionMedium,
    grid: &GridSpec,
    cells: &[f64],
    (sources, at_faces): (&Sources, AtFaces),
    phi: &[DVec3],
) -> Vec<Moments> {
    let (n, h) = (grid.n_cells.as_usizevec3(), grid.edges());
    let flow = |[a, b]: [usize; 2], axis: usize| {
        let reach = [a, b].map(|c| of.reach(cells[c]));
        let between = (0.5 * (reach[0].recip() + reach[1].recip())).recip();
        let q = at_faces.q([a, b].map(|c| sources.carried[c][axis]), reach);
        q - between * (phi[b] - phi[a]) / h[axis]
    };
    let flux = |c: usize, axis: usize| {
        let pairs = [before(n, c, axis).map(|p| [p, c]), next(n, c, axis).map(|a| [c, a])];
        let flows: Vec<DVec3> = pairs.into_iter().flatten().map(|pair| flow(pair, axis)).collect();
        match flows.len() {
            0 => sources.carried[c][axis],
            len => flows.iter().sum::<DVec3>() / len as f64,
        }
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
