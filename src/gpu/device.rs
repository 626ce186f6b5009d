//! Choosing and opening a Vulkan device; its limits; the allocator and its leak report.

use std::ffi::CStr;
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};

use super::instance::Instance;
use super::probe::describe;
use crate::error::{Error, Result};

/// What is known of a device before it is opened.
#[derive(Debug, Clone)]
pub struct DeviceInfo {
    pub index: usize,
    pub name: String,
    pub driver: String,
    pub api_version: (u32, u32, u32),
    pub kind: &'static str,
    pub uuid: String,
    /// Why nimbus cannot use it, if it cannot.
    pub unusable: Option<String>,
    pub limits: Limits,
    /// Whether it can show pictures in windows.
    pub has_swapchain: bool,
    /// The extension by which the device's clock and the host's can be read at one moment, where
    /// there is one.
    pub calibrated_timestamps: Option<&'static CStr>,
    pub(super) physical: vk::PhysicalDevice,
    pub(super) queue_family: u32,
}

/// The limits that nimbus's wishes are checked against.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Bytes of one storage buffer that a shader can see.
    pub max_storage_buffer_bytes: u64,
    /// Of a texel buffer.
    pub max_texels: u64,
    /// Workgroups along x of one dispatch.
    pub max_workgroups_x: u32,
    pub max_workgroup_invocations: u32,
    pub max_shared_memory_bytes: u32,
    pub max_push_constant_bytes: u32,
    pub max_image_extent: u32,
    /// Size of the greatest device-local heap.
    pub device_memory_bytes: u64,
    pub subgroup_size: u32,
    /// Whether compute shaders may sum and compare over a subgroup.
    pub subgroup_arithmetic: bool,
    /// Whether they may vote over it, count votes, and read what another invocation has.
    pub subgroup_shuffle: bool,
    /// There are no subgroups of another size.
    pub subgroup_size_fixed: bool,
    /// A kernel can ask for subgroups of that size.
    pub subgroup_size_chosen: bool,
    /// Shaders may have words of 64 bits.
    pub words_64: bool,
    /// And floats of 64 bits.
    pub floats_64: bool,
    /// 0 where the queue has no timestamps.
    pub timestamp_valid_bits: u32,
    pub timestamp_period_ns: f64,
}

impl Limits {
    /// Whether a workgroup of so many invocations can be sure to be one subgroup, and whose
    /// invocations know of each other.
    pub fn is_one_subgroup(&self, n_invocations: u32) -> bool {
        self.subgroup_shuffle
            && self.subgroup_size == n_invocations
            && (self.subgroup_size_fixed || self.subgroup_size_chosen)
    }

    /// Nanoseconds from the device's own zero to a timestamp of its queue.
    pub(super) fn ticks_ns(&self, ticks: u64) -> f64 {
        (ticks & self.tick_mask()) as f64 * self.timestamp_period_ns
    }

    /// The bits of a timestamp that count.
    pub(super) fn tick_mask(&self) -> u64 {
        u64::MAX.checked_shr(64 - self.timestamp_valid_bits).unwrap_or(0)
    }
}

/// An open device. Dropping it reports every allocation that is still alive to the instance's
/// messages.
pub struct Device {
    shared: Arc<Shared>,
    info: DeviceInfo,
}

/// What every resource holds on to; destroyed with the last of them.
pub(super) struct Shared {
    pub raw: ash::Device,
    queue: Mutex<vk::Queue>,
    pub queue_family: u32,
    pub limits: Limits,
    pub allocator: ManuallyDrop<Arc<Mutex<Allocator>>>,
    debug: Option<ext::debug_utils::Device>,
    /// Buffers are filled with NaN when they are made.
    pub poisons: AtomicBool,
    pub instance: Arc<Instance>,
}

impl Device {
    /// Every Vulkan device, usable or not, in the loader's order.
    pub fn list(instance: &Instance) -> Result<Vec<DeviceInfo>> {
        let physical = unsafe { instance.raw.enumerate_physical_devices() }
            .map_err(|e| Error::vulkan("vkEnumeratePhysicalDevices", e))?;
        Ok(physical.into_iter().enumerate().map(|(i, p)| describe(instance, i, p)).collect())
    }

    /// Opens the device named by `choice` (an index, or part of a name), else the best one:
    /// discrete, then integrated, virtual, CPU.
    pub fn open(instance: &Arc<Instance>, choice: Option<&str>) -> Result<Device> {
        let info = Self::choose(Self::list(instance)?, choice)?;
        let raw = create(instance, &info)?;
        let queue = unsafe { raw.get_device_queue(info.queue_family, 0) };
        let mut debug_settings = gpu_allocator::AllocatorDebugSettings::default();
        // Device::drop reports leaks itself, into the messages that tests read.
        debug_settings.log_leaks_on_shutdown = false;
        let desc = AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: raw.clone(),
            physical_device: info.physical,
            debug_settings,
            buffer_device_address: false,
            allocation_sizes: gpu_allocator::AllocationSizes::default(),
        };
        let allocator = Allocator::new(&desc).map_err(|e| {
            unsafe { raw.destroy_device(None) };
            Error::vulkan("creating the allocator", e)
        })?;
        let debug =
            instance.has_debug_utils.then(|| ext::debug_utils::Device::new(&instance.raw, &raw));
        let shared = Arc::new(Shared {
            raw,
            queue: Mutex::new(queue),
            queue_family: info.queue_family,
            limits: info.limits,
            allocator: ManuallyDrop::new(Arc::new(Mutex::new(allocator))),
            debug,
            poisons: AtomicBool::new(false),
            instance: instance.clone(),
        });
        Ok(Device { shared, info })
    }

    /// The device that [`Device::open`] would take of `devices`.
    pub fn choose(devices: Vec<DeviceInfo>, choice: Option<&str>) -> Result<DeviceInfo> {
        let names: Vec<String> =
            devices.iter().map(|d| format!("{}: {}", d.index, d.name)).collect();
        let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        let unknown = |text: &str| {
            Err(Error::usage(format!(
                "--device \"{text}\": expected an index or a part of a name; found: {names}"
            )))
        };
        let found = match choice.map(str::trim) {
            // Part of every name, and hardly meant: an unset variable in a script.
            Some("") => return unknown(""),
            None => {
                let rank = |d: &DeviceInfo| {
                    ["discrete", "integrated", "virtual", "cpu"]
                        .iter()
                        .position(|k| *k == d.kind)
                        .unwrap_or(9)
                };
                devices.into_iter().filter(|d| d.unusable.is_none()).min_by_key(rank)
            }
            Some(text) => {
                // Names hold numbers too: "4090".
                let index = text
                    .parse()
                    .ok()
                    .and_then(|index: usize| devices.iter().position(|d| d.index == index));
                let named = || {
                    devices
                        .iter()
                        .position(|d| d.name.to_lowercase().contains(&text.to_lowercase()))
                };
                index.or_else(named).map(|i| devices[i].clone())
            }
        };
        match (found, choice) {
            (None, None) => Err(Error::vulkan(
                "device choice",
                format!(
                    "no usable Vulkan 1.3 device (found: {names}); tools/bootstrap installs a \
                     software one"
                ),
            )),
            (None, Some(text)) => unknown(text),
            (Some(device), _) => match &device.unusable {
                Some(why) => Err(Error::vulkan("device choice", format!("{}: {why}", device.name))),
                None => Ok(device),
            },
        }
    }

    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// From now on every buffer is made full of NaN, so that what is read before it is written
    /// shows.
    pub fn poison(&self) {
        self.shared.poisons.store(true, Ordering::Relaxed);
    }

    pub fn limits(&self) -> &Limits {
        &self.info.limits
    }

    pub(super) fn format_features(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        let instance = &self.shared.instance.raw;
        unsafe { instance.get_physical_device_format_properties(self.info.physical, format) }
            .optimal_tiling_features
    }

    #[cfg(feature = "window")]
    pub(super) fn physical(&self) -> vk::PhysicalDevice {
        self.info.physical
    }

    pub(super) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    /// Bytes allocated on the device at present.
    pub fn allocated_bytes(&self) -> u64 {
        self.shared.lock_allocator().generate_report().total_allocated_bytes
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // An error here is a lost device, which the call that lost it has reported.
        let _ = unsafe { self.shared.raw.device_wait_idle() };
        let report = self.shared.lock_allocator().generate_report();
        for leak in &report.allocations {
            self.shared
                .instance
                .messages()
                .push(format!("leak: {} ({} bytes)", leak.name, leak.size));
        }
    }
}

impl Shared {
    pub fn lock_allocator(&self) -> std::sync::MutexGuard<'_, Allocator> {
        self.allocator.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// One thread at a time may hand something to the device.
    pub fn lock_queue(&self) -> std::sync::MutexGuard<'_, vk::Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Names a handle for validation messages and frame debuggers.
    pub fn name<H: vk::Handle>(&self, handle: H, name: &str) {
        let Some(debug) = &self.debug else { return };
        let Ok(name) = std::ffi::CString::new(name) else { return };
        let info =
            vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        // A name that cannot be set is no reason to stop.
        let _ = unsafe { debug.set_debug_utils_object_name(&info) };
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        // SAFETY: the last owner; every resource held an Arc of this and is destroyed. The
        // allocator frees its blocks through the device and so goes first.
        unsafe {
            ManuallyDrop::drop(&mut self.allocator);
            self.raw.destroy_device(None);
        }
    }
}

fn create(instance: &Instance, info: &DeviceInfo) -> Result<ash::Device> {
    let priorities = [1.0];
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(info.queue_family)
        .queue_priorities(&priorities)];
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default().timeline_semaphore(true);
    // Demotion is what `discard` compiles to.
    let mut v13 = vk::PhysicalDeviceVulkan13Features::default()
        .synchronization2(true)
        .dynamic_rendering(true)
        .shader_demote_to_helper_invocation(true)
        .subgroup_size_control(true)
        .compute_full_subgroups(true);
    let swapchain = (instance.has_surfaces && info.has_swapchain).then_some(khr::swapchain::NAME);
    let extensions: Vec<_> =
        info.calibrated_timestamps.into_iter().chain(swapchain).map(CStr::as_ptr).collect();
    let create = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions);
    let features = vk::PhysicalDeviceFeatures::default()
        .shader_int64(info.limits.words_64)
        .shader_float64(info.limits.floats_64);
    let create = create.enabled_features(&features).push_next(&mut v12).push_next(&mut v13);
    unsafe { instance.raw.create_device(info.physical, &create, None) }
        .map_err(|e| Error::vulkan("vkCreateDevice", e))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn device(index: usize, name: &str, kind: &'static str) -> DeviceInfo {
        let limits = Limits {
            max_storage_buffer_bytes: 0,
            max_texels: 0,
            max_workgroups_x: 0,
            max_workgroup_invocations: 0,
            max_shared_memory_bytes: 0,
            max_push_constant_bytes: 0,
            max_image_extent: 0,
            device_memory_bytes: 0,
            subgroup_size: 0,
            subgroup_arithmetic: false,
            subgroup_shuffle: false,
            subgroup_size_fixed: false,
            subgroup_size_chosen: false,
            words_64: false,
            floats_64: false,
            timestamp_valid_bits: 0,
            timestamp_period_ns: 0.0,
        };
        DeviceInfo {
            index,
            name: name.to_owned(),
            driver: String::new(),
            api_version: (1, 3, 0),
            kind,
            uuid: String::new(),
            unusable: None,
            limits,
            has_swapchain: false,
            calibrated_timestamps: None,
            physical: vk::PhysicalDevice::null(),
            queue_family: 0,
        }
    }

    #[test]
    fn a_device_is_chosen_by_index_or_name_or_kind() {
        let devices = || {
            vec![device(0, "llvmpipe (LLVM 15)", "cpu"), device(1, "GeForce RTX 4090", "discrete")]
        };
        let chosen = |choice| Device::choose(devices(), choice).map(|d| d.index);
        assert_eq!(chosen(None), Ok(1));
        assert_eq!(chosen(Some("0")), Ok(0));
        assert_eq!(chosen(Some("4090")), Ok(1));
        assert_eq!(chosen(Some("GEFORCE")), Ok(1));
        // 1 is an index although it stands in both names.
        assert_eq!(chosen(Some("1")), Ok(1));
        assert_eq!(chosen(Some("15")), Ok(0));
        for wrong in ["", "  ", "7", "Radeon"] {
            let error = chosen(Some(wrong)).expect_err(wrong);
            assert_eq!(error.exit_code(), 2);
            let said = error.to_string();
            assert!(said.contains("0: llvmpipe (LLVM 15), 1: GeForce RTX 4090"), "{said}");
        }
    }
}
