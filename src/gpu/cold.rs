//! Cold caches: a write of a buffer before each pass, outside of the times of passes.

use super::buffer::Buffer;
use super::kernel::Kernel;

/// A kernel that writes buffers before each pass, so that the pass finds none of its data in a
/// cache.
///
/// A kernel and no fill: it runs on all cores, whose own caches it fills, too, and a driver may
/// fill past the caches.
pub struct ColdCaches {
    /// A kernel with one binding, the buffer that it writes, and push constants of four words.
    pub kernel: Kernel,
    /// The buffers to write, one after the other.
    pub buffers: Vec<Buffer>,
    /// The push constants.
    pub push: [u32; 4],
    /// Workgroups that write a buffer.
    pub n_groups: u32,
}

impl ColdCaches {
    /// Returns the bytes that are written before each pass.
    pub fn bytes(&self) -> u64 {
        self.buffers.iter().map(Buffer::bytes).sum()
    }
}
