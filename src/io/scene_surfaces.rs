//! The scene's surfaces.

use serde_json::json;

use super::magnitude::{COORDINATE, GREATEST, LEAST, shortest};
use super::scene_lights::material_named;
use super::toml_section::Section;
use crate::error::Result;
use crate::model::material::Material;
use crate::model::surface::Surface;

/// Facets along each side, where the scene does not say.
const DEFAULT_SUBDIVIDE: [u32; 2] = [8, 8];
const MAX_SUBDIVIDE: u32 = 4096;
/// |cos| of the angle between u and v, below which they are perpendicular but for the rounding of typed digits.
const SQUARE: f64 = 1e-6;

pub fn read_surfaces(root: &mut Section, materials: &[Material]) -> Result<Vec<Surface>> {
    let mut surfaces = Vec::new();
    let mut resolved = Vec::new();
    for mut s in root.sections("surface")? {
        s.expect_keys(&["center", "u", "v", "material", "subdivide"], &[])?;
        let center = s.required_vec3("center", COORDINATE)?;
        let (u, v) = (s.required_vec3("u", COORDINATE)?, s.required_vec3("v", COORDINATE)?);
        for (key, axis) in [("u", u), ("v", v)] {
            if !(LEAST..=GREATEST).contains(&axis.length()) {
                let (least, greatest) = (shortest(LEAST), shortest(GREATEST));
                let what = format!(
                    "expected a half axis {least} to {greatest} long, found {:.3e}",
                    axis.length()
                );
                return Err(s.fault(key, what));
            }
        }
        let cosine = u.normalize().dot(v.normalize());
        if cosine.abs() > SQUARE {
            let what = format!(
                "expected a half axis perpendicular to `u`, found the cosine {cosine:.3e} \
                 between them"
            );
            return Err(s.fault("v", what));
        }
        let i_material = material_named(&mut s, materials)?;
        let subdivide = s.u32_pair("subdivide", DEFAULT_SUBDIVIDE, 1, MAX_SUBDIVIDE)?;
        surfaces.push(Surface { center, u, v, i_material, subdivide });
        resolved.push(s.finish());
    }
    root.record("surface", json!(resolved));
    Ok(surfaces)
}
