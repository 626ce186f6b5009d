//! A clear sky: what is seen behind the clouds, the light that it gives, and the air before them
//! (model.md §19).
//!
//! Energies are photometric: an irradiance of 1 is 10⁵/π lx, so that a white surface in 100 klx,
//! full sunlight, has the radiance 1. Colours are balanced for daylight: D55 is white.

mod air;
mod dome;
mod sea;
mod sunlight;
mod units;

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use air::ClearAir;
pub use air::{LEAST_UP, SCALE_HEIGHTS_M};
use dome::Dome;
pub use dome::N_COEFFICIENTS;
use sunlight::sunlight;
use units::balanced;
pub use units::{UNIT_LX, luminance};

use super::cover::Sea;
use super::light::{Light, UP};
use super::material::Material;
use super::named::named;
use super::tilt::Tilt;

/// Angular radius of the sun, radians.
pub const SUN_RADIUS: f64 = 4.65e-3;
/// Greatest radiance of the sun's disc. Half floats keep a picture's transmittance to 2⁻¹²; a
/// brighter disc would show through opaque clouds.
const GREATEST_DISC: f64 = 32.0;

named! {
    /// Law of a sky's light.
    pub enum SkyModel {
        /// The film's background.
        None = "none",
        /// Hošek and Wilkie 2012.
        HosekWilkie = "hosek-wilkie",
    }
}

/// Returns the exposure at which a white surface across the light of all suns, in that of the
/// skies, has a luminance of 0.8; 1 without such light.
pub fn sunlit_exposure(lights: &[Light]) -> f64 {
    const SHOWN: f64 = 0.8;
    let is_far = |light: &&Light| light.is_sky() || light.is_sun();
    let all = luminance(lights.iter().filter(is_far).map(Light::energy).sum());
    if all > 0.0 { SHOWN * PI / all } else { 1.0 }
}

/// The settings of a scene's sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkySettings {
    /// Optical depth of all air over that of its molecules: 1 to 10.
    pub turbidity: f64,
    /// Albedo of the ground that lights the sky, linear RGB.
    pub albedo: DVec3,
    /// Length of a scene unit, m.
    pub metres_per_unit: f64,
    /// Factor of the scene's heights.
    pub exaggeration: f64,
    /// Height of the sea level, scene units.
    pub sea_level: f64,
    /// Factor of the air's depth before things of the scene.
    pub haze: f64,
    /// Whether the sun's disc is drawn.
    pub has_disc: bool,
    /// Material of the plane at sea level.
    pub i_ground: Option<usize>,
}

impl SkySettings {
    /// Returns the sky of a turbidity over dark ground, in a scene of metres: all of the air, the
    /// sun's disc, and no plane at sea level.
    pub fn of_turbidity(turbidity: f64) -> SkySettings {
        SkySettings {
            turbidity,
            albedo: DVec3::splat(0.1),
            metres_per_unit: 1.0,
            exaggeration: 1.0,
            sea_level: 0.0,
            haze: 1.0,
            has_disc: true,
            i_ground: None,
        }
    }
}

/// A clear sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sky {
    settings: SkySettings,
    dome: Dome,
    air: ClearAir,
    /// Irradiance of the sky on a level plane.
    irradiance: DVec3,
    tilt: Tilt,
}

impl Sky {
    /// Returns the sky of a sun.
    ///
    /// # Errors
    /// The sun is below the horizon, or a setting is out of its range.
    pub fn new(settings: SkySettings, toward_sun: DVec3) -> Result<Sky, String> {
        let dome = Dome::new(toward_sun, settings.turbidity, settings.albedo)?;
        let dome = Dome { scale: balanced(dome.scale), ..dome };
        let irradiance = irradiance_on(&dome, UP);
        let tilt = tilt_of(&dome, irradiance);
        Ok(Sky { settings, dome, air: ClearAir::new(settings.turbidity), irradiance, tilt })
    }

    /// Returns the sun's irradiance across its light at sea level, linear RGB.
    pub fn of_sun(&self) -> DVec3 {
        balanced(sunlight(self.dome.toward_sun.y, self.settings.turbidity))
    }

    /// Returns the sky's irradiance on a level plane, linear RGB.
    pub fn of_sky(&self) -> DVec3 {
        self.irradiance
    }

    /// Returns where the sky is brighter and darker, as a plane over the directions. Walls have the
    /// sky's irradiance in the mean, and the difference between toward the sun and away from it.
    pub fn tilt(&self) -> Tilt {
        self.tilt
    }

    /// Returns the radiance from a unit direction, as it is seen from sea level.
    pub fn radiance(&self, direction: DVec3) -> DVec3 {
        self.dome.radiance(direction)
    }

    /// Returns the share of light that all air over the sea takes, in a direction whose sine of
    /// elevation is `up`.
    pub fn taken_from_sea(&self, up: f64) -> DVec3 {
        taken(self.air.toward_space(0.0, up))
    }

    /// Returns the settings.
    pub fn settings(&self) -> &SkySettings {
        &self.settings
    }
}

/// Points of a quadrature along the azimuth and the height.
const N_AZIMUTHS: u32 = 64;
const N_HEIGHTS: u32 = 128;

fn azimuth(k: u32) -> (f64, f64) {
    ((f64::from(k) + 0.5) * TAU / f64::from(N_AZIMUTHS)).sin_cos()
}

/// Returns ∫ L max(0, n·ω) over the upper half of the directions.
fn irradiance_on(dome: &Dome, n: DVec3) -> DVec3 {
    let at = |(i, k): (u32, u32)| {
        let up = (f64::from(i) + 0.5) / f64::from(N_HEIGHTS);
        let across = (1.0 - up * up).sqrt();
        let (sin, cos) = azimuth(k);
        let direction = DVec3::new(across * cos, up, across * sin);
        dome.radiance(direction) * direction.dot(n).max(0.0)
    };
    let all = (0..N_HEIGHTS).flat_map(|i| (0..N_AZIMUTHS).map(move |k| (i, k)));
    all.map(at).sum::<DVec3>() * (TAU / f64::from(N_HEIGHTS * N_AZIMUTHS))
}

/// Walls over which the mean is taken.
const N_WALLS: u32 = 8;

/// Returns the tilt of a dome that has the irradiance `level` on a level plane.
fn tilt_of(dome: &Dome, level: DVec3) -> Tilt {
    let sun = DVec3::new(dome.toward_sun.x, 0.0, dome.toward_sun.z).normalize_or(DVec3::X);
    let on = |n: DVec3| irradiance_on(dome, n) / level.max(DVec3::splat(f64::MIN_POSITIVE));
    let wall = |k: u32| {
        let (sin, cos) = (f64::from(k) * TAU / f64::from(N_WALLS)).sin_cos();
        on(DVec3::new(cos * sun.x - sin * sun.z, 0.0, sin * sun.x + cos * sun.z))
    };
    let walls: Vec<DVec3> = (0..N_WALLS).map(wall).collect();
    let mean = walls.iter().sum::<DVec3>() / f64::from(N_WALLS);
    Tilt::of_walls(sun, [walls[0], walls[N_WALLS as usize / 2], mean])
}

/// Returns the share of light that air of an optical depth takes.
fn taken(depth: DVec3) -> DVec3 {
    depth.map(|depth| -(-depth).exp_m1())
}

/// The air between the eye and a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Haze {
    /// Share of the light that comes through.
    pub through: DVec3,
    /// Radiance that the air adds.
    pub added: DVec3,
}

impl Haze {
    /// Returns what is seen of a radiance.
    pub fn over(&self, radiance: DVec3) -> DVec3 {
        self.through * radiance + self.added
    }
}

/// A sky as an eye sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkyView {
    /// The sky.
    pub sky: Sky,
    /// Height of the eye over the sea, m.
    pub height_m: f64,
    /// Radiance of the sun's disc; 0 without.
    pub disc: DVec3,
    /// Irradiance of the suns across their light.
    pub sun: DVec3,
    /// Radiance of the plane at sea level; `None` without.
    pub ground: Option<DVec3>,
    /// Sea that the plane is.
    pub sea: Option<Sea>,
}

impl SkyView {
    /// Returns the view from `eye` with the scene's lights and materials.
    pub fn new(
        sky: &Sky,
        eye: DVec3,
        lights: &[Light],
        materials: &[Material],
        time_s: f64,
    ) -> SkyView {
        let SkySettings { metres_per_unit, exaggeration, sea_level, .. } = sky.settings;
        let suns = lights.iter().filter(|light| light.is_sun());
        let sun: DVec3 = suns.map(Light::energy).sum();
        let disc = sun / (PI * SUN_RADIUS.sin().powi(2));
        let dimmed = disc * (GREATEST_DISC / disc.max_element().max(GREATEST_DISC));
        // The law of a facet that faces up (model.md §7), with nothing in the way.
        let level = |light: &Light| light.share(UP, &light.arrival(DVec3::ZERO), 1.0);
        let far = |light: &&Light| light.is_sky() || light.is_sun();
        let on_ground: DVec3 = lights.iter().filter(far).map(|l| l.energy() * level(l)).sum();
        let ground = |i: usize| materials[i].at(time_s).kd * on_ground / PI;
        SkyView {
            sky: *sky,
            height_m: (eye.y - sea_level) * metres_per_unit / exaggeration,
            disc: if sky.settings.has_disc { dimmed } else { DVec3::ZERO },
            sun,
            ground: sky.settings.i_ground.map(ground),
            sea: sky.settings.i_ground.and_then(|i| materials[i].cover.sea()),
        }
    }

    /// Returns the radiance that a level sea mirrors to the eye, which sees it in a unit
    /// direction: the sky, and `sunlit` of the sun. 0 from below.
    pub fn in_sea(&self, sea: &Sea, direction: DVec3, sunlit: f64) -> DVec3 {
        let toward_eye = -direction;
        if toward_eye.y <= 0.0 {
            return DVec3::ZERO;
        }
        let (mirrored, share) = sea.mirror(toward_eye);
        let of_sun = sunlit * sea.glitter(self.toward_sun(), toward_eye);
        share * self.sky.radiance(mirrored) + of_sun * self.sun
    }

    /// Returns the dome's coefficients by channel.
    pub fn coefficients(&self) -> [DVec3; N_COEFFICIENTS] {
        self.sky.dome.coefficients
    }

    /// Returns the factor of the dome.
    pub fn scale(&self) -> DVec3 {
        self.sky.dome.scale
    }

    /// Returns the unit vector toward the sun.
    pub fn toward_sun(&self) -> DVec3 {
        self.sky.dome.toward_sun
    }

    /// Returns the vertical optical depths of molecules and aerosol.
    pub fn vertical_depths(&self) -> [DVec3; 2] {
        self.sky.air.vertical
    }

    /// Returns the radiance that opaque air has in a unit direction: the sky's over the share of
    /// light that its air takes. Down, air is seen as high up as above the horizon.
    fn of_air(&self, direction: DVec3) -> DVec3 {
        self.sky.radiance(direction) / self.sky.taken_from_sea(direction.y.abs())
    }

    /// Returns the air before a place at `offset` from the eye, scene units.
    pub fn before(&self, offset: DVec3) -> Haze {
        let SkySettings { metres_per_unit, exaggeration, haze, .. } = self.sky.settings;
        let Some(direction) = offset.try_normalize() else {
            return Haze { through: DVec3::ONE, added: DVec3::ZERO };
        };
        let true_offset = offset * metres_per_unit / DVec3::new(1.0, exaggeration, 1.0);
        let to_m = self.height_m + true_offset.y;
        let depth = haze * self.sky.air.between(self.height_m, to_m, true_offset.length());
        let taken = taken(depth);
        Haze { through: 1.0 - taken, added: taken * self.of_air(direction) }
    }

    /// Returns the radiance behind everything, in a unit direction.
    pub fn behind(&self, direction: DVec3) -> DVec3 {
        let of_air = self.of_air(direction);
        if direction.y >= 0.0 {
            let depth = self.sky.air.toward_space(self.height_m, direction.y);
            return taken(depth) * of_air + self.disc * self.share_of_disc(direction);
        }
        let Some(ground) = self.ground.filter(|_| self.height_m > 0.0) else { return of_air };
        let SkySettings { metres_per_unit, exaggeration, .. } = self.sky.settings;
        let height = self.height_m * exaggeration / metres_per_unit;
        let mirrored = self.sea.map(|sea| self.in_sea(&sea, direction, 1.0)).unwrap_or_default();
        self.before(direction * (height / -direction.y)).over(ground + mirrored)
    }

    /// Returns the share of the sun's disc that a direction sees. Its rim is a tenth of its radius
    /// wide.
    fn share_of_disc(&self, direction: DVec3) -> f64 {
        let sun = self.sky.dome.toward_sun;
        let off = direction.cross(sun).length() / SUN_RADIUS;
        if direction.dot(sun) < 0.0 { 0.0 } else { ((1.05 - off) / 0.1).clamp(0.0, 1.0) }
    }
}

#[cfg(test)]
mod tests;
