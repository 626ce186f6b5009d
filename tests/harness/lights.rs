//! A light's arrival at a point in f32 (shaders/include/light.glsl), with a running bound.

#![allow(dead_code, reason = "each test binary uses its own part")]

use glam::DVec3;
use nimbus::layout::frame::LightRecord;
use nimbus::model::light::{Light, MIN_PENUMBRA};

use crate::bounded::{Bounded, Random, dot, exact3};

pub fn double(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

pub struct Arrival {
    pub toward: [Bounded; 3],
    /// Infinite for lights that are not in the scene.
    pub distance: Bounded,
    pub falloff: Bounded,
}

/// Vectors of the light are f32 numbers; the spot's cosines are not.
pub fn arrival(light: &Light, p: [f32; 3]) -> Arrival {
    let exact = Bounded::exact;
    let (position, radius, cone) = match *light {
        Light::Directional { direction, .. } => return from_afar(-direction),
        Light::Sky { .. } => return from_afar(DVec3::Y),
        Light::Point { position, radius, .. } => (position, radius, None),
        Light::Spot { position, direction, radius, cos_inner, cos_outer, .. } => {
            let scale = 1.0 / (cos_inner - cos_outer).max(MIN_PENUMBRA);
            (
                position,
                radius,
                Some((-direction, Bounded::once(scale), Bounded::once(-cos_outer * scale))),
            )
        }
    };
    let offset = [0, 1, 2].map(|i| exact(position[i]).minus(exact(f64::from(p[i]))));
    let at_the_light = position == double(p);
    let distance = if at_the_light { exact(0.0) } else { dot(offset, offset).root() };
    let toward = if at_the_light {
        DVec3::Y.to_array().map(exact)
    } else {
        offset.map(|o| o.over(distance))
    };
    let reach = distance.at_least(radius);
    let share = cone.map_or(exact(1.0), |(axis, scale, offset)| {
        scale.times(dot(toward, axis.to_array().map(exact))).plus(offset).within_0_and_1()
    });
    Arrival { toward, distance, falloff: share.squared().over(reach.squared()) }
}

fn from_afar(toward: DVec3) -> Arrival {
    let exact = Bounded::exact;
    Arrival {
        toward: exact3(toward.as_vec3().to_array()),
        distance: exact(f64::INFINITY),
        falloff: exact(1.0),
    }
}

/// Returns a point light or a spot whose vectors are f32 numbers within ±`reach` of the origin.
pub fn near_light(r: &mut Random, reach: f64, is_spot: bool) -> Light {
    let mut vector = |low: f64, high: f64| double([0; 3].map(|_| r.within(low, high)));
    let (position, intensity) = (vector(-reach, reach), vector(0.0, 5.0));
    let radius = f64::from(r.within(0.01, 0.5));
    if !is_spot {
        return Light::Point { position, intensity, radius };
    }
    let inner = f64::from(r.within(0.1, 1.0));
    let cos_outer = (inner + f64::from(r.within(0.1, 1.0))).cos();
    Light::Spot {
        position,
        direction: double(r.direction()),
        intensity,
        radius,
        cos_inner: inner.cos(),
        cos_outer,
    }
}

/// The records; the inputs are already relative to O.
pub fn records(lights: &[Light]) -> Vec<LightRecord> {
    lights.iter().map(|l| LightRecord::new(l, DVec3::ZERO)).collect()
}
