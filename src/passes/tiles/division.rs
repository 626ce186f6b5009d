//! The division of a picture into bins of tiles, and of tiles into rows of pixels.

use crate::error::{Error, Result};
use crate::gpu::Limits;

/// Pixels of an invocation; the shader's RUN.
pub const RUN: u32 = 8;
/// Tiles along a side of a bin; the shaders' TILES_ACROSS.
pub const TILES_ACROSS: u32 = 4;
/// The most bins: twice the most pairs of a block is then the most pairs held at once.
const MAX_BINS: u32 = 1 << 15;

/// The tiles and bins of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Division {
    /// Columns of the picture.
    pub width: u32,
    /// Rows of the picture.
    pub height: u32,
    /// Invocations of a workgroup, which composes a tile.
    pub(super) invocations: u32,
    /// Columns and rows of a tile.
    pub(super) tile: [u32; 2],
    pub(super) n_bins_x: u32,
    /// Number of bins.
    pub n_bins: u32,
}

impl Division {
    /// Divides `width` × `height` pixels into tiles of workgroups of `invocations`.
    ///
    /// # Errors
    /// Fails if there would be too many bins.
    pub fn new(width: u32, height: u32, invocations: u32) -> Result<Division> {
        let rows = if invocations <= 16 { 8 } else { 16 };
        let tile = [RUN * (invocations / rows), rows];
        let [bin_width, bin_height] = tile.map(|n| TILES_ACROSS * n);
        let n_bins_x = width.div_ceil(bin_width);
        match n_bins_x.checked_mul(height.div_ceil(bin_height)) {
            Some(n_bins) if n_bins <= MAX_BINS => {
                Ok(Division { width, height, invocations, tile, n_bins_x, n_bins })
            }
            _ => Err(Error::limit(format!(
                "draw.path = \"tiles\": {width} x {height} pixels are more than its {MAX_BINS} \
                 bins of {bin_width} x {bin_height}; expected \"sprites\""
            ))),
        }
    }

    /// Returns the number of bits of a bin's index.
    pub fn n_bits(&self) -> u32 {
        (self.n_bins - 1).max(1).ilog2() + 1
    }

    /// Returns the number of tiles of all bins.
    pub(super) fn n_tiles(&self) -> u64 {
        u64::from(self.n_bins) * u64::from(TILES_ACROSS * TILES_ACROSS)
    }

    /// Returns the number of pixels of the picture.
    pub fn n_pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

/// Returns the invocations of a workgroup: one subgroup.
pub fn invocations(limits: &Limits) -> u32 {
    limits.subgroup_size.clamp(8, 64)
}
