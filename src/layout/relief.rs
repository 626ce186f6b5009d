//! Records of the boxes over ground.

use glam::DVec3;

use super::record;
use crate::model::relief::{self, ReliefNode};
use crate::model::terrain::Terrain;

/// `i_cell` of a box over several cells.
pub const NO_CELL: u32 = u32::MAX;

record! {
    /// A box over cells of ground, relative to the ground's origin, in its greatest extents. The
    /// boxes within it follow.
    pub struct ReliefNodeRecord {
        /// Low corner.
        low: [f32; 3],
        /// Number of the next box after those within, counted over all grounds.
        end: u32,
        /// High corner.
        high: [f32; 3],
        /// Its cell, or [`NO_CELL`].
        i_cell: u32,
    }
}

/// Least extent that something is divided by. The shader has the same.
const LEAST_EXTENT: f64 = 1e-30;

impl ReliefNodeRecord {
    fn new(node: &ReliefNode, extent: f64, i_first: u32) -> ReliefNodeRecord {
        let scaled = |corner: DVec3| (corner / extent).as_vec3().to_array();
        ReliefNodeRecord {
            low: scaled(node.low),
            end: i_first + node.end,
            high: scaled(node.high),
            i_cell: node.i_cell.unwrap_or(NO_CELL),
        }
    }

    /// Returns the boxes over all grounds, one ground after the other.
    pub fn of(terrains: &[Terrain]) -> Vec<ReliefNodeRecord> {
        let mut all = Vec::new();
        for terrain in terrains {
            let i_first = all.len() as u32;
            let extent = terrain.greatest_extent().max(LEAST_EXTENT);
            let nodes = relief::nodes(terrain);
            all.extend(nodes.iter().map(|node| ReliefNodeRecord::new(node, extent, i_first)));
        }
        all
    }
}
