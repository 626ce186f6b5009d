//! An open Vulkan device: its queue, its allocator and its leak report.

use std::ffi::CStr;
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::prelude::VkResult;
use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};

use super::call::Call;
use super::capture::Capture;
use super::device_info::DeviceInfo;
use super::device_options::DeviceOptions;
use super::executed::Executed;
use super::fault;
use super::features;
use super::guard::Guards;
use super::instance::Instance;
use super::kept_pipelines::KeptPipelines;
use super::limits::Limits;
use super::memory_count::MemoryCount;
use super::over_limit::OverLimit;
use super::pass_times::PassTimes;
use super::statistics::{PipelineReport, Reports};
use super::tick_clock::TickClock;
use crate::error::{Error, Result};

/// An open device.
///
/// Dropping it reports every allocation that is still alive to the instance's messages.
pub struct Device {
    shared: Arc<SharedDevice>,
    info: DeviceInfo,
}

/// The part of a device that every resource holds on to; destroyed with the last of them.
pub(super) struct SharedDevice {
    pub raw: ash::Device,
    queue: Mutex<vk::Queue>,
    pub queue_family: u32,
    pub limits: Limits,
    pub allocator: ManuallyDrop<Arc<Mutex<Allocator>>>,
    /// Device-local memory in use.
    pub memory_count: Arc<MemoryCount>,
    /// Timestamps, which may wrap, as times that do not.
    pub tick_clock: TickClock,
    /// Names and labels for the tools that show them.
    pub debug: Option<ext::debug_utils::Device>,
    /// The guard bands of buffers, where they are wanted.
    pub guards: Option<Guards>,
    /// Most nanoseconds that a submission is predicted to take, if there is a limit.
    pub max_submit_ns: Option<f64>,
    /// Pipelines that cannot keep to it.
    pub over_limit: OverLimit,
    /// The way in which the times of passes are taken.
    pub pass_times: PassTimes,
    /// Submissions that ended.
    pub executed: Executed,
    /// Whether the device may be at work for ever, so that nothing that it may use can be freed.
    is_abandoned: AtomicBool,
    /// Whether the times at which presented pictures are visible can be asked for.
    #[cfg(feature = "window")]
    pub tells_shown: bool,
    /// Whether commands can count invocations.
    pub counts_invocations: bool,
    /// The frame to capture, if one is to be captured.
    pub capture: Option<Capture>,
    /// Compute pipelines for kernels that are made again.
    pub pipelines: KeptPipelines,
    /// Reports on new pipelines, where they are wanted.
    pub reports: Option<Reports>,
    /// Where the driver says why the device was lost, if it does.
    faults: Option<ext::device_fault::Device>,
    pub instance: Arc<Instance>,
}

impl Device {
    /// Opens the device that [`DeviceInfo::choose`] chooses.
    ///
    /// # Errors
    /// No device matches, or the driver fails to open it.
    pub fn open(instance: &Arc<Instance>, choice: Option<&str>) -> Result<Device> {
        Device::with_options(instance, choice, &DeviceOptions::default())
    }

    /// Opens a device with options.
    ///
    /// # Errors
    /// Fails as [`Device::open`] does.
    pub fn with_options(
        instance: &Arc<Instance>,
        choice: Option<&str>,
        options: &DeviceOptions,
    ) -> Result<Device> {
        let capture = options.captured_frame.map(Capture::new).transpose()?;
        let info = DeviceInfo::choose(DeviceInfo::list(instance)?, choice)?;
        let mut info = match &options.limits {
            Some(limits) => info.lowered(limits),
            None => info,
        };
        if options.pass_times == PassTimes::Off {
            info.limits.timestamp_valid_bits = 0;
        }
        let has_statistics = options.reports_pipelines && info.has_pipeline_statistics;
        let counts_invocations = options.counts_on(&instance.vulkan.raw, info.physical);
        let raw = create(instance, &info, options, has_statistics, counts_invocations)?;
        let queue = unsafe { raw.get_device_queue(info.queue_family, 0) };
        let mut debug_settings = gpu_allocator::AllocatorDebugSettings::default();
        // Device::drop reports leaks itself, into the messages that tests read.
        debug_settings.log_leaks_on_shutdown = false;
        let desc = AllocatorCreateDesc {
            instance: instance.vulkan.raw.clone(),
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
        let debug = instance
            .vulkan
            .has_debug_utils
            .then(|| ext::debug_utils::Device::new(&instance.vulkan.raw, &raw));
        let statistics = has_statistics
            .then(|| khr::pipeline_executable_properties::Device::new(&instance.vulkan.raw, &raw));
        let faults =
            info.tells_faults.then(|| ext::device_fault::Device::new(&instance.vulkan.raw, &raw));
        instance.messages().claim(raw.handle());
        instance.messages().claim(queue);
        let shared = Arc::new(SharedDevice {
            raw,
            queue: Mutex::new(queue),
            queue_family: info.queue_family,
            limits: info.limits,
            allocator: ManuallyDrop::new(Arc::new(Mutex::new(allocator))),
            memory_count: Arc::default(),
            tick_clock: TickClock::new(&info.limits),
            debug,
            guards: options.guard.then(Guards::default),
            max_submit_ns: options.max_submit_ns(info.kind),
            over_limit: OverLimit::default(),
            pass_times: options.pass_times,
            executed: Executed::default(),
            is_abandoned: AtomicBool::new(false),
            #[cfg(feature = "window")]
            tells_shown: presents(instance, &info) && info.tells_shown,
            counts_invocations,
            capture,
            pipelines: KeptPipelines::default(),
            reports: options.reports_pipelines.then(|| Reports::new(statistics)),
            faults,
            instance: instance.clone(),
        });
        Ok(Device { shared, info })
    }

    /// Returns the number of submissions that have ended, and of those that were not executed,
    /// although the driver said that they were done.
    pub fn executed(&self) -> (u64, u64) {
        self.shared.executed.counts()
    }

    /// Returns the properties of the device.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// Returns the limits of the device.
    pub fn limits(&self) -> &Limits {
        &self.info.limits
    }

    /// Returns the number of compute pipelines that are kept for kernels that are made again.
    pub fn n_kept_pipelines(&self) -> usize {
        self.shared.pipelines.len()
    }

    /// Takes the reports on pipelines that were made since the last call; none without
    /// [`DeviceOptions::reports_pipelines`].
    pub fn take_pipeline_reports(&self) -> Vec<PipelineReport> {
        self.shared.reports.as_ref().map_or(vec![], Reports::take)
    }

    /// Returns notes on work that takes longer than a submission is to take; each once.
    pub fn take_over_limit(&self) -> Vec<String> {
        self.shared.max_submit_ns.map_or(vec![], |limit| self.shared.over_limit.take(limit))
    }

    /// Returns the bytes allocated on the device at present.
    pub fn allocated_bytes(&self) -> u64 {
        self.shared.lock_allocator().generate_report().total_allocated_bytes
    }

    pub(super) fn format_features(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        let instance = &self.shared.instance.vulkan.raw;
        unsafe { instance.get_physical_device_format_properties(self.info.physical, format) }
            .optimal_tiling_features
    }

    #[cfg(feature = "window")]
    pub(super) fn physical(&self) -> vk::PhysicalDevice {
        self.info.physical
    }

    pub(super) fn shared(&self) -> &Arc<SharedDevice> {
        &self.shared
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        if self.shared.is_abandoned() {
            return;
        }
        // An error here is a lost device, which the call that lost it has reported.
        let _ = unsafe { self.shared.raw.device_wait_idle() };
        // They hold on to the device.
        self.shared.pipelines.clear();
        let report = self.shared.lock_allocator().generate_report();
        let messages = self.shared.instance.messages();
        for leak in &report.allocations {
            messages.push(format!("leak: {} ({} bytes)", leak.name, leak.size));
        }
    }
}

impl SharedDevice {
    pub fn lock_allocator(&self) -> MutexGuard<'_, Allocator> {
        self.allocator.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Locks the queue: one thread at a time may submit to it.
    pub fn lock_queue(&self) -> MutexGuard<'_, vk::Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the flags with which pipelines are made on this device.
    pub fn pipeline_flags(&self) -> vk::PipelineCreateFlags {
        self.reports.as_ref().map_or(vk::PipelineCreateFlags::empty(), Reports::flags)
    }

    /// Returns the flags with which compute pipelines are made. Where submissions have a limit,
    /// their workgroups can be dispatched in parts.
    pub fn kernel_flags(&self) -> vk::PipelineCreateFlags {
        let parts = match self.max_submit_ns {
            Some(_) => vk::PipelineCreateFlags::DISPATCH_BASE,
            None => vk::PipelineCreateFlags::empty(),
        };
        self.pipeline_flags() | parts
    }

    /// Keeps a report on a new pipeline, if the device was opened for reports.
    pub fn report(&self, raw: vk::Pipeline, name: &str, variant: &[(&str, u32)]) -> Result<()> {
        self.reports.as_ref().map_or(Ok(()), |reports| reports.add(raw, name, variant))
    }

    /// Turns the result of a call that can lose the device into ours. A loss comes with what the
    /// driver says of it.
    pub fn outcome<T>(&self, result: VkResult<T>, call: &str, object: &str) -> Result<T> {
        let is_lost = matches!(result, Err(vk::Result::ERROR_DEVICE_LOST));
        let told = self.faults.as_ref().filter(|_| is_lost).and_then(fault::told);
        result.of_call(call, object).map_err(|e| match told {
            Some(told) => e.with_note(&told),
            None => e,
        })
    }

    /// Makes it safe to drop the buffers of a submission after the wait for it has failed. Waits
    /// for the whole device, or abandons the device if that wait may never end or fails, too.
    pub fn settle(&self, failure: vk::Result) {
        let is_idle = match failure {
            vk::Result::ERROR_DEVICE_LOST => true,
            vk::Result::TIMEOUT => false,
            _ => {
                let _queue = self.lock_queue();
                let waited = unsafe { self.raw.device_wait_idle() };
                matches!(waited, Ok(()) | Err(vk::Result::ERROR_DEVICE_LOST))
            }
        };
        if !is_idle {
            self.is_abandoned.store(true, Ordering::Relaxed);
        }
    }

    /// Whether the device was given up. It and its objects then live until the process exits.
    pub fn is_abandoned(&self) -> bool {
        self.is_abandoned.load(Ordering::Relaxed)
    }

    /// Names a new handle and returns it as an owned one that `destroy` destroys.
    pub fn own<H: vk::Handle + Copy>(
        self: &Arc<Self>,
        raw: H,
        name: &str,
        destroy: Destroy<H>,
    ) -> Owned<H> {
        self.name(raw, name);
        Owned { raw, destroy, shared: self.clone() }
    }
}

impl Drop for SharedDevice {
    fn drop(&mut self) {
        if self.is_abandoned() {
            return;
        }
        // SAFETY: the last owner; every resource held an Arc of this and is destroyed. The
        // allocator frees its blocks through the device and so goes first.
        unsafe {
            ManuallyDrop::drop(&mut self.allocator);
            self.raw.destroy_device(None);
        }
    }
}

/// The function of a device that destroys a kind of handle.
pub(super) type Destroy<H> = unsafe fn(&ash::Device, H, Option<&vk::AllocationCallbacks<'_>>);

/// A Vulkan object that is destroyed when it is dropped.
///
/// The owner must first have waited for all commands that use the object.
pub(super) struct Owned<H: vk::Handle + Copy> {
    pub raw: H,
    destroy: Destroy<H>,
    shared: Arc<SharedDevice>,
}

impl<H: vk::Handle + Copy> Drop for Owned<H> {
    fn drop(&mut self) {
        if !self.shared.is_abandoned() {
            // SAFETY: the handle was made by this device and nobody else destroys it.
            unsafe { (self.destroy)(&self.shared.raw, self.raw, None) };
        }
    }
}

/// Whether a device is opened to present to windows.
fn presents(instance: &Instance, info: &DeviceInfo) -> bool {
    !instance.vulkan.surface_extensions.is_empty() && info.has_swapchain
}

fn create(
    instance: &Instance,
    info: &DeviceInfo,
    options: &DeviceOptions,
    has_statistics: bool,
    counts_invocations: bool,
) -> Result<ash::Device> {
    let priorities = [1.0];
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(info.queue_family)
        .queue_priorities(&priorities)];
    let (mut v12, mut v13) = features::enabled(&info.limits);
    let presents = presents(instance, info);
    let swapchain = presents.then_some(khr::swapchain::NAME);
    let tells_shown = presents && info.tells_shown;
    let [present_id, present_wait] =
        [khr::present_id::NAME, khr::present_wait::NAME].map(|name| tells_shown.then_some(name));
    let statistics = has_statistics.then_some(khr::pipeline_executable_properties::NAME);
    // A device that has it demands that it is enabled.
    let portable = info.is_portable.then_some(khr::portability_subset::NAME);
    let faults = info.tells_faults.then_some(ext::device_fault::NAME);
    let calibration = info.clock_calibration.map(|calibration| calibration.extension);
    let optional = [calibration, swapchain, present_id, present_wait, statistics, portable, faults];
    let extensions: Vec<_> = optional.into_iter().flatten().map(CStr::as_ptr).collect();
    let mut fault = vk::PhysicalDeviceFaultFeaturesEXT::default().device_fault(true);
    let mut executables = vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default()
        .pipeline_executable_info(true);
    let mut ids = vk::PhysicalDevicePresentIdFeaturesKHR::default().present_id(true);
    let mut waits = vk::PhysicalDevicePresentWaitFeaturesKHR::default().present_wait(true);
    let features = vk::PhysicalDeviceFeatures::default()
        .shader_int64(info.limits.has_int64)
        .shader_float64(info.limits.has_float64)
        .pipeline_statistics_query(counts_invocations)
        .large_points(info.limits.max_point_size > 1.0)
        // A read far beyond the end must not end the process.
        .robust_buffer_access(options.guard);
    let mut create = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .enabled_features(&features)
        .push_next(&mut v12)
        .push_next(&mut v13);
    if has_statistics {
        create = create.push_next(&mut executables);
    }
    if tells_shown {
        create = create.push_next(&mut ids).push_next(&mut waits);
    }
    if info.tells_faults {
        create = create.push_next(&mut fault);
    }
    unsafe { instance.vulkan.raw.create_device(info.physical, &create, None) }
        .of_call("vkCreateDevice", "")
}
