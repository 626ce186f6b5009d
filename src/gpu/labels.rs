//! Names of objects and labels of commands, for frame debuggers and profilers.

use std::ffi::CString;

use ash::vk;

use super::device::SharedDevice;

impl SharedDevice {
    /// Names a handle for frame debuggers, and claims validation messages about it.
    pub fn name<H: vk::Handle + Copy>(&self, handle: H, name: &str) {
        if self.instance.vulkan.has_validation {
            self.instance.messages().claim(handle);
        }
        let Some(debug) = &self.debug else { return };
        let Ok(name) = CString::new(name) else { return };
        let info =
            vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        // A name that cannot be set is no reason to stop.
        let _ = unsafe { debug.set_debug_utils_object_name(&info) };
    }

    /// Begins a labelled stretch of commands, which frame debuggers and profilers show by its name.
    pub fn begin_label(&self, commands: vk::CommandBuffer, name: &str) {
        let Some((debug, name)) = self.debug.as_ref().zip(CString::new(name).ok()) else { return };
        let label = vk::DebugUtilsLabelEXT::default().label_name(&name);
        unsafe { debug.cmd_begin_debug_utils_label(commands, &label) };
    }

    /// Ends the stretch that began last, in the same command buffer: Vulkan allows another one, and
    /// Mesa 22.3 crashes there.
    pub fn end_label(&self, commands: vk::CommandBuffer) {
        if let Some(debug) = &self.debug {
            unsafe { debug.cmd_end_debug_utils_label(commands) };
        }
    }
}
