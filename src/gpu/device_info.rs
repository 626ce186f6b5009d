//! Properties and limits of a Vulkan device before it is opened, and the choice among devices.

use std::ffi::CStr;

use ash::{ext, khr, vk};

use super::advice::no_driver;
use super::call::Call;
use super::extensions::has_extension;
use super::host_clock::{self, ClockCalibration};
use super::instance::Instance;
use super::limits::{LLVMPIPE_ITERATIONS, Limits};
use super::{fault, features};
use crate::error::{Error, Result};

/// Properties of a device that need no opening.
#[derive(Debug, Clone)]
pub struct DeviceInfo {
    /// Its place in the loader's order.
    pub index: usize,
    /// The driver's name of it.
    pub name: String,
    /// The driver's name and version.
    pub driver: String,
    /// Major, minor and patch version of Vulkan.
    pub api_version: (u32, u32, u32),
    /// "discrete", "integrated", "virtual", "cpu" or "other".
    pub kind: &'static str,
    /// VkPhysicalDeviceIDProperties::deviceUUID in hexadecimal.
    pub uuid: String,
    /// The maker's number in PCI, or of Khronos.
    pub vendor: u32,
    /// Its address on the PCI bus, such as 0000:03:00.0, where the driver tells it.
    pub pci_address: Option<String>,
    /// The reason why nimbus cannot use it, where there is one.
    pub unusable: Option<String>,
    /// Its limits.
    pub limits: Limits,
    /// Whether it can present to windows.
    pub has_swapchain: bool,
    /// Whether it tells when presented pictures are visible (VK_KHR_present_wait).
    pub tells_shown: bool,
    /// The way in which the device reads its clock and the host's at one moment, where it can.
    pub clock_calibration: Option<ClockCalibration>,
    /// Whether the device is one over another API (VK_KHR_portability_subset), such as MoltenVK's.
    /// nimbus uses nothing that such a device may lack.
    pub is_portable: bool,
    /// Whether the driver describes the pipelines that it makes.
    pub has_pipeline_statistics: bool,
    /// Whether the driver says why a device was lost (VK_EXT_device_fault).
    pub tells_faults: bool,
    pub(super) physical: vk::PhysicalDevice,
    pub(super) queue_family: u32,
}

impl DeviceInfo {
    /// Lists every Vulkan device, usable or not, in the loader's order. The list is empty where no
    /// driver has a device.
    ///
    /// # Errors
    /// The driver fails to enumerate its devices.
    pub fn list(instance: &Instance) -> Result<Vec<DeviceInfo>> {
        let physical = match unsafe { instance.vulkan.raw.enumerate_physical_devices() } {
            // The loader's answer where no driver has a device.
            Err(vk::Result::ERROR_INITIALIZATION_FAILED) => vec![],
            listed => listed.of_call("vkEnumeratePhysicalDevices", "")?,
        };
        let describe = |(index, physical)| DeviceInfo::describe(instance, index, physical);
        Ok(physical.into_iter().enumerate().map(describe).collect())
    }

    /// Chooses the device named by `choice` (digits are an index, other text is part of one name),
    /// else the best one: discrete, then integrated, virtual, CPU.
    ///
    /// # Errors
    /// No device matches, several do, or the named one is unusable. The message lists the devices.
    pub fn choose(devices: Vec<DeviceInfo>, choice: Option<&str>) -> Result<DeviceInfo> {
        let names: Vec<String> =
            devices.iter().map(|d| format!("{}: {}", d.index, d.name)).collect();
        let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        let Some(text) = choice.map(str::trim) else {
            const KINDS: [&str; 4] = ["discrete", "integrated", "virtual", "cpu"];
            let rank = |d: &DeviceInfo| KINDS.iter().position(|kind| *kind == d.kind).unwrap_or(9);
            let usable = devices.into_iter().filter(|d| d.unusable.is_none());
            return usable.min_by_key(rank).ok_or_else(|| {
                let what = format!("no usable Vulkan 1.3 device (found: {names}); {}", no_driver());
                Error::vulkan("device choice", what)
            });
        };
        match &named(&devices, text)[..] {
            [DeviceInfo { name, unusable: Some(why), .. }] => {
                Err(Error::vulkan("device choice", format!("{name}: {why}")))
            }
            [device] => Ok((*device).clone()),
            [] => {
                let no_index = if is_index(text) { "no device has this index; " } else { "" };
                Err(Error::usage(format!(
                    "--device \"{text}\": {no_index}expected an index or a part of a name; found: \
                     {names}"
                )))
            }
            several => {
                let all: Vec<String> =
                    several.iter().map(|d| format!("{}: {}", d.index, d.name)).collect();
                Err(Error::usage(format!(
                    "--device \"{text}\" is part of {} names ({}); expected the index of one",
                    several.len(),
                    all.join(", ")
                )))
            }
        }
    }

    fn describe(instance: &Instance, index: usize, physical: vk::PhysicalDevice) -> DeviceInfo {
        let vulkan = &instance.vulkan.raw;
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut id = vk::PhysicalDeviceIDProperties::default();
        let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
        let mut sizes = vk::PhysicalDeviceSubgroupSizeControlProperties::default();
        let mut buffers = vk::PhysicalDeviceMaintenance4Properties::default();
        let mut all = vk::PhysicalDeviceProperties2::default()
            .push_next(&mut driver)
            .push_next(&mut id)
            .push_next(&mut subgroup)
            .push_next(&mut sizes)
            .push_next(&mut buffers);
        unsafe { vulkan.get_physical_device_properties2(physical, &mut all) };
        let properties = all.properties;
        let families = unsafe { vulkan.get_physical_device_queue_family_properties(physical) };
        let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        let family = families.iter().position(|f| f.queue_flags.contains(wanted));
        let heaps = unsafe { vulkan.get_physical_device_memory_properties(physical) };
        let local = |heap: &&vk::MemoryHeap| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL);
        let memory_bytes = heaps.memory_heaps_as_slice().iter().filter(local).map(|h| h.size).max();
        let version = properties.api_version;
        let limits = properties.limits;
        let features = unsafe { vulkan.get_physical_device_features(physical) };
        let in_compute =
            |stages: vk::ShaderStageFlags| stages.contains(vk::ShaderStageFlags::COMPUTE);
        let has_subgroup = |operations| {
            in_compute(subgroup.supported_stages)
                && subgroup.supported_operations.contains(operations)
        };
        use vk::SubgroupFeatureFlags as Subgroup;
        DeviceInfo {
            index,
            name: text(properties.device_name_as_c_str()),
            driver: [driver.driver_name_as_c_str(), driver.driver_info_as_c_str()]
                .map(text)
                .join(" ")
                .trim()
                .to_owned(),
            api_version: (
                vk::api_version_major(version),
                vk::api_version_minor(version),
                vk::api_version_patch(version),
            ),
            kind: match properties.device_type {
                vk::PhysicalDeviceType::DISCRETE_GPU => "discrete",
                vk::PhysicalDeviceType::INTEGRATED_GPU => "integrated",
                vk::PhysicalDeviceType::VIRTUAL_GPU => "virtual",
                vk::PhysicalDeviceType::CPU => "cpu",
                _ => "other",
            },
            uuid: id.device_uuid.iter().map(|b| format!("{b:02x}")).collect(),
            vendor: properties.vendor_id,
            pci_address: pci_address(vulkan, physical),
            unusable: unusable(vulkan, physical, version, family),
            limits: Limits {
                max_storage_buffer_bytes: u64::from(limits.max_storage_buffer_range),
                max_buffer_bytes: buffers.max_buffer_size,
                max_storage_buffers: features::max_storage_buffers(&limits),
                max_texels: u64::from(limits.max_texel_buffer_elements),
                max_workgroups_x: limits.max_compute_work_group_count[0],
                max_workgroup_invocations: features::max_workgroup_invocations(&limits),
                max_shared_memory_bytes: limits.max_compute_shared_memory_size,
                max_push_constant_bytes: limits.max_push_constants_size,
                max_image_extent: limits
                    .max_image_dimension2_d
                    .min(limits.max_framebuffer_width)
                    .min(limits.max_framebuffer_height),
                max_point_size: features::max_point_size(&features, &limits),
                device_memory_bytes: memory_bytes.unwrap_or(0),
                subgroup_size: subgroup.subgroup_size,
                has_subgroup_arithmetic: has_subgroup(Subgroup::ARITHMETIC),
                has_subgroup_shuffle: has_subgroup(
                    Subgroup::BALLOT | Subgroup::VOTE | Subgroup::SHUFFLE,
                ),
                is_subgroup_size_fixed: sizes.min_subgroup_size == sizes.max_subgroup_size,
                can_choose_subgroup_size: in_compute(sizes.required_subgroup_size_stages),
                has_int64: features.shader_int64 == vk::TRUE,
                has_float64: features.shader_float64 == vk::TRUE,
                has_float16: features::has_float16(vulkan, physical),
                max_loop_iterations: match driver.driver_id {
                    vk::DriverId::MESA_LLVMPIPE => LLVMPIPE_ITERATIONS,
                    _ => u32::MAX,
                },
                timestamp_valid_bits: family.map_or(0, |i| families[i].timestamp_valid_bits),
                timestamp_period_ns: f64::from(limits.timestamp_period),
            },
            has_swapchain: has_extension(vulkan, physical, khr::swapchain::NAME),
            tells_shown: features::has_present_wait(vulkan, physical),
            clock_calibration: clock_calibration(instance, physical),
            is_portable: has_extension(vulkan, physical, khr::portability_subset::NAME),
            has_pipeline_statistics: has_pipeline_statistics(vulkan, physical),
            tells_faults: has_extension(vulkan, physical, ext::device_fault::NAME)
                && fault::is_told(vulkan, physical),
            physical,
            queue_family: family.unwrap_or(0) as u32,
        }
    }
}

#[cfg(test)]
impl DeviceInfo {
    /// Returns a device that does not exist.
    pub(crate) fn of_limits(name: &str, kind: &'static str, limits: Limits) -> DeviceInfo {
        DeviceInfo {
            index: 0,
            name: name.to_owned(),
            driver: String::new(),
            api_version: (1, 3, 0),
            kind,
            uuid: String::new(),
            vendor: 0,
            pci_address: None,
            unusable: None,
            limits,
            has_swapchain: false,
            tells_shown: false,
            clock_calibration: None,
            is_portable: false,
            has_pipeline_statistics: false,
            tells_faults: false,
            physical: vk::PhysicalDevice::null(),
            queue_family: 0,
        }
    }
}

/// Whether a text is an index: names hold numbers, too ("LLVM 15", "256 bits", "4090"), but digits
/// alone never mean a name.
fn is_index(text: &str) -> bool {
    !text.is_empty() && text.chars().all(|c| c.is_ascii_digit())
}

/// Returns the devices that a text names: by its index, by its whole name, or by a part of it.
fn named<'a>(devices: &'a [DeviceInfo], text: &str) -> Vec<&'a DeviceInfo> {
    if is_index(text) {
        return devices.iter().filter(|d| text.parse() == Ok(d.index)).collect();
    }
    let (text, lower) = (text.to_lowercase(), |d: &DeviceInfo| d.name.to_lowercase());
    let whole: Vec<&DeviceInfo> = devices.iter().filter(|d| lower(d) == text).collect();
    // An empty text is part of every name, and hardly meant: a script's unset variable.
    let is_part = |d: &&DeviceInfo| !text.is_empty() && lower(d).contains(&text);
    if whole.is_empty() { devices.iter().filter(is_part).collect() } else { whole }
}

/// Returns the reason why nimbus cannot use a device, where there is one.
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
    let missing = needs.iter().find(|(has, _)| *has == vk::FALSE);
    missing.map(|(_, name)| format!("feature {name} is missing"))
}

/// Returns the way in which a device reads its clock and one of the host at one moment, by the
/// newer extension where there are two.
fn clock_calibration(
    instance: &Instance,
    physical: vk::PhysicalDevice,
) -> Option<ClockCalibration> {
    let (entry, raw) = (&instance.vulkan.entry, &instance.vulkan.raw);
    let extension = [khr::calibrated_timestamps::NAME, ext::calibrated_timestamps::NAME]
        .into_iter()
        .find(|name| has_extension(raw, physical, name))?;
    let domains = unsafe {
        if extension == khr::calibrated_timestamps::NAME {
            khr::calibrated_timestamps::Instance::new(entry, raw)
                .get_physical_device_calibrateable_time_domains(physical)
        } else {
            ext::calibrated_timestamps::Instance::new(entry, raw)
                .get_physical_device_calibrateable_time_domains(physical)
        }
    };
    let domain = host_clock::domain_among(&domains.ok()?)?;
    Some(ClockCalibration { extension, domain })
}

/// Returns a device's address on the PCI bus, as Linux writes it.
fn pci_address(instance: &ash::Instance, physical: vk::PhysicalDevice) -> Option<String> {
    let mut bus = vk::PhysicalDevicePCIBusInfoPropertiesEXT::default();
    let mut all = vk::PhysicalDeviceProperties2::default().push_next(&mut bus);
    if !has_extension(instance, physical, ext::pci_bus_info::NAME) {
        return None;
    }
    unsafe { instance.get_physical_device_properties2(physical, &mut all) };
    let [domain, number, device] = [bus.pci_domain, bus.pci_bus, bus.pci_device];
    Some(format!("{domain:04x}:{number:02x}:{device:02x}.{:x}", bus.pci_function))
}

/// Whether a device describes its pipelines.
fn has_pipeline_statistics(instance: &ash::Instance, physical: vk::PhysicalDevice) -> bool {
    let mut feature = vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default();
    let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut feature);
    if has_extension(instance, physical, khr::pipeline_executable_properties::NAME) {
        unsafe { instance.get_physical_device_features2(physical, &mut all) };
    }
    feature.pipeline_executable_info == vk::TRUE
}

/// Returns a fixed-size C string of Vulkan as text; empty where it does not end.
fn text<E>(chars: std::result::Result<&CStr, E>) -> String {
    chars.map_or_else(|_| String::new(), |s| s.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn device(index: usize, name: &str, kind: &'static str) -> DeviceInfo {
        DeviceInfo { index, ..DeviceInfo::of_limits(name, kind, Limits::default()) }
    }

    #[test]
    fn a_device_is_chosen_by_index_name_or_kind() {
        let devices = || {
            vec![device(0, "llvmpipe (LLVM 15)", "cpu"), device(1, "GeForce RTX 4090", "discrete")]
        };
        let chosen = |choice| DeviceInfo::choose(devices(), choice).map(|d| d.index);
        assert_eq!(chosen(None), Ok(1));
        assert_eq!(chosen(Some("0")), Ok(0));
        assert_eq!(chosen(Some("RTX 4090")), Ok(1));
        assert_eq!(chosen(Some("GEFORCE")), Ok(1));
        // 1 is an index although it stands in a name.
        assert_eq!(chosen(Some("1")), Ok(1));
        assert_eq!(chosen(Some(" 01 ")), Ok(1));
        for wrong in ["", "  ", "7", "15", "4090", "99999999999999999999", "-1", "Radeon"] {
            let error = chosen(Some(wrong)).expect_err(wrong);
            assert_eq!(error.exit_code(), 2);
            let message = error.to_string();
            assert!(message.contains("0: llvmpipe (LLVM 15), 1: GeForce RTX 4090"), "{message}");
        }
        let twins = || vec![device(0, "H100", "discrete"), device(1, "H100 PCIe", "discrete")];
        assert_eq!(DeviceInfo::choose(twins(), Some("h100")).map(|d| d.index), Ok(0));
        let error = DeviceInfo::choose(twins(), Some("100")).map(|d| d.index);
        assert!(error.expect_err("an index").to_string().contains("no device has this index"));
        let error = DeviceInfo::choose(twins(), Some("H1")).map(|d| d.index).expect_err("two");
        assert!(error.to_string().contains("2 names (0: H100, 1: H100 PCIe)"), "{error}");
        assert_eq!(error.exit_code(), 2);
    }

    proptest! {
        /// Digits choose by index alone; other text chooses the only device with that part of a
        /// name, and otherwise no device.
        #[test]
        fn no_device_is_chosen_by_chance(
            names in prop::collection::vec("[A-Ca-c0-2 ]{1,6}", 0..4),
            text in "[A-Ca-c0-3 ]{0,3}",
        ) {
            let all = || -> Vec<DeviceInfo> {
                names.iter().enumerate().map(|(i, name)| device(i, name, "discrete")).collect()
            };
            let found = DeviceInfo::choose(all(), Some(&text)).map(|d| d.index);
            let wanted = text.trim().to_lowercase();
            if is_index(&wanted) {
                let index = wanted.parse().expect("a short number");
                prop_assert_eq!(found.ok(), Some(index).filter(|i| *i < names.len()));
            } else if let Ok(i) = found {
                let is_like = |name: &&String| name.to_lowercase().contains(&wanted);
                prop_assert!(is_like(&&names[i]) && !wanted.is_empty());
                let is_whole = names[i].to_lowercase() == wanted;
                prop_assert!(is_whole || names.iter().filter(is_like).count() == 1);
            }
        }
    }
}
