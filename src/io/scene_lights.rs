//! The scene's lights and materials.

use glam::DVec3;
use serde_json::json;

use super::magnitude::{
    AMOUNT, COORDINATE, GREATEST, GREATEST_EXPONENT, GREATEST_SHARE, LEAST_LIGHT_RADIUS,
};
use super::suggest::{did_you_mean, list_given, shown};
use super::toml_section::{Bounds, Section};
use crate::error::Result;
use crate::model::light::Light;
use crate::model::material::{Brdf, Material, MaterialKey};
use crate::model::weather::{steps, sun};

/// What lights a scene without any `[[light]]`: a sun from the upper right, and the sky.
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

/// The material of a scene without any `[[material]]`.
pub const DEFAULT_MATERIAL: &str = r#"
[[material]]
name = "cloud"
"#;

#[derive(Clone, Copy)]
enum Kind {
    Directional,
    Point,
    Spot,
    Sky,
    Sun,
}

pub fn read_lights(root: &mut Section) -> Result<Vec<Light>> {
    let mut lights = Vec::new();
    let mut resolved = Vec::new();
    for mut s in root.sections("light")? {
        let kinds = [
            ("directional", Kind::Directional),
            ("point", Kind::Point),
            ("spot", Kind::Spot),
            ("sky", Kind::Sky),
            ("sun", Kind::Sun),
        ];
        lights.push(match s.required_choice("kind", &kinds, &[])? {
            Kind::Directional => read_directional(&mut s)?,
            Kind::Point => read_point(&mut s)?,
            Kind::Spot => read_spot(&mut s)?,
            Kind::Sun => read_sun(&mut s)?,
            Kind::Sky => {
                s.expect_keys(&["kind", "irradiance", "constant"], &[])?;
                let irradiance = s.required_vec3("irradiance", AMOUNT)?;
                Light::Sky {
                    irradiance,
                    constant: s.f64("constant", 0.15, Bounds::Within(0.0, GREATEST_SHARE))?,
                }
            }
        });
        resolved.push(s.finish());
    }
    root.record("light", json!(resolved));
    Ok(lights)
}

const LIGHT_RADIUS: Bounds = Bounds::Within(LEAST_LIGHT_RADIUS, GREATEST);
/// Nearer than this a point light's irradiance does not grow, where the scene does not say.
const DEFAULT_LIGHT_RADIUS: f64 = 1e-3;

fn read_point(s: &mut Section) -> Result<Light> {
    s.expect_keys(&["kind", "position", "intensity", "radius"], &[])?;
    Ok(Light::Point {
        position: s.required_vec3("position", COORDINATE)?,
        intensity: s.required_vec3("intensity", AMOUNT)?,
        radius: s.f64("radius", DEFAULT_LIGHT_RADIUS, LIGHT_RADIUS)?,
    })
}

fn read_spot(s: &mut Section) -> Result<Light> {
    s.expect_keys(
        &["kind", "position", "direction", "intensity", "inner_deg", "outer_deg", "radius"],
        &[],
    )?;
    let outer = s.f64("outer_deg", 45.0, Bounds::Within(0.0, 180.0))?;
    let inner = s.f64("inner_deg", 0.0, Bounds::Within(0.0, 180.0))?;
    if inner > outer {
        let what =
            format!("expected at most outer_deg = {outer} (both are half angles), found {inner}");
        return Err(s.fault("inner_deg", what));
    }
    Ok(Light::Spot {
        position: s.required_vec3("position", COORDINATE)?,
        direction: read_direction(s)?,
        intensity: s.required_vec3("intensity", AMOUNT)?,
        radius: s.f64("radius", DEFAULT_LIGHT_RADIUS, LIGHT_RADIUS)?,
        cos_inner: inner.to_radians().cos(),
        cos_outer: outer.to_radians().cos(),
    })
}

fn read_direction(s: &mut Section) -> Result<DVec3> {
    let direction = s.required_vec3("direction", Bounds::Any)?;
    // Scaled first: the square of a long or short vector's length has no number.
    let direction = (direction / direction.abs().max_element()).try_normalize();
    direction.ok_or_else(|| s.fault("direction", "expected a direction, found [0, 0, 0]"))
}

fn read_directional(s: &mut Section) -> Result<Light> {
    s.expect_keys(&["kind", "direction", "irradiance"], &[])?;
    Ok(Light::Directional {
        direction: read_direction(s)?,
        irradiance: s.required_vec3("irradiance", AMOUNT)?,
    })
}

/// A directional light from where the sun stands; x is east and z south.
fn read_sun(s: &mut Section) -> Result<Light> {
    s.expect_keys(&["kind", "date", "latitude_deg", "longitude_deg", "irradiance"], &[])?;
    let date = s.required_string("date")?;
    let Some(time_s) = steps::parse(&date) else {
        let what = format!(
            "expected a time such as \"2005-08-28 18:00:00\" (UTC), found {}",
            shown(&date)
        );
        return Err(s.fault("date", what));
    };
    let latitude = s.f64("latitude_deg", 0.0, Bounds::Within(-90.0, 90.0))?.to_radians();
    let longitude = s.f64("longitude_deg", 0.0, Bounds::Within(-180.0, 360.0))?.to_radians();
    let toward = sun::toward(time_s, latitude, longitude);
    if toward.y <= 0.0 {
        let below = -toward.y.asin().to_degrees();
        return Err(s.fault(
            "date",
            format!("expected a time of day: the sun is {below:.1}° below the horizon then"),
        ));
    }
    Ok(Light::Directional {
        direction: -toward,
        irradiance: s.required_vec3("irradiance", AMOUNT)?,
    })
}

pub fn read_materials(root: &mut Section, warnings: &mut Vec<String>) -> Result<Vec<Material>> {
    let mut materials: Vec<Material> = Vec::new();
    let mut resolved = Vec::new();
    for mut s in root.sections("material")? {
        s.expect_keys(&["name", "kd", "ks", "ns", "path"], &[])?;
        let name = s.required_string("name")?;
        if let Some(i) = materials.iter().position(|m| m.name == name) {
            return Err(
                s.fault("name", format!("`{}` is already the name of material {i}", shown(&name)))
            );
        }
        let keys = match s.has("path") {
            true => read_edits(&mut s)?,
            false => vec![MaterialKey { time_s: 0.0, brdf: read_brdf(&mut s, PLAIN)? }],
        };
        let material = Material { name, keys };
        warn(&s, &material, warnings);
        materials.push(material);
        resolved.push(s.finish());
    }
    root.record("material", json!(resolved));
    Ok(materials)
}

/// What a material is where its table does not say.
const PLAIN: Brdf = Brdf { kd: DVec3::splat(0.9), ks: DVec3::ZERO, ns: 8.0 };

fn read_brdf(s: &mut Section, otherwise: Brdf) -> Result<Brdf> {
    Ok(Brdf {
        kd: s.vec3("kd", otherwise.kd, Bounds::Within(0.0, 1.0))?,
        ks: s.vec3("ks", otherwise.ks, AMOUNT)?,
        ns: s.f64("ns", otherwise.ns, Bounds::Within(0.0, GREATEST_EXPONENT))?,
    })
}

/// The keys of a material that is edited over time; what a key leaves out is as in the key before
/// it.
fn read_edits(s: &mut Section) -> Result<Vec<MaterialKey>> {
    for key in ["kd", "ks", "ns"] {
        if s.has(key) {
            return Err(s.fault(
                key,
                "a material has either `kd`, `ks`, `ns` or a `path` of them, not both",
            ));
        }
    }
    let mut keys: Vec<MaterialKey> = Vec::new();
    let mut resolved = Vec::new();
    for mut item in s.sections("path")? {
        item.expect_keys(&["time_s", "kd", "ks", "ns"], &[])?;
        let time_s = item.required_f64("time_s", COORDINATE)?;
        if let Some(before) = keys.last().map(|k| k.time_s).filter(|before| time_s <= *before) {
            return Err(
                item.fault("time_s", format!("times must grow, found {time_s} after {before}"))
            );
        }
        let brdf = read_brdf(&mut item, keys.last().map_or(PLAIN, |k| k.brdf))?;
        keys.push(MaterialKey { time_s, brdf });
        resolved.push(item.finish());
    }
    if keys.is_empty() {
        return Err(s.fault("path", "expected at least one { time_s, kd, ks, ns }"));
    }
    s.record("path", json!(resolved));
    Ok(keys)
}

/// The material that the key `material` names; without it the only one, else the one called
/// "cloud".
pub fn material_named(s: &mut Section, materials: &[Material]) -> Result<usize> {
    let default = if materials.len() == 1 { &materials[0].name } else { "cloud" };
    let name = s.string("material", default)?;
    numbered(s, "material", &name, materials)
}

/// Of ground; None of "none", the default.
pub fn ground_named(s: &mut Section, materials: &[Material]) -> Result<Option<usize>> {
    let name = s.string("ground", "none")?;
    if name == "none" { Ok(None) } else { numbered(s, "ground", &name, materials).map(Some) }
}

fn numbered(s: &mut Section, key: &str, name: &str, materials: &[Material]) -> Result<usize> {
    let names: Vec<&str> = materials.iter().map(|m| m.name.as_str()).collect();
    names.iter().position(|known| *known == name).ok_or_else(|| {
        let meant = did_you_mean(name, &names);
        let meant = if meant.is_empty() { ";".to_owned() } else { meant };
        match names.is_empty() {
            true => s.fault(key, format!("unknown material `{}`; the scene has none", shown(name))),
            false => s.fault(
                key,
                format!(
                    "unknown material `{}`{meant} the scene has {}",
                    shown(name),
                    list_given(&names)
                ),
            ),
        }
    })
}

fn warn(s: &Section, material: &Material, warnings: &mut Vec<String>) {
    let (at, name) = (s.place("ks"), shown(&material.name));
    let albedo = material.max_albedo();
    if albedo > 1.0 {
        warnings.push(format!(
            "{at}: material `{name}` has K_d + 4 K_s = {albedo:.3}: above 1 it can reflect more \
             light than it receives"
        ));
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::io::toml_tree::Document;

    #[test]
    fn the_defaults_are_toml() {
        let mut document = Document::parse("title = ''".to_owned(), Path::new("x.toml")).unwrap();
        document.default_to("light", DEFAULT_LIGHTS);
        document.default_to("material", DEFAULT_MATERIAL);
        let mut root = Section::root(&document).unwrap();
        assert_eq!(read_lights(&mut root).unwrap().len(), 2);
        let material = &read_materials(&mut root, &mut Vec::new()).unwrap()[0];
        assert_eq!((material.name.as_str(), material.at(0.0)), ("cloud", PLAIN));
    }
}
