//! The first reflection, C (15) and §2.5 (2), diffuse basis only: model.md §7 and §11 "first".
//! In: normals, transmittance [facet × light]. Out: irradiance (W m⁻²) and radiance L1 (W m⁻² sr⁻¹), RGB a facet.

use std::f64::consts::PI;

use glam::DVec3;

use crate::model::light::Light;

/// I_d,j = Σ_l E_l f_l(n_j, V(j, l)).
pub fn irradiance(normals: &[DVec3], transmittance: &[f64], lights: &[Light]) -> Vec<DVec3> {
    let at = |(j, &n): (usize, &DVec3)| {
        let of = &transmittance[j * lights.len()..][..lights.len()];
        lights.iter().zip(of).map(|(light, &v)| light.irradiance() * light.factor(n, v)).sum()
    };
    normals.iter().enumerate().map(at).collect()
}

/// L1_j = K_d c_j I_d,j/π: `kd` by region, `colors` by particle (1 for boxes).
pub fn radiance(irradiance: &[DVec3], regions: &[u32], kd: &[DVec3], colors: &[DVec3]) -> Vec<DVec3> {
    let of = |((&e, &region), &color): ((&DVec3, &u32), &DVec3)| kd[region as usize] * color * e / PI;
    irradiance.iter().zip(regions).zip(colors).map(of).collect()
}
