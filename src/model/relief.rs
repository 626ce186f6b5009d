//! Boxes over ground, by which light's way past it is found (model.md §16).

use std::ops::Range;

use glam::DVec3;

use super::light::Light;
use super::terrain::Terrain;

/// A box over cells of a terrain. Boxes lie in depth-first order: those within a box follow it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReliefNode {
    /// Low corner, relative to the terrain's origin.
    pub low: DVec3,
    /// High corner.
    pub high: DVec3,
    /// Number of the first box after those within.
    pub end: u32,
    /// The cell, where the box has only one.
    pub i_cell: Option<u32>,
}

/// Returns the number of boxes over a terrain.
pub fn n_nodes(terrain: &Terrain) -> u64 {
    (2 * terrain.n_cells()).saturating_sub(1)
}

/// Returns the boxes over a terrain, the one over all of it first.
pub fn nodes(terrain: &Terrain) -> Vec<ReliefNode> {
    let mut all = Vec::with_capacity(n_nodes(terrain) as usize);
    if terrain.n_cells() > 0 {
        let [columns, rows] = terrain.n.map(|n| 0..n - 1);
        add(&mut all, terrain, columns, rows);
    }
    all
}

/// Adds the boxes over a rectangle of cells, and returns its corners. Halving the longer side
/// leaves at most 64 calls within each other.
fn add(
    all: &mut Vec<ReliefNode>,
    terrain: &Terrain,
    columns: Range<u32>,
    rows: Range<u32>,
) -> (DVec3, DVec3) {
    let i_own = all.len();
    let unknown = ReliefNode { low: DVec3::ZERO, high: DVec3::ZERO, end: 0, i_cell: None };
    all.push(unknown);
    let halves = |of: Range<u32>| {
        let middle = of.start + (of.end - of.start) / 2;
        [of.start..middle, middle..of.end]
    };
    let (low, high) = match [columns.len(), rows.len()] {
        [1, 1] => {
            let i_cell = rows.start * (terrain.n[0] - 1) + columns.start;
            all[i_own].i_cell = Some(i_cell);
            let points = terrain.corners(i_cell).map(|k| terrain.points[k]);
            let start = (points[0], points[0]);
            points.iter().fold(start, |(low, high), p| (low.min(*p), high.max(*p)))
        }
        [n_columns, n_rows] => {
            let parts = match n_columns >= n_rows {
                true => halves(columns).map(|columns| (columns, rows.clone())),
                false => halves(rows).map(|rows| (columns.clone(), rows)),
            };
            let [a, b] = parts.map(|(columns, rows)| add(all, terrain, columns, rows));
            (a.0.min(b.0), a.1.max(b.1))
        }
    };
    let end = all.len() as u32;
    let own = &mut all[i_own];
    (own.low, own.high, own.end) = (low, high, end);
    (low, high)
}

/// Returns whether ground may hide a light from ground: without heights, none does.
pub fn may_hide(terrains: &[Terrain], lights: &[Light]) -> bool {
    let is_level = |t: &Terrain| {
        let (low, high) = t.extent();
        low.y == high.y
    };
    let has_relief = terrains.len() > 1 || !terrains.iter().all(is_level);
    has_relief && lights.iter().any(|light| !light.is_sky())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    /// Points of a unit grid whose heights count up.
    fn stairs(n: [u32; 2]) -> Terrain {
        let at = |k: u32| DVec3::new((k % n[0]).into(), k.into(), -f64::from(k / n[0]));
        let points = Arc::new((0..n[0] * n[1]).map(at).collect());
        Terrain { origin: DVec3::ZERO, points, n, ..Terrain::default() }
    }

    #[test]
    fn every_cell_has_a_box_within_those_around_it() {
        for n in [[2, 2], [3, 2], [2, 9], [8, 5]] {
            let terrain = stairs(n);
            let all = nodes(&terrain);
            assert_eq!(all.len() as u64, n_nodes(&terrain));
            let mut cells: Vec<u32> = all.iter().filter_map(|node| node.i_cell).collect();
            cells.sort();
            assert!(cells.into_iter().map(u64::from).eq(0..terrain.n_cells()));
            assert_eq!((all[0].low, all[0].high), terrain.extent());
            for (i, node) in all.iter().enumerate() {
                let within = &all[i + 1..node.end as usize];
                assert_eq!(within.is_empty(), node.i_cell.is_some());
                for inner in within {
                    assert!(inner.end <= node.end);
                    assert!(node.low.cmple(inner.low).all() && node.high.cmpge(inner.high).all());
                }
            }
        }
    }

    #[test]
    fn a_cells_box_by_hand() {
        // Cell 3 of 4 x 3 points lies between points 4, 5, 8 and 9.
        let all = nodes(&stairs([4, 3]));
        let cell = all.iter().find(|node| node.i_cell == Some(3)).unwrap();
        assert_eq!(cell.low, DVec3::new(0.0, 4.0, -2.0));
        assert_eq!(cell.high, DVec3::new(1.0, 9.0, -1.0));
    }

    #[test]
    fn level_ground_and_a_sky_hide_nothing() {
        let sun = Light::Directional { direction: DVec3::NEG_Y, irradiance: DVec3::ONE };
        let sky = Light::even_sky(DVec3::ONE, 0.0);
        let hills = stairs([3, 3]);
        let level = Terrain {
            points: Arc::new(hills.points.iter().map(|p| DVec3::new(p.x, 0.0, p.z)).collect()),
            ..hills.clone()
        };
        let [hills, level] = [[hills], [level]];
        assert!(may_hide(&hills, &[sun, sky]) && !may_hide(&hills, &[sky]));
        assert!(!may_hide(&level, &[sun]) && !may_hide(&[], &[sun]));
        assert!(may_hide(&[level.clone(), level].concat(), &[sun]));
    }
}
