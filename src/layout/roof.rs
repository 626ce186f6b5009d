//! Push constants of the kernels that measure a device's roofs and that make its caches cold.

use crate::layout::record;

record! {
    /// Push constants of `roof_memory.comp`.
    pub struct MemoryPush {
        /// Number of elements of 16 bytes, a power of two, less 1.
        last: u32,
        /// Elements of a block, divided by 64.
        n_block: u32,
        /// Blocks that a workgroup passes over.
        n_repeat: u32,
        /// Number that is added to every word that is written.
        salt: u32,
    }
}

record! {
    /// Push constants of `roof_arithmetic.comp`.
    pub struct ArithmeticPush {
        /// Loops of [`STEPS`] steps.
        n_loops: u32,
        /// Factor of a step.
        a: u32,
        /// Summand of a step.
        b: u32,
    }
}

record! {
    /// Push constants of `roof_atomics.comp`.
    pub struct AtomicsPush {
        /// Number of counters, a power of two, less 1.
        last: u32,
        /// Additions of an invocation.
        n_loops: u32,
    }
}

/// Invocations of a workgroup of these kernels.
pub const LANES: u32 = 64;
/// Bytes of an element of `roof_memory.comp`.
pub const ELEMENT_BYTES: u64 = 16;
/// Steps of a loop of `roof_arithmetic.comp`.
pub const STEPS: u32 = 16;
/// Chains of an invocation of `roof_arithmetic.comp`: of 64-bit numbers, and of others.
pub const CHAINS: [u32; 2] = [8, 12];
/// `MODE` of `roof_memory.comp`: reads elements of a storage buffer.
pub const READ: u32 = 0;
/// `MODE` of `roof_memory.comp`: reads texels.
pub const READ_TEXELS: u32 = 1;
/// `MODE` of `roof_memory.comp`: writes.
pub const WRITE: u32 = 2;
/// `MODE` of `roof_memory.comp`: copies.
pub const COPY: u32 = 3;
