//! Push constants of the pass's shaders.

use crate::layout::frame::CameraRecord;
use crate::layout::record;

record! {
    /// Push constants of `tiles_splat.comp`.
    pub struct SplatPush {
        /// The camera.
        camera: CameraRecord,
        /// Sides of a pixel, as slopes.
        pixel: [f32; 2],
        /// Radius of a blob's footprint, in σ.
        cutoff: f32,
        /// Facet of the first particle.
        i_first_facet: u32,
        /// Columns of the picture.
        width: u32,
        /// Rows of the picture.
        height: u32,
        /// Columns of a tile.
        tile_width: u32,
        /// Rows of a tile.
        tile_height: u32,
        /// One over the optical depth at which a blob ends.
        inv_threshold: f32,
        /// Least b²/(2 σ²) at which a blob ends.
        least_cut: f32,
    }
}

record! {
    /// Push constants of `tiles_rounds.comp`.
    pub struct RoundsPush {
        /// Number of rounds.
        n_rounds: u32,
        /// The most pairs of a round.
        capacity: u32,
        /// The most blocks of a round.
        most_blocks: u32,
        /// Entries that a workgroup of the sort takes.
        sort_tile: u32,
        /// Workgroups that find the bins' ranges.
        bin_groups: u32,
    }
}

record! {
    /// Push constants of `tiles_clear.comp`.
    pub struct ClearPush {
        /// Fours of the state.
        n_fours: u32,
        /// Padding.
        unused: u32,
    }
}

record! {
    /// Push constants of `tiles_pairs.comp`.
    pub struct PairsPush {
        /// Greatest slopes of the view.
        tangents: [f32; 2],
        /// Sides of a tile, as slopes.
        tile: [f32; 2],
        /// Columns of bins.
        n_bins_x: u32,
        /// The round.
        i_round: u32,
        /// b²/(2 σ²) at the cutoff, in powers of two.
        cut: f32,
        /// One over the optical depth at which a blob ends.
        inv_threshold: f32,
        /// Least b²/(2 σ²) at which a blob ends.
        least_cut: f32,
    }
}

record! {
    /// Push constants of `tiles_ranges.comp`.
    pub struct RangesPush {
        /// Number of bins.
        n_bins: u32,
        /// The round.
        i_round: u32,
        /// The most workgroups along x of a dispatch.
        max_groups: u32,
        /// The most tiles that a workgroup draws.
        most_tiles: u32,
    }
}

record! {
    /// Push constants of `tiles.comp`.
    pub struct Push {
        /// Greatest slopes of the view.
        tangents: [f32; 2],
        /// Sides of a pixel, as slopes.
        pixel: [f32; 2],
        /// Columns of the picture.
        width: u32,
        /// Rows of the picture.
        height: u32,
        /// Columns of bins.
        n_bins_x: u32,
        /// The round.
        i_round: u32,
        /// b²/(2 σ²) at the cutoff, in powers of two.
        cut: f32,
        /// Transmittance below which a pixel is opaque.
        saturated: f32,
        /// One over the optical depth at which a blob ends.
        inv_threshold: f32,
        /// Least b²/(2 σ²) at which a blob ends.
        least_cut: f32,
        /// The scene's y along the camera's right.
        y_right: f32,
        /// The scene's y along the camera's up.
        y_up: f32,
        /// The scene's y along the camera's forward.
        y_forward: f32,
        /// The near plane's distance over the thickness of a slice; 0 without slices.
        near_in_slices: f32,
    }
}
