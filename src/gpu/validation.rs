//! The Khronos validation layer: its settings, and the way of its messages to whom they concern.

use std::collections::HashMap;
use std::ffi::{CStr, c_void};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError, Weak};

use ash::{ext, vk};

use super::call::Call;
use crate::error::{Error, Result};

const LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// The settings that newer layers want switched on by name, beside synchronization validation:
/// the layer of 1.4.309 compares shader accesses between dispatches only on request.
const SETTINGS: [&CStr; 2] = [c"validate_sync", c"syncval_shader_accesses_heuristic"];

/// The messages of the validation layer and the leak report, in order.
///
/// Tests and `--validation` fail on any. All handles on an instance share one messenger. It passes
/// a message to the handle whose device named one of the message's objects. A message without such
/// an object goes to every handle, so that none is lost.
#[derive(Default)]
pub struct Messages(Mutex<Vec<String>>);

/// The receivers of messages: all of them, and by Vulkan object.
#[derive(Default)]
struct Receivers {
    all: Vec<Weak<Messages>>,
    by_object: HashMap<u64, Weak<Messages>>,
}

static RECEIVERS: LazyLock<Mutex<Receivers>> = LazyLock::new(Default::default);

fn receivers() -> MutexGuard<'static, Receivers> {
    RECEIVERS.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Messages {
    /// Returns an empty list that receives messages until it is dropped.
    pub(super) fn listening() -> Arc<Messages> {
        let messages = Arc::new(Messages::default());
        let mut receivers = receivers();
        receivers.all.retain(|m| m.strong_count() > 0);
        receivers.by_object.retain(|_, m| m.strong_count() > 0);
        receivers.all.push(Arc::downgrade(&messages));
        messages
    }

    /// Claims the messages about a Vulkan object.
    pub(super) fn claim(self: &Arc<Self>, object: impl vk::Handle) {
        receivers().by_object.insert(object.as_raw(), Arc::downgrade(self));
    }

    /// Appends a message.
    pub fn push(&self, message: String) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(message);
    }

    /// Returns all messages so far and empties the list.
    pub fn take(&self) -> Vec<String> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Creates an instance with the validation layer, its settings and its messenger.
///
/// # Errors
/// The layer is not installed, or the driver refuses.
pub(super) fn create_instance(
    entry: &ash::Entry,
    info: vk::InstanceCreateInfo<'_>,
    mut extensions: Vec<*const std::ffi::c_char>,
) -> Result<ash::Instance> {
    let layers = unsafe { entry.enumerate_instance_layer_properties() }
        .of_call("vkEnumerateInstanceLayerProperties", "")?;
    if !layers.iter().any(|l| l.layer_name_as_c_str() == Ok(LAYER)) {
        let what = "VK_LAYER_KHRONOS_validation is not installed (Debian: \
            vulkan-validationlayers)";
        return Err(Error::vulkan("validation", what));
    }
    let of_layer = unsafe { entry.enumerate_instance_extension_properties(Some(LAYER)) }
        .of_call("vkEnumerateInstanceExtensionProperties", "of the validation layer")?;
    let has_settings =
        of_layer.iter().any(|e| e.extension_name_as_c_str() == Ok(ext::layer_settings::NAME));
    extensions.extend(has_settings.then_some(ext::layer_settings::NAME.as_ptr()));
    let is_on: vk::Bool32 = vk::TRUE;
    let settings = SETTINGS.map(|name| {
        let mut setting = vk::LayerSettingEXT::default()
            .layer_name(LAYER)
            .setting_name(name)
            .ty(vk::LayerSettingTypeEXT::BOOL32)
            .values(bytemuck::bytes_of(&is_on));
        // `values` counts bytes, Vulkan counts values.
        setting.value_count = 1;
        setting
    });
    let mut settings = vk::LayerSettingsCreateInfoEXT::default().settings(&settings);
    let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
    // The first messenger hears of the instance's own creation, the second of all that follows.
    let mut messenger = messenger_info();
    let layers = [LAYER.as_ptr()];
    let mut info = info
        .enabled_layer_names(&layers)
        .enabled_extension_names(&extensions)
        .push_next(&mut features)
        .push_next(&mut messenger);
    if has_settings {
        info = info.push_next(&mut settings);
    }
    // SAFETY: `info` and all it points to live until the call returns.
    let raw = unsafe { entry.create_instance(&info, None) }.of_call("vkCreateInstance", "")?;
    let debug = ext::debug_utils::Instance::new(entry, &raw);
    match unsafe { debug.create_debug_utils_messenger(&messenger_info(), None) } {
        Ok(_) => Ok(raw),
        Err(e) => {
            unsafe { raw.destroy_instance(None) };
            Err(Error::vulkan("vkCreateDebugUtilsMessengerEXT", e))
        }
    }
}

fn messenger_info() -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    use vk::DebugUtilsMessageSeverityFlagsEXT as Severity;
    use vk::DebugUtilsMessageTypeFlagsEXT as Type;
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(Severity::WARNING | Severity::ERROR)
        .message_type(Type::VALIDATION | Type::PERFORMANCE)
        .pfn_user_callback(Some(on_message))
}

unsafe extern "system" fn on_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    _user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: Vulkan passes valid callback data, whose arrays are as long as their counts.
    unsafe {
        if let Some(data) = data.as_ref() {
            let objects = match data.p_objects.is_null() {
                true => &[],
                false => std::slice::from_raw_parts(data.p_objects, data.object_count as usize),
            };
            let text =
                |s: Option<&CStr>| s.map_or_else(String::new, |s| s.to_string_lossy().into());
            let id = text(data.message_id_name_as_c_str());
            let message = text(data.message_as_c_str());
            if !is_error_of_layer(&id, &message) {
                // Newer layers name the rule beside the message instead of in it.
                let is_named = message.contains(&id);
                deliver(objects, if is_named { message } else { format!("{id}: {message}") });
            }
        }
    }
    vk::FALSE
}

/// Returns whether a message is a known error of the layer.
fn is_error_of_layer(id: &str, message: &str) -> bool {
    is_conflict_of_presents(id, message)
        || is_wait_beside_acquire(id, message)
        || is_newer_extension(message)
}

/// Returns whether the layer says that it is older than an extension of the device. The device's
/// list decides what may be enabled; the layer checks the extension's calls less, and says so.
fn is_newer_extension(message: &str) -> bool {
    message.contains("Device Extension VK_") && message.contains(" is not supported by this layer")
}

/// Returns whether a swapchain is said to be used by two threads, one of which waits for a picture
/// to be visible.
///
/// Layers before 1.3.271 report this, although Vulkan allows vkWaitForPresentKHR beside every other
/// use of the swapchain but its end (KhronosGroup/Vulkan-ValidationLayers issue 3615). Either of
/// the two calls may be named. Only the thread that presents acquires images.
fn is_wait_beside_acquire(id: &str, message: &str) -> bool {
    id == "UNASSIGNED-Threading-MultipleThreads"
        && message.contains("object of type VkSwapchainKHR is simultaneously used")
        && ["vkWaitForPresentKHR()", "vkAcquireNextImageKHR()"].iter().any(|c| message.contains(c))
}

/// Returns whether two presents of one swapchain image are said to conflict.
///
/// Layers from 1.4.304 to 1.4.357 at least report this if one thread submits while another acquires
/// and presents (KhronosGroup/Vulkan-ValidationLayers issues 8576, 10586 and 13117). The order of
/// the two presents needs no semaphore of ours: an image can be presented again only once
/// vkAcquireNextImageKHR has returned it, and another rule reports a present of an image that was
/// not acquired (VUID-VkPresentInfoKHR-pImageIndices-01430). So the message never tells of a fault
/// of the program. A conflict of drawing with a present has another text, and is not left out.
fn is_conflict_of_presents(id: &str, message: &str) -> bool {
    id == "SYNC-HAZARD-WRITE-AFTER-PRESENT"
        && message.starts_with("vkQueuePresentKHR(): ")
        && message.contains("previously written by another vkQueuePresentKHR")
}

fn deliver(objects: &[vk::DebugUtilsObjectNameInfoEXT<'_>], message: String) {
    let (owner, all) = {
        let receivers = receivers();
        let owner =
            objects.iter().find_map(|o| receivers.by_object.get(&o.object_handle)?.upgrade());
        (owner, receivers.all.iter().filter_map(Weak::upgrade).collect::<Vec<_>>())
    };
    match owner {
        Some(owner) => owner.push(message),
        None => all.iter().for_each(|receiver| receiver.push(message.clone())),
    }
}

#[cfg(test)]
mod tests {
    use super::is_error_of_layer;

    #[test]
    fn only_a_conflict_of_two_presents_is_left_out() {
        let id = "SYNC-HAZARD-WRITE-AFTER-PRESENT";
        let presents = "vkQueuePresentKHR(): WRITE_AFTER_PRESENT hazard detected. \
            vkQueuePresentKHR presents swapchain image 2 (VkImage 0x60000000006 from \
            VkSwapchainKHR 0x30000000003), which was previously written by another \
            vkQueuePresentKHR command.";
        assert!(is_error_of_layer(id, presents));
        assert!(!is_error_of_layer("SYNC-HAZARD-PRESENT-AFTER-WRITE", presents));
        let drawing = "vkQueueSubmit2(): WRITE_AFTER_PRESENT hazard detected. vkCmdBlitImage \
            writes to resource, which was previously written by vkQueuePresentKHR.";
        assert!(!is_error_of_layer(id, drawing));
        assert!(!is_error_of_layer(id, &presents.replace("another vkQueuePresentKHR", "a copy")));
    }

    #[test]
    fn that_the_layer_is_older_than_an_extension_is_left_out() {
        let of = |what: &str| format!("{what} VK_KHR_calibrated_timestamps is not supported by");
        let id = "VUID_Undefined";
        assert!(is_error_of_layer(id, &(of("Device Extension") + " this layer.  Using it may")));
        assert!(!is_error_of_layer(id, &(of("Device Extension") + " this device")));
        assert!(!is_error_of_layer(id, &(of("vkCreateDevice():") + " this layer")));
    }

    #[test]
    fn only_a_wait_for_a_picture_beside_another_use_is_left_out() {
        let id = "UNASSIGNED-Threading-MultipleThreads";
        let of = |call: &str, object: &str| {
            format!(
                "THREADING ERROR : {call}(): object of type {object} is simultaneously used in \
                 thread 140137163896512 and thread 140137165997760"
            )
        };
        for call in ["vkWaitForPresentKHR", "vkAcquireNextImageKHR"] {
            assert!(is_error_of_layer(id, &of(call, "VkSwapchainKHR")));
            assert!(!is_error_of_layer(id, &of(call, "VkSemaphore")));
        }
        assert!(!is_error_of_layer(id, &of("vkDestroySwapchainKHR", "VkSwapchainKHR")));
        assert!(!is_error_of_layer(id, &of("vkQueueSubmit2", "VkQueue")));
    }
}
