//! Device memory: allocations that are named `room.thing` and freed when they are dropped.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use gpu_allocator::{AllocationError, MemoryLocation};

use super::device::SharedDevice;
use crate::error::{Error, Result};

/// Memory of a buffer or an image.
pub(super) struct Memory {
    /// None only while it is dropped.
    allocation: Option<Allocation>,
    /// Its bytes, if it is memory of the device.
    local_bytes: u64,
    shared: Arc<SharedDevice>,
}

impl Memory {
    /// Allocates memory; `is_linear` for buffers, false for images.
    ///
    /// # Errors
    /// The device has too little memory left, or the driver fails.
    pub fn new(
        shared: &Arc<SharedDevice>,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        is_linear: bool,
    ) -> Result<Memory> {
        let desc = AllocationCreateDesc {
            name,
            requirements,
            location,
            linear: is_linear,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        let allocation = shared.lock_allocator().allocate(&desc).map_err(|e| {
            let bytes = format!("{} bytes of device memory", requirements.size);
            match e {
                AllocationError::OutOfMemory => Error::limit(format!("{name}: {bytes}: {e}")),
                AllocationError::Internal(why) => {
                    Error::vulkan(format!("allocating {name}"), format!("{bytes}: {why}"))
                }
                e => Error::vulkan(format!("allocating {name}"), format!("{bytes}: {e}")),
            }
        })?;
        let local = vk::MemoryPropertyFlags::DEVICE_LOCAL;
        let is_local = allocation.memory_properties().contains(local);
        let local_bytes = if is_local { allocation.size() } else { 0 };
        shared.memory_count.add(local_bytes);
        Ok(Memory { allocation: Some(allocation), local_bytes, shared: shared.clone() })
    }

    /// Returns the memory block and the offset in it, in bytes.
    pub fn place(&self) -> (vk::DeviceMemory, u64) {
        let null = (vk::DeviceMemory::null(), 0);
        // SAFETY: the block lives as long as the allocation.
        self.allocation.as_ref().map_or(null, |a| (unsafe { a.memory() }, a.offset()))
    }

    /// Returns the device that it was allocated on.
    pub fn shared(&self) -> &SharedDevice {
        &self.shared
    }

    /// Returns the bytes as the host sees them; none in memory that the host cannot map.
    pub fn mapped(&self) -> Option<&[u8]> {
        self.allocation.as_ref()?.mapped_slice()
    }

    /// The same, to be written.
    pub fn mapped_mut(&mut self) -> Option<&mut [u8]> {
        self.allocation.as_mut()?.mapped_slice_mut()
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        self.shared.memory_count.remove(self.local_bytes);
        if let Some(allocation) = self.allocation.take()
            && !self.shared.is_abandoned()
        {
            // Freeing fails only for an allocation of another allocator, which this is not.
            let _ = self.shared.lock_allocator().free(allocation);
        }
    }
}
