//! Tables `[[material]]`, and the keys of other tables that name a material.

use glam::DVec3;

use super::key::{Keys, keys, names, read_path, read_tables};
use super::spec::{Spec, choice, described, integer, number, one_of, required_text, text, vector};
use crate::error::Result;
use crate::io::bounds::{AMOUNT, Bounds, COORDINATE, DIVISOR, GREATEST_EXPONENT, SHARE};
use crate::io::document::section::Section;
use crate::io::document::suggest::{list_given, shown, suggestion};
use crate::model::cover::{Cover, Land, Sea};
use crate::model::material::{Brdf, Material, MaterialKey};
use crate::model::phase::{Phase, RADII_UM, Scattering};

/// Material of a scene without any `[[material]]`.
pub const DEFAULT_MATERIAL: &str = r#"
[[material]]
name = "cloud"
"#;

/// BRDF of a material whose table does not set it.
const PLAIN: Brdf = Brdf { kd: DVec3::splat(0.9), ks: DVec3::ZERO, ns: 8.0 };

keys! { MATERIAL: fn material(s) -> Material { Material;
    /// Name by which clouds and surfaces refer to the material.
    name: required_text();
    /// Settings of a material that changes over time, in place of `kd`, `ks` and `ns`. A setting
    /// left out is that of the entry before.
    keys ["path"]: described("array of { time_s, kd, ks, ns }") => |_| read_keys(s);
    scattering => scattering(s)?;
    cover => read_cover(s)?;
}}

keys! { SCATTERING: fn scattering(s) -> Scattering { Scattering;
    /// Albedo of single scattering in a cloud, linear RGB, for the reference "transport". With
    /// "derived", a thick cloud reflects `kd`.
    albedo: one_of("derived", [("derived".into(), None)], Some(vector([1.0; 3], SHARE).map(Some)));
    /// Phase function of a cloud, for the reference "transport". A number is the mean cosine g of
    /// Henyey and Greenstein's, "derived" is g = `lighting.forward`, and "mie" is that of droplets.
    phase: one_of("derived", [("derived".into(), Shape::Derived), ("mie".into(), Shape::Droplets)],
        Some(number(0.85, COSINE).map(Shape::MeanCosine))) => |shape| read_phase(s, &shape);
}}

keys! {
    /// Radius of the droplets where `phase` is "mie".
    DROPLET: fn droplet(s) -> f64 =
        "droplet_um": number(10.0, Bounds::Within(RADII_UM[0], RADII_UM[1])), "um";
}

/// A cover as a scene names it.
#[derive(Debug, Clone, Copy)]
enum CoverName {
    Plain,
    Land,
    Sea,
}

const COVERS: &[(&str, CoverName)] =
    &[("plain", CoverName::Plain), ("land", CoverName::Land), ("sea", CoverName::Sea)];

keys! {
    /// Cover of ground that is of the material: "land" has patches of other brightness and hue, and
    /// "sea" mirrors the sun and the sky of [sky].
    COVER: fn cover_name(s) -> CoverName = "cover": choice("plain", COVERS);
}

keys! { LAND: fn land(s) -> Land { Land;
    /// Standard deviation of the brightness of patches over its mean, of the cover "land".
    contrast: number(0.25, SHARE);
    /// Mean distance of patches, of the cover "land".
    length ["patch_length"]: number(1.0, DIVISOR), "unit";
}}

keys! {
    /// Wind whose waves the cover "sea" has.
    SEA_WIND: fn sea_wind(s) -> f64 = "sea_wind": number(5.0, Bounds::Within(0.0, 30.0)), "m/s";
}

fn read_cover(s: &mut Section) -> Result<Cover> {
    let (name, land, wind) = (cover_name(s)?, land(s)?, sea_wind(s)?);
    Ok(match name {
        CoverName::Plain => Cover::Plain,
        CoverName::Land => Cover::Land(land),
        CoverName::Sea => Cover::Sea(Sea::of_wind(wind)),
    })
}

/// Range of a phase function's mean cosine.
const COSINE: Bounds = Bounds::Within(-0.99, 0.99);

/// A phase function as a scene names it.
#[derive(Debug, Clone, Copy)]
enum Shape {
    Derived,
    Droplets,
    MeanCosine(f64),
}

fn read_phase(s: &mut Section, shape: &Spec<Shape>) -> Result<Option<Phase>> {
    let shape = shape.take(s, "phase")?;
    let radius_um = droplet(s)?;
    Ok(match shape {
        Shape::Derived => None,
        Shape::Droplets => Some(Phase::droplets(radius_um)),
        Shape::MeanCosine(g) => Some(Phase::HenyeyGreenstein { g }),
    })
}

keys! { BRDF: fn brdf(s, before: Brdf) -> Brdf { Brdf;
    /// Diffuse reflectance K_d, linear RGB.
    kd: vector([0.9; 3], SHARE) => |kd| kd.or(before.kd.to_array()).take(s, "kd");
    /// Specular reflectance K_s, linear RGB. K_d + 4 K_s above 1 reflects more light than arrives.
    ks: vector([0.0; 3], AMOUNT) => |ks| ks.or(before.ks.to_array()).take(s, "ks");
    /// Exponent n_s of the lobe.
    ns: number(8.0, Bounds::Within(0.0, GREATEST_EXPONENT))
        => |ns| ns.or(before.ns).take(s, "ns");
}}

keys! { MATERIAL_KEY: fn material_key(s, before: Brdf) -> MaterialKey { MaterialKey;
    /// Time at which the material has these settings. Times must grow.
    time_s: number(0.0, COORDINATE).required(), "s";
    brdf => brdf(s, before)?;
}}

keys! {
    /// Name of the material. Without it, the only material, or else the one named "cloud".
    MATERIAL_NAME: pub fn material_named(s, materials: &[Material]) -> usize =
        "material": text("cloud") => |name| {
            let name = match materials {
                [only] => name.or(only.name.as_str()),
                _ => name,
            };
            let name = name.take(s, "material")?;
            number_of(s, "material", &name, materials)
        };
}

keys! {
    /// Name of the material of the ground (HGT) under the cloud, or "none" for no ground.
    GROUND: pub fn ground_named(s, materials: &[Material]) -> Option<usize> =
        "ground": text("none") => |name| match name.take(s, "ground")?.as_str() {
            "none" => Ok(None),
            name => number_of(s, "ground", name, materials).map(Some),
        };
}

keys! {
    /// Points of the ground a column, along each side: light between them is linear.
    GROUND_POINTS: pub fn ground_points(s) -> u32 = "ground_points": integer(1, 1, 16);
}

keys! {
    /// Name of the material of an endless plane at sea level, or "none" for no plane.
    PLANE: pub fn plane_named(s, materials: &[Material]) -> Option<usize> =
        "ground": text("none") => |name| match name.take(s, "ground")?.as_str() {
            "none" => Ok(None),
            name => number_of(s, "ground", name, materials).map(Some),
        };
}

/// Keys of `[[material]]`.
pub const KEYS: [Keys; 7] = [MATERIAL, SCATTERING, DROPLET, COVER, LAND, SEA_WIND, BRDF];
/// Keys of the entries of a material's path.
pub const PATH_KEYS: [Keys; 2] = [MATERIAL_KEY, BRDF];

/// Reads every `[[material]]`. Settings that are allowed but hardly meant go to `warnings`.
pub fn read_materials(root: &mut Section, warnings: &mut Vec<String>) -> Result<Vec<Material>> {
    read_tables(root, "material", |s, before: &[Material]| {
        s.expect_keys(names(&KEYS))?;
        let material = material(s)?;
        let name = shown(&material.name);
        if let Some(i) = before.iter().position(|m| m.name == material.name) {
            return Err(s.fault("name", format!("`{name}` is already the name of material {i}")));
        }
        let albedo = material.max_albedo();
        if albedo > 1.0 {
            warnings.push(format!(
                "{}: material `{name}` has K_d + 4 K_s = {albedo:.3}: above 1 it can reflect more \
                 light than it receives",
                s.place("ks")
            ));
        }
        Ok(material)
    })
}

fn read_keys(s: &mut Section) -> Result<Vec<MaterialKey>> {
    if !s.has("path") {
        return Ok(vec![MaterialKey { time_s: 0.0, brdf: brdf(s, PLAIN)? }]);
    }
    let not_both = "a material has either `kd`, `ks`, `ns` or a `path` of them, not both";
    let before = |key: Option<&MaterialKey>| key.map_or(PLAIN, |key| key.brdf);
    read_path(
        s,
        &PATH_KEYS,
        (BRDF, not_both),
        |key| key.time_s,
        |item, key| material_key(item, before(key)),
    )
}

/// Returns the number of the material that `key` names.
fn number_of(s: &Section, key: &str, name: &str, materials: &[Material]) -> Result<usize> {
    let names: Vec<&str> = materials.iter().map(|m| m.name.as_str()).collect();
    names.iter().position(|known| *known == name).ok_or_else(|| {
        let known = match names.is_empty() {
            true => "; the scene has none".to_owned(),
            false => format!("{} the scene has {}", suggestion(name, &names), list_given(&names)),
        };
        s.fault(key, format!("unknown material `{}`{known}", shown(name)))
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::io::document::tree::Document;

    #[test]
    fn the_default_material_is_toml() {
        let mut document = Document::parse("title = ''".to_owned(), Path::new("x.toml")).unwrap();
        document.default_to("material", DEFAULT_MATERIAL);
        let mut root = Section::root(&document).unwrap();
        let material = &read_materials(&mut root, &mut Vec::new()).unwrap()[0];
        assert_eq!((material.name.as_str(), material.at(0.0)), ("cloud", PLAIN));
    }
}
