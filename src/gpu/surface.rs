//! The surface that a window system gives: what of a window Vulkan knows, and what it takes.

use std::sync::Arc;

use ash::{khr, vk};
use raw_window_handle::{RawDisplayHandle, RawWindowHandle};

use super::device::Device;
use super::instance::Instance;
use super::memory::TargetFormat;
use crate::error::{Error, Result};

/// When a picture that is ready is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PresentMode {
    /// At the next refresh, one after the other: every device has it.
    Fifo,
    /// At the next refresh, the newest.
    Mailbox,
    /// At once.
    Immediate,
}

impl PresentMode {
    pub const NAMES: [(&'static str, PresentMode); 3] = [
        ("fifo", PresentMode::Fifo),
        ("mailbox", PresentMode::Mailbox),
        ("immediate", PresentMode::Immediate),
    ];

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

/// A window, as Vulkan knows it. The window must outlive it.
pub struct Surface {
    pub(super) raw: vk::SurfaceKHR,
    loader: khr::surface::Instance,
    /// Outlives it.
    _instance: Arc<Instance>,
}

impl Surface {
    /// An instance that can show pictures on `display`, and the surface of a window there.
    pub fn open(
        validation: bool,
        display: RawDisplayHandle,
        window: RawWindowHandle,
    ) -> Result<(Arc<Instance>, Surface)> {
        let wanted = ash_window::enumerate_required_extensions(display).map_err(|e| {
            Error::vulkan("window extensions", format!("no Vulkan for this window system: {e}"))
        })?;
        // SAFETY: the list is of static C strings.
        let names: Vec<_> =
            wanted.iter().map(|name| unsafe { std::ffi::CStr::from_ptr(*name) }).collect();
        let instance = Instance::with_extensions(validation, &names)?;
        // SAFETY: both handles are those of a living window; whoever holds the surface keeps it.
        let raw = unsafe {
            ash_window::create_surface(&instance.entry, &instance.raw, display, window, None)
        }
        .map_err(|e| Error::vulkan("creating the window's surface", e))?;
        let loader = khr::surface::Instance::new(&instance.entry, &instance.raw);
        Ok((instance.clone(), Surface { raw, loader, _instance: instance }))
    }

    /// Whether `device` can show pictures here; an error that says so where it cannot.
    pub fn check(&self, device: &Device) -> Result<()> {
        let family = device.shared().queue_family;
        let can = unsafe {
            self.loader.get_physical_device_surface_support(device.physical(), family, self.raw)
        };
        match can {
            Ok(true) if device.info().has_swapchain => Ok(()),
            Ok(_) => Err(Error::vulkan(
                "window",
                format!("{} cannot show pictures in it", device.info().name),
            )),
            Err(e) => Err(Error::vulkan("vkGetPhysicalDeviceSurfaceSupportKHR", e)),
        }
    }

    /// The modes that `device` has here, of those that nimbus knows.
    pub fn modes(&self, device: &Device) -> Result<Vec<PresentMode>> {
        let found = unsafe {
            self.loader.get_physical_device_surface_present_modes(device.physical(), self.raw)
        };
        let found =
            found.map_err(|e| Error::vulkan("vkGetPhysicalDeviceSurfacePresentModesKHR", e))?;
        Ok(PresentMode::NAMES
            .map(|(_, mode)| mode)
            .into_iter()
            .filter(|m| found.contains(&m.raw()))
            .collect())
    }

    pub(super) fn capabilities(&self, device: &Device) -> Result<vk::SurfaceCapabilitiesKHR> {
        unsafe { self.loader.get_physical_device_surface_capabilities(device.physical(), self.raw) }
            .map_err(|e| Error::vulkan("vkGetPhysicalDeviceSurfaceCapabilitiesKHR", e))
    }

    /// What of its formats holds bytes as they are shown.
    pub(super) fn format(&self, device: &Device) -> Result<TargetFormat> {
        let found =
            unsafe { self.loader.get_physical_device_surface_formats(device.physical(), self.raw) };
        let found = found.map_err(|e| Error::vulkan("vkGetPhysicalDeviceSurfaceFormatsKHR", e))?;
        let has = |format: &TargetFormat| {
            let of =
                |f: &vk::SurfaceFormatKHR| f.format == format.raw() && f.color_space == COLOR_SPACE;
            found.iter().any(of)
        };
        [TargetFormat::Rgba8, TargetFormat::Bgra8].into_iter().find(has).ok_or_else(|| {
            Error::vulkan("window", "it takes neither R8G8B8A8_UNORM nor B8G8R8A8_UNORM in sRGB")
        })
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        // SAFETY: its swapchains are gone: who has both drops them first. The instance is alive.
        unsafe { self.loader.destroy_surface(self.raw, None) };
    }
}

/// Bytes are shown as they are.
pub(super) const COLOR_SPACE: vk::ColorSpaceKHR = vk::ColorSpaceKHR::SRGB_NONLINEAR;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_have_their_names() {
        for (name, mode) in PresentMode::NAMES {
            assert_eq!(mode.name(), name);
        }
    }
}
