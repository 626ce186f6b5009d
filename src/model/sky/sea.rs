//! The mirror of a sea under wind: sun and sky in waves whose slopes are Gaussian (model.md §19).
//!
//! *Source*: Cox and Munk, "Measurement of the Roughness of the Sea Surface from Photographs of the
//! Sun's Glitter", 1954; shadowing by Smith, "Geometrical shadowing of a random rough surface",
//! 1967.

use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use glam::DVec3;

use crate::model::cover::Sea;

/// Share of light that water mirrors straight from above.
const MIRRORED_FROM_ABOVE: f64 = 0.02;
/// Least sine of the elevations of the sun and of a wave's normal.
const LEAST_UP: f64 = 1e-4;

/// Returns the share of light that water mirrors; Schlick's fit of Fresnel's law.
fn fresnel(cosine: f64) -> f64 {
    MIRRORED_FROM_ABOVE + (1.0 - MIRRORED_FROM_ABOVE) * (1.0 - cosine.min(1.0)).powi(5)
}

impl Sea {
    /// Returns the standard deviation of the slopes along one direction.
    fn deviation(&self) -> f64 {
        (0.5 * self.slopes).sqrt()
    }

    /// Returns Φ(c) and φ(c) of the normal distribution, and sin θ, for a direction with
    /// cos θ = `up` ≥ 0. c is cot θ over the slopes' deviation.
    fn normal_at(&self, up: f64) -> [f64; 3] {
        let across = (1.0 - up * up).max(0.0).sqrt();
        let c = up / (self.deviation() * across).max(1e-12);
        let density = (-0.5 * c * c).exp() / TAU.sqrt();
        [0.5 * libm::erfc(-c * FRAC_1_SQRT_2), density, across]
    }

    /// Returns the area of the waves that a direction sees, over that of the level sea; at cos θ =
    /// `up`. Without waves it is `up`.
    fn seen(&self, up: f64) -> f64 {
        let [share, density, across] = self.normal_at(up);
        up * share + self.deviation() * across * density
    }

    /// Returns the mean normal of the waves that a direction sees, of unit length.
    fn mean_normal(&self, toward_eye: DVec3) -> DVec3 {
        let [share, _, _] = self.normal_at(toward_eye.y);
        let tilt = self.deviation().powi(2) * share / self.seen(toward_eye.y);
        DVec3::new(tilt * toward_eye.x, 1.0, tilt * toward_eye.z).normalize()
    }

    /// Returns where the mean of the waves mirrors a direction, and the share of light that it
    /// mirrors.
    pub fn mirror(&self, toward_eye: DVec3) -> (DVec3, f64) {
        let normal = self.mean_normal(toward_eye);
        let cosine = normal.dot(toward_eye);
        ((2.0 * cosine * normal - toward_eye).normalize(), fresnel(cosine))
    }

    /// Returns the radiance of a sun's glitter over its irradiance across the beam.
    pub fn glitter(&self, toward_sun: DVec3, toward_eye: DVec3) -> f64 {
        let half = toward_sun + toward_eye;
        let normal = half.normalize_or(DVec3::Y);
        let sun_up = toward_sun.y.max(LEAST_UP);
        let facing = normal.dot(toward_eye);
        let shadowed = self.seen(toward_eye.y) + toward_eye.y * (self.seen(sun_up) / sun_up - 1.0);
        fresnel(facing) * self.density(normal) / (4.0 * normal.y.max(LEAST_UP).powi(4) * shadowed)
    }

    /// Returns the density of slopes at a normal.
    fn density(&self, normal: DVec3) -> f64 {
        (-self.exponent(normal)).exp() / (PI * self.slopes)
    }

    /// Returns the square of a normal's slope over the mean square.
    pub fn exponent(&self, normal: DVec3) -> f64 {
        let up = normal.y.max(LEAST_UP);
        (normal.x * normal.x + normal.z * normal.z) / (up * up * self.slopes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn toward(elevation_deg: f64) -> DVec3 {
        let (sin, cos) = elevation_deg.to_radians().sin_cos();
        DVec3::new(cos, sin, 0.0)
    }

    /// Means over the waves that a direction sees, weighted as it sees them: by a fine grid of
    /// slopes.
    fn mean_over_waves(sea: &Sea, eye: DVec3, of: impl Fn(DVec3, f64) -> f64) -> f64 {
        let (mut sum, mut all, n) = (0.0, 0.0, 400);
        let reach = 5.0 * sea.deviation();
        for (i, k) in (0..n).flat_map(|i| (0..n).map(move |k| (i, k))) {
            let [x, z] = [i, k].map(|i| reach * (2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0));
            let normal = DVec3::new(-x, 1.0, -z);
            let weight = (-(x * x + z * z) / sea.slopes).exp() * normal.dot(eye).max(0.0);
            let unit = normal.normalize();
            sum += weight * of(unit, unit.dot(eye));
            all += weight;
        }
        sum / all
    }

    #[test]
    fn the_mean_normal_is_that_of_the_waves_that_are_seen() {
        for wind in [0.0, 5.0, 15.0] {
            let sea = Sea::of_wind(wind);
            for elevation in [90.0, 40.0, 10.0, 2.0, 0.0] {
                let eye = toward(elevation);
                let slope = mean_over_waves(&sea, eye, |normal, _| normal.x / normal.y);
                let normal = sea.mean_normal(eye);
                let off = (slope - normal.x / normal.y).abs();
                assert!(off < 2e-3 * sea.deviation() + 1e-9, "{wind} {elevation}: {off}");
            }
        }
    }

    /// One mirror in place of all waves: what that leaves out.
    #[test]
    fn the_mean_wave_mirrors_nearly_as_much_as_all() {
        for (wind, most) in [(3.0, 0.04), (10.0, 0.09)] {
            let sea = Sea::of_wind(wind);
            for elevation in [90.0, 45.0, 20.0, 10.0, 5.0, 1.0] {
                let eye = toward(elevation);
                let all = mean_over_waves(&sea, eye, |_, cosine| fresnel(cosine.max(0.0)));
                let (_, one) = sea.mirror(eye);
                println!("{wind} m/s, {elevation}°: {one:.4} for {all:.4}");
                assert!((one - all).abs() < most, "{wind} {elevation}: {one} for {all}");
            }
        }
    }

    #[test]
    fn glitter_by_hand_and_by_energy() {
        // Straight down: F/(4 π σ²), with waves of 5 m/s: 0.02/(4 π · 0.0286).
        let sea = Sea::of_wind(5.0);
        let up = DVec3::Y;
        assert!((sea.glitter(up, up) / (0.02 / (4.0 * PI * 0.0286)) - 1.0).abs() < 1e-12);
        // All that is mirrored upward of a high sun is about F of what arrives.
        let (mut sum, n) = (0.0, 400);
        let sun = toward(60.0);
        for (i, k) in (0..n).flat_map(|i| (0..n).map(move |k| (i, k))) {
            let (u, phi) = ((f64::from(i) + 0.5) / f64::from(n), f64::from(k) / f64::from(n) * TAU);
            let across = (1.0 - u * u).sqrt();
            let eye = DVec3::new(across * phi.cos(), u, across * phi.sin());
            sum += sea.glitter(sun, eye) * u * TAU / f64::from(n * n);
        }
        let share = sum / sun.y;
        assert!((0.019..0.026).contains(&share), "{share}");
        // It is finite for the lowest sun and eye.
        let low = sea.glitter(toward(0.0), DVec3::new(-1.0, 0.0, 0.0));
        assert!(low.is_finite() && low >= 0.0, "{low}");
    }
}
