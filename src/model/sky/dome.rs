//! Radiance of the clear sky seen from sea level.
//!
//! *Source*: Hošek and Wilkie, "An Analytic Model for Full Spectral Sky-Dome Radiance", SIGGRAPH
//! 2012, eq. 8, with their fits for linear sRGB. Those are in W m⁻² sr⁻¹ of which 1 W is 683 lm.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;
use hw_skymodel::rgb::{SkyParams, SkyState};

use super::units::UNIT_W;

/// Number of the coefficients A to I of eq. 8.
pub const N_COEFFICIENTS: usize = 9;

/// The sky of one sun, one turbidity and one albedo of the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dome {
    /// Unit vector toward the sun.
    pub toward_sun: DVec3,
    /// A to I, by channel.
    pub coefficients: [DVec3; N_COEFFICIENTS],
    /// Factor of the radiance, scene units, by channel.
    pub scale: DVec3,
}

impl Dome {
    /// Returns the sky with the sun at `toward_sun`, which is not below the horizon. Turbidity: 1
    /// to 10; albedo of the ground, linear RGB: 0 to 1.
    ///
    /// # Errors
    /// Says which number is out of range.
    pub fn new(toward_sun: DVec3, turbidity: f64, albedo: DVec3) -> Result<Dome, String> {
        // The crate's bound is π/2 in f32.
        let elevation = (toward_sun.y.asin() as f32).min(FRAC_PI_2 as f32);
        let albedo = albedo.as_vec3().to_array();
        let params = SkyParams { elevation, turbidity: turbidity as f32, albedo };
        let (of_channels, scale) = SkyState::new(&params).map_err(|e| e.to_string())?.raw();
        let of = |k: usize, channel: usize| f64::from(of_channels[channel * N_COEFFICIENTS + k]);
        let coefficients = std::array::from_fn(|k| DVec3::new(of(k, 0), of(k, 1), of(k, 2)));
        Ok(Dome { toward_sun, coefficients, scale: DVec3::from(scale.map(f64::from)) / UNIT_W })
    }

    /// Returns the radiance from a unit direction. Below the horizon the height counts as above it,
    /// and the angle from the sun is the true one.
    pub fn radiance(&self, direction: DVec3) -> DVec3 {
        let [a, b, c, d, e, f, g, h, i] = self.coefficients;
        let cos_sun = direction.dot(self.toward_sun);
        let from_sun = direction.cross(self.toward_sun).length().atan2(cos_sun);
        let up = direction.y.abs();
        let square = cos_sun * cos_sun;
        let exp = |v: DVec3| v.map(f64::exp);
        let around = 1.0 + i * i - 2.0 * cos_sun * i;
        let halo = (1.0 + square) / around.map(|v| v.powf(1.5));
        let of_height = 1.0 + a * exp(b / (up + 0.01));
        let of_sun = c + d * exp(e * from_sun) + f * square + g * halo + h * up.sqrt();
        // The fits may go below 0 opposite of the sun.
        (self.scale * of_height * of_sun).max(DVec3::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Elevation of the sun, turbidity, albedo, [angle from the zenith, azimuth from the sun],
    /// radiance. Angles are in degrees, the radiance in W m⁻² sr⁻¹. The radiance is that of the
    /// authors' program (ArHosekSkyModel.c 1.4a, `arhosek_tristim_skymodel_radiance`).
    type Published = (f64, f64, f64, [f64; 2], [f64; 3]);

    const PUBLISHED: [Published; 30] = [
        (1.0, 2.0, 0.1, [0.0, 0.0], [0.514203, 0.677161, 0.730289]),
        (1.0, 2.0, 0.1, [45.0, 90.0], [1.01049, 1.2238, 1.20902]),
        (1.0, 2.0, 0.1, [80.0, 180.0], [4.66936, 3.66134, 1.89411]),
        (1.0, 4.5, 0.3, [0.0, 0.0], [0.474431, 0.64956, 0.754512]),
        (1.0, 4.5, 0.3, [45.0, 90.0], [1.06506, 1.21441, 1.20645]),
        (1.0, 4.5, 0.3, [80.0, 180.0], [3.78854, 3.04485, 1.71774]),
        (10.0, 2.0, 0.1, [0.0, 0.0], [0.798746, 1.66967, 3.01543]),
        (10.0, 2.0, 0.1, [45.0, 90.0], [1.54401, 2.79608, 4.53438]),
        (10.0, 2.0, 0.1, [80.0, 180.0], [8.65227, 11.613, 11.8174]),
        (10.0, 4.5, 0.3, [0.0, 0.0], [1.14402, 2.03737, 3.27364]),
        (10.0, 4.5, 0.3, [45.0, 90.0], [2.14882, 3.41492, 4.81612]),
        (10.0, 4.5, 0.3, [80.0, 180.0], [8.44369, 10.643, 10.7635]),
        (30.0, 2.0, 0.1, [0.0, 0.0], [1.37082, 2.82005, 5.92609]),
        (30.0, 2.0, 0.1, [45.0, 90.0], [2.11743, 4.19418, 8.11489]),
        (30.0, 2.0, 0.1, [80.0, 180.0], [9.27935, 14.9775, 20.839]),
        (30.0, 4.5, 0.3, [0.0, 0.0], [2.44277, 3.98766, 7.01235]),
        (30.0, 4.5, 0.3, [45.0, 90.0], [3.38617, 5.52917, 9.21618]),
        (30.0, 4.5, 0.3, [80.0, 180.0], [10.6791, 15.1825, 20.2566]),
        (60.0, 2.0, 0.1, [0.0, 0.0], [2.48593, 4.26173, 9.20935]),
        (60.0, 2.0, 0.1, [45.0, 90.0], [2.68436, 5.15813, 10.8718]),
        (60.0, 2.0, 0.1, [80.0, 180.0], [7.83737, 13.0808, 21.3004]),
        (60.0, 4.5, 0.3, [0.0, 0.0], [6.54022, 8.68758, 13.7288]),
        (60.0, 4.5, 0.3, [45.0, 90.0], [4.87622, 7.81574, 14.1699]),
        (60.0, 4.5, 0.3, [80.0, 180.0], [10.3568, 15.732, 24.7673]),
        (90.0, 2.0, 0.1, [0.0, 0.0], [5.06449, 11.9083, 12.5763]),
        (90.0, 2.0, 0.1, [45.0, 90.0], [3.21769, 6.16813, 11.8143]),
        (90.0, 2.0, 0.1, [80.0, 180.0], [9.02857, 13.1455, 21.5191]),
        (90.0, 4.5, 0.3, [0.0, 0.0], [30.788, 31.1396, 31.9258]),
        (90.0, 4.5, 0.3, [45.0, 90.0], [6.29965, 9.37903, 14.6481]),
        (90.0, 4.5, 0.3, [80.0, 180.0], [12.9063, 17.3488, 23.957]),
    ];

    #[test]
    fn the_sky_is_that_of_the_authors() {
        for (elevation, turbidity, albedo, [from_zenith, azimuth], expected) in PUBLISHED {
            let place = |zenith: f64, azimuth: f64| {
                let (sin, cos) = zenith.to_radians().sin_cos();
                let (sin_a, cos_a) = azimuth.to_radians().sin_cos();
                DVec3::new(sin * cos_a, cos, sin * sin_a)
            };
            let sun = place(90.0 - elevation, 0.0);
            let dome = Dome::new(sun, turbidity, DVec3::splat(albedo)).unwrap();
            let found = UNIT_W * dome.radiance(place(from_zenith, azimuth));
            let error = (found / DVec3::from(expected) - 1.0).abs().max_element();
            // The crate's fits are in f32: 1e-6 of the greatest term.
            assert!(error < 1e-4, "{elevation}° {from_zenith}° {azimuth}°: {found}, {error:.1e}");
        }
    }

    #[test]
    fn numbers_out_of_range_are_told() {
        let of = |up: f64, turbidity| Dome::new(DVec3::new(0.0, up, 0.0), turbidity, DVec3::ONE);
        assert!(of(1.0, 2.0).is_ok());
        assert!(of(1.0, 11.0).unwrap_err().contains("urbidity"));
        assert!(of(-0.1, 2.0).unwrap_err().contains("levation"));
    }
}
