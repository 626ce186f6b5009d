//! Emitters: suns with an angular radius, the sky, and lamps (transport.md, "Light").

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::ray::around;
use super::stream::Stream;
use crate::model::light::{Light, UP};
use crate::model::sky::Sky;

/// A sun: a disc of even radiance in the sky.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sun {
    toward: DVec3,
    /// 1 − cos of the angular radius.
    width: f64,
    irradiance: DVec3,
    radiance: DVec3,
}

/// The lights of a scene. A sky has the radiance E/π above and `constant` E/π all around. Under a
/// clear sky, that from above is multiplied by the dome's radiance over the dome's own E/π.
#[derive(Debug, Clone, PartialEq)]
pub struct Lights {
    suns: Vec<Sun>,
    /// Radiance of the sky from above, and from below; means under a clear sky.
    sky: [DVec3; 2],
    clear: Option<Sky>,
    /// Point and spot lights.
    lamps: Vec<Light>,
}

/// A sampled direction from a point to a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightSample {
    /// Unit vector toward the light.
    pub toward: DVec3,
    /// Distance up to which it can be hidden; infinite for suns and the sky.
    pub distance: f64,
    /// Radiance of suns, and of the sky. In place of a sun's, a lamp has its irradiance across
    /// `toward` over the chance of the lamp.
    pub light: [DVec3; 2],
    /// Density per solid angle of the direction; `None` for a lamp, which no direction meets by
    /// chance.
    pub density: Option<f64>,
}

impl Lights {
    /// Returns the lights; a sun's angular radius is in radians.
    pub fn new(lights: &[Light], sun_radius: f64) -> Lights {
        let width = 2.0 * (0.5 * sun_radius).sin().powi(2);
        let (mut suns, mut sky, mut lamps) = (vec![], [DVec3::ZERO; 2], vec![]);
        for light in lights {
            match *light {
                Light::Directional { direction, irradiance } => {
                    // ∫ cos dω over the disc is π sin².
                    let radiance = irradiance / (PI * sun_radius.sin().powi(2));
                    suns.push(Sun { toward: -direction, width, irradiance, radiance });
                }
                Light::Sky { irradiance, constant, .. } => {
                    let [above, below] = &mut sky;
                    *above += irradiance * ((1.0 + constant) / PI);
                    *below += irradiance * (constant / PI);
                }
                Light::Point { .. } | Light::Spot { .. } => lamps.push(*light),
            }
        }
        Lights { suns, sky, clear: None, lamps }
    }

    /// Returns the lights under a clear sky.
    pub fn under(self, clear: Option<Sky>) -> Lights {
        Lights { clear, ..self }
    }

    /// Returns lights of a sky of that radiance all around.
    pub fn uniform(radiance: DVec3) -> Lights {
        Lights { suns: vec![], sky: [radiance; 2], clear: None, lamps: vec![] }
    }

    /// Returns whether nothing shines.
    pub fn is_dark(&self) -> bool {
        self.suns.is_empty() && self.lamps.is_empty() && self.sky == [DVec3::ZERO; 2]
    }

    /// Returns the radiance along the unit vector `toward` from outside of the scene: of the suns,
    /// and of the sky.
    pub fn environment(&self, toward: DVec3) -> [DVec3; 2] {
        let of_suns = self.suns.iter().filter(|sun| sun.shows(toward)).map(|sun| sun.radiance);
        [of_suns.sum(), self.sky_radiance(toward)]
    }

    /// Returns the radiance of the sky alone.
    pub fn sky_radiance(&self, toward: DVec3) -> DVec3 {
        let [above, below] = self.sky;
        match &self.clear {
            _ if toward.dot(UP) < 0.0 => below,
            Some(clear) => {
                let mean = clear.of_sky().max(DVec3::splat(f64::MIN_POSITIVE)) / PI;
                below + (above - below) * (clear.radiance(toward) / mean)
            }
            None => above,
        }
    }

    /// Returns the density per solid angle with which [`Lights::sample`] at `p` samples the
    /// direction `toward`, by any light.
    pub fn density(&self, p: DVec3, toward: DVec3) -> f64 {
        let all = self.all_strength(p);
        if all == 0.0 {
            return 0.0;
        }
        let of_sky = self.sky_strength() / all * self.sky_density(toward);
        let shown = self.suns.iter().filter(|sun| sun.shows(toward));
        of_sky + shown.map(|sun| sun.strength() / all / (TAU * sun.width)).sum::<f64>()
    }

    /// Samples a direction from `p` to a light. Lights are chosen by their unobstructed irradiance.
    /// `None` if nothing shines there.
    pub fn sample(&self, p: DVec3, stream: &mut Stream) -> Option<LightSample> {
        let all = self.all_strength(p);
        if all == 0.0 {
            return None;
        }
        let mut left = stream.uniform() * all - self.sky_strength();
        if left < 0.0 {
            let toward = self.sample_sky(stream);
            return Some(self.to_environment(p, toward));
        }
        for sun in &self.suns {
            left -= sun.strength();
            if left < 0.0 {
                let cosine = 1.0 - sun.width * stream.uniform();
                let toward = around(sun.toward, cosine, stream.uniform());
                return Some(self.to_environment(p, toward));
            }
        }
        for lamp in &self.lamps {
            let strength = irradiance(lamp, p);
            left -= strength;
            if left < 0.0 {
                let arrival = lamp.arrival(p);
                return Some(LightSample {
                    toward: arrival.toward,
                    distance: arrival.distance,
                    light: [lamp.energy() * (arrival.falloff * all / strength), DVec3::ZERO],
                    density: None,
                });
            }
        }
        // Rounding led past the last one.
        None
    }

    fn to_environment(&self, p: DVec3, toward: DVec3) -> LightSample {
        let density = Some(self.density(p, toward));
        LightSample { toward, distance: f64::INFINITY, light: self.environment(toward), density }
    }

    /// Returns the sum of the lights' strengths at `p`, by which they are chosen.
    fn all_strength(&self, p: DVec3) -> f64 {
        let suns: f64 = self.suns.iter().map(Sun::strength).sum();
        self.sky_strength() + suns + self.lamps.iter().map(|lamp| irradiance(lamp, p)).sum::<f64>()
    }

    fn sky_strength(&self) -> f64 {
        PI * self.sky.iter().map(|l| l.max_element()).fold(0.0, f64::max)
    }

    fn sky_density(&self, toward: DVec3) -> f64 {
        match (self.is_above_only(), toward.dot(UP) >= 0.0) {
            (true, true) => 1.0 / TAU,
            (true, false) => 0.0,
            (false, _) => 0.5 / TAU,
        }
    }

    fn is_above_only(&self) -> bool {
        self.sky[1] == DVec3::ZERO
    }

    fn sample_sky(&self, stream: &mut Stream) -> DVec3 {
        let u = stream.uniform();
        let cosine = if self.is_above_only() { u } else { 2.0 * u - 1.0 };
        around(UP, cosine, stream.uniform())
    }
}

fn irradiance(lamp: &Light, p: DVec3) -> f64 {
    lamp.energy().max_element() * lamp.arrival(p).falloff
}

impl Sun {
    fn strength(&self) -> f64 {
        self.irradiance.max_element()
    }

    fn shows(&self, toward: DVec3) -> bool {
        // 1 − cos = |a − b|²/2 keeps its digits.
        0.5 * (toward - self.toward).length_squared() <= self.width
    }
}
