//! Transmittance from every facet toward every light through the density grid, model.md §8 and §11 "transmit".
//! In: the grid, positions relative to O. Out: [facet × light], light fastest; dimensionless.

use glam::DVec3;

use super::grid::sample;
use crate::model::grid::GridSpec;
use crate::model::light::Light;

/// Greatest number of march steps: 8 a cell of the largest grid's axis, so that no `step` knob can hang a GPU.
pub const MAX_STEPS: u32 = 4096;

/// Distance from `p` along unit `d` to where the ray leaves the grid's box; 0 where `p` is not inside.
pub fn exit_distance(spec: &GridSpec, p: DVec3, d: DVec3) -> f64 {
    let (low, high) = (spec.low, spec.high());
    if !(p.cmpge(low).all() && p.cmple(high).all()) {
        return 0.0;
    }
    let along = |i: usize| match d[i] {
        v if v > 0.0 => (high[i] - p[i]) / v,
        v if v < 0.0 => (low[i] - p[i]) / v,
        _ => f64::INFINITY,
    };
    let length = along(0).min(along(1)).min(along(2));
    // Without a direction there is no way to go.
    if length.is_finite() { length } else { 0.0 }
}

/// Number of equal march steps over `length`; `step` is in cells.
pub fn n_steps(spec: &GridSpec, length: f64, step: f64) -> u32 {
    // `as` saturates; NaN (0/0) becomes 0 and then 1.
    ((length / (step * spec.cell)).ceil() as u32).clamp(1, MAX_STEPS)
}

/// τ = Σ ρ(x_k) s by midpoints from `p` toward unit `d`.
pub fn optical_depth(spec: &GridSpec, cells: &[f64], p: DVec3, d: DVec3, step: f64) -> f64 {
    let length = exit_distance(spec, p, d);
    let n = n_steps(spec, length, step);
    let s = length / f64::from(n);
    let sum: f64 = (0..n).map(|k| sample(spec, cells, p + (f64::from(k) + 0.5) * s * d)).sum();
    sum * s
}

/// τ of every facet toward every light.
pub fn optical_depths(spec: &GridSpec, cells: &[f64], positions: &[DVec3], lights: &[Light], step: f64) -> Vec<f64> {
    let toward_all = |&p: &DVec3| lights.iter().map(move |l| optical_depth(spec, cells, p, l.toward(), step));
    positions.iter().flat_map(toward_all).collect()
}

/// V = e^{−(1−g)τ}, g = `forward`, of every facet toward every light.
pub fn transmittance(
    spec: &GridSpec,
    cells: &[f64],
    positions: &[DVec3],
    lights: &[Light],
    forward: f64,
    step: f64,
) -> Vec<f64> {
    let tau = optical_depths(spec, cells, positions, lights, step);
    tau.iter().map(|tau| (-(1.0 - forward) * tau).exp()).collect()
}
