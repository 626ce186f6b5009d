//! Tables `[[ground]]`.

use super::key::{Keys, keys, names, read_tables};
use super::materials::{MATERIAL_NAME, material_named};
use super::spec::{Spec, integer, integers, number, pair, vector};
use crate::error::Result;
use crate::io::bounds::{AMOUNT, COORDINATE, DIVISOR};
use crate::io::document::section::Section;
use crate::model::hills::{Hills, MAX_POINTS};
use crate::model::material::Material;
use crate::model::terrain::Terrain;

fn required_pair() -> Spec<[f64; 2]> {
    pair([1.0; 2], DIVISOR).required()
}

keys! { HILLS: fn hills(s) -> Hills { Hills;
    /// Middle of the ground, at its mean height.
    position: vector([0.0; 3], COORDINATE), "unit";
    /// Lengths eastward (x) and southward (z).
    size: required_pair(), "unit";
    /// Points along both, at each of which light falls on the ground.
    points: integers([64, 64], 2, MAX_POINTS);
    /// Standard deviation of the heights; 0 is level ground.
    relief: number(0.0, AMOUNT), "unit";
    /// Length of the widest hills.
    length ["relief_length"]: number(1.0, DIVISOR), "unit";
    /// Seed of the hills.
    seed: integer(1, 0, u32::MAX);
}}

/// Keys of `[[ground]]`.
pub const KEYS: [Keys; 2] = [HILLS, MATERIAL_NAME];

/// Reads every `[[ground]]`.
pub fn read_grounds(root: &mut Section, materials: &[Material]) -> Result<Vec<Terrain>> {
    read_tables(root, "ground", |s, _| {
        s.expect_keys(names(&KEYS))?;
        let (hills, i_material) = (hills(s)?, material_named(s, materials)?);
        Ok(hills.terrain(i_material))
    })
}
