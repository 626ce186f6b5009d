//! How the radiance of a sky's light changes with direction (model.md §19).

use std::f64::consts::PI;

use glam::DVec3;

/// A change of radiance over the upper half of the directions. A sky of irradiance E has the
/// radiance E/π (1 + t·ω − ⅔ t_y) from ω, with a vector t for each channel. So E stays what a level
/// plane gets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tilt {
    /// t along x, y and z; its channels are linear RGB.
    pub along: [DVec3; 3],
}

/// Mean of the sine of the elevation by the light on a level plane.
const MEAN_UP: f64 = 2.0 / 3.0;

impl Tilt {
    /// The same radiance from all of the upper directions.
    pub const EVEN: Tilt = Tilt { along: [DVec3::ZERO; 3] };

    /// Returns the tilt of a sky whose light on walls is `mean` as a mean over the azimuths. A wall
    /// that faces the unit vector `level` has as much more than its opposite as `toward` is more
    /// than `away`. All are irradiances over that of a level plane.
    pub fn of_walls(level: DVec3, [toward, away, mean]: [DVec3; 3]) -> Tilt {
        let across = 1.5 * (toward - away);
        let up = (mean - 0.5) / (MEAN_UP / PI - 0.5 * MEAN_UP);
        Tilt { along: [across * level.x, up, across * level.z] }
    }

    /// Returns π times the radiance from an upward unit direction over E. High up under a
    /// low sun it may be below 0.
    pub fn radiance(&self, direction: DVec3) -> DVec3 {
        let [x, y, z] = self.along;
        1.0 + x * direction.x + y * (direction.y - MEAN_UP) + z * direction.z
    }

    /// Returns the irradiance over E on a facet of unit normal `n`.
    ///
    /// The directions above both the horizon and the facet are a lune whose planes meet at π − α,
    /// with α between `n` and the zenith. Over it, ∫ ω(n·ω)dω is ⅔((π − α)n + sin α ŷ).
    pub fn irradiance(&self, n: DVec3) -> DVec3 {
        let even = 0.5 + 0.5 * n.y;
        let across = n.cross(DVec3::Y).length();
        let mean = (MEAN_UP / PI) * ((PI - across.atan2(n.y)) * n + across * DVec3::Y)
            - MEAN_UP * even * DVec3::Y;
        let [x, y, z] = self.along;
        even + x * mean.x + y * mean.y + z * mean.z
    }

    /// Returns the flux of the sky's light over E along x, y and z: down, and away from where the
    /// sky is bright.
    pub fn flux(&self) -> [DVec3; 3] {
        let [x, _, z] = self.along;
        [-MEAN_UP * x, -DVec3::ONE, -MEAN_UP * z]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unit directions of the upper half, and the solid angle of each.
    fn directions() -> impl Iterator<Item = (DVec3, f64)> {
        let (n_up, n_around) = (200, 400);
        let of = move |i: i32, k: i32| {
            let up = (f64::from(i) + 0.5) / f64::from(n_up);
            let (sin, cos) = ((f64::from(k) + 0.5) * 2.0 * PI / f64::from(n_around)).sin_cos();
            let across = (1.0 - up * up).sqrt();
            (DVec3::new(across * cos, up, across * sin), 2.0 * PI / f64::from(n_up * n_around))
        };
        (0..n_up).flat_map(move |i| (0..n_around).map(move |k| of(i, k)))
    }

    #[test]
    fn the_irradiance_is_the_integral_of_the_radiance() {
        let tilt = Tilt {
            along: [
                DVec3::new(0.3, -0.2, 0.0),
                DVec3::new(-0.7, 0.4, 0.0),
                DVec3::new(-0.1, 0.2, 0.0),
            ],
        };
        for n in [DVec3::Y, DVec3::X, DVec3::NEG_Z, DVec3::NEG_Y, DVec3::new(0.48, -0.6, 0.64)] {
            let of = |(w, part): (DVec3, f64)| tilt.radiance(w) * (w.dot(n).max(0.0) * part / PI);
            let sum: DVec3 = directions().map(of).sum();
            let found = tilt.irradiance(n);
            assert!((found - sum).abs().max_element() < 2e-4, "{n}: {found}, {sum}");
        }
        let flux: DVec3 = directions().map(|(w, part)| -w * (tilt.radiance(w).x * part / PI)).sum();
        let found = DVec3::from(tilt.flux().map(|along| along.x));
        assert!((found - flux).abs().max_element() < 2e-4, "{found}, {flux}");
        // A level plane has E, whatever the tilt; a roof's underside nothing.
        assert!((tilt.irradiance(DVec3::Y) - 1.0).abs().max_element() < 1e-15);
        assert!(tilt.irradiance(DVec3::NEG_Y).abs().max_element() < 1e-15);
    }

    #[test]
    fn walls_have_the_mean_and_the_difference_that_the_tilt_was_made_of() {
        let level = DVec3::new(0.6, 0.0, -0.8);
        let [toward, away] = [DVec3::new(0.9, 0.7, 0.5), DVec3::new(0.4, 0.5, 0.5)];
        let mean = DVec3::new(0.62, 0.58, 0.5);
        let tilt = Tilt::of_walls(level, [toward, away, mean]);
        let middle = |n: DVec3| tilt.irradiance(n);
        assert!((middle(level) - middle(-level) - (toward - away)).abs().max_element() < 1e-15);
        let side = DVec3::new(0.8, 0.0, 0.6);
        assert!((middle(side) - mean).abs().max_element() < 1e-15);
        let even = Tilt::of_walls(level, [DVec3::splat(0.5); 3]);
        assert_eq!(even, Tilt { along: [DVec3::ZERO, DVec3::ZERO, DVec3::splat(-0.0)] });
        assert_eq!(Tilt::EVEN.irradiance(DVec3::X), DVec3::splat(0.5));
    }
}
