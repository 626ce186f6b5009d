//! Tables `[[surface]]`.

use super::key::{Keys, keys, names, read_tables};
use super::materials::{MATERIAL_NAME, material_named};
use super::spec::{integers, required_vector};
use crate::error::Result;
use crate::io::bounds::{COORDINATE, GREATEST, LEAST, rounded, shortest};
use crate::io::document::section::Section;
use crate::model::material::Material;
use crate::model::surface::Surface;

const MAX_SUBDIVIDE: u32 = 4096;
/// |cos| of the angle between u and v below which they count as perpendicular: digits as people
/// type them leave an angle that is right to about six of them.
const SQUARE: f64 = 1e-6;

keys! { SURFACE: fn surface(s, materials: &[Material]) -> Surface { Surface;
    /// Centre of the rectangle.
    center: required_vector(COORDINATE), "unit";
    /// Half axis; u × v is the side that is lit.
    u: required_vector(COORDINATE), "unit";
    /// Half axis, perpendicular to u.
    v: required_vector(COORDINATE), "unit";
    i_material => material_named(s, materials)?;
    /// Facets along u and along v.
    subdivide: integers([8, 8], 1, MAX_SUBDIVIDE);
}}

/// Keys of `[[surface]]`.
pub const KEYS: [Keys; 2] = [SURFACE, MATERIAL_NAME];

/// Reads every `[[surface]]`.
pub fn read_surfaces(root: &mut Section, materials: &[Material]) -> Result<Vec<Surface>> {
    read_tables(root, "surface", |s, _| {
        s.expect_keys(names(&KEYS))?;
        let surface = surface(s, materials)?;
        for (key, axis) in [("u", surface.u), ("v", surface.v)] {
            let length = axis.length();
            if !(LEAST..=GREATEST).contains(&length) {
                let (least, most) = (shortest(LEAST), shortest(GREATEST));
                let found = rounded(length);
                let what = format!("expected a half axis {least} to {most} long, found {found}");
                return Err(s.fault(key, what));
            }
        }
        let cosine = surface.u.normalize().dot(surface.v.normalize());
        if cosine.abs() > SQUARE {
            let cosine = rounded(cosine);
            let what = format!(
                "expected a half axis perpendicular to `u`, found the cosine {cosine} between them"
            );
            return Err(s.fault("v", what));
        }
        Ok(surface)
    })
}
