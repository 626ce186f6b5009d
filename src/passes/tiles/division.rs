//! How a picture is divided into bins of tiles, and tiles into rows of pixels.

use crate::error::{Error, Result};
use crate::gpu::Limits;

/// An invocation's pixels; the shader's RUN.
pub const RUN: u32 = 8;
/// Tiles along a bin's side; the shaders' TILES_ACROSS.
pub const TILES_ACROSS: u32 = 4;
/// Bins: twice a block's worst pairs are as many as there may be at once then.
const MOST_BINS: u32 = 1 << 15;

/// How the picture is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Division {
    pub width: u32,
    pub height: u32,
    /// Invocations of a workgroup, and pixels of its tile.
    pub(super) invocations: u32,
    pub(super) tile: [u32; 2],
    pub(super) n_bins_x: u32,
    pub n_bins: u32,
}

impl Division {
    /// `width` × `height` pixels by workgroups of so many invocations. An error where there would
    /// be too many bins.
    pub fn of(width: u32, height: u32, invocations: u32) -> Result<Division> {
        let rows = if invocations <= 16 { 8 } else { 16 };
        let tile = [RUN * (invocations / rows), rows];
        let [n_bins_x, n_bins_y] =
            [width.div_ceil(TILES_ACROSS * tile[0]), height.div_ceil(TILES_ACROSS * tile[1])];
        match n_bins_x.checked_mul(n_bins_y) {
            Some(n_bins) if n_bins <= MOST_BINS => {
                Ok(Division { width, height, invocations, tile, n_bins_x, n_bins })
            }
            _ => Err(Error::limit(format!(
                "draw.path = \"tiles\": {width} x {height} pixels are more than its {MOST_BINS} \
                 bins of {} x {}; expected \"sprites\"",
                TILES_ACROSS * tile[0],
                TILES_ACROSS * tile[1]
            ))),
        }
    }

    /// Bits of a bin's number.
    pub fn n_bits(&self) -> u32 {
        (self.n_bins - 1).max(1).ilog2() + 1
    }

    /// Tiles of all bins.
    pub fn n_tiles(&self) -> u64 {
        u64::from(self.n_bins) * u64::from(TILES_ACROSS * TILES_ACROSS)
    }

    pub(super) fn n_pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

/// Invocations of a workgroup: one subgroup.
pub fn invocations(limits: &Limits) -> u32 {
    limits.subgroup_size.clamp(8, 64)
}
