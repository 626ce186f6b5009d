//! Light that clouds scatter once toward the eye: model.md §18 and passes.md "scatter".
//!
//! In: centres of blobs, optical depths [facet][light], lights relative to O. Out: fluence (W m⁻²)
//! and radiance (W m⁻² sr⁻¹), RGB a facet.

use std::f64::consts::PI;

use glam::DVec3;

use crate::model::light::{Light, UP};
use crate::model::medium::ScatterLaw;

/// Optical depth of a way that a surface bars, and to a light without energy.
pub const BARRED: f64 = 1e30;

/// Returns the fluence Σ E F e^{−sτ} of suns and lamps at `p`, to which depths are `taus`.
pub fn fluence(law: &ScatterLaw, p: DVec3, taus: &[f64], lights: &[Light]) -> DVec3 {
    let of = |(light, tau): (&Light, f64)| {
        light.energy() * light.arrival(p).falloff * (-tau * law.depth).exp()
    };
    arriving(lights, taus).filter(|(light, _)| !light.is_sky()).map(of).sum()
}

/// Returns the radiance that a blob at `p` scatters once toward `eye`. Without `has_sky` the sky is
/// left out: diffusion has it.
pub fn radiance(
    law: &ScatterLaw,
    p: DVec3,
    eye: DVec3,
    taus: &[f64],
    lights: &[Light],
    has_sky: bool,
) -> DVec3 {
    let outgoing = (eye - p).try_normalize().unwrap_or(UP);
    let of = |(light, tau): (&Light, f64)| match *light {
        Light::Sky { irradiance, constant, .. } if has_sky => {
            irradiance / PI * law.of_sky(outgoing.dot(UP), constant, tau)
        }
        Light::Sky { .. } => DVec3::ZERO,
        _ => {
            let arrival = light.arrival(p);
            let cosine = -arrival.toward.dot(outgoing);
            light.energy() * arrival.falloff * law.toward_eye(cosine, tau)
        }
    };
    arriving(lights, taus).map(of).sum()
}

/// Returns the lights whose ways are not barred, with their depths. No factor on depths, be it 0,
/// lets barred light through.
fn arriving<'a>(lights: &'a [Light], taus: &'a [f64]) -> impl Iterator<Item = (&'a Light, f64)> {
    lights.iter().zip(taus.iter().copied()).filter(|(_, tau)| *tau < BARRED)
}
