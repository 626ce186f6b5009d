//! Clouds diagnosed from relative humidity where a file has no cloud water,
//! model.md §15. Outputs label them "diagnosed".

use super::air::{
    EPSILON, GRAVITY, HEAT_CAPACITY, R_DRY, dry_density, relative_humidity, saturation_ratio,
};
use super::extinction::single_moment_phase;
use super::grid::Grid;

/// Relative humidity above which a cell has clouds, between Sundqvist's 0.75 over land and 0.85
/// over sea.
const CRITICAL_HUMIDITY: f64 = 0.8;
/// Liquid water of a cloud as a share of the adiabatic one; mixing removes the rest. A choice:
/// stratocumulus has 0.6 to 0.9, cumulus half and less.
const ADIABATIC_SHARE: f64 = 0.5;
/// Greatest water content of a cloud, kg/kg; beyond it, rain removes water.
const MAX_WATER_RATIO: f64 = 0.5e-3;
/// Latent heat of evaporation, J/kg, at 0 °C.
const LATENT_HEAT: f64 = 2.501e6;

/// Returns the share of a cell that clouds cover: 1 − √((1 − f)/(1 − f_c)). *Source*: Sundqvist,
/// Berge and Kristjánsson 1989.
pub fn fraction(humidity: f64) -> f64 {
    if humidity.is_nan() || humidity <= CRITICAL_HUMIDITY {
        return 0.0;
    }
    1.0 - ((1.0 - humidity.min(1.0)) / (1.0 - CRITICAL_HUMIDITY)).sqrt()
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
/// from the lowest humid cell of the layer. Water below 273.15 K is ice.
pub fn extinction(grid: &Grid, air: &Air) -> Vec<f64> {
    let shape = grid.shape();
    let mut extinction = vec![0.0; shape.n_cells()];
    for i_column in 0..shape.n_columns() {
        let mut below = 0.0;
        for k in 0..shape.nz {
            let i = shape.cell(k, i_column);
            let (p, t) = (air.pressure_pa[i], air.temperature_k[i]);
            let covered = fraction(relative_humidity(air.vapour[i], p, t));
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
        assert_eq!(
            (fraction(0.0), fraction(0.8), fraction(1.0), fraction(1.3)),
            (0.0, 0.0, 1.0, 1.0)
        );
        // 1 − √(0.05/0.2) = 0.5.
        assert!((fraction(0.95) - 0.5).abs() < 1e-12);
        assert_eq!(fraction(f64::NAN), 0.0);
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
