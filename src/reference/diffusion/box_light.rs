//! Light that the box of the grid sends to the surfaces and ground around it.

use glam::DVec3;

use super::faces::{Patch, Skies, patch, share};
use super::field::DiffuseLight;
use crate::model::grid::{GridSpec, PATCHES};
use crate::model::light::Light;

/// The light that the box sends to surfaces and ground.
pub struct BoxLight<'a> {
    grid: &'a GridSpec,
    diffuse: &'a DiffuseLight,
    /// Patches, with φ and F there.
    patches: Vec<(Patch, [DVec3; 4])>,
}

impl<'a> BoxLight<'a> {
    /// Returns the light of `diffuse` on `grid`.
    pub fn new(grid: &'a GridSpec, diffuse: &'a DiffuseLight) -> BoxLight<'a> {
        let n = PATCHES as usize;
        let of = |i: usize| {
            let (axis, side) = (i / (2 * n * n), i / (n * n) % 2);
            let patch = patch(grid, axis, side, [i % n, i / n % n]);
            (patch, diffuse.at(patch.center).0)
        };
        BoxLight { grid, diffuse, patches: (0..6 * n * n).map(of).collect() }
    }

    /// Returns the irradiance of a facet by the box and the sky beside it. `is_open` tells of which
    /// lights nothing in the zenith hides the facet.
    pub fn irradiance(
        &self,
        (p, normal): (DVec3, DVec3),
        lights: &[Light],
        is_open: impl Fn(usize) -> bool,
    ) -> DVec3 {
        let skies = Skies::new(lights);
        let is_roofed = |(i, light): (usize, &Light)| {
            light.is_sky() && light.energy() != DVec3::ZERO && !is_open(i)
        };
        if lights.iter().enumerate().any(is_roofed) {
            return skies.all;
        }
        let (low, high) = (self.grid.low, self.grid.high());
        let nearest = p.clamp(low, high);
        let edge = (high - low).max_element() / f64::from(PATCHES);
        let far = (p.distance(nearest) / edge).min(1.0);
        let [phi, x, y, z] = self.diffuse.at(nearest).0;
        let across = x * normal.x + y * normal.y + z * normal.z;
        let inside = (0.25 * phi - 0.5 * across).max(DVec3::ZERO);
        let of_patch = |(patch, [phi, x, y, z]): &(Patch, [DVec3; 4])| {
            let to = (patch.center - p).normalize_or_zero();
            let along = *x * to.x + *y * to.y + *z * to.z;
            let sent = 0.25 * (*phi - 3.0 * along).max(DVec3::ZERO);
            let share = share((patch.center, patch.outward), patch.area, (p, normal));
            share * (sent - skies.from(to))
        };
        let outside = skies.on(normal) + self.patches.iter().map(of_patch).sum::<DVec3>();
        inside.lerp(outside.max(DVec3::ZERO), far)
    }
}

#[cfg(test)]
mod tests {
    use glam::UVec3;

    use super::*;

    const GRID: GridSpec =
        GridSpec { n_cells: UVec3::new(8, 6, 4), cell: 0.5, aspect: 1.0, low: DVec3::ZERO };

    /// Light of constant φ and F.
    fn constant(phi: f64, flux: DVec3) -> DiffuseLight {
        let cell = [phi, flux.x, flux.y, flux.z].map(DVec3::splat);
        DiffuseLight::of_cells(&GRID, vec![cell; 192])
    }

    #[test]
    fn an_empty_box_does_not_change_the_sky() {
        // φ = 2E + 4kE and F = −E along y, inside of the box, below it and beside it.
        let sky = Light::even_sky(DVec3::ONE, 0.3);
        let diffuse = constant(2.0 + 1.2, DVec3::NEG_Y);
        let of = BoxLight::new(&GRID, &diffuse);
        let at = |p, n| of.irradiance((p, n), &[sky], |_| true).x;
        for y in [1.0, 0.0, -0.1] {
            let e = at(DVec3::new(2.0, y, 1.0), DVec3::Y);
            assert!((e - 1.3).abs() < 0.05, "at {y}: {e}");
        }
        // P1 has not the sky's edge at the horizon: only the mean over the hemisphere is right.
        let e = at(DVec3::new(2.0, -3.0, 1.0), DVec3::Y);
        assert!((e - 1.3).abs() < 0.1, "{e}");
        assert!((at(DVec3::new(40.0, -3.0, 1.0), DVec3::Y) - 1.3).abs() < 1e-3);
        // Under a roof.
        assert_eq!(of.irradiance((DVec3::ONE, DVec3::Y), &[sky], |_| false).x, 0.3);
    }

    #[test]
    fn even_light_arrives_from_the_box_as_from_the_sky() {
        let even = Light::even_sky(DVec3::splat(1e-9), 1e9);
        let diffuse = constant(4.0, DVec3::ZERO);
        let of = BoxLight::new(&GRID, &diffuse);
        for p in [DVec3::ONE, DVec3::new(2.0, -0.2, 1.0), DVec3::new(9.0, -1.0, 1.0)] {
            let e = of.irradiance((p, DVec3::new(0.6, 0.8, 0.0)), &[even], |_| true).x;
            assert!((e - 1.0).abs() < 1e-8, "{p}: {e}");
        }
    }
}
