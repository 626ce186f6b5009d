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

/// Sectors of the sphere around the directions of bounces: of each long axis, and by the signs.
const N_SECTORS: usize = 24;

/// Returns by axis the share of a direction that counts as positive, before a face of the box.
fn positive(d: DVec3, axis: usize, side: usize) -> [f64; 3] {
    let mut positive = d.to_array().map(|part| (0.5 + 2.0 * part).clamp(0.0, 1.0));
    // Behind the face is nothing.
    positive[axis] = side as f64;
    positive
}

/// Returns the shares of a direction in the sectors, 1 in all.
fn shares(d: DVec3, positive: [f64; 3]) -> [f64; N_SECTORS] {
    std::array::from_fn(|k| {
        let of_sign = |bit: usize| match k >> bit & 1 {
            1 => 1.0 - positive[bit],
            _ => positive[bit],
        };
        d[k / 8].powi(2) * of_sign(0) * of_sign(1) * of_sign(2)
    })
}

/// Returns the integral over π of a cosine times the shares in a sector: half of it goes to the
/// cosine's axis, and a quarter to each other one.
fn projected(k: usize, axis: usize) -> f64 {
    if k / 8 == axis { 1.0 / 8.0 } else { 1.0 / 16.0 }
}

/// Light that arrives at the box from surfaces and ground, less that of the sky that they hide:
/// irradiance by axis, side, patch and sector.
#[derive(Debug, Clone)]
pub struct FaceLight(Vec<[DVec3; N_SECTORS]>);

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
            let mut sums = [DVec3::ZERO; N_SECTORS];
            for (f, sent) in facets.iter().zip(radiosity) {
                let share = share((f.position, f.normal), f.area, (place, outward));
                let toward = (f.position - place).normalize_or_zero();
                let light = share * (*sent - skies.from(toward));
                let shares = shares(toward, positive(toward, axis, side));
                sums.iter_mut().zip(shares).for_each(|(sum, share)| *sum += share * light);
            }
            sums
        };
        FaceLight((0..6 * n * n).map(at).collect())
    }

    /// Returns the irradiance at a place of a face, given by its share of the box along each axis:
    /// bilinear between the patches' centres.
    pub fn at(&self, axis: usize, side: usize, part: DVec3) -> DVec3 {
        self.sectors_at(axis, side, part).into_iter().sum()
    }

    /// Returns π times the mean radiance there from the sector of direction `k` of bounces.
    pub fn from(&self, axis: usize, side: usize, part: DVec3, k: usize) -> DVec3 {
        self.sectors_at(axis, side, part)[k] / projected(k, axis)
    }

    /// Returns π times the radiance there from `d`, of which the share `above` comes from above the
    /// horizon.
    pub fn between(&self, axis: usize, side: usize, part: DVec3, d: DVec3, above: f64) -> DVec3 {
        let mut positive = positive(d, axis, side);
        if axis != 1 {
            positive[1] = above;
        }
        let sectors = self.sectors_at(axis, side, part).into_iter().zip(shares(d, positive));
        sectors.enumerate().map(|(k, (sum, share))| share / projected(k, axis) * sum).sum()
    }

    fn sectors_at(&self, axis: usize, side: usize, part: DVec3) -> [DVec3; N_SECTORS] {
        let n = PATCHES as usize;
        let along = |axis: usize| {
            let at = (part[axis] * n as f64 - 0.5).clamp(0.0, n as f64 - 1.0);
            let base = (at as usize).min(n - 1);
            (base, (base + 1).min(n - 1), at - base as f64)
        };
        let ((u, next_u, s), (v, next_v, t)) = (along((axis + 1) % 3), along((axis + 2) % 3));
        std::array::from_fn(|k| {
            let of = |u: usize, v: usize| self.0[(2 * axis + side) * n * n + v * n + u][k];
            let row = |v: usize| of(u, v).lerp(of(next_u, v), s);
            row(v).lerp(row(next_v), t)
        })
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
    fn a_wide_floor_has_its_radiance_in_the_sectors_below() {
        let floor = floor(-4.1);
        let light = FaceLight::new(&GRID, &floor, &vec![DVec3::ONE; 6400], &[], 0.5);
        let mid = DVec3::splat(0.5);
        // Of y, the long axis 1: the sectors 10, 11, 14 and 15 lie below, two of them before +x.
        for (axis, side, k) in [(1, 0, 10), (1, 0, 15), (0, 1, 10), (0, 1, 14)] {
            let l = light.from(axis, side, mid, k).x;
            // The floor ends 20 away, at 13° below the horizon from 4.6 above it. Of what is below
            // by less than 14°, a part counts as above.
            assert!((l - 0.97).abs() < 0.04, "{axis} {k}: {l}");
        }
        assert!(light.from(0, 1, mid, 8).x < 0.01);
        let down = light.between(1, 0, mid, -DVec3::Y, 0.0).x;
        assert!((down - 0.97).abs() < 0.04, "{down}");
        let side = |above: f64| light.between(0, 1, mid, DVec3::new(0.8, -0.6, 0.0), above).x;
        assert!(side(1.0) < 0.03 && (2.0 * side(0.5) - side(0.0) - side(1.0)).abs() < 1e-15);
    }

    #[test]
    fn sectors_divide_what_a_face_sees() {
        // Midpoints of a lattice on the half sphere before +x, equal in area.
        let (mut sums, n) = ([0.0; N_SECTORS], 400);
        for i in 0..n * n {
            let (cosine, angle) = ((i / n) as f64 + 0.5, (i % n) as f64 + 0.5);
            let (cosine, angle) = (cosine / n as f64, 2.0 * PI * angle / n as f64);
            let sine = (1.0 - cosine * cosine).sqrt();
            let d = DVec3::new(cosine, sine * angle.cos(), sine * angle.sin());
            let of = shares(d, positive(d, 0, 1));
            assert!((of.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            sums.iter_mut().zip(of).for_each(|(sum, s)| *sum += 2.0 * cosine * s / (n * n) as f64);
        }
        for (k, sum) in sums.into_iter().enumerate() {
            let expected = if k & 1 == 1 { 0.0 } else { projected(k, 0) };
            // A midpoint's error falls with n².
            assert!((sum - expected).abs() < 1e-5, "{k}: {sum}");
        }
        // Directions of bounces have the signs of their sector, and most of their light is there.
        for (k, d) in super::super::bounce::directions().into_iter().enumerate() {
            assert!(shares(d, d.to_array().map(|part| f64::from(part > 0.0)))[k] > 0.8);
        }
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
