//! The Vulkan instance, its validation layers, and what they said.

use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex, PoisonError};

use ash::{ext, vk};

use crate::error::{Error, Result};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// What the validation layers and the leak report said, in order. Tests and `--validation` fail on
/// any.
#[derive(Default)]
pub struct Messages(Mutex<Vec<String>>);

impl Messages {
    pub fn push(&self, message: String) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(message);
    }

    /// All messages so far; the list is empty afterwards.
    pub fn take(&self) -> Vec<String> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

pub struct Instance {
    pub(super) raw: ash::Instance,
    pub(super) has_debug_utils: bool,
    /// Devices may be asked to show pictures in windows.
    pub(super) has_surfaces: bool,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    messages: Arc<Messages>,
    // Holds the loader's library open; dropped last.
    pub(super) entry: ash::Entry,
}

impl Instance {
    /// An instance of Vulkan 1.3. With `validation` the Khronos layer runs with synchronization
    /// validation, and its absence is an error: a check that silently does not run is worse than
    /// none.
    pub fn new(validation: bool) -> Result<Arc<Instance>> {
        Instance::with_extensions(validation, &[])
    }

    /// The same that can show pictures in windows, by the extensions which the window system
    /// `wanted`.
    pub(super) fn with_extensions(validation: bool, wanted: &[&CStr]) -> Result<Arc<Instance>> {
        // SAFETY: the loader is a trusted system library; it is kept open as long as anything made
        // from it.
        let entry = unsafe { ash::Entry::load() }.map_err(|e| {
            Error::vulkan(
                "loading libvulkan",
                format!("{e}; is the Vulkan loader installed? (tools/bootstrap)"),
            )
        })?;
        let messages = Arc::new(Messages::default());
        let layers = unsafe { entry.enumerate_instance_layer_properties() }
            .map_err(|e| Error::vulkan("vkEnumerateInstanceLayerProperties", e))?;
        let has_layer = layers.iter().any(|l| l.layer_name_as_c_str() == Ok(VALIDATION_LAYER));
        if validation && !has_layer {
            let what = "VK_LAYER_KHRONOS_validation is not installed (Debian: \
                vulkan-validationlayers; tools/bootstrap)";
            return Err(Error::vulkan("validation", what));
        }
        let extensions = unsafe { entry.enumerate_instance_extension_properties(None) }
            .map_err(|e| Error::vulkan("vkEnumerateInstanceExtensionProperties", e))?;
        let has_debug_utils = validation
            || extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(ext::debug_utils::NAME));
        if let Some(missing) = wanted
            .iter()
            .find(|name| !extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(name)))
        {
            let what = format!(
                "the Vulkan loader lacks {}: no driver here shows pictures",
                missing.to_string_lossy()
            );
            return Err(Error::vulkan("window extensions", what));
        }
        let mut names = wanted.to_vec();
        names.extend(has_debug_utils.then_some(ext::debug_utils::NAME));
        let raw = create(&entry, validation, &names, &messages)?;
        let messenger = if validation {
            let debug = ext::debug_utils::Instance::new(&entry, &raw);
            let made =
                unsafe { debug.create_debug_utils_messenger(&messenger_info(&messages), None) };
            match made {
                Ok(messenger) => Some((debug, messenger)),
                Err(e) => {
                    unsafe { raw.destroy_instance(None) };
                    return Err(Error::vulkan("vkCreateDebugUtilsMessengerEXT", e));
                }
            }
        } else {
            None
        };
        let has_surfaces = !wanted.is_empty();
        Ok(Arc::new(Instance { raw, has_debug_utils, has_surfaces, messenger, messages, entry }))
    }

    pub fn messages(&self) -> &Arc<Messages> {
        &self.messages
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: everything made from the instance holds an Arc of it and is gone by now.
        unsafe {
            if let Some((debug, messenger)) = self.messenger.take() {
                debug.destroy_debug_utils_messenger(messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

fn create(
    entry: &ash::Entry,
    validation: bool,
    extensions: &[&CStr],
    messages: &Arc<Messages>,
) -> Result<ash::Instance> {
    let application = vk::ApplicationInfo::default()
        .application_name(c"nimbus")
        .engine_name(c"nimbus")
        .api_version(vk::API_VERSION_1_3);
    let layers = if validation { vec![VALIDATION_LAYER.as_ptr()] } else { vec![] };
    let extensions: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
    let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
    let mut messenger = messenger_info(messages);
    let mut info = vk::InstanceCreateInfo::default()
        .application_info(&application)
        .enabled_layer_names(&layers)
        .enabled_extension_names(&extensions);
    if validation {
        info = info.push_next(&mut features).push_next(&mut messenger);
    }
    // SAFETY: `info` and all it points to live until the call returns.
    unsafe { entry.create_instance(&info, None) }.map_err(|e| Error::vulkan("vkCreateInstance", e))
}

/// The messenger borrows `messages` by raw pointer; [`Instance`] keeps the Arc until the messenger
/// is destroyed.
fn messenger_info(messages: &Arc<Messages>) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    use vk::DebugUtilsMessageSeverityFlagsEXT as Severity;
    use vk::DebugUtilsMessageTypeFlagsEXT as Type;
    let mut info = vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(Severity::WARNING | Severity::ERROR)
        .message_type(Type::VALIDATION | Type::PERFORMANCE)
        .pfn_user_callback(Some(on_message));
    info.p_user_data = Arc::as_ptr(messages).cast_mut().cast();
    info
}

unsafe extern "system" fn on_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: Vulkan passes valid callback data; `user` is the Messages of an instance that is
    // still alive.
    unsafe {
        if let (Some(data), Some(messages)) = (data.as_ref(), user.cast::<Messages>().as_ref()) {
            let text = data.message_as_c_str().map_or("(no text)".into(), CStr::to_string_lossy);
            messages.push(text.into_owned());
        }
    }
    vk::FALSE
}
