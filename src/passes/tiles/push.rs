//! Push constants of the pass's shaders.

use crate::layout::frame::CameraRecord;
use crate::layout::record;

record! {
    /// Push constants of `tiles_splat.comp`.
    pub struct SplatPush {
        camera: CameraRecord,
        pixel: [f32; 2],
        cutoff: f32,
        i_first_facet: u32,
        width: u32,
        height: u32,
        tile_width: u32,
        tile_height: u32,
        inv_threshold: f32,
    }
}

record! {
    /// Push constants of `tiles_rounds.comp`.
    pub struct RoundsPush {
        n_rounds: u32,
        capacity: u32,
        most_blocks: u32,
        sort_tile: u32,
        bin_groups: u32,
    }
}

record! {
    /// Push constants of `tiles_clear.comp`.
    pub struct ClearPush { n_pixels: u32, unused: u32 }
}

record! {
    /// Push constants of `tiles_pairs.comp`.
    pub struct PairsPush {
        tangents: [f32; 2],
        tile: [f32; 2],
        n_bins_x: u32,
        i_round: u32,
        cut: f32,
        inv_threshold: f32,
    }
}

record! {
    /// Push constants of `tiles_ranges.comp`.
    pub struct RangesPush { n_bins: u32, i_round: u32, max_groups: u32, most_tiles: u32 }
}

record! {
    /// Push constants of `tiles.comp`.
    pub struct Push {
        tangents: [f32; 2],
        pixel: [f32; 2],
        width: u32,
        height: u32,
        n_bins_x: u32,
        i_round: u32,
        cut: f32,
        saturated: f32,
        inv_threshold: f32,
        /// The scene's y along right, up and forward.
        y_right: f32,
        y_up: f32,
        y_forward: f32,
    }
}
