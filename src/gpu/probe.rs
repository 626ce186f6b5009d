//! What Vulkan says of a device before it is opened, and whether nimbus can use it.

use std::ffi::CStr;

use ash::{khr, vk};

use super::calibration;
use super::device::{DeviceInfo, Limits};
use super::instance::Instance;

/// What is known of a device without opening it.
pub(super) fn describe(
    instance: &Instance,
    index: usize,
    physical: vk::PhysicalDevice,
) -> DeviceInfo {
    let calibrated_timestamps = calibration::probe(instance, physical);
    let has_swapchain = has_extension(instance, physical, khr::swapchain::NAME);
    let instance = &instance.raw;
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut id = vk::PhysicalDeviceIDProperties::default();
    let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
    let mut sizes = vk::PhysicalDeviceSubgroupSizeControlProperties::default();
    let mut all = vk::PhysicalDeviceProperties2::default()
        .push_next(&mut driver)
        .push_next(&mut id)
        .push_next(&mut subgroup)
        .push_next(&mut sizes);
    unsafe { instance.get_physical_device_properties2(physical, &mut all) };
    let properties = all.properties;
    let families = unsafe { instance.get_physical_device_queue_family_properties(physical) };
    let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    let family = families.iter().position(|f| f.queue_flags.contains(wanted));
    let memory = unsafe { instance.get_physical_device_memory_properties(physical) };
    let device_memory_bytes = memory
        .memory_heaps_as_slice()
        .iter()
        .filter(|h| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
        .map(|h| h.size)
        .max();
    let version = properties.api_version;
    let limits = properties.limits;
    let features = unsafe { instance.get_physical_device_features(physical) };
    DeviceInfo {
        index,
        name: text(&properties.device_name),
        driver: format!("{} {}", text(&driver.driver_name), text(&driver.driver_info))
            .trim()
            .to_owned(),
        api_version: (
            vk::api_version_major(version),
            vk::api_version_minor(version),
            vk::api_version_patch(version),
        ),
        kind: kind(properties.device_type),
        uuid: id.device_uuid.iter().map(|b| format!("{b:02x}")).collect(),
        unusable: unusable(instance, physical, version, family),
        limits: Limits {
            max_storage_buffer_bytes: u64::from(limits.max_storage_buffer_range),
            max_texels: u64::from(limits.max_texel_buffer_elements),
            max_workgroups_x: limits.max_compute_work_group_count[0],
            max_workgroup_invocations: limits.max_compute_work_group_invocations,
            max_shared_memory_bytes: limits.max_compute_shared_memory_size,
            max_push_constant_bytes: limits.max_push_constants_size,
            max_image_extent: limits
                .max_image_dimension2_d
                .min(limits.max_framebuffer_width)
                .min(limits.max_framebuffer_height),
            device_memory_bytes: device_memory_bytes.unwrap_or(0),
            subgroup_size: subgroup.subgroup_size,
            subgroup_arithmetic: subgroup
                .supported_operations
                .contains(vk::SubgroupFeatureFlags::ARITHMETIC)
                && subgroup.supported_stages.contains(vk::ShaderStageFlags::COMPUTE),
            subgroup_shuffle: subgroup.supported_operations.contains(
                vk::SubgroupFeatureFlags::BALLOT
                    | vk::SubgroupFeatureFlags::VOTE
                    | vk::SubgroupFeatureFlags::SHUFFLE,
            ) && subgroup
                .supported_stages
                .contains(vk::ShaderStageFlags::COMPUTE),
            subgroup_size_fixed: sizes.min_subgroup_size == sizes.max_subgroup_size,
            subgroup_size_chosen: sizes
                .required_subgroup_size_stages
                .contains(vk::ShaderStageFlags::COMPUTE),
            words_64: features.shader_int64 == vk::TRUE,
            floats_64: features.shader_float64 == vk::TRUE,
            timestamp_valid_bits: family.map_or(0, |i| families[i].timestamp_valid_bits),
            timestamp_period_ns: f64::from(limits.timestamp_period),
        },
        has_swapchain,
        calibrated_timestamps,
        physical,
        queue_family: family.unwrap_or(0) as u32,
    }
}

fn unusable(
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
    version: u32,
    family: Option<usize>,
) -> Option<String> {
    if version < vk::API_VERSION_1_3 {
        return Some("Vulkan 1.3 is needed".into());
    }
    if family.is_none() {
        return Some("no queue for both graphics and compute".into());
    }
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
    let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
    let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut v12).push_next(&mut v13);
    unsafe { instance.get_physical_device_features2(physical, &mut all) };
    let needs = [
        (v12.timeline_semaphore, "timelineSemaphore"),
        (v13.synchronization2, "synchronization2"),
        (v13.dynamic_rendering, "dynamicRendering"),
        (v13.shader_demote_to_helper_invocation, "shaderDemoteToHelperInvocation"),
        (v13.subgroup_size_control, "subgroupSizeControl"),
        (v13.compute_full_subgroups, "computeFullSubgroups"),
    ];
    needs
        .iter()
        .find(|(has, _)| *has == vk::FALSE)
        .map(|(_, name)| format!("feature {name} is missing"))
}

/// What cannot be listed is not there.
pub(super) fn has_extension(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    name: &CStr,
) -> bool {
    let extensions = unsafe { instance.raw.enumerate_device_extension_properties(physical) };
    extensions.is_ok_and(|all| all.iter().any(|e| e.extension_name_as_c_str() == Ok(name)))
}

fn kind(t: vk::PhysicalDeviceType) -> &'static str {
    match t {
        vk::PhysicalDeviceType::DISCRETE_GPU => "discrete",
        vk::PhysicalDeviceType::INTEGRATED_GPU => "integrated",
        vk::PhysicalDeviceType::VIRTUAL_GPU => "virtual",
        vk::PhysicalDeviceType::CPU => "cpu",
        _ => "other",
    }
}

/// A fixed-size C string of Vulkan as text.
fn text(chars: &[std::ffi::c_char]) -> String {
    let bytes: Vec<u8> = chars.iter().map(|c| *c as u8).collect();
    CStr::from_bytes_until_nul(&bytes).map_or(String::new(), |s| s.to_string_lossy().into_owned())
}
