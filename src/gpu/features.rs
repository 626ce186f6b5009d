//! Features of Vulkan 1.2 and 1.3 that devices are opened with.

use ash::{khr, vk};

use super::extensions::has_extension;
use super::limits::Limits;

/// Returns the features that nimbus enables: those that it needs, and 16-bit floats where the
/// device has them.
pub(super) fn enabled(
    limits: &Limits,
) -> (vk::PhysicalDeviceVulkan12Features<'static>, vk::PhysicalDeviceVulkan13Features<'static>) {
    let v12 = vk::PhysicalDeviceVulkan12Features::default()
        .timeline_semaphore(true)
        .shader_float16(limits.has_float16);
    // `discard` compiles to demotion.
    let v13 = vk::PhysicalDeviceVulkan13Features::default()
        .synchronization2(true)
        .dynamic_rendering(true)
        .shader_demote_to_helper_invocation(true)
        .subgroup_size_control(true)
        .compute_full_subgroups(true);
    (v12, v13)
}

/// Returns whether shaders of a device can compute with 16-bit floats.
pub(super) fn has_float16(instance: &ash::Instance, physical: vk::PhysicalDevice) -> bool {
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
    let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut v12);
    // A device that is older than Vulkan 1.2 leaves the structure as it is.
    unsafe { instance.get_physical_device_features2(physical, &mut all) };
    v12.shader_float16 == vk::TRUE
}

/// Returns the pixels along a side of the largest point, see [`Limits::max_point_size`].
pub(super) fn max_point_size(
    features: &vk::PhysicalDeviceFeatures,
    limits: &vk::PhysicalDeviceLimits,
) -> f32 {
    // sprites.vert widens points by this POINT_STEP.
    const MOST_GRANULARITY: f32 = 0.125;
    match features.large_points == vk::TRUE && limits.point_size_granularity <= MOST_GRANULARITY {
        true => limits.point_size_range[1],
        false => 0.0,
    }
}

/// Returns whether a device tells when the pictures that it presents are visible.
pub(super) fn has_present_wait(instance: &ash::Instance, physical: vk::PhysicalDevice) -> bool {
    let extensions = [khr::swapchain::NAME, khr::present_id::NAME, khr::present_wait::NAME];
    if !extensions.iter().all(|name| has_extension(instance, physical, name)) {
        return false;
    }
    let mut id = vk::PhysicalDevicePresentIdFeaturesKHR::default();
    let mut wait = vk::PhysicalDevicePresentWaitFeaturesKHR::default();
    let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut id).push_next(&mut wait);
    unsafe { instance.get_physical_device_features2(physical, &mut all) };
    [id.present_id, wait.present_wait] == [vk::TRUE; 2]
}

/// Returns the invocations that a workgroup may have along x, the only axis that kernels use.
pub(super) fn max_workgroup_invocations(limits: &vk::PhysicalDeviceLimits) -> u32 {
    limits.max_compute_work_group_invocations.min(limits.max_compute_work_group_size[0])
}

/// Returns the most storage buffers that one stage of a pipeline with one set can bind.
pub(super) fn max_storage_buffers(limits: &vk::PhysicalDeviceLimits) -> u32 {
    limits.max_per_stage_descriptor_storage_buffers.min(limits.max_descriptor_set_storage_buffers)
}
