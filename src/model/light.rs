//! Lights: C's I(x, y, z, θ, φ, λ) as directional, point and spot lights, and the sky (model.md §7,
//! §8).

use glam::DVec3;

use super::tilt::Tilt;

/// A light of a scene; energies are linear RGB.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Light {
    /// Parallel light.
    Directional {
        /// Unit vector along which light travels.
        direction: DVec3,
        /// Irradiance on a plane across `direction`, W m⁻².
        irradiance: DVec3,
    },
    /// Light from a point, the same in every direction.
    Point {
        /// Place of the light.
        position: DVec3,
        /// Power per solid angle, W sr⁻¹.
        intensity: DVec3,
        /// Distance below which the irradiance is constant.
        radius: f64,
    },
    /// Light from a point in a cone.
    Spot {
        /// Place of the light.
        position: DVec3,
        /// Unit axis of the cone, away from the light.
        direction: DVec3,
        /// Power per solid angle within the inner angle, W sr⁻¹.
        intensity: DVec3,
        /// Distance below which the irradiance is constant.
        radius: f64,
        /// Cosine of the inner angle, within which the intensity is full.
        cos_inner: f64,
        /// Cosine of the outer angle, beyond which there is no light.
        cos_outer: f64,
    },
    /// Sky: irradiance E (½ + ½ n·up) e^{−(1−g)τ toward up} + E·constant. Only the diffuse basis
    /// reflects it.
    Sky {
        /// E, W m⁻².
        irradiance: DVec3,
        /// Share of E that arrives whatever the normal and the clouds.
        constant: f64,
        /// Where it is brighter and darker, for the light of mode "diffusion".
        tilt: Tilt,
    },
}

/// The sky's up direction, whatever the camera's.
pub const UP: DVec3 = DVec3::Y;

/// Least difference of a spot's cosines, as in KHR_lights_punctual: the edge of a cone without
/// penumbra.
pub const MIN_PENUMBRA: f64 = 1e-3;

/// Unobstructed arrival of a light at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arrival {
    /// Unit vector toward the light; up for the sky.
    pub toward: DVec3,
    /// Distance of the light; infinite for directional lights and the sky.
    pub distance: f64,
    /// Irradiance across `toward` as a share of the light's energy: 1, or 1/d² times the cone's
    /// share.
    pub falloff: f64,
}

impl Light {
    /// Returns a sky that has the same radiance everywhere above the horizon.
    pub const fn even_sky(irradiance: DVec3, constant: f64) -> Light {
        Light::Sky { irradiance, constant, tilt: Tilt::EVEN }
    }

    /// Returns the light relative to `origin`.
    pub fn relative_to(mut self, origin: DVec3) -> Light {
        if let Light::Point { position, .. } | Light::Spot { position, .. } = &mut self {
            *position -= origin;
        }
        self
    }

    /// Returns how the light arrives at `p` if nothing is in its way.
    pub fn arrival(&self, p: DVec3) -> Arrival {
        match *self {
            Light::Directional { direction, .. } => {
                Arrival { toward: -direction, distance: f64::INFINITY, falloff: 1.0 }
            }
            Light::Sky { .. } => Arrival { toward: UP, distance: f64::INFINITY, falloff: 1.0 },
            Light::Point { position, radius, .. } => from_point(position, radius, p),
            Light::Spot { position, direction, radius, cos_inner, cos_outer, .. } => {
                let arrival = from_point(position, radius, p);
                let width = (cos_inner - cos_outer).max(MIN_PENUMBRA);
                let share = ((-arrival.toward.dot(direction) - cos_outer) / width).clamp(0.0, 1.0);
                Arrival { falloff: arrival.falloff * share * share, ..arrival }
            }
        }
    }

    /// Returns the irradiance on a facet of normal `n` as a share of the light's energy.
    pub fn share(&self, n: DVec3, arrival: &Arrival, transmittance: f64) -> f64 {
        match self {
            Light::Sky { constant, .. } => transmittance * (0.5 + 0.5 * n.dot(UP)) + constant,
            _ => transmittance * arrival.falloff * n.dot(arrival.toward).max(0.0),
        }
    }

    /// Returns the irradiance on a facet of normal `n`, with the tilt of a sky, which
    /// [`Light::share`] leaves out.
    pub fn irradiance(&self, n: DVec3, arrival: &Arrival, transmittance: f64) -> DVec3 {
        match *self {
            Light::Sky { irradiance, constant, tilt } => {
                irradiance * (transmittance * tilt.irradiance(n) + constant)
            }
            _ => self.energy() * self.share(n, arrival, transmittance),
        }
    }

    /// Returns the light's energy, linear RGB: irradiance of directional lights and the sky,
    /// intensity of point and spot lights.
    pub fn energy(&self) -> DVec3 {
        match *self {
            Light::Directional { irradiance, .. } | Light::Sky { irradiance, .. } => irradiance,
            Light::Point { intensity, .. } | Light::Spot { intensity, .. } => intensity,
        }
    }

    /// Returns whether the light is parallel, as a sun's.
    pub fn is_sun(&self) -> bool {
        matches!(self, Light::Directional { .. })
    }

    /// Returns whether the light comes from a point.
    pub fn is_lamp(&self) -> bool {
        matches!(self, Light::Point { .. } | Light::Spot { .. })
    }

    /// Returns whether the light is a sky, which has no direction that a lobe could reflect.
    pub fn is_sky(&self) -> bool {
        matches!(self, Light::Sky { .. })
    }
}

fn from_point(position: DVec3, radius: f64, p: DVec3) -> Arrival {
    let offset = position - p;
    let distance = offset.length();
    // At the light itself the direction is arbitrary.
    let toward = if distance > 0.0 { offset / distance } else { UP };
    Arrival { toward, distance, falloff: distance.max(radius).powi(-2) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_light_falls_with_the_square_down_to_its_radius() {
        let light = Light::Point { position: DVec3::Y, intensity: DVec3::ONE, radius: 0.5 };
        let a = light.arrival(DVec3::new(0.0, -3.0, 0.0));
        assert_eq!(a, Arrival { toward: DVec3::Y, distance: 4.0, falloff: 1.0 / 16.0 });
        assert_eq!(light.arrival(DVec3::Y * 0.9).falloff, 4.0);
        assert_eq!(light.arrival(DVec3::Y), Arrival { toward: UP, distance: 0.0, falloff: 4.0 });
        assert_eq!(light.share(DVec3::NEG_Y, &a, 1.0), 0.0);
    }

    #[test]
    fn a_spot_fades_between_its_angles() {
        let spot = |cos_inner, cos_outer| Light::Spot {
            position: DVec3::ZERO,
            direction: DVec3::NEG_Y,
            intensity: DVec3::ONE,
            radius: 0.0,
            cos_inner,
            cos_outer,
        };
        // 45° off the axis at distance √2; the cone's cosines around cos 45°.
        let p = DVec3::new(1.0, -1.0, 0.0);
        let c = 0.5f64.sqrt();
        let falloff = |light: Light| light.arrival(p).falloff;
        assert!((falloff(spot(c - 0.1, c - 0.2)) - 0.5).abs() < 1e-15);
        assert_eq!(falloff(spot(c + 0.2, c + 0.1)), 0.0);
        assert!((falloff(spot(c + 0.1, c - 0.1)) - 0.5 * 0.25).abs() < 1e-12);
    }

    #[test]
    fn the_sky_lights_from_above_and_a_constant_from_everywhere() {
        let sky = Light::even_sky(DVec3::ONE, 0.25);
        let a = sky.arrival(DVec3::ONE);
        assert_eq!((sky.share(DVec3::Y, &a, 1.0), sky.share(DVec3::NEG_Y, &a, 1.0)), (1.25, 0.25));
        assert_eq!(sky.share(DVec3::X, &a, 0.5), 0.5);
    }
}
