//! Light that arrives at the box of the grid from the surfaces and ground around it.

use std::f64::consts::PI;

use glam::DVec3;

use crate::model::grid::{GridSpec, PATCHES};
use crate::model::light::Light;
use crate::model::tilt::Tilt;
use crate::reference::facets::Facet;

/// A part of a face of the box.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    pub center: DVec3,
    pub outward: DVec3,
    pub area: f64,
}

/// Returns patch `[u, v]` of a face: `side` is 0 for the lower and 1 for the upper face of `axis`,
/// and u and v count along the next two axes.
pub(super) fn patch(grid: &GridSpec, axis: usize, side: usize, [u, v]: [usize; 2]) -> Patch {
    let (n, extent) = (PATCHES as usize, grid.high() - grid.low);
    let mut part = DVec3::ZERO;
    part[axis] = side as f64;
    part[(axis + 1) % 3] = (u as f64 + 0.5) / n as f64;
    part[(axis + 2) % 3] = (v as f64 + 0.5) / n as f64;
    Patch {
        center: grid.low + part * extent,
        outward: if side == 1 { DVec3::AXES[axis] } else { -DVec3::AXES[axis] },
        area: extent[(axis + 1) % 3] * extent[(axis + 2) % 3] / (n * n) as f64,
    }
}

/// Returns what of the light that leaves a small area at `from` evenly arrives at `to`, by its
/// irradiance: A cos cos/πd², at most 1.
pub(super) fn share(from: (DVec3, DVec3), area: f64, to: (DVec3, DVec3)) -> f64 {
    let d = from.0 - to.0;
    let (a, b) = (d.dot(to.1), -d.dot(from.1));
    if a > 0.0 && b > 0.0 {
        (area * a * b / (PI * d.length_squared().powi(2))).min(1.0)
    } else {
        0.0
    }
}

/// The skies of a scene.
#[derive(Debug, Clone)]
pub(super) struct Skies {
    /// Irradiance and tilt of what comes from above the horizon.
    above: Vec<(DVec3, Tilt)>,
    /// Irradiance from everywhere.
    pub all: DVec3,
}

impl Skies {
    /// Returns the skies among `lights`.
    pub fn new(lights: &[Light]) -> Skies {
        let mut skies = Skies { above: vec![], all: DVec3::ZERO };
        for light in lights {
            if let Light::Sky { irradiance, constant, tilt } = *light {
                skies.all += irradiance * constant;
                skies.above.push((irradiance, tilt));
            }
        }
        skies
    }

    /// Returns π times the radiance from a unit direction, of which the share `above` comes from
    /// above the horizon.
    pub fn along(&self, direction: DVec3, above: f64) -> DVec3 {
        let lifted = direction.with_y(direction.y.max(0.0));
        self.all
            + above * self.above.iter().map(|(e, tilt)| e * tilt.radiance(lifted)).sum::<DVec3>()
    }

    /// Returns the same from a direction that is above the horizon or not.
    pub fn from(&self, direction: DVec3) -> DVec3 {
        self.along(direction, if direction.y > 0.0 { 1.0 } else { 0.0 })
    }

    /// Returns the irradiance on a facet of unit normal `n`.
    pub fn on(&self, n: DVec3) -> DVec3 {
        self.all + self.above.iter().map(|(e, tilt)| e * tilt.irradiance(n)).sum::<DVec3>()
    }
}

/// Light that arrives at the box from surfaces and ground, less that of the sky that they hide:
/// by axis, side, and patch.
#[derive(Debug, Clone)]
pub struct FaceLight(Vec<DVec3>);

impl FaceLight {
    /// Returns the light of `facets`, which send out `radiosity`, W m⁻².
    ///
    /// Facets shine as points. The receiving places lie deeper in the box by `lift`, at most to its
    /// middle, so that facets near the face do not show.
    pub fn new(
        grid: &GridSpec,
        facets: &[Facet],
        radiosity: &[DVec3],
        lights: &[Light],
        lift: f64,
    ) -> FaceLight {
        let n = PATCHES as usize;
        let skies = Skies::new(lights);
        let half = 0.5 * (grid.high() - grid.low);
        let at = |i: usize| {
            let (axis, side) = (i / (2 * n * n), i / (n * n) % 2);
            let Patch { center, outward, .. } = patch(grid, axis, side, [i % n, i / n % n]);
            let place = center - outward * lift.min(half[axis]);
            let of = |(f, sent): (&Facet, &DVec3)| {
                let share = share((f.position, f.normal), f.area, (place, outward));
                share * (*sent - skies.from((f.position - place).normalize_or_zero()))
            };
            facets.iter().zip(radiosity).map(of).sum()
        };
        FaceLight((0..6 * n * n).map(at).collect())
    }

    /// Returns the light at a place of a face, given by its share of the box along each axis:
    /// bilinear between the patches' centres.
    pub fn at(&self, axis: usize, side: usize, part: DVec3) -> DVec3 {
        let n = PATCHES as usize;
        let along = |axis: usize| {
            let at = (part[axis] * n as f64 - 0.5).clamp(0.0, n as f64 - 1.0);
            let base = (at as usize).min(n - 1);
            (base, (base + 1).min(n - 1), at - base as f64)
        };
        let ((u, next_u, s), (v, next_v, t)) = (along((axis + 1) % 3), along((axis + 2) % 3));
        let of = |u: usize, v: usize| self.0[(2 * axis + side) * n * n + v * n + u];
        let row = |v: usize| of(u, v).lerp(of(next_u, v), s);
        row(v).lerp(row(next_v), t)
    }
}

#[cfg(test)]
mod tests {
    use glam::UVec3;

    use super::*;

    const GRID: GridSpec =
        GridSpec { n_cells: UVec3::new(8, 6, 4), cell: 0.5, aspect: 1.0, low: DVec3::ZERO };

    /// A floor of edge 40 at height `y` in facets of edge ½.
    fn floor(y: f64) -> Vec<Facet> {
        let at = |i: u32| 0.5 * (f64::from(i) + 0.5) - 20.0;
        let facet = |i: u32| Facet {
            position: DVec3::new(at(i % 80), y, at(i / 80)),
            normal: DVec3::Y,
            area: 0.25,
            region: 0,
            sigma: 0.0,
            conditioning: 1.0,
        };
        (0..6400).map(facet).collect()
    }

    #[test]
    fn a_wide_floor_fills_what_is_below_the_box() {
        let floor = floor(-0.5);
        let sent = vec![DVec3::ONE; floor.len()];
        let light = FaceLight::new(&GRID, &floor, &sent, &[], 0.5);
        // Nearly all that the lower face sees, half of what the sides see, nothing above.
        let mid = DVec3::splat(0.5);
        let (down, side, up) =
            (light.at(1, 0, mid).x, light.at(0, 1, mid).x, light.at(1, 1, mid).x);
        // The floor is 40 wide: from 1 above its middle 1/(1 + 20²) is missing, and the sum over
        // points is within 1 %. From 2 above, a side sees ½(1 − 2/√(2² + 20²)) of it, were it
        // endless along the side.
        assert!((down - 1.0).abs() < 0.02, "{down}");
        assert!((side - 0.45).abs() < 0.02, "{side}");
        assert_eq!(up, 0.0);
    }

    #[test]
    fn a_floor_as_bright_as_the_sky_changes_nothing() {
        let floor = floor(-2.0);
        let even = Light::even_sky(DVec3::ZERO, 1.0);
        // Of no sky, it hides nothing.
        let light = FaceLight::new(&GRID, &floor, &vec![DVec3::ZERO; 6400], &[even], 0.5);
        assert_eq!(light.at(1, 0, DVec3::splat(0.3)), DVec3::ZERO);
        let sky = Light::even_sky(DVec3::splat(2.0), 0.5);
        let light = FaceLight::new(&GRID, &floor, &vec![DVec3::ONE; 6400], &[sky], 0.5);
        assert_eq!(light.at(1, 0, DVec3::splat(0.3)), DVec3::ZERO);
        // A black one hides the share that comes from everywhere.
        let light = FaceLight::new(&GRID, &floor, &vec![DVec3::ZERO; 6400], &[sky], 0.5);
        assert!((light.at(1, 0, DVec3::splat(0.5)).x + 1.0).abs() < 0.03);
    }
}
