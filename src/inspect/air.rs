//! A scene's air as a row: temperature, humidity, and the level at which it condenses.

use serde::Serialize;

use crate::model::moisture::T0_K;
use crate::model::scene::Scene;

/// The air of a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AirRow {
    /// Law of the saturation pressure.
    pub saturation: String,
    /// Whether the saturation is over ice.
    pub ice: bool,
    /// Temperature at the ground in °C.
    pub temperature_c: f64,
    /// Pressure at the ground in hPa.
    pub pressure_hpa: f64,
    /// Relative humidity at the ground, 0 to 1.
    pub humidity: f64,
    /// Dew point at the ground in °C.
    pub dew_point_c: f64,
    /// Saturation pressure E in hPa.
    pub saturation_hpa: f64,
    /// Vapour pressure e in hPa.
    pub vapour_hpa: f64,
    /// Height over the ground, in m, at which a lifted parcel becomes saturated.
    pub base_m: f64,
    /// Temperature there in °C.
    pub base_c: f64,
    /// Pressure there in hPa.
    pub base_hpa: f64,
    /// That height in scene units.
    pub base: f64,
    /// Rise of that height, in scene units, for a parcel that is warmer by 1 K.
    pub lift: f64,
}

/// Returns the air of a scene as a row.
pub fn row(scene: &Scene) -> AirRow {
    let (air, parcel, law) = (&scene.air, &scene.air.parcel, scene.air.law);
    let level = air.condensation();
    AirRow {
        saturation: law.saturation.name().to_owned(),
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
