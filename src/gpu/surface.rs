//! The Vulkan surface of a window, and its present modes and formats.

use std::ffi::CStr;
use std::sync::Arc;

use ash::{khr, vk};
use raw_window_handle::{RawDisplayHandle, RawWindowHandle};

use super::call::Call;
use super::device::Device;
use super::image::TargetFormat;
use super::instance::Instance;
use crate::error::{Error, Result};

/// When a presented image becomes visible.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum PresentMode {
    /// In order, one at each refresh. Every window supports this mode.
    #[value(help = "In order, one at each refresh")]
    Fifo,
    /// The newest at each refresh.
    Mailbox,
    /// At once.
    Immediate,
}

impl PresentMode {
    /// All modes with their names on the command line.
    pub const NAMES: [(&'static str, PresentMode); 3] = [
        ("fifo", PresentMode::Fifo),
        ("mailbox", PresentMode::Mailbox),
        ("immediate", PresentMode::Immediate),
    ];

    /// Returns the name on the command line.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize].0
    }

    pub(super) fn raw(self) -> vk::PresentModeKHR {
        match self {
            PresentMode::Fifo => vk::PresentModeKHR::FIFO,
            PresentMode::Mailbox => vk::PresentModeKHR::MAILBOX,
            PresentMode::Immediate => vk::PresentModeKHR::IMMEDIATE,
        }
    }
}

/// The surface of a window, which must outlive it.
pub struct Surface {
    pub(super) raw: vk::SurfaceKHR,
    loader: khr::surface::Instance,
}

/// Values are shown as the image holds them.
pub(super) const COLOR_SPACE: vk::ColorSpaceKHR = vk::ColorSpaceKHR::SRGB_NONLINEAR;

impl Surface {
    /// Opens an instance that can present to `display`, and the surface of a window there.
    ///
    /// # Errors
    /// Vulkan has no extension for the window system, or the driver refuses the window.
    pub fn open(
        validation: bool,
        display: RawDisplayHandle,
        window: RawWindowHandle,
    ) -> Result<(Arc<Instance>, Surface)> {
        let wanted = ash_window::enumerate_required_extensions(display).map_err(|e| {
            Error::vulkan("window extensions", format!("no Vulkan for this window system: {e}"))
        })?;
        // SAFETY: the list is of static C strings.
        let names: Vec<_> = wanted.iter().map(|name| unsafe { CStr::from_ptr(*name) }).collect();
        let instance = Instance::with_extensions(validation, &names)?;
        let (entry, raw) = (&instance.vulkan.entry, &instance.vulkan.raw);
        let loader = khr::surface::Instance::new(entry, raw);
        // SAFETY: both handles are those of a living window, which the caller keeps.
        let raw = unsafe { ash_window::create_surface(entry, raw, display, window, None) }
            .of_call("creating the window's surface", "")?;
        Ok((instance, Surface { raw, loader }))
    }

    /// Checks that `device` can present here.
    ///
    /// # Errors
    /// It cannot.
    pub fn check(&self, device: &Device) -> Result<()> {
        let (physical, family) = (device.physical(), device.shared().queue_family);
        let can =
            unsafe { self.loader.get_physical_device_surface_support(physical, family, self.raw) };
        match can.of_call("vkGetPhysicalDeviceSurfaceSupportKHR", "")? {
            true if device.info().has_swapchain => Ok(()),
            _ => {
                let what = format!("{} cannot present to it", device.info().name);
                Err(Error::vulkan("window", what))
            }
        }
    }

    /// Returns the modes that `device` has here, of those that nimbus knows.
    ///
    /// # Errors
    /// The device or the surface is lost.
    pub fn modes(&self, device: &Device) -> Result<Vec<PresentMode>> {
        let found = unsafe {
            self.loader.get_physical_device_surface_present_modes(device.physical(), self.raw)
        }
        .of_call("vkGetPhysicalDeviceSurfacePresentModesKHR", "")?;
        let modes = PresentMode::NAMES.map(|(_, mode)| mode).into_iter();
        Ok(modes.filter(|mode| found.contains(&mode.raw())).collect())
    }

    pub(super) fn capabilities(&self, device: &Device) -> Result<vk::SurfaceCapabilitiesKHR> {
        unsafe { self.loader.get_physical_device_surface_capabilities(device.physical(), self.raw) }
            .of_call("vkGetPhysicalDeviceSurfaceCapabilitiesKHR", "")
    }

    /// Returns a format of the surface whose bytes are shown as they are.
    pub(super) fn format(&self, device: &Device) -> Result<TargetFormat> {
        let found =
            unsafe { self.loader.get_physical_device_surface_formats(device.physical(), self.raw) }
                .of_call("vkGetPhysicalDeviceSurfaceFormatsKHR", "")?;
        let has = |format: &TargetFormat| {
            found.iter().any(|f| f.format == format.raw() && f.color_space == COLOR_SPACE)
        };
        [TargetFormat::Rgba8, TargetFormat::Bgra8].into_iter().find(has).ok_or_else(|| {
            Error::vulkan("window", "it takes neither R8G8B8A8_UNORM nor B8G8R8A8_UNORM in sRGB")
        })
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        // SAFETY: the owner of both drops the swapchain first; the instance is never destroyed.
        unsafe { self.loader.destroy_surface(self.raw, None) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn present_modes_have_their_own_names() {
        for (name, mode) in PresentMode::NAMES {
            assert_eq!(mode.name(), name);
        }
    }
}
