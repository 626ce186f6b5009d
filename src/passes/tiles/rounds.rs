//! The rounds of a frame: how many pairs of bins and splats are held at once.

use super::division::{Division, TILES_ACROSS};
use crate::error::{Error, Result};
use crate::gpu::Limits;
use crate::passes::blobs::{BlobView, Extent};

/// Splats of a block; the shaders' BLOCK.
pub const BLOCK: u32 = 256;
/// Iterations of a tile's loops for each splat, if its invocations are one subgroup: more than the
/// 0.8 that they take with shared memory, and the 0.25 to 0.7 with registers.
const ITERATIONS_OF_SPLAT: u32 = 1;
/// Further ones without subgroup operations, where an invocation also counts what the others have
/// found: 0.8.
const ITERATIONS_OF_COUNT: u32 = 1;
/// Further ones with slices, where splats are taken one by one, with two turns for each eight:
/// 0.75.
const ITERATIONS_OF_SHARES: u32 = 1;
/// The most slices between the nearest and the farthest centre of a frame's blobs: those of a
/// scene, and some for what rounds.
pub const MAX_SLICES: u32 = 1024;
/// Iterations of a tile's loops for each slice: one closes it, one begins its splats.
const ITERATIONS_OF_SLICE: u32 = 2;
/// The most blocks of a frame: workgroups along x that every device has.
const MAX_BLOCKS_OF_FRAME: u32 = 65_535;
/// The most pairs held at once on any device: 512 MiB, and as much for the sort.
const MAX_PAIRS: u64 = 1 << 26;
/// Pairs that an invocation of the sort visits in four iterations: it walks its tiles twice.
const PAIRS_PER_ITERATION: u64 = SORT_TILE / 4;
/// Entries of a tile of the sort.
const SORT_TILE: u64 = 1024;

/// Returns the fours of floats of a pixel that a round hands to the next; the shaders' STATE_FOURS.
pub(super) fn state_fours(slices: u32) -> u64 {
    if slices > 0 { 2 + u64::from(slices) } else { 1 }
}

/// How tiles are composed, as far as the loops of a round depend on it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Form {
    /// A tile's invocations use subgroup operations.
    pub is_one_subgroup: bool,
    /// Slices among which an overlapping blob is dealt; 0 without.
    pub slices: u32,
}

impl Form {
    /// Returns `text`, a further change that a user must make where blobs are composed by slices,
    /// and nothing elsewhere.
    fn remedy_of_slices(self, text: &str) -> &str {
        if self.slices > 0 { text } else { "" }
    }

    /// Returns the most blocks whose splats a tile may take all of, if its loops may have
    /// `iterations`.
    fn most_blocks(self, iterations: u32) -> u32 {
        let without_subgroup = if self.is_one_subgroup { 0 } else { ITERATIONS_OF_COUNT };
        let (of_shares, of_slices) = match self.slices > 0 {
            true => (ITERATIONS_OF_SHARES, ITERATIONS_OF_SLICE * MAX_SLICES),
            false => (0, 0),
        };
        let of_splat = ITERATIONS_OF_SPLAT + without_subgroup + of_shares;
        (iterations.saturating_sub(of_slices) / (of_splat * BLOCK)).clamp(1, MAX_BLOCKS_OF_FRAME)
    }
}

/// The rounds in which a picture is composed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rounds {
    /// Blocks of splats.
    pub n_blocks: u32,
    /// Pairs of a bin and a splat that are held at once.
    pub capacity: u64,
    /// Number of rounds.
    pub n: u32,
    /// The most blocks of a round.
    pub most_blocks: u32,
}

impl Rounds {
    /// Returns the rounds of `n_max` splats; `max_pairs` may lower the pairs held at once.
    pub fn new(
        n_max: u32,
        division: &Division,
        limits: &Limits,
        max_pairs: Option<u64>,
        form: Form,
    ) -> Result<Rounds> {
        let n_blocks = n_max.div_ceil(BLOCK);
        if n_blocks > MAX_BLOCKS_OF_FRAME {
            let most = u64::from(MAX_BLOCKS_OF_FRAME) * u64::from(BLOCK);
            return Err(Error::limit(format!(
                "draw.path = \"tiles\" draws {most} particles at most, the scene has {n_max}; \
                 expected \"sprites\"{}",
                form.remedy_of_slices(" and draw.overlap = \"thin\"")
            )));
        }
        let state_bytes = 16 * state_fours(form.slices);
        let has_state_room = state_bytes * division.n_pixels() <= limits.max_storage_buffer_bytes;
        let all = u64::from(n_max) * u64::from(division.n_bins);
        let a_block = u64::from(BLOCK) * u64::from(division.n_bins);
        let room = limits.max_storage_buffer_bytes.min(limits.device_memory_bytes / 16) / 8;
        // Without room for the state between rounds, one round must hold all pairs.
        let least = if has_state_room { (all / 4).max(1 << 20) } else { all };
        let iterations = limits.max_loop_iterations;
        let by_loops = PAIRS_PER_ITERATION.saturating_mul(u64::from(iterations) + 1);
        let max_pairs = max_pairs.unwrap_or(MAX_PAIRS.min(by_loops));
        let most_blocks = form.most_blocks(iterations);
        let capacity = least.min(all).min(room).min(max_pairs).max(2 * a_block);
        // Every round but the last has less room left than a block may need, or all blocks.
        let n_by_pairs = all.div_ceil(capacity - a_block) as u32;
        let n = if all <= capacity { 1 } else { n_by_pairs } + n_blocks.div_ceil(most_blocks) - 1;
        if n > 1 && !has_state_room {
            return Err(Error::limit(format!(
                "draw.path = \"tiles\", the default: a picture of {}×{} is drawn in rounds where \
                 the scene has {n_max} particles, and {state_bytes} bytes a pixel between them are \
                 more than \
                 this device's {} (maxStorageBufferRange); expected {}draw.path = \"sprites\"",
                division.width,
                division.height,
                limits.max_storage_buffer_bytes,
                form.remedy_of_slices("draw.overlap = \"thin\", or with it ")
            )));
        }
        Ok(Rounds { n_blocks, capacity, n, most_blocks })
    }

    /// Returns the most rounds that a frame needs: all if the places of the blobs are unknown.
    pub fn of_frame(&self, division: &Division, view: &BlobView<'_>) -> u32 {
        let Some(extents) = view.extents else { return self.n };
        let (mut pairs, mut most) = (0, 0);
        for extent in extents {
            let bins = most_bins(division, view, extent);
            pairs += u64::from(extent.n_particles) * bins;
            most = most.max(bins);
        }
        // A round ends before the block that has no room, so that less than a block's pairs of it
        // may be unused; or after the most blocks.
        let used = self.capacity.saturating_sub(u64::from(BLOCK) * most).max(1);
        let by_pairs = if pairs <= self.capacity { 1 } else { pairs.div_ceil(used) };
        let by_blocks = self.n_blocks.div_ceil(self.most_blocks).max(1) - 1;
        by_pairs.saturating_add(by_blocks.into()).min(self.n.into()) as u32
    }
}

/// Returns the most bins that a blob of `extent` reaches.
fn most_bins(division: &Division, view: &BlobView<'_>, extent: &Extent) -> u64 {
    let Division { width, height, n_bins_x, n_bins, .. } = *division;
    let [across, up] = view.widest_of(extent);
    if across == 0.0 {
        return 0;
    }
    if !(across.max(up)).is_finite() {
        return n_bins.into();
    }
    let [bin_width, bin_height] = division.tile.map(|n| f64::from(TILES_ACROSS * n));
    let along = |slopes: f64, tangent: f32, pixels: u32, bin: f64, n_bins: u32| {
        // The picture is 2 tangents wide. A quad is widened by a part of a pixel.
        let reached = (slopes * f64::from(pixels) / (2.0 * f64::from(tangent)) + 2.0) / bin;
        (reached.ceil() as u64).saturating_add(1).min(n_bins.into())
    };
    along(across, view.camera.tan_x, width, bin_width, n_bins_x)
        * along(up, view.camera.tan_y, height, bin_height, n_bins / n_bins_x)
}

#[cfg(test)]
mod tests;
