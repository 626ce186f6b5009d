//! The rounds of a frame: how many pairs of bins and splats are held at once.

use super::division::Division;
use crate::error::{Error, Result};
use crate::gpu::Limits;

/// Splats of a block; the shaders' BLOCK.
pub const BLOCK: u32 = 256;
/// The most blocks of a round. A tile's loops take up to 0.8 iterations a splat, and llvmpipe ends
/// all loops of an invocation after 65 535 iterations.
pub(super) const MAX_BLOCKS: u32 = 256;
/// The most blocks of a frame: workgroups along x that every device has.
const MAX_BLOCKS_OF_FRAME: u32 = 65_535;
/// The most pairs held at once: the sort visits its tiles of 1024 twice in an invocation, and
/// llvmpipe's loops take 65 535 iterations.
const MAX_PAIRS: u64 = 1 << 24;
/// Bytes of a pixel that a round hands to the next: four floats.
const STATE_BYTES: u64 = 16;

/// The rounds in which a picture is composed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rounds {
    /// Blocks of splats.
    pub n_blocks: u32,
    /// Pairs of a bin and a splat that are held at once.
    pub capacity: u64,
    /// Number of rounds.
    pub n: u32,
}

impl Rounds {
    /// Returns the rounds of `n_max` splats; `max_pairs` may lower the pairs held at once.
    pub fn new(
        n_max: u32,
        division: &Division,
        limits: &Limits,
        max_pairs: Option<u64>,
    ) -> Result<Rounds> {
        let n_blocks = n_max.div_ceil(BLOCK);
        if n_blocks > MAX_BLOCKS_OF_FRAME {
            let most = u64::from(MAX_BLOCKS_OF_FRAME) * u64::from(BLOCK);
            return Err(Error::limit(format!(
                "draw.path = \"tiles\" draws {most} particles at most, the scene has {n_max}; \
                 expected \"sprites\""
            )));
        }
        let has_state_room = STATE_BYTES * division.n_pixels() <= limits.max_storage_buffer_bytes;
        let all = u64::from(n_max) * u64::from(division.n_bins);
        let a_block = u64::from(BLOCK) * u64::from(division.n_bins);
        let room = limits.max_storage_buffer_bytes.min(limits.device_memory_bytes / 16) / 8;
        // Without room for the state between rounds, one round must hold all pairs.
        let least = if has_state_room { (all / 4).max(1 << 20) } else { all };
        let max_pairs = max_pairs.unwrap_or(MAX_PAIRS);
        let capacity = least.min(all).min(room).min(max_pairs).max(2 * a_block);
        // Every round but the last has less room left than a block may need, or MAX_BLOCKS blocks.
        let n_by_pairs = all.div_ceil(capacity - a_block) as u32;
        let n = if all <= capacity { 1 } else { n_by_pairs } + n_blocks.div_ceil(MAX_BLOCKS) - 1;
        if n > 1 && !has_state_room {
            return Err(Error::limit(format!(
                "draw.path = \"tiles\", the default: a picture of {}×{} is drawn in rounds where \
                 the scene has {n_max} particles, and 16 bytes a pixel between them are more than \
                 this device's {} (maxStorageBufferRange); expected draw.path = \"sprites\"",
                division.width, division.height, limits.max_storage_buffer_bytes
            )));
        }
        Ok(Rounds { n_blocks, capacity, n })
    }
}
