//! Transmittance from every facet to every light: past the surfaces and through the density grid,
//! model.md §8 and passes.md "transmit".
//!
//! In: grid, rectangles, facets and lights, all relative to O. Out: [facet][light], dimensionless.

use glam::DVec3;

use super::grid::sample;
use super::occlude::{Rectangle, is_clear};
use super::scatter::BARRED;
use crate::model::grid::{GridSpec, MAX_MARCH_STEPS};
use crate::model::light::Light;

/// Everything that attenuates light, and how it is marched through.
#[derive(Debug, Clone, Copy)]
pub struct Obstacles<'a> {
    /// Place of the density grid.
    pub spec: &'a GridSpec,
    /// Densities of its cells.
    pub cells: &'a [f64],
    /// Rectangles of the surfaces, which are the first regions.
    pub rectangles: &'a [Rectangle],
    /// March step, cells.
    pub step: f64,
    /// g.
    pub forward: f64,
}

/// A point where light arrives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receiver {
    /// Centre of the facet.
    pub position: DVec3,
    /// Index of its region.
    pub i_region: u32,
}

/// Returns the range of the way from `p` along unit `d`, `distance` long, that leads through the
/// grid's box, faces included; `None` if it misses the box.
pub fn crossing(spec: &GridSpec, p: DVec3, d: DVec3, distance: f64) -> Option<(f64, f64)> {
    let (low, high) = (spec.low, spec.high());
    let (mut enter, mut leave) = (0f64, distance);
    for i in 0..3 {
        if d[i] != 0.0 {
            let (a, b) = ((low[i] - p[i]) / d[i], (high[i] - p[i]) / d[i]);
            (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
        } else if !(low[i]..=high[i]).contains(&p[i]) {
            return None;
        }
    }
    // Without a direction the range is unbounded.
    (enter <= leave && leave.is_finite()).then_some((enter, leave))
}

/// Returns the number of march steps of `step` over `length`; the last one is shorter.
pub fn n_steps(length: f64, step: f64) -> u32 {
    // `as` saturates; NaN (0/0) becomes 0 and then 1.
    ((length / step).ceil() as u32).clamp(1, MAX_MARCH_STEPS)
}

/// Returns τ = Σ ρ(x_k) s_k from `p` along unit `d` over `distance`. Steps of `step` cells begin
/// where the way enters the grid's box; the last one is shorter, so that τ is continuous in the
/// length. x_k is the middle of step k.
pub fn optical_depth(
    spec: &GridSpec,
    cells: &[f64],
    p: DVec3,
    d: DVec3,
    distance: f64,
    step: f64,
) -> f64 {
    let Some((enter, leave)) = crossing(spec, p, d, distance) else { return 0.0 };
    let (length, step) = (leave - enter, step / spec.cells_along(d));
    let of_step = |k: u32| {
        let from = f64::from(k) * step;
        let s = step.min(length - from);
        sample(spec, cells, p + (enter + (from + 0.5 * s)) * d) * s
    };
    (0..n_steps(length, step)).map(of_step).sum()
}

/// Returns the number of samples of the grid that [`optical_depth`] takes.
pub fn n_samples(spec: &GridSpec, p: DVec3, d: DVec3, distance: f64, step: f64) -> u32 {
    crossing(spec, p, d, distance)
        .map_or(0, |(enter, leave)| n_steps(leave - enter, step / spec.cells_along(d)))
}

impl Obstacles<'_> {
    /// Returns e^{−(1−g)τ} on the way from `p` to the light.
    fn through_the_cloud(&self, p: DVec3, light: &Light) -> f64 {
        let way = light.arrival(p);
        let tau = optical_depth(self.spec, self.cells, p, way.toward, way.distance, self.step);
        (-(1.0 - self.forward) * tau).exp()
    }

    /// Returns V of every facet toward every light: 0 if a surface hides the light, else
    /// e^{−(1−g)τ}; 0 for lights without energy. *Shape*: [facet][light].
    pub fn transmittance(&self, receivers: &[Receiver], lights: &[Light]) -> Vec<f64> {
        let is_clear = |r: &Receiver, l: &_| is_clear(self.rectangles, r.i_region, r.position, l);
        self.where_lit(receivers, lights, is_clear)
    }

    /// Returns the transmittance of the clouds alone; 0 for lights without energy. *Shape*:
    /// [receiver][light].
    pub fn through(&self, receivers: &[Receiver], lights: &[Light]) -> Vec<f64> {
        self.where_lit(receivers, lights, |_, _| true)
    }

    /// Returns the optical depth from every receiver to every light: [`BARRED`] if a surface hides
    /// the light, and of lights without energy. *Shape*: [receiver][light].
    pub fn depths(&self, receivers: &[Receiver], lights: &[Light]) -> Vec<f64> {
        let one = |r: &Receiver, light: &Light| {
            let is_lit = light.energy() != DVec3::ZERO
                && is_clear(self.rectangles, r.i_region, r.position, light);
            if !is_lit {
                return BARRED;
            }
            let way = light.arrival(r.position);
            let (toward, distance) = (way.toward, way.distance);
            optical_depth(self.spec, self.cells, r.position, toward, distance, self.step)
        };
        let of = |r: &Receiver| lights.iter().map(|light| one(r, light)).collect::<Vec<_>>();
        receivers.iter().flat_map(of).collect()
    }

    fn where_lit(
        &self,
        receivers: &[Receiver],
        lights: &[Light],
        is_lit: impl Fn(&Receiver, &Light) -> bool,
    ) -> Vec<f64> {
        let one = |r: &Receiver, light: &Light| {
            let is_lit = light.energy() != DVec3::ZERO && is_lit(r, light);
            if is_lit { self.through_the_cloud(r.position, light) } else { 0.0 }
        };
        let of = |r: &Receiver| lights.iter().map(|light| one(r, light)).collect::<Vec<_>>();
        receivers.iter().flat_map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::UVec3;

    /// 8 × 4 × 4 cells of edge ½, low corner at the origin.
    const SPEC: GridSpec =
        GridSpec { aspect: 1.0, n_cells: UVec3::new(8, 4, 4), cell: 0.5, low: DVec3::ZERO };
    const SUN: Light = Light::Directional { direction: DVec3::NEG_X, irradiance: DVec3::ONE };

    fn transmittance(cells: &[f64], positions: &[DVec3], light: Light, forward: f64) -> Vec<f64> {
        let receivers: Vec<_> =
            positions.iter().map(|&position| Receiver { position, i_region: 0 }).collect();
        Obstacles { spec: &SPEC, cells, rectangles: &[], step: 0.5, forward }
            .transmittance(&receivers, &[light])
    }

    #[test]
    fn samples_of_a_way_by_hand() {
        let of = |p: DVec3, d: DVec3, distance: f64| n_samples(&SPEC, p, d, distance, 0.5);
        // From ¼ to the face at 4, steps of ¼; a lamp at 1; a way that misses the grid.
        let p = DVec3::new(0.25, 1.0, 1.0);
        assert_eq!(of(p, DVec3::X, f64::INFINITY), 15);
        assert_eq!(of(p, DVec3::X, 1.0), 4);
        assert_eq!(of(p + 5.0 * DVec3::Y, DVec3::X, f64::INFINITY), 0);
    }

    #[test]
    fn through_a_uniform_block_transmittance_is_an_exponential() {
        let cells = vec![1.5; 128];
        let p = DVec3::new(0.25, 1.0, 1.0);
        // From the first cell's centre to the last one's: L = 3.5; the half cell beyond lies
        // outside the hull of the centres and holds nothing. Midpoints of half cells meet every
        // face exactly.
        let v = |forward| transmittance(&cells, &[p], SUN, forward)[0];
        for forward in [0.0, 0.85] {
            assert!((v(forward) / (-(1.0 - forward) * 1.5 * 3.5f64).exp() - 1.0).abs() < 1e-14);
        }
        assert_eq!(v(1.0), 1.0);
    }

    #[test]
    fn rays_that_leave_at_once_or_miss_the_box_meet_nothing() {
        let cells = vec![1.5; 128];
        let leaving =
            [DVec3::new(4.0, 1.0, 1.0), DVec3::new(4.1, 1.0, 1.0), DVec3::new(-1.0, 2.1, 1.0)];
        assert_eq!(transmittance(&cells, &leaving, SUN, 0.0), [1.0; 3]);
        assert_eq!(crossing(&SPEC, DVec3::ONE, DVec3::ZERO, f64::INFINITY), None);
        // Along a face it is inside, beyond its corner it is not.
        assert_eq!(crossing(&SPEC, DVec3::ZERO, DVec3::X, f64::INFINITY), Some((0.0, 4.0)));
        assert_eq!(
            crossing(&SPEC, DVec3::new(-1.0, 3.5, 1.0), DVec3::new(0.6, -0.8, 0.0), 9.0),
            Some((1.875, 4.375))
        );
        assert_eq!(crossing(&SPEC, DVec3::new(-1.0, 1.0, 1.0), DVec3::X, 0.9), None);
    }

    #[test]
    fn ways_begin_outside_and_end_at_lamps() {
        let cells = vec![1.0; 128];
        let lamp = |x: f64| {
            let position = DVec3::new(x, 1.0, 1.0);
            Light::Point { position, intensity: DVec3::ONE, radius: 1e-3 }
        };
        let v = |from: f64, light: Light| {
            transmittance(&cells, &[DVec3::new(from, 1.0, 1.0)], light, 0.0)[0]
        };
        // From the hull of the centres at ¼ on: to a lamp at 3, and back; to a lamp before the box;
        // through all of it.
        assert!((v(-2.0, lamp(3.0)) / (-2.75f64).exp() - 1.0).abs() < 1e-14);
        assert!((v(3.0, lamp(-2.0)) / (-2.75f64).exp() - 1.0).abs() < 1e-14);
        assert!((v(1.0, lamp(3.0)) / (-2.0f64).exp() - 1.0).abs() < 1e-14);
        assert_eq!((v(-2.0, lamp(-0.5)), v(-2.0, lamp(-2.0))), (1.0, 1.0));
        assert!((v(-2.0, SUN) / (-3.5f64).exp() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn rectangles_hide_and_clouds_dim() {
        use crate::model::surface::Surface;
        let surface = |center, subdivide| Surface {
            center,
            u: 2.0 * DVec3::Z,
            v: 2.0 * DVec3::X,
            i_material: 0,
            subdivide,
        };
        // A floor of one facet, and above it a lid over x −3…1, z −2…2.
        let floor = Rectangle::new(&surface(DVec3::NEG_Y, [1, 1]), DVec3::ZERO);
        let lid = Rectangle::new(&surface(DVec3::new(-1.0, 5.0, 0.0), [2, 2]), DVec3::ZERO);
        let (cells, rectangles) = (vec![1.0; 128], [floor, lid]);
        let all = Obstacles {
            spec: &SPEC,
            cells: &cells,
            rectangles: &rectangles,
            step: 0.5,
            forward: 0.5,
        };
        let sky = Light::even_sky(DVec3::ONE, 0.0);
        let dark = Light::even_sky(DVec3::ZERO, 0.0);
        let at = |x: f64, y: f64, i_region| Receiver { position: DVec3::new(x, y, 1.0), i_region };
        // On the floor, in the cloud under the lid and beside it, on the lid itself.
        let receivers = [at(0.0, -1.0, 0), at(0.75, 1.0, 2), at(1.25, 1.0, 2), at(-1.0, 5.0, 1)];
        let through = (-0.5f64 * 0.75).exp();
        assert_eq!(all.transmittance(&receivers, &[sky]), [0.0, 0.0, through, 1.0]);
        // The way from the floor passes outside the cloud's hull; the lid does not count.
        assert_eq!(all.through(&receivers, &[sky]), [1.0, through, through, 1.0]);
        assert_eq!(all.transmittance(&receivers, &[dark]), [0.0; 4]);
        assert_eq!(all.through(&receivers, &[dark]), [0.0; 4]);
    }

    #[test]
    fn facets_run_slower_than_lights_and_steps_are_counted() {
        let sky = Light::even_sky(DVec3::ONE, 0.0);
        let p = [DVec3::new(0.25, 1.0, 1.0), DVec3::new(2.25, 1.0, 1.0)];
        let receivers = p.map(|position| Receiver { position, i_region: 0 });
        let all =
            Obstacles { spec: &SPEC, cells: &[1.0; 128], rectangles: &[], step: 0.5, forward: 0.0 };
        // +x: 3.5 and 1.5; +y: from 1 to the last centre at 1.75. Sums of exact halves and
        // quarters.
        let expected = [3.5f64, 0.75, 1.5, 0.75].map(|tau| (-tau).exp());
        assert_eq!(all.transmittance(&receivers, &[SUN, sky]), expected);
        let leave = crossing(&SPEC, p[0], DVec3::new(-0.6, 0.8, 0.0), f64::INFINITY);
        assert_eq!(leave, Some((0.0, 0.25 / 0.6)));
        assert_eq!([n_steps(3.75, 0.25), n_steps(3.76, 0.25), n_steps(0.0, 0.25)], [15, 16, 1]);
        assert_eq!(n_steps(3.75, 1e-9), MAX_MARCH_STEPS);
    }

    #[test]
    fn the_last_step_is_shorter_and_the_depth_continuous() {
        // ρ = x between the centres of the first and the last cell: the midpoint rule is exact on
        // whole steps.
        let cells: Vec<f64> = (0..128).map(|i| 0.25 + 0.5 * f64::from(i % 8)).collect();
        let tau = |x: f64| {
            optical_depth(&SPEC, &cells, DVec3::new(x, 1.0, 1.0), DVec3::X, f64::INFINITY, 1.0)
        };
        // By hand, steps of ½ from 2.8: midpoints 3.05, 3.55; the last from 3.8 to 4 is 0.2 long,
        // its midpoint at 3.9 beyond the last centre. From 2.1 the last lies at 3.6…4, its midpoint
        // 3.8 outside too.
        assert!((tau(2.8) - 0.5 * (3.05 + 3.55)).abs() < 1e-14);
        assert!((tau(2.1) - 0.5 * (2.35 + 2.85 + 3.35)).abs() < 1e-14);
        // Where a ray's length passes a whole number of steps, the step that comes in has length 0.
        // With an empty margin, as a scene's grid has it, the density is continuous too.
        let margin: Vec<f64> = (0..128).map(|i| if i % 8 == 7 { 0.0 } else { cells[i] }).collect();
        let tau = |x: f64| {
            optical_depth(&SPEC, &margin, DVec3::new(x, 1.0, 1.0), DVec3::X, f64::INFINITY, 1.0)
        };
        assert!(tau(2.5) > 0.0 && (tau(2.5 - 1e-9) - tau(2.5 + 1e-9)).abs() < 1e-7);
        // In a grid the march ends after MAX_MARCH_STEPS.
        let short = optical_depth(&SPEC, &[1.0; 128], DVec3::ONE, DVec3::X, f64::INFINITY, 1e-4);
        assert!((short - 4096.0 * 0.5e-4).abs() < 1e-12);
    }
}
