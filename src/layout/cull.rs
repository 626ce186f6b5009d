//! What `cull` tells of the particles that it keeps (docs/model.md §11 "cull").

use crate::layout::record;

record! {
    /// How many they are, as what comes after asks for it.
    pub struct KeptRecord {
        /// Workgroups that sort them: [n, 1, 1]; their number.
        sort: [u32; 4],
        /// A draw's arguments: vertices, instances, 0, 0.
        draw: [u32; 4],
        /// Workgroups that make splats of them: [n, 1, 1]; 0.
        splat: [u32; 4],
    }
}

impl KeptRecord {
    /// The word that holds their number.
    pub const I_COUNT: u32 = 3;
    /// The first of the three words that hold the sort's workgroups, of the four of a draw's
    /// arguments, and of the three of the splats' workgroups.
    pub const I_SORT: u32 = 0;
    pub const I_DRAW: u32 = 4;
    pub const I_SPLAT: u32 = 8;

    /// Of `n` that the host knows, where a workgroup makes `splat_block` splats.
    pub fn of(n: u32, splat_block: u32) -> KeptRecord {
        // The host that knows their number sorts them by it.
        KeptRecord {
            sort: [0, 1, 1, n],
            draw: [4, n, 0, 0],
            splat: [n.div_ceil(splat_block), 1, 1, 0],
        }
    }
}
