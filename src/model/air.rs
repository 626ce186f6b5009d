//! The air that a scene's clouds form in, and the height where a parcel lifted from the ground
//! becomes saturated (model.md §4).

use super::moisture::{Level, Parcel, Vapour};

/// The air of a scene, given by a parcel at the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    /// Air at the ground.
    pub parcel: Parcel,
    /// Law of the saturation vapour pressure.
    pub law: Vapour,
    /// Length of a scene unit in metres.
    pub metres_per_unit: f64,
    /// Height of the ground, scene units.
    pub ground: f64,
}

impl Air {
    /// Returns the lifted condensation level of air from the ground.
    pub fn condensation(&self) -> Level {
        self.parcel.condensation(self.law)
    }

    /// Returns the height of the clouds' bases, scene units.
    pub fn base(&self) -> f64 {
        self.ground + self.condensation().height_m / self.metres_per_unit
    }

    /// Returns how much higher a parcel of the same vapour condenses if it is 1 K warmer, scene
    /// units per kelvin.
    pub fn lift(&self) -> f64 {
        let t_k = self.parcel.t_k + 1.0;
        let humidity = self.law.relative_humidity(self.parcel.vapour_pa(self.law), t_k);
        let warmer = Parcel { t_k, humidity, ..self.parcel };
        (warmer.condensation(self.law).height_m - self.condensation().height_m)
            / self.metres_per_unit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::moisture::{Saturation, T0_K};

    #[test]
    fn bases_are_in_the_scenes_units() {
        // At 20 °C and 60 % the dew point is 12.0 °C; by the rule of 125 m a kelvin (Espy) the base
        // is 1000 m up.
        let air = Air {
            parcel: Parcel { t_k: T0_K + 20.0, pressure_pa: 101_325.0, humidity: 0.6 },
            law: Vapour { saturation: Saturation::Bolton, ice: false },
            metres_per_unit: 250.0,
            ground: -2.0,
        };
        assert!((air.parcel.dew_point_k(air.law) - T0_K - 12.0).abs() < 0.05);
        assert!((air.condensation().height_m - 1000.0).abs() < 20.0, "{:?}", air.condensation());
        assert!((air.base() - (air.condensation().height_m / 250.0 - 2.0)).abs() < 1e-12);
        assert!((air.lift() * 250.0 - 125.0).abs() < 3.0, "{}", air.lift());
    }
}
