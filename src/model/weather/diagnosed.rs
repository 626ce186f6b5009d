//! Clouds diagnosed from relative humidity where a file has no cloud water,
//! model.md §15. Outputs label them "diagnosed".

use super::air::{
    EPSILON, GRAVITY, HEAT_CAPACITY, R_DRY, dry_density, humidity_over_ice, saturation_ratio,
};
use super::extinction::single_moment_phase;
use super::grid::Grid;

/// Relative humidity above which a cell of [`COARSE_M`] has clouds: at the ground, and high above
/// it.
const CRITICAL_AT_GROUND: f64 = 0.99;
const CRITICAL_ABOVE: f64 = 0.6;
/// Power with which pressure leads from one to the other.
const CRITICAL_POWER: i32 = 4;
/// Width of the cells that these numbers were found for: T42.
const COARSE_M: f64 = 300e3;
/// Liquid water of a cloud as a share of the adiabatic one; mixing removes the rest. A choice:
/// stratocumulus has 0.6 to 0.9, cumulus half and less.
const ADIABATIC_SHARE: f64 = 0.5;
/// Greatest water content of a cloud, kg/kg; beyond it, rain removes water.
const MAX_WATER_RATIO: f64 = 0.5e-3;
/// Latent heat of evaporation, J/kg, at 0 °C.
const LATENT_HEAT: f64 = 2.501e6;

/// Returns the relative humidity above which a cell `width_m` wide has clouds. `pressure` is over
/// that of the ground. *Source*: the model ECHAM4, Lohmann and Roeckner 1996, for cells of 300 km.
/// In smaller ones humidity varies less: by Δx^{1/3} in a spectrum of k^{−5/3}.
pub fn critical_humidity(pressure: f64, width_m: f64) -> f64 {
    let high = 1.0 - pressure.powi(-CRITICAL_POWER);
    let coarse = CRITICAL_ABOVE + (CRITICAL_AT_GROUND - CRITICAL_ABOVE) * high.exp();
    1.0 - (1.0 - coarse) * (width_m / COARSE_M).cbrt().min(1.0)
}

/// Returns the share of a cell that clouds cover, with clouds above the humidity `critical`: 1 −
/// √((1 − f)/(1 − f_c)). *Source*: Sundqvist, Berge and Kristjánsson 1989.
pub fn fraction(humidity: f64, critical: f64) -> f64 {
    if humidity.is_nan() || humidity <= critical {
        return 0.0;
    }
    1.0 - ((1.0 - humidity.min(1.0)) / (1.0 - critical)).sqrt()
}

/// Returns the water that rising saturated air condenses, kg/kg per metre: (c_p/L)(Γ_d − Γ_s).
/// *Source*: Γ_s is the moist-adiabatic lapse rate of the Glossary of Meteorology (AMS).
fn condensed_per_metre(p_pa: f64, t_k: f64) -> f64 {
    let q = saturation_ratio(p_pa, t_k);
    let dry = GRAVITY / HEAT_CAPACITY;
    let (warmth, spread) =
        (LATENT_HEAT * q / (R_DRY * t_k), LATENT_HEAT * LATENT_HEAT * q * EPSILON);
    let moist = GRAVITY * (1.0 + warmth) / (HEAT_CAPACITY + spread / (R_DRY * t_k * t_k));
    (HEAT_CAPACITY / LATENT_HEAT * (dry - moist)).max(0.0)
}

/// Air on a grid's cells at one moment.
pub struct Air {
    /// Pressure.
    pub pressure_pa: Vec<f64>,
    /// Temperature.
    pub temperature_k: Vec<f64>,
    /// Mixing ratio of water vapour, kg/kg.
    pub vapour: Vec<f64>,
}

impl Air {
    /// Returns the density of the dry air of a cell, kg/m³.
    pub fn dry_density(&self, i: usize) -> f64 {
        dry_density(self.pressure_pa[i], self.temperature_k[i], self.vapour[i])
    }
}

/// Returns the extinction of every cell, m⁻¹: [`fraction`] times water that grows adiabatically
/// from the lowest humid cell of the layer. Water below 273.15 K is ice, and humidity is over ice.
pub fn extinction(grid: &Grid, air: &Air) -> Vec<f64> {
    let shape = grid.shape();
    let mut extinction = vec![0.0; shape.n_cells()];
    for i_column in 0..shape.n_columns() {
        let width_m = grid.ground.area_m2(i_column).sqrt();
        let mut below = 0.0;
        for k in 0..shape.nz {
            let i = shape.cell(k, i_column);
            let (p, t) = (air.pressure_pa[i], air.temperature_k[i]);
            let critical = critical_humidity(p / air.pressure_pa[i_column], width_m);
            let covered = fraction(humidity_over_ice(air.vapour[i], p, t), critical);
            // A dry cell ends the layer.
            if covered == 0.0 {
                below = 0.0;
                continue;
            }
            let grown = ADIABATIC_SHARE * condensed_per_metre(p, t) * grid.thickness_m(i);
            let within = (below + 0.5 * grown).min(MAX_WATER_RATIO);
            below += grown;
            extinction[i] = covered * single_moment_phase(t).extinction(within, air.dry_density(i));
        }
    }
    extinction
}

#[cfg(test)]
mod tests {
    use super::super::grid::{Ground, Shape};
    use super::*;

    #[test]
    fn fraction_by_hand() {
        assert_eq!([0.0, 0.8, 1.0, 1.3].map(|f| fraction(f, 0.8)), [0.0, 0.0, 1.0, 1.0]);
        // 1 − √(0.05/0.2) = 0.5.
        assert!((fraction(0.95, 0.8) - 0.5).abs() < 1e-12);
        assert_eq!(fraction(f64::NAN, 0.8), 0.0);
    }

    #[test]
    fn critical_humidity_by_hand() {
        let coarse = |p: f64| critical_humidity(p, 300e3);
        // e^{1 − 1} at the ground; at 0.8 of its pressure 1 − 2.4414 = −1.4414, and 0.6 + 0.39 ·
        // 0.2366.
        assert!((coarse(1.0) - 0.99).abs() < 1e-12 && (coarse(0.2) - 0.6).abs() < 1e-12);
        assert!((coarse(0.8) - 0.69227).abs() < 1e-5);
        // 37.5 km are an eighth: half of the distance from saturation. No cell is coarser.
        assert!((critical_humidity(0.2, 37.5e3) - 0.8).abs() < 1e-12);
        assert_eq!(critical_humidity(0.8, 1e6), coarse(0.8));
    }

    #[test]
    fn condensation_by_hand() {
        // At 10 °C and 900 hPa q_s = 0.622 · 12.27/(900 − 0.378 · 12.27) = 8.524e-3; L q/(R T) =
        // 0.26235; Γ_s = 9.81 · 1.26235/(1004.5 + 2.501e6² · 8.524e-3 · 0.622/(287 · 283.15²)) =
        // 9.81 · 1.26235/2445.8 = 5.0633e-3 K/m; Γ_d = 9.7661e-3; times 1004.5/2.501e6: 1.8888e-6 a
        // metre, the usual 2 g/kg a kilometre.
        assert!(
            (condensed_per_metre(9e4, 283.15) - 1.889e-6).abs() < 3e-9,
            "{}",
            condensed_per_metre(9e4, 283.15)
        );
        // Cold air condenses almost nothing.
        assert!(condensed_per_metre(3e4, 230.0) < 0.3e-6);
    }

    #[test]
    fn water_grows_from_the_base_of_a_layer() {
        let shape = Shape { nx: 1, ny: 1, nz: 5 };
        let ground = Ground::new(shape, (1e3, 1e3), (&[1.0], &[1.0]), false).unwrap();
        let grid = Grid::new(ground, vec![0.0, 200.0, 400.0, 600.0, 800.0, 1000.0]).unwrap();
        let (p, t) = (9e4, 283.15);
        let saturated = saturation_ratio(p, t);
        // Dry, humid, humid, dry, humid.
        let vapour = [0.5, 1.0, 1.0, 0.5, 1.0].map(|f| f * saturated).to_vec();
        let air = Air { pressure_pa: vec![p; 5], temperature_k: vec![t; 5], vapour };
        let beta = extinction(&grid, &air);
        // 0.5 · 1.889e-6 · 100 m = 9.444e-5 kg/kg at the middle of the first 200 m. The extinction
        // is 0.15 m⁻¹ a g/kg in 1 kg/m³, and the dry density is 9e4/(287 · 283.15 (1 +
        // 8.524e-3/0.622)) = 1.0925.
        assert!((beta[1] - 0.15 * 1.0925 * 0.09444).abs() < 1e-5, "{beta:?}");
        assert!((beta[2] / beta[1] - 3.0).abs() < 1e-12);
        assert_eq!((beta[0], beta[3], beta[4]), (0.0, 0.0, beta[1]));
        // A kilometre deep, the cloud has its greatest water content.
        let deep = Grid { heights_m: vec![0.0, 1e3, 2e3, 3e3, 4e3, 5e3], ..grid };
        assert!((extinction(&deep, &air)[2] - 0.15 * 1.0925 * 0.5).abs() < 1e-5);
    }
}
