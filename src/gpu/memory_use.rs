//! The device memory in use: by nimbus as it allocates, and by the process as the driver tells.

use std::sync::Arc;

use ash::{ext, vk};

use super::device::Device;
use super::extensions::has_extension;
use super::instance::Instance;
use super::memory_count::MemoryCount;

/// Device-local memory at one moment, in bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DeviceMemory {
    /// Buffers and images of nimbus.
    pub own: u64,
    /// The most of them since the reading before.
    pub own_peak: u64,
    /// Use of the whole process as the driver tells it (VK_EXT_memory_budget), if it does. The
    /// driver counts whole blocks and its own memory, too.
    pub process: Option<u64>,
}

/// A reader of the memory of an open device, for any thread.
#[derive(Clone)]
pub struct MemoryProbe {
    own: Arc<MemoryCount>,
    budget: Option<(Arc<Instance>, vk::PhysicalDevice)>,
}

impl Device {
    /// Returns a reader of the device's memory. It does not keep the device open.
    pub fn memory_probe(&self) -> MemoryProbe {
        let (shared, physical) = (self.shared(), self.info().physical);
        let instance = &shared.instance;
        let has_budget = has_extension(&instance.vulkan.raw, physical, ext::memory_budget::NAME);
        MemoryProbe {
            own: shared.memory_count.clone(),
            budget: has_budget.then(|| (instance.clone(), physical)),
        }
    }

    /// Returns major and minor number of the device's primary node in /dev/dri, where the driver
    /// tells them (VK_EXT_physical_device_drm).
    pub fn drm_node(&self) -> Option<[i64; 2]> {
        let (instance, physical) = (&self.shared().instance.vulkan.raw, self.info().physical);
        if !has_extension(instance, physical, ext::physical_device_drm::NAME) {
            return None;
        }
        let mut drm = vk::PhysicalDeviceDrmPropertiesEXT::default();
        let mut all = vk::PhysicalDeviceProperties2::default().push_next(&mut drm);
        unsafe { instance.get_physical_device_properties2(physical, &mut all) };
        (drm.has_primary == vk::TRUE).then_some([drm.primary_major, drm.primary_minor])
    }
}

impl MemoryProbe {
    /// Returns whether the driver tells the use of the whole process.
    pub fn has_budget(&self) -> bool {
        self.budget.is_some()
    }

    /// Returns the memory in use. The next peak counts from here.
    pub fn read(&self) -> DeviceMemory {
        let (own, own_peak) = self.own.take();
        DeviceMemory { own, own_peak, process: self.budget.as_ref().map(process_bytes) }
    }
}

/// Returns the use of all device-local heaps.
fn process_bytes((instance, physical): &(Arc<Instance>, vk::PhysicalDevice)) -> u64 {
    let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
    let mut all = vk::PhysicalDeviceMemoryProperties2::default().push_next(&mut budget);
    unsafe { instance.vulkan.raw.get_physical_device_memory_properties2(*physical, &mut all) };
    let memory = all.memory_properties;
    let heaps = memory.memory_heaps_as_slice().iter().zip(budget.heap_usage);
    let local = heaps.filter(|(heap, _)| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL));
    local.map(|(_, used)| used).sum()
}

const _: () = {
    const fn is_for_any_thread<T: Send + Sync>() {}
    is_for_any_thread::<MemoryProbe>();
};
