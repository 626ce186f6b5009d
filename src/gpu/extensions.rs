//! The extensions that a device lists.

use std::ffi::CStr;

use ash::vk;

/// Whether a device lists an extension; false where the list cannot be read.
pub(super) fn has_extension(
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
    name: &CStr,
) -> bool {
    let extensions = unsafe { instance.enumerate_device_extension_properties(physical) };
    extensions.is_ok_and(|all| all.iter().any(|e| e.extension_name_as_c_str() == Ok(name)))
}
