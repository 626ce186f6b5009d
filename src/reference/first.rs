//! The first reflection, C (15) and §2.5 (2), diffuse basis only: model.md §7 and passes.md
//! "first".
//!
//! In: positions and normals, transmittance [facet][light], lights relative to O. Out: irradiance
//! (W m⁻²) and radiance L1 (W m⁻² sr⁻¹), RGB a facet.

use std::f64::consts::PI;

use glam::DVec3;

use crate::model::basis;
use crate::model::light::Light;

/// Returns I_d,j = Σ_l E_l f_l(n_j, V(j, l)).
pub fn irradiance(
    positions: &[DVec3],
    normals: &[DVec3],
    transmittance: &[f64],
    lights: &[Light],
) -> Vec<DVec3> {
    let at = |(j, (&p, &n)): (usize, (&DVec3, &DVec3))| {
        let of = &transmittance[j * lights.len()..][..lights.len()];
        lights
            .iter()
            .zip(of)
            .map(|(light, &v)| light.energy() * light.share(n, &light.arrival(p), v))
            .sum()
    };
    positions.iter().zip(normals).enumerate().map(at).collect()
}

/// Returns L1_j = K_d c_j I_d,j/π, with `kd` by region and `colors` by facet (1 for boxes and
/// surfaces).
pub fn radiance(
    irradiance: &[DVec3],
    regions: &[u32],
    kd: &[DVec3],
    colors: &[DVec3],
) -> Vec<DVec3> {
    let of =
        |((&e, &region), &color): ((&DVec3, &u32), &DVec3)| kd[region as usize] * color * e / PI;
    irradiance.iter().zip(regions).zip(colors).map(of).collect()
}

/// Returns the rows of T1 of a facet: g/π, then g v_b(γ) for every vector of the basis
/// ([`basis::evaluate`]'s tables).
///
/// γ lies between the normal and the half vector of `toward` the light and `outgoing`. Lobes are 0
/// for the sky, and where the eye is behind the facet (passes.md "contract").
pub fn responses(
    light: &Light,
    g: f64,
    normal: DVec3,
    toward: DVec3,
    outgoing: DVec3,
    vectors: &[Vec<f64>],
) -> Vec<f64> {
    let half = (toward + outgoing).normalize();
    let gap = 0.5 * (normal - half).length_squared();
    let shines = !light.is_sky() && normal.dot(outgoing) > 0.0;
    let glossy = |v: &Vec<f64>| if shines { g * basis::evaluate(v, gap) } else { 0.0 };
    std::iter::once(g / PI).chain(vectors.iter().map(glossy)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SUN: Light = Light::Directional { direction: DVec3::NEG_Y, irradiance: DVec3::splat(PI) };

    fn lit(light: Light, normal: DVec3, transmittance: f64) -> DVec3 {
        let e = irradiance(&[DVec3::ZERO], &[normal], &[transmittance], &[light]);
        radiance(&e, &[0], &[DVec3::ONE], &[DVec3::ONE])[0]
    }

    #[test]
    fn a_white_facet_under_a_sun_of_pi_has_radiance_one() {
        assert_eq!(lit(SUN, DVec3::Y, 1.0), DVec3::ONE);
        assert_eq!(lit(SUN, DVec3::NEG_Y, 1.0), DVec3::ZERO);
        // cos 60° = ½ and V = ½; the two roundings of the slant normal stay below 1e-15.
        let slant = DVec3::new(3f64.sqrt() / 2.0, 0.5, 0.0);
        assert!((lit(SUN, slant, 0.5).x - 0.25).abs() < 1e-15);
    }

    #[test]
    fn the_sky_lights_from_above_and_a_constant_from_everywhere() {
        let sky = Light::even_sky(DVec3::splat(PI), 0.25);
        let l = |n, v| lit(sky, n, v).x;
        assert_eq!((l(DVec3::Y, 1.0), l(DVec3::NEG_Y, 1.0), l(DVec3::X, 1.0)), (1.25, 0.25, 0.75));
        assert_eq!(l(DVec3::Y, 0.0), 0.25);
    }

    #[test]
    fn lights_add_and_regions_and_colors_choose_the_albedo() {
        let sky = Light::even_sky(DVec3::splat(PI), 0.0);
        let e = irradiance(
            &[DVec3::ZERO; 2],
            &[DVec3::Y, DVec3::NEG_Y],
            &[1.0, 0.5, 1.0, 1.0],
            &[SUN, sky],
        );
        assert_eq!(e, [DVec3::splat(1.5 * PI), DVec3::ZERO]);
        let kd = [DVec3::ZERO, DVec3::new(1.0, 0.5, 0.0)];
        let l = radiance(&e, &[1, 0], &kd, &[DVec3::new(1.0, 0.5, 1.0), DVec3::ONE]);
        assert!((l[0] - DVec3::new(1.5, 0.375, 0.0)).length() < 1e-15 && l[1] == DVec3::ZERO);
    }
    #[test]
    fn a_point_light_falls_off_with_the_facets_distance() {
        let light = Light::Point {
            position: DVec3::new(0.0, 3.0, 0.0),
            intensity: DVec3::splat(PI),
            radius: 1e-3,
        };
        // 2 above the first facet, and 5 from the second, 3 up and 4 aside: I/d² · 3/5.
        let positions = [DVec3::Y, DVec3::new(4.0, 0.0, 0.0)];
        let e = irradiance(&positions, &[DVec3::Y; 2], &[0.5, 1.0], &[light]);
        assert_eq!(e[0], DVec3::splat(PI / 8.0));
        assert!((e[1] - DVec3::splat(PI / 25.0 * 0.6)).length() < 1e-15);
        let apart = light.relative_to(DVec3::Y);
        assert_eq!(irradiance(&[DVec3::ZERO], &[DVec3::Y], &[0.5], &[apart])[0], e[0]);
    }

    #[test]
    fn lobes_respond_at_their_angle_but_not_to_the_sky_or_behind() {
        // v_1 = t over its nodes. Light straight above, eye at 60° from it: the half vector lies at
        // γ = 30°.
        let ramp: Vec<f64> = (0..basis::N_NODES).map(basis::node_t).collect();
        let sin60 = 3f64.sqrt() / 2.0;
        let normal = DVec3::Y;
        let toward_eye = |cos: f64, sin: f64| DVec3::new(sin, cos, 0.0);
        let of = |light: &Light, outgoing| {
            responses(light, 0.5, normal, DVec3::Y, outgoing, std::slice::from_ref(&ramp))
        };
        let before = of(&SUN, toward_eye(0.5, sin60));
        let gap = 1.0 - sin60;
        assert!(
            (before[0] - 0.5 / PI).abs() < 1e-15
                && (before[1] - 0.5 * gap.powf(0.25)).abs() < 1e-15
        );
        assert_eq!(of(&SUN, toward_eye(-0.5, sin60)), [0.5 / PI, 0.0]);
        let sky = Light::even_sky(DVec3::ONE, 0.0);
        assert_eq!(of(&sky, toward_eye(0.5, sin60)), [0.5 / PI, 0.0]);
    }
}
