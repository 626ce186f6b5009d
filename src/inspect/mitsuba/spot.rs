//! A spot light as Mitsuba reads it. Its own spot gets dimmer in proportion to the angle, so it
//! throws a picture of this one's law instead.

use std::fmt::Write;

use glam::DVec3;

use super::vector::list;
use crate::model::light::{Light, MIN_PENUMBRA};

/// Columns and rows of the picture, which Mitsuba interpolates.
const SIDE: u32 = 512;
/// Cosine of the widest outer angle, 80 degrees: beyond it the picture has no room for the middle.
const LEAST_COSINE: f64 = 0.173_648_177_666_930_33;
/// Share of the outer angle within which Mitsuba's own spot is not dimmed.
const WHOLE: f64 = 1.0 - 1e-5;

/// Returns the name of the picture of spot `i`.
pub fn file_name(i: usize) -> String {
    format!("spot-{i}.exr")
}

/// Returns whether a light is a spot that no picture can show.
pub(super) fn is_too_wide(light: &Light) -> bool {
    matches!(light, Light::Spot { cos_outer, .. } if *cos_outer < LEAST_COSINE - 1e-9)
}

/// Returns the picture that a spot throws: columns and rows, and linear RGBA. It reaches from
/// -tan to tan of the outer angle.
pub(super) fn picture(light: &Light) -> Option<([u32; 2], Vec<f32>)> {
    let Light::Spot { cos_inner, cos_outer, .. } = *light else { return None };
    let tangent = (1.0 - cos_outer * cos_outer).max(0.0).sqrt() / cos_outer;
    let width = (cos_inner - cos_outer).max(MIN_PENUMBRA);
    let at = |i: u32| ((2 * i + 1) as f64 / f64::from(SIDE) - 1.0) * tangent;
    let pixel = |i: u32, j: u32| {
        let cosine = (1.0 + at(i) * at(i) + at(j) * at(j)).sqrt().recip();
        let share = ((cosine - cos_outer) / width).clamp(0.0, 1.0);
        let value = (share * share) as f32;
        [value, value, value, 1.0]
    };
    let pixels = (0..SIDE).flat_map(|j| (0..SIDE).flat_map(move |i| pixel(i, j)));
    Some(([SIDE; 2], pixels.collect()))
}

/// Writes spot `i` of the scene.
pub(super) fn emitter(text: &mut String, light: &Light, i: usize) -> std::fmt::Result {
    let Light::Spot { position, direction, intensity, cos_outer, .. } = *light else {
        return Ok(());
    };
    let outer = cos_outer.acos().to_degrees();
    let up: DVec3 = direction.any_orthonormal_vector();
    writeln!(
        text,
        r#"  <emitter type="spot">
    <transform name="to_world">
      <lookat origin="{}" target="{}" up="{}"/>
    </transform>
    <rgb name="intensity" value="{}"/>
    <float name="cutoff_angle" value="{outer}"/>
    <float name="beam_width" value="{}"/>
    <texture type="bitmap" name="texture">
      <string name="filename" value="{}"/>
      <boolean name="raw" value="true"/>
    </texture>
  </emitter>"#,
        list(position),
        list(position + direction),
        list(up),
        list(intensity),
        WHOLE * outer,
        file_name(i)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The light that the picture throws on a plane one unit away is the light that arrives there.
    #[test]
    fn the_picture_has_the_light_of_the_spot() {
        for (inner, outer) in [(0.0, 45.0), (20.0, 30.0), (10.0, 80.0)].map(|(a, b)| {
            let radians = |degrees: f64| degrees.to_radians().cos();
            (radians(a), radians(b))
        }) {
            let light = Light::Spot {
                position: DVec3::ZERO,
                direction: DVec3::Z,
                intensity: DVec3::ONE,
                radius: 1e-3,
                cos_inner: inner,
                cos_outer: outer,
            };
            assert!(!is_too_wide(&light));
            let ([width, height], rgba) = picture(&light).unwrap();
            let tangent = outer.acos().tan();
            let mut n_lit = 0;
            for (k, pixel) in rgba.chunks_exact(4).enumerate() {
                let (i, j) = (k as u32 % width, k as u32 / width);
                let of =
                    |i: u32, n: u32| ((f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0) * tangent;
                let p = DVec3::new(of(i, width), of(j, height), 1.0);
                let expected = light.arrival(p).falloff * p.length_squared();
                assert!((f64::from(pixel[0]) - expected).abs() < 1e-6, "{i} {j}: {pixel:?}");
                n_lit += usize::from(pixel[0] > 0.0);
            }
            assert!(n_lit > rgba.len() / 8 && n_lit < rgba.len() / 4, "{n_lit}");
        }
        let wide = Light::Spot {
            position: DVec3::ZERO,
            direction: DVec3::Z,
            intensity: DVec3::ONE,
            radius: 1e-3,
            cos_inner: 1.0,
            cos_outer: 81f64.to_radians().cos(),
        };
        assert!(is_too_wide(&wide) && picture(&Light::even_sky(DVec3::ONE, 0.0)).is_none());
    }
}
