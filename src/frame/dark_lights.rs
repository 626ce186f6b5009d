//! Lights that light no facet, with the reason.

use super::readback::LitFacets;
use crate::model::light::Light;

/// Greatest irradiance times exposure of a light that lights nothing. A white diffuse facet shows a
/// π-th of it, which is less than a third of half an 8-bit step.
const LEAST_SHOWN: f64 = 0.5 / 255.0;
/// Share of the facets around a lamp that face it if the lamp is inside a cloud; around a lamp at a
/// flat side, half of a cloud's facets face it. Each facet counts by area / distance², as it would
/// receive light.
const FEW_FACING: f64 = 0.1;

/// Returns a sentence about every light whose irradiance shows on no facet, and about every lamp
/// from which nearly all facets face away. `lights` are relative to the lighting origin, as the
/// facets are. Skies are left out: their constant part reaches every facet.
pub fn dark_lights(exposure: f64, lights: &[Light], facets: &LitFacets) -> Vec<String> {
    let all = lights.iter().enumerate();
    all.filter_map(|(i, light)| {
        let what = defect(exposure, light, &Reach::of(light, i, facets)?)?;
        Some(format!("light.{i} {what}"))
    })
    .collect()
}

/// The way in which a light reaches the facets.
#[derive(Default)]
struct Reach {
    /// Greatest share of the energy that arrives at a facet.
    greatest: f64,
    /// The same if nothing were in the way.
    clear: f64,
    /// Sum of area times falloff over all facets, and over those that face the light.
    around: f64,
    facing: f64,
    /// A facet faces the light.
    turns_to_it: bool,
}

impl Reach {
    /// Returns none for a light without energy, or without facets to light.
    fn of(light: &Light, i: usize, all: &LitFacets) -> Option<Reach> {
        if light.is_sky() || light.energy().max_element() <= 0.0 || all.facets.is_empty() {
            return None;
        }
        let mut reach = Reach::default();
        for (facet, transmittance) in all.facets.iter().zip(all.transmittance_to(i)) {
            let arrival = light.arrival(facet.position.map(f64::from).into());
            let normal = facet.normal.map(f64::from).into();
            let (weight, share) =
                (f64::from(facet.area) * arrival.falloff, light.share(normal, &arrival, 1.0));
            let faces = arrival.toward.dot(normal) > 0.0;
            reach.clear = reach.clear.max(share);
            reach.greatest = reach.greatest.max(share * f64::from(transmittance));
            reach.around += weight;
            reach.facing += if faces { weight } else { 0.0 };
            reach.turns_to_it |= faces;
        }
        // NaN is no evidence of darkness.
        (!reach.greatest.is_nan()).then_some(reach)
    }
}

const INSIDE: &str = "face away from it, as around a lamp inside a cloud; a place outside of the \
    cloud lights it";

fn defect(exposure: f64, light: &Light, reach: &Reach) -> Option<String> {
    let shows = |share: f64| share * light.energy().max_element() * exposure >= LEAST_SHOWN;
    let is_lamp = matches!(light, Light::Point { .. } | Light::Spot { .. });
    let facing = reach.facing / reach.around;
    if shows(reach.greatest) {
        let percent = 100.0 * (1.0 - facing);
        return (is_lamp && facing < FEW_FACING).then(|| {
            format!("lights hardly anything: {percent:.0} % of the facets around it {INSIDE}")
        });
    }
    let reason = match light {
        _ if !reach.turns_to_it => return Some(format!("lights nothing: all facets {INSIDE}")),
        Light::Spot { .. } if reach.around == 0.0 => {
            "no facet is in its cone; `direction` and `outer_deg` set the cone"
        }
        _ if shows(reach.clear) => "clouds or surfaces are in its way to every facet that faces it",
        Light::Directional { .. } => {
            "its irradiance is too small to show; a greater `irradiance` makes it brighter"
        }
        Light::Point { .. } | Light::Spot { .. } | Light::Sky { .. } => {
            "it is too weak or too far away to show; `intensity` and `position` make it brighter"
        }
    };
    Some(format!("lights nothing: {reason}"))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::layout::facet::FacetRecord;

    const EXPOSURE: f64 = 0.5;

    fn facet(position: [f32; 3], normal: [f32; 3]) -> FacetRecord {
        FacetRecord { position, normal, area: 1.0, ..FacetRecord::default() }
    }

    fn lamp(position: DVec3, intensity: f64) -> Light {
        Light::Point { position, intensity: DVec3::splat(intensity), radius: 0.01 }
    }

    /// Two facets of a cloud around the origin.
    fn shell(transmittance: f32) -> LitFacets {
        let facets =
            vec![facet([1.0, 0.0, 0.0], [1.0, 0.0, 0.0]), facet([0.0, 1.0, 0.0], [0.0, 1.0, 0.0])];
        LitFacets { transmittance: vec![transmittance; facets.len()], facets }
    }

    fn said(light: Light, facets: &LitFacets) -> String {
        dark_lights(EXPOSURE, &[light], facets).join("\n")
    }

    #[test]
    fn a_light_that_shows_on_a_facet_is_not_named() {
        assert_eq!(said(lamp(DVec3::X * 3.0, 4.0), &shell(1.0)), "");
        assert_eq!(said(lamp(DVec3::X * 3.0, 0.0), &shell(1.0)), "");
        assert_eq!(said(lamp(DVec3::ZERO, 1.0), &LitFacets::default()), "");
        // At distance 2, 1/4 of the intensity arrives.
        let least = 4.0 * LEAST_SHOWN / EXPOSURE;
        assert_eq!(said(lamp(DVec3::X * 3.0, 1.001 * least), &shell(1.0)), "");
        assert!(said(lamp(DVec3::X * 3.0, 0.999 * least), &shell(1.0)).contains("too weak"));
    }

    #[test]
    fn the_reason_is_the_one_that_holds() {
        let inside = said(lamp(DVec3::ZERO, 100.0), &shell(1.0));
        assert!(inside.starts_with("light.0 lights nothing: all facets face away"), "{inside}");
        let mut most_away = shell(1.0);
        most_away.facets.push(facet([3.0, 0.0, 0.0], [-1.0, 0.0, 0.0]));
        most_away.transmittance.push(1.0);
        // 1 and 1 face away, and 1/9 faces the lamp.
        let inside = said(lamp(DVec3::ZERO, 100.0), &most_away);
        assert!(inside.contains("hardly anything: 95 % of the facets around it"), "{inside}");
        assert!(said(lamp(DVec3::X * 3.0, 4.0), &shell(1e-6)).contains("in its way"));
        let spot = Light::Spot {
            position: DVec3::X * 3.0,
            direction: DVec3::X,
            intensity: DVec3::ONE,
            radius: 0.01,
            cos_inner: 0.9,
            cos_outer: 0.8,
        };
        assert!(said(spot, &shell(1.0)).contains("cone"));
        let sun = |y: f64| Light::Directional {
            direction: DVec3::new(0.0, y, 0.0),
            irradiance: DVec3::ONE,
        };
        assert_eq!(said(sun(-1.0), &shell(1.0)), "");
        let ceiling =
            LitFacets { transmittance: vec![1.0], facets: vec![facet([0.0; 3], [0.0, -1.0, 0.0])] };
        assert!(said(sun(-1.0), &ceiling).contains("all facets face away"));
    }
}
