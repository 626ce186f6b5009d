//! Transmittance from every facet toward every light through the density grid, model.md §8 and §11 "transmit".
//! In: the grid, positions relative to O. Out: [facet × light], light fastest; dimensionless.

use glam::DVec3;

use super::grid::sample;
use crate::model::grid::GridSpec;
use crate::model::light::Light;

/// Greatest number of march steps, 8 a cell along the longest axis of the largest grid: no `step` knob hangs a GPU.
/// A march that would need more ends after this many.
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

/// Number of march steps over `length`, the last one shorter; `step` is in cells.
pub fn n_steps(spec: &GridSpec, length: f64, step: f64) -> u32 {
    // `as` saturates; NaN (0/0) becomes 0 and then 1.
    ((length / (step * spec.cell)).ceil() as u32).clamp(1, MAX_STEPS)
}

/// τ = Σ ρ(x_k) s_k from `p` toward unit `d`: steps of `step` cells, the last one shorter, so that τ is continuous in
/// the length; x_k is the middle of step k.
pub fn optical_depth(spec: &GridSpec, cells: &[f64], p: DVec3, d: DVec3, step: f64) -> f64 {
    let length = exit_distance(spec, p, d);
    let of_step = |k: u32| {
        let from = f64::from(k) * step * spec.cell;
        let s = (step * spec.cell).min(length - from);
        sample(spec, cells, p + (from + 0.5 * s) * d) * s
    };
    (0..n_steps(spec, length, step)).map(of_step).sum()
}

/// τ of every facet toward every light.
pub fn optical_depths(spec: &GridSpec, cells: &[f64], positions: &[DVec3], lights: &[Light], step: f64) -> Vec<f64> {
    let toward_all = |&p: &DVec3| lights.iter().map(move |l| optical_depth(spec, cells, p, l.arrival(p).toward, step));
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

#[cfg(test)]
mod tests {
    use super::*;
    use glam::UVec3;

    /// 8 × 4 × 4 cells of edge ½, low corner at the origin.
    const SPEC: GridSpec = GridSpec { n_cells: UVec3::new(8, 4, 4), cell: 0.5, low: DVec3::ZERO };
    const SUN: Light = Light::Directional { direction: DVec3::NEG_X, irradiance: DVec3::ONE };

    #[test]
    fn through_a_uniform_block_transmittance_is_an_exponential() {
        let cells = vec![1.5; 128];
        let p = DVec3::new(0.25, 1.0, 1.0);
        // From the first cell's centre to the last one's: L = 3.5; the half cell beyond lies outside the hull
        // of the centres and holds nothing. Midpoints of half cells meet every face exactly.
        let v = |forward| transmittance(&SPEC, &cells, &[p], &[SUN], forward, 0.5)[0];
        for forward in [0.0, 0.85] {
            assert!((v(forward) / (-(1.0 - forward) * 1.5 * 3.5f64).exp() - 1.0).abs() < 1e-14);
        }
        assert_eq!(v(1.0), 1.0);
    }

    #[test]
    fn rays_that_leave_at_once_or_start_outside_meet_nothing() {
        let cells = vec![1.5; 128];
        let leaving = [DVec3::new(4.0, 1.0, 1.0), DVec3::new(4.1, 1.0, 1.0), DVec3::new(-1.0, 1.0, 1.0)];
        assert_eq!(transmittance(&SPEC, &cells, &leaving, &[SUN], 0.0, 0.5), [1.0; 3]);
        assert_eq!(exit_distance(&SPEC, DVec3::ONE, DVec3::ZERO), 0.0);
    }

    #[test]
    fn facets_run_slower_than_lights_and_steps_are_counted() {
        let sky = Light::Sky { irradiance: DVec3::ONE, constant: 0.0 };
        let p = [DVec3::new(0.25, 1.0, 1.0), DVec3::new(2.25, 1.0, 1.0)];
        let tau = optical_depths(&SPEC, &vec![1.0; 128], &p, &[SUN, sky], 0.5);
        // +x: 3.5 and 1.5; +y: from 1 to the last centre at 1.75. Sums of exact halves and quarters.
        assert_eq!(tau, [3.5, 0.75, 1.5, 0.75]);
        assert_eq!(exit_distance(&SPEC, p[0], DVec3::new(-0.6, 0.8, 0.0)), 0.25 / 0.6);
        assert_eq!([n_steps(&SPEC, 3.75, 0.5), n_steps(&SPEC, 3.76, 0.5), n_steps(&SPEC, 0.0, 0.5)], [15, 16, 1]);
        assert_eq!(n_steps(&SPEC, 3.75, 1e-9), MAX_STEPS);
    }

    #[test]
    fn the_last_step_is_shorter_and_the_depth_continuous() {
        // ρ = x between the centres of the first and the last cell: the midpoint rule is exact on whole steps.
        let cells: Vec<f64> = (0..128).map(|i| 0.25 + 0.5 * f64::from(i % 8)).collect();
        let tau = |x: f64| optical_depth(&SPEC, &cells, DVec3::new(x, 1.0, 1.0), DVec3::X, 1.0);
        // By hand, steps of ½ from 2.8: midpoints 3.05, 3.55; the last from 3.8 to 4 is 0.2 long, its midpoint at
        // 3.9 beyond the last centre. From 2.1 the last lies at 3.6…4, its midpoint 3.8 outside too.
        assert!((tau(2.8) - 0.5 * (3.05 + 3.55)).abs() < 1e-14);
        assert!((tau(2.1) - 0.5 * (2.35 + 2.85 + 3.35)).abs() < 1e-14);
        // Where a ray's length passes a whole number of steps, the step that comes in has length 0. With an empty
        // margin, as a scene's grid has it, the density is continuous too.
        let margin: Vec<f64> = (0..128).map(|i| if i % 8 == 7 { 0.0 } else { cells[i] }).collect();
        let tau = |x: f64| optical_depth(&SPEC, &margin, DVec3::new(x, 1.0, 1.0), DVec3::X, 1.0);
        assert!(tau(2.5) > 0.0 && (tau(2.5 - 1e-9) - tau(2.5 + 1e-9)).abs() < 1e-7);
        // In a grid the march ends after MAX_STEPS.
        let short = optical_depth(&SPEC, &[1.0; 128], DVec3::ONE, DVec3::X, 1e-4);
        assert!((short - 4096.0 * 0.5e-4).abs() < 1e-12);
    }
}
