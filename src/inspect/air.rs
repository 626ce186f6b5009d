//! A scene's air as a row: what it holds, and where it condenses.

use serde::Serialize;

use crate::model::moisture::T0_K;
use crate::model::scene::Scene;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AirRow {
    pub saturation: String,
    pub ice: bool,
    /// At the ground.
    pub temperature_c: f64,
    pub pressure_hpa: f64,
    pub humidity: f64,
    pub dew_point_c: f64,
    /// E and e.
    pub saturation_hpa: f64,
    pub vapour_hpa: f64,
    /// Where a parcel that is lifted becomes saturated, over the ground.
    pub base_m: f64,
    pub base_c: f64,
    pub base_hpa: f64,
    /// Scene units: that height, and by how much it is higher for a parcel that is warmer by a
    /// kelvin.
    pub base: f64,
    pub lift: f64,
}

pub fn row(scene: &Scene) -> AirRow {
    let (air, parcel, law) = (&scene.air, &scene.air.parcel, scene.air.law);
    let level = air.condensation();
    AirRow {
        saturation: law.saturation.to_string(),
        ice: law.ice,
        temperature_c: parcel.t_k - T0_K,
        pressure_hpa: 0.01 * parcel.pressure_pa,
        humidity: parcel.humidity,
        dew_point_c: parcel.dew_point_k(law) - T0_K,
        saturation_hpa: 0.01 * law.saturation(parcel.t_k),
        vapour_hpa: 0.01 * parcel.vapour_pa(law),
        base_m: level.height_m,
        base_c: level.t_k - T0_K,
        base_hpa: 0.01 * level.pressure_pa,
        base: air.base(),
        lift: air.lift(),
    }
}
