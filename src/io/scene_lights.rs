//! The scene's lights and materials.

use glam::DVec3;
use serde_json::json;

use super::magnitude::{AMOUNT, GREATEST_SHARE};
use super::toml_section::{Bounds, Section};
use crate::error::Result;
use crate::model::light::Light;
use crate::model::material::Material;

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
    Sky,
}

pub fn read_lights(root: &mut Section) -> Result<Vec<Light>> {
    let mut lights = Vec::new();
    let mut resolved = Vec::new();
    for mut s in root.sections("light")? {
        let kinds = [("directional", Kind::Directional), ("sky", Kind::Sky)];
        lights.push(match s.required_choice("kind", &kinds, &["point", "spot"])? {
            Kind::Directional => read_directional(&mut s)?,
            Kind::Sky => {
                s.expect_keys(&["kind", "irradiance", "constant"], &[])?;
                let irradiance = s.required_vec3("irradiance", AMOUNT)?;
                Light::Sky { irradiance, constant: s.f64("constant", 0.15, Bounds::Within(0.0, GREATEST_SHARE))? }
            }
        });
        resolved.push(s.finish());
    }
    root.record("light", json!(resolved));
    Ok(lights)
}

fn read_directional(s: &mut Section) -> Result<Light> {
    s.expect_keys(&["kind", "direction", "irradiance"], &[])?;
    let direction = s.required_vec3("direction", Bounds::Any)?;
    // Scaled first: the square of a long or short vector's length has no number.
    let direction = (direction / direction.abs().max_element()).try_normalize();
    let direction = direction.ok_or_else(|| s.fault("direction", "expected a direction, found [0, 0, 0]"))?;
    Ok(Light::Directional { direction, irradiance: s.required_vec3("irradiance", AMOUNT)? })
}

pub fn read_materials(root: &mut Section, warnings: &mut Vec<String>) -> Result<Vec<Material>> {
    let mut materials: Vec<Material> = Vec::new();
    let mut resolved = Vec::new();
    for mut s in root.sections("material")? {
        s.expect_keys(&["name", "kd", "ks", "ns"], &[])?;
        let name = s.required_string("name")?;
        if let Some(i) = materials.iter().position(|m| m.name == name) {
            return Err(s.fault("name", format!("`{name}` is already the name of material {i}")));
        }
        let material = Material {
            name,
            kd: s.vec3("kd", DVec3::splat(0.9), Bounds::Within(0.0, 1.0))?,
            ks: s.vec3("ks", DVec3::ZERO, AMOUNT)?,
            ns: s.f64("ns", 8.0, AMOUNT)?,
        };
        warn(&s, &material, warnings);
        materials.push(material);
        resolved.push(s.finish());
    }
    root.record("material", json!(resolved));
    Ok(materials)
}

fn warn(s: &Section, material: &Material, warnings: &mut Vec<String>) {
    let (at, name) = (s.place("ks"), &material.name);
    let albedo = material.greatest_albedo();
    if albedo > 1.0 {
        warnings.push(format!(
            "{at}: material `{name}` has K_d + 4 K_s = {albedo:.3}: above 1 it can reflect more light than it receives"
        ));
    }
    if material.ks.max_element() > 0.0 {
        warnings.push(format!("{at}: K_s of material `{name}` is ignored: this version lights with the diffuse basis"));
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
        assert_eq!((material.name.as_str(), material.kd), ("cloud", DVec3::splat(0.9)));
    }
}
