//! Cold caches for single passes: before each pass the device writes a buffer of the size of its
//! last cache level.

use std::sync::Arc;

use super::renderer::Renderer;
use crate::error::Result;
use crate::gpu::{Buffer, ColdCaches, Compiler, Device, Kernel, MemoryUsage};
use crate::layout::roof::{ELEMENT_BYTES, LANES, MemoryPush, WRITE};

/// Most workgroups that write a buffer. They fill every GPU.
const MOST_GROUPS: u64 = 4096;
/// Least bytes that are written.
const LEAST_BYTES: u64 = 1 << 20;

impl Renderer {
    /// Makes the device write at least `bytes` before each pass of later frames, outside of the
    /// pass's time. The pictures stay the same, to the byte.
    ///
    /// # Errors
    /// Fails if the device has too little memory or the kernel does not compile.
    pub fn set_cold(&mut self, device: &Device, compiler: &Compiler, bytes: u64) -> Result<()> {
        let cold = Arc::new(cold_caches(device, compiler, bytes)?);
        self.make_cold(&cold);
        Ok(())
    }
}

/// Makes the kernel and the buffers: of one size, a power of two that a binding can hold.
fn cold_caches(device: &Device, compiler: &Compiler, bytes: u64) -> Result<ColdCaches> {
    let most = device.limits().max_storage_buffer_bytes.max(LEAST_BYTES);
    let largest = if most.is_power_of_two() { most } else { most.next_power_of_two() / 2 };
    let each = (bytes / 4).max(LEAST_BYTES).next_power_of_two().min(largest);
    let buffer = |_| {
        let name = "frame.cold";
        Buffer::new::<[u32; 4]>(device, name, each / ELEMENT_BYTES, MemoryUsage::Device)
    };
    let buffers = (0..bytes.div_ceil(each).max(1)).map(buffer).collect::<Result<Vec<_>>>()?;
    let macros = [("MODE", WRITE)];
    let kernel =
        Kernel::with_macros(device, compiler, "roof.memory", MemoryPush::FIELDS, &[], &macros)?;
    let n = each / ELEMENT_BYTES;
    let n_groups = (n / u64::from(LANES)).min(MOST_GROUPS);
    let n_block = n / u64::from(LANES) / n_groups;
    let push = [n as u32 - 1, n_block as u32, 1, 0];
    Ok(ColdCaches { kernel, buffers, push, n_groups: n_groups as u32 })
}
