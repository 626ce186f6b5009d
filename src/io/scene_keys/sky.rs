//! Table `[sky]`, and the exposure that goes by its light (model.md §19).

use super::key::{Keys, keys, read_table};
use super::materials::{PLANE, plane_named};
use super::spec::{choice, flag, number, vector};
use super::weather::EXAGGERATION;
use crate::error::Result;
use crate::io::bounds::{Bounds, COORDINATE};
use crate::io::document::section::Section;
use crate::model::material::Material;
use crate::model::sky::{SkyModel, SkySettings};

/// Range of turbidities that the model has fits for.
const TURBIDITY: Bounds = Bounds::Within(1.0, 10.0);
/// Range of the length of a unit: lengths of a scene have numbers in metres, too.
const METRES: Bounds = Bounds::Within(1e-6, 1e6);
const UNIT: Bounds = Bounds::Within(0.0, 1.0);
/// Range of the factor of the air's depth.
const HAZE: Bounds = Bounds::Within(0.0, 100.0);

keys! {
    /// Law of a clear sky, in place of the film's background: that of Hošek and Wilkie, or "none".
    /// It needs one light of kind "sun" or "directional".
    MODEL: fn model(s) -> SkyModel = "model": choice("none", &SkyModel::NAMES);
}

keys! { SKY: fn sky(s, i_ground: Option<usize>) -> SkySettings { SkySettings;
    /// Depth of all air over that of its molecules: 2 is very clear, 3 clear, 6 hazy.
    turbidity: number(3.0, TURBIDITY);
    /// Albedo of the ground that the sky reflects, linear RGB.
    albedo: vector([0.1; 3], UNIT);
    /// Length of a scene unit.
    metres_per_unit: number(1.0, METRES), "m";
    /// Factor of the heights in the scene: that of its weather.
    exaggeration: number(1.0, EXAGGERATION);
    /// Height of the sea level, from which the air thins out.
    sea_level: number(0.0, COORDINATE), "unit";
    /// Factor of the air's depth before clouds and ground; 0 leaves the air out.
    haze: number(1.0, HAZE);
    /// Whether the sun is drawn.
    has_disc ["disc"]: flag(true);
    i_ground => i_ground;
}}

/// Keys of `[sky]`.
pub const KEYS: [Keys; 3] = [MODEL, PLANE, SKY];

/// Reads `[sky]`; `None` without one.
pub fn read_sky(root: &mut Section, materials: &[Material]) -> Result<Option<SkySettings>> {
    read_table(root, "sky", &KEYS, |s| {
        let model = model(s)?;
        let i_ground = plane_named(s, materials)?;
        let settings = sky(s, i_ground)?;
        Ok(match model {
            SkyModel::None => None,
            SkyModel::HosekWilkie => Some(settings),
        })
    })
}
