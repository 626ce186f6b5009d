//! Tables `[[light]]`.

use glam::DVec3;

use super::key::{Keys, keys, names, read_tables};
use super::spec::{Spec, choice, number, required_text, required_vector};
use crate::error::Result;
use crate::io::bounds::{AMOUNT, Bounds, COORDINATE, GREATEST, GREATEST_SHARE, LEAST_LIGHT_RADIUS};
use crate::io::document::section::Section;
use crate::io::document::suggest::shown;
use crate::model::light::Light;
use crate::model::sky::{Sky, SkySettings};
use crate::model::tilt::Tilt;
use crate::model::weather::{steps, sun};

/// Lights of a scene without any `[[light]]`: a sun from the upper right, and the sky.
pub const DEFAULT_LIGHTS: &str = r#"
[[light]]
kind = "directional"
direction = [-0.5, -0.8, -0.3]
irradiance = [3.0, 2.9, 2.7]
[[light]]
kind = "sky"
irradiance = [0.8, 0.87, 1.0]
constant = 0.55
"#;

/// Irradiance of the sun and of the sky that a clear sky has, and where the sky is bright.
pub struct Clear {
    sun: DVec3,
    sky: DVec3,
    tilt: Tilt,
}

type Reader = fn(&mut Section, Option<&Clear>) -> Result<Light>;

/// A kind of light: its keys beside `kind`, and their reader.
type LightKind = (&'static [Keys], Reader);

const KINDS: &[(&str, LightKind)] = &[
    ("directional", (&[DIRECTIONAL], directional)),
    ("point", (&[POINT], point)),
    ("spot", (&[CONE, SPOT], read_spot)),
    ("sky", (&[SKY], sky)),
    ("sun", (&[SUN], read_sun)),
];

fn radius() -> Spec<f64> {
    number(1e-3, Bounds::Within(LEAST_LIGHT_RADIUS, GREATEST))
}

/// The key that a clear sky has a default for.
const IRRADIANCE: &str = "irradiance";

/// Range of a half angle, degrees.
const HALF_ANGLE: Bounds = Bounds::Within(0.0, 180.0);

keys! {
    /// Kind of the light, which its other keys follow from.
    KIND: pub fn kind(s) -> LightKind = "kind": choice("", KINDS).required();
}

/// Irradiance whose default a clear sky sets, if there is one.
fn irradiance(clear: Option<DVec3>) -> Spec<DVec3> {
    let spec = required_vector(AMOUNT);
    match clear {
        Some(default) => spec.or(default.to_array()),
        None => spec,
    }
}

keys! { DIRECTIONAL: fn directional(s, clear: Option<&Clear>) -> Light { Light::Directional;
    /// Direction in which the light travels.
    direction: required_vector(Bounds::Any) => |d| unit_vector(s, &d);
    /// Linear RGB irradiance on a plane across the direction. A `[sky]` has a default for it.
    irradiance: required_vector(AMOUNT) => |_| irradiance(clear.map(|c| c.sun)).take(s, IRRADIANCE);
}}

keys! { POINT: fn point(s, _clear: Option<&Clear>) -> Light { Light::Point;
    /// Place of the light.
    position: required_vector(COORDINATE), "unit";
    /// Linear RGB power for each solid angle.
    intensity: required_vector(AMOUNT);
    /// Distance below which the irradiance stops growing.
    radius: radius(), "unit";
}}

struct Cone {
    outer: f64,
    inner: f64,
}

keys! { CONE: fn cone(s) -> Cone { Cone;
    /// Half angle beyond which there is no light.
    outer ["outer_deg"]: number(45.0, HALF_ANGLE), "degree";
    /// Half angle below which the light is full.
    inner ["inner_deg"]: number(0.0, HALF_ANGLE), "degree";
}}

keys! { SPOT: fn spot(s, cone: Cone) -> Light { Light::Spot;
    cos_outer => cone.outer.to_radians().cos();
    cos_inner => cone.inner.to_radians().cos();
    /// Place of the light.
    position: required_vector(COORDINATE), "unit";
    /// Direction of the axis of its cone.
    direction: required_vector(Bounds::Any) => |d| unit_vector(s, &d);
    /// Linear RGB power for each solid angle.
    intensity: required_vector(AMOUNT);
    /// Distance below which the irradiance stops growing.
    radius: radius(), "unit";
}}

keys! { SKY: fn sky(s, clear: Option<&Clear>) -> Light { Light::Sky;
    tilt => clear.map_or(Tilt::EVEN, |c| c.tilt);
    /// Linear RGB irradiance from above. A `[sky]` has a default for it.
    irradiance: required_vector(AMOUNT) => |_| irradiance(clear.map(|c| c.sky)).take(s, IRRADIANCE);
    /// Share of the irradiance that reaches every facet, whatever is in the way.
    constant: number(0.15, Bounds::Within(0.0, GREATEST_SHARE));
}}

/// A directional light from where the sun stands.
struct Sun {
    time_s: f64,
    latitude: f64,
    longitude: f64,
    irradiance: DVec3,
}

keys! { SUN: fn sun(s, clear: Option<&Clear>) -> Sun { Sun;
    /// Date and time, such as "2005-08-28 18:00:00".
    time_s ["date"]: required_text(), "UTC" => |date| time_of(s, &date);
    /// Latitude, positive to the north.
    latitude ["latitude_deg"]: number(0.0, Bounds::Within(-90.0, 90.0)), "degree";
    /// Longitude, positive to the east.
    longitude ["longitude_deg"]: number(0.0, Bounds::Within(-180.0, 360.0)), "degree";
    /// Linear RGB irradiance on a plane across the light. A `[sky]` has a default for it.
    irradiance: required_vector(AMOUNT) => |_| irradiance(clear.map(|c| c.sun)).take(s, IRRADIANCE);
}}

/// Returns the sky of the scene's only sun.
///
/// # Errors
/// There is none or there are several, or the sun is below the horizon.
pub fn under_sky(root: &mut Section, settings: SkySettings) -> Result<Sky> {
    let mut suns = Vec::new();
    for s in &mut root.sections("light")? {
        let (_, read) = kind(s)?;
        // What the sky sets does not matter for the place of its sun.
        let any = Some(&Clear { sun: DVec3::ZERO, sky: DVec3::ZERO, tilt: Tilt::EVEN });
        if let Light::Directional { direction, .. } = read(s, any)? {
            suns.push(-direction);
        }
    }
    let [toward] = suns[..] else {
        let n = suns.len();
        let what = format!(
            "a sky has the light of one sun: expected one [[light]] of kind \"sun\" or \
             \"directional\", found {n}"
        );
        return Err(root.section("sky")?.fault("model", what));
    };
    Sky::new(settings, toward).map_err(|what| match root.section("sky") {
        Ok(s) => s.fault("model", format!("the sky cannot be computed: {what}")),
        Err(error) => error,
    })
}

/// Lists the kinds of lights and the keys of each.
pub fn kinds() -> impl Iterator<Item = (&'static str, &'static [Keys])> {
    KINDS.iter().map(|(name, (lists, _))| (*name, *lists))
}

/// Reads every `[[light]]`. Under a clear sky, sun and sky need no `irradiance`.
pub fn read_lights(root: &mut Section, sky: Option<&Sky>) -> Result<Vec<Light>> {
    let clear = sky.map(|sky| Clear { sun: sky.of_sun(), sky: sky.of_sky(), tilt: sky.tilt() });
    read_tables(root, "light", |s, _| {
        let (lists, read) = kind(s)?;
        s.expect_keys(names(&[&[KIND], lists].concat()))?;
        read(s, clear.as_ref())
    })
}

fn read_spot(s: &mut Section, _: Option<&Clear>) -> Result<Light> {
    let cone = cone(s)?;
    let Cone { outer, inner } = cone;
    if inner <= outer {
        return spot(s, cone);
    }
    let what =
        format!("expected at most outer_deg = {outer} (both are half angles), found {inner}");
    Err(s.fault("inner_deg", what))
}

/// Reads a direction and normalises it.
fn unit_vector(s: &mut Section, direction: &Spec<DVec3>) -> Result<DVec3> {
    let direction = direction.take(s, "direction")?;
    // Scaled first: the square of a long or short vector's length has no number.
    let direction = (direction / direction.abs().max_element()).try_normalize();
    direction.ok_or_else(|| s.fault("direction", "expected a direction, found [0, 0, 0]"))
}

fn time_of(s: &mut Section, date: &Spec<String>) -> Result<f64> {
    let date = date.take(s, "date")?;
    steps::parse(&date).ok_or_else(|| {
        let found = shown(&date);
        let what = format!("expected a time such as \"2005-08-28 18:00:00\" (UTC), found {found}");
        s.fault("date", what)
    })
}

/// Reads a sun; x is east and z south.
fn read_sun(s: &mut Section, clear: Option<&Clear>) -> Result<Light> {
    let Sun { time_s, latitude, longitude, irradiance } = sun(s, clear)?;
    let toward = sun::toward(time_s, latitude.to_radians(), longitude.to_radians());
    if toward.y <= 0.0 {
        let below = -toward.y.asin().to_degrees();
        let what = format!("expected a time of day: the sun is {below:.1}° below the horizon then");
        return Err(s.fault("date", what));
    }
    Ok(Light::Directional { direction: -toward, irradiance })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::io::document::tree::Document;

    #[test]
    fn default_lights_are_toml() {
        let mut document = Document::parse("title = ''".to_owned(), Path::new("x.toml")).unwrap();
        document.default_to("light", DEFAULT_LIGHTS);
        assert_eq!(read_lights(&mut Section::root(&document).unwrap(), None).unwrap().len(), 2);
    }
}
