//! The record by which `cull` passes on the number of kept particles (passes.md
//! "cull").

use crate::layout::record;

record! {
    /// The number of kept particles, as the dispatches and draws that follow need it.
    pub struct KeptRecord {
        /// Workgroups that sort the particles: [n, 1, 1]; the number of particles.
        sort: [u32; 4],
        /// Arguments of a draw: vertices, instances, 0, 0.
        draw: [u32; 4],
        /// Workgroups that make splats of the particles: [n, 1, 1]; 0.
        splat: [u32; 4],
        /// Arguments of a draw of points: vertices, instances, 0, 0.
        points: [u32; 4],
    }
}

impl KeptRecord {
    /// The word that holds the number of particles.
    pub const I_COUNT: u32 = 3;
    /// The first of the three words with the sort's workgroups.
    pub const I_SORT: u32 = 0;
    /// The first of the four words of the draw.
    pub const I_DRAW: u32 = 4;
    /// The first of the three words with the splats' workgroups.
    pub const I_SPLAT: u32 = 8;
    /// The first of the four words of the draw of points.
    pub const I_POINTS: u32 = 12;

    /// Returns the record of `n` particles that the host knows, where a workgroup makes
    /// `splat_block` splats. The host sorts by its own number, so the sort has no workgroups here.
    pub fn of(n: u32, splat_block: u32) -> KeptRecord {
        KeptRecord {
            sort: [0, 1, 1, n],
            draw: [4, n, 0, 0],
            splat: [n.div_ceil(splat_block), 1, 1, 0],
            points: [n, 1, 0, 0],
        }
    }
}
