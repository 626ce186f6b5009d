//! The Vulkan instance, and the messages of its validation layer.
//!
//! A process makes each kind of VkInstance once and keeps it until it exits. The loader of Vulkan
//! 1.4.309 walks its list of instances without a lock when an object is named, and crashes where
//! another thread destroys an instance meanwhile (KhronosGroup/Vulkan-Loader#1863).

use std::ffi::CStr;
use std::sync::{Arc, Mutex, PoisonError};

use ash::{ext, khr, vk};

use super::advice::{PACKAGES, no_driver};
use super::call::Call;
use super::validation::{self, Messages};
use crate::error::{Error, Result};

/// A handle on the process's Vulkan instance, with its own list of messages.
///
/// Messages about an object go to the handle whose device owns that object; see [`Messages`].
pub struct Instance {
    pub(super) vulkan: &'static VulkanInstance,
    messages: Arc<Messages>,
}

/// A VkInstance that lives as long as the process.
pub(super) struct VulkanInstance {
    pub raw: ash::Instance,
    pub has_debug_utils: bool,
    /// The extensions by which devices can present to windows; empty without windows.
    pub surface_extensions: Vec<&'static CStr>,
    pub has_validation: bool,
    // Holds the loader's library open.
    pub entry: ash::Entry,
}

static INSTANCES: Mutex<Vec<&'static VulkanInstance>> = Mutex::new(vec![]);

impl Instance {
    /// Returns a handle on an instance of Vulkan 1.3. With `validation`, the Khronos layer runs
    /// with synchronization validation.
    ///
    /// # Errors
    /// The loader is missing, or the validation layer is wanted and not installed: a check that
    /// silently does not run is worse than none.
    pub fn new(validation: bool) -> Result<Arc<Instance>> {
        Instance::with_extensions(validation, &[])
    }

    /// Returns a handle on an instance that can present to windows by the extensions `surface`.
    pub(super) fn with_extensions(
        has_validation: bool,
        surface: &[&'static CStr],
    ) -> Result<Arc<Instance>> {
        let messages = Messages::listening();
        let mut made = INSTANCES.lock().unwrap_or_else(PoisonError::into_inner);
        let is_wanted = |i: &&&VulkanInstance| {
            i.has_validation == has_validation && i.surface_extensions == surface
        };
        let vulkan = match made.iter().find(is_wanted) {
            Some(vulkan) => *vulkan,
            None => {
                let vulkan: &'static VulkanInstance =
                    Box::leak(Box::new(VulkanInstance::new(has_validation, surface)?));
                made.push(vulkan);
                vulkan
            }
        };
        Ok(Arc::new(Instance { vulkan, messages }))
    }

    /// Returns the validation messages and leak reports of this handle's devices.
    pub fn messages(&self) -> &Arc<Messages> {
        &self.messages
    }
}

impl VulkanInstance {
    fn new(has_validation: bool, surface: &[&'static CStr]) -> Result<VulkanInstance> {
        // SAFETY: the loader is a trusted system library; it is kept open as long as anything made
        // from it.
        let entry = unsafe { ash::Entry::load() }.map_err(|_| {
            let what = format!("there is no Vulkan loader (libvulkan); {PACKAGES}");
            Error::vulkan("loading libvulkan", what)
        })?;
        let offered = unsafe { entry.enumerate_instance_extension_properties(None) }
            .of_call("vkEnumerateInstanceExtensionProperties", "")?;
        let has = |name: &CStr| offered.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
        if let Some(missing) = surface.iter().find(|name| !has(name)) {
            let what = format!(
                "no Vulkan driver here presents to windows ({} is missing); {}",
                missing.to_string_lossy(),
                no_driver()
            );
            return Err(Error::vulkan("window extensions", what));
        }
        let has_debug_utils = has_validation || has(ext::debug_utils::NAME);
        let mut extensions: Vec<_> = surface.iter().map(|name| name.as_ptr()).collect();
        // Drivers over another API, such as MoltenVK on macOS, are listed only if asked for.
        let is_portable = has(khr::portability_enumeration::NAME);
        extensions.extend(is_portable.then_some(khr::portability_enumeration::NAME.as_ptr()));
        let flags = match is_portable {
            true => vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR,
            false => vk::InstanceCreateFlags::empty(),
        };
        extensions.extend(has_debug_utils.then_some(ext::debug_utils::NAME.as_ptr()));
        let application = vk::ApplicationInfo::default()
            .application_name(c"nimbus")
            .engine_name(c"nimbus")
            .api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&application).flags(flags);
        let raw = match has_validation {
            true => validation::create_instance(&entry, info, extensions)?,
            false => {
                let info = info.enabled_extension_names(&extensions);
                // SAFETY: `info` and all it points to live until the call returns.
                let made = unsafe { entry.create_instance(&info, None) };
                if made.as_ref().err() == Some(&vk::Result::ERROR_INCOMPATIBLE_DRIVER) {
                    let what = format!("there is no Vulkan driver; {}", no_driver());
                    return Err(Error::vulkan("vkCreateInstance", what));
                }
                made.of_call("vkCreateInstance", "")?
            }
        };
        let surface_extensions = surface.to_vec();
        Ok(VulkanInstance { raw, has_debug_utils, surface_extensions, has_validation, entry })
    }
}
