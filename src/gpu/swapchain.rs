//! Pictures in a window: the surface that a window system gives, and the images that go to and fro between it and nimbus.

use std::sync::Arc;

use ash::{khr, vk};
use raw_window_handle::{RawDisplayHandle, RawWindowHandle};

use super::device::{Device, Shared};
use super::instance::Instance;
use super::memory::{Image, TargetFormat};
use super::recorder::{Barriers, Commands, Recorder};
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
    pub const NAMES: [(&'static str, PresentMode); 3] =
        [("fifo", PresentMode::Fifo), ("mailbox", PresentMode::Mailbox), ("immediate", PresentMode::Immediate)];

    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize].0
    }

    fn raw(self) -> vk::PresentModeKHR {
        match self {
            PresentMode::Fifo => vk::PresentModeKHR::FIFO,
            PresentMode::Mailbox => vk::PresentModeKHR::MAILBOX,
            PresentMode::Immediate => vk::PresentModeKHR::IMMEDIATE,
        }
    }
}

/// A window, as Vulkan knows it. The window must outlive it.
pub struct Surface {
    raw: vk::SurfaceKHR,
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
        let wanted = ash_window::enumerate_required_extensions(display)
            .map_err(|e| Error::vulkan("window extensions", format!("no Vulkan for this window system: {e}")))?;
        // SAFETY: the list is of static C strings.
        let names: Vec<_> = wanted.iter().map(|name| unsafe { std::ffi::CStr::from_ptr(*name) }).collect();
        let instance = Instance::with_extensions(validation, &names)?;
        // SAFETY: both handles are those of a living window; whoever holds the surface keeps it.
        let raw = unsafe { ash_window::create_surface(&instance.entry, &instance.raw, display, window, None) }
            .map_err(|e| Error::vulkan("creating the window's surface", e))?;
        let loader = khr::surface::Instance::new(&instance.entry, &instance.raw);
        Ok((instance.clone(), Surface { raw, loader, _instance: instance }))
    }

    /// Whether `device` can show pictures here; an error that says so where it cannot.
    pub fn check(&self, device: &Device) -> Result<()> {
        let family = device.shared().queue_family;
        let can = unsafe { self.loader.get_physical_device_surface_support(device.physical(), family, self.raw) };
        match can {
            Ok(true) if device.info().has_swapchain => Ok(()),
            Ok(_) => Err(Error::vulkan("window", format!("{} cannot show pictures in it", device.info().name))),
            Err(e) => Err(Error::vulkan("vkGetPhysicalDeviceSurfaceSupportKHR", e)),
        }
    }

    /// The modes that `device` has here, of those that nimbus knows.
    pub fn modes(&self, device: &Device) -> Result<Vec<PresentMode>> {
        let found = unsafe { self.loader.get_physical_device_surface_present_modes(device.physical(), self.raw) };
        let found = found.map_err(|e| Error::vulkan("vkGetPhysicalDeviceSurfacePresentModesKHR", e))?;
        Ok(PresentMode::NAMES.map(|(_, mode)| mode).into_iter().filter(|m| found.contains(&m.raw())).collect())
    }

    fn capabilities(&self, device: &Device) -> Result<vk::SurfaceCapabilitiesKHR> {
        unsafe { self.loader.get_physical_device_surface_capabilities(device.physical(), self.raw) }
            .map_err(|e| Error::vulkan("vkGetPhysicalDeviceSurfaceCapabilitiesKHR", e))
    }

    /// What of its formats holds bytes as they are shown.
    fn format(&self, device: &Device) -> Result<TargetFormat> {
        let found = unsafe { self.loader.get_physical_device_surface_formats(device.physical(), self.raw) };
        let found = found.map_err(|e| Error::vulkan("vkGetPhysicalDeviceSurfaceFormatsKHR", e))?;
        let has = |format: &TargetFormat| {
            let of = |f: &vk::SurfaceFormatKHR| f.format == format.raw() && f.color_space == COLOR_SPACE;
            found.iter().any(of)
        };
        [TargetFormat::Rgba8, TargetFormat::Bgra8]
            .into_iter()
            .find(has)
            .ok_or_else(|| Error::vulkan("window", "it takes neither R8G8B8A8_UNORM nor B8G8R8A8_UNORM in sRGB"))
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        // SAFETY: its swapchains are gone: who has both drops them first. The instance is alive.
        unsafe { self.loader.destroy_surface(self.raw, None) };
    }
}

const COLOR_SPACE: vk::ColorSpaceKHR = vk::ColorSpaceKHR::SRGB_NONLINEAR;

/// What became of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    Yes,
    /// The window system had no image to draw into for [`PATIENCE_NS`]: nothing of the window is seen.
    Late,
    /// The window is of another size by now, or nothing of it is seen: the swapchain is to be made anew.
    Outdated,
}

/// A window behind others may get no images at all; who waits for one could not be told to stop.
const PATIENCE_NS: u64 = 250_000_000;

/// So many pictures may be on their way to the window.
const ON_THEIR_WAY: usize = 2;

/// The images of a window. Fields drop in order: commands wait for what is still under way.
pub struct Swapchain {
    /// One for each picture on its way.
    commands: Vec<Commands>,
    images: Vec<Image>,
    /// By commands: the image may be drawn into.
    ready: Vec<vk::Semaphore>,
    /// By image: it may be shown.
    drawn: Vec<vk::Semaphore>,
    i_next: usize,
    raw: vk::SwapchainKHR,
    loader: khr::swapchain::Device,
    format: TargetFormat,
    mode: PresentMode,
    shared: Arc<Shared>,
}

impl Swapchain {
    /// For `surface` as large as it is; `size` where the window system leaves that to us. None where nothing of the window is
    /// seen: it is minimised. The one before must be gone.
    pub fn new(device: &Device, surface: &Surface, size: [u32; 2], mode: PresentMode) -> Result<Option<Swapchain>> {
        let capabilities = surface.capabilities(device)?;
        let extent = extent_of(&capabilities, size);
        if extent.width == 0 || extent.height == 0 {
            return Ok(None);
        }
        let format = surface.format(device)?;
        let most = if capabilities.max_image_count == 0 { u32::MAX } else { capabilities.max_image_count };
        let alpha = [vk::CompositeAlphaFlagsKHR::OPAQUE, vk::CompositeAlphaFlagsKHR::INHERIT]
            .into_iter()
            .find(|a| capabilities.supported_composite_alpha.contains(*a))
            .unwrap_or(vk::CompositeAlphaFlagsKHR::PRE_MULTIPLIED);
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(surface.raw)
            .min_image_count((capabilities.min_image_count + 1).min(most))
            .image_format(format.raw())
            .image_color_space(COLOR_SPACE)
            .image_extent(extent)
            .image_array_layers(1)
            .image_usage(vk::ImageUsageFlags::COLOR_ATTACHMENT)
            .pre_transform(capabilities.current_transform)
            .composite_alpha(alpha)
            .present_mode(mode.raw())
            .clipped(true);
        let shared = device.shared().clone();
        let loader = khr::swapchain::Device::new(&shared.instance.raw, &shared.raw);
        let raw =
            unsafe { loader.create_swapchain(&info, None) }.map_err(|e| Error::vulkan("vkCreateSwapchainKHR", e))?;
        let (commands, images) = (vec![], vec![]);
        let mut chain =
            Swapchain { commands, images, ready: vec![], drawn: vec![], i_next: 0, raw, loader, format, mode, shared };
        chain.fill(device, extent)?;
        Ok(Some(chain))
    }

    fn fill(&mut self, device: &Device, extent: vk::Extent2D) -> Result<()> {
        let images = unsafe { self.loader.get_swapchain_images(self.raw) }
            .map_err(|e| Error::vulkan("vkGetSwapchainImagesKHR", e))?;
        for raw in images {
            self.images.push(Image::of_swapchain(&self.shared, "window.image", raw, extent, self.format)?);
            self.drawn.push(self.semaphore("window.drawn")?);
        }
        for _ in 0..ON_THEIR_WAY {
            self.commands.push(Commands::new(device, "window.show")?);
            self.ready.push(self.semaphore("window.ready")?);
        }
        Ok(())
    }

    fn semaphore(&self, name: &str) -> Result<vk::Semaphore> {
        let made = unsafe { self.shared.raw.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) };
        let semaphore = made.map_err(|e| Error::vulkan("vkCreateSemaphore", e))?;
        self.shared.name(semaphore, name);
        Ok(semaphore)
    }

    pub fn format(&self) -> TargetFormat {
        self.format
    }

    pub fn mode(&self) -> PresentMode {
        self.mode
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.images.first().map_or([0, 0], |image| image.size().into())
    }

    /// Has `draw` fill an image, which is black before, and shows it.
    pub fn show(&mut self, draw: impl FnOnce(&mut Recorder<'_>, &mut Image) -> Result<()>) -> Result<Shown> {
        let i = self.i_next;
        // What was drawn with these commands before is done, and so their semaphore is free.
        self.commands[i].wait()?;
        let acquired =
            unsafe { self.loader.acquire_next_image(self.raw, PATIENCE_NS, self.ready[i], vk::Fence::null()) };
        let i_image = match acquired {
            // A picture that does not quite fit is shown all the same: its semaphore is signalled.
            Ok((i_image, _)) => i_image as usize,
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => return Ok(Shown::Late),
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR | vk::Result::ERROR_SURFACE_LOST_KHR) => return Ok(Shown::Outdated),
            Err(e) => return Err(Error::vulkan("vkAcquireNextImageKHR", e)),
        };
        self.i_next = (i + 1) % ON_THEIR_WAY;
        let image = &mut self.images[i_image];
        self.commands[i].record(Barriers::Placed, |rec| {
            draw(rec, image)?;
            rec.show(image);
            Ok(())
        })?;
        self.commands[i].submit_between(Some(self.ready[i]), Some(self.drawn[i_image]))?;
        let (drawn, chains, images) = ([self.drawn[i_image]], [self.raw], [i_image as u32]);
        let info = vk::PresentInfoKHR::default().wait_semaphores(&drawn).swapchains(&chains).image_indices(&images);
        match unsafe { self.loader.queue_present(self.shared.queue, &info) } {
            Ok(false) => Ok(Shown::Yes),
            Ok(true) | Err(vk::Result::ERROR_OUT_OF_DATE_KHR | vk::Result::ERROR_SURFACE_LOST_KHR) => {
                Ok(Shown::Outdated)
            }
            Err(e) => Err(Error::vulkan("vkQueuePresentKHR", e)),
        }
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        // SAFETY: all that was submitted or shown ends before what it uses; a lost device has ended it.
        unsafe {
            let _ = self.shared.raw.queue_wait_idle(self.shared.queue);
            self.commands.clear();
            self.images.clear();
            for semaphore in self.ready.drain(..).chain(self.drawn.drain(..)) {
                self.shared.raw.destroy_semaphore(semaphore, None);
            }
            self.loader.destroy_swapchain(self.raw, None);
        }
    }
}

/// What the window system says; where it leaves the size open, `size` within its limits.
fn extent_of(capabilities: &vk::SurfaceCapabilitiesKHR, size: [u32; 2]) -> vk::Extent2D {
    let current = capabilities.current_extent;
    if current.width != u32::MAX {
        return current;
    }
    let (least, most) = (capabilities.min_image_extent, capabilities.max_image_extent);
    vk::Extent2D { width: size[0].clamp(least.width, most.width), height: size[1].clamp(least.height, most.height) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_window_system_has_the_first_word_on_the_size() {
        let of = |width, height| vk::Extent2D { width, height };
        let mut capabilities = vk::SurfaceCapabilitiesKHR {
            current_extent: of(640, 480),
            min_image_extent: of(1, 1),
            max_image_extent: of(1000, 700),
            ..Default::default()
        };
        assert_eq!(extent_of(&capabilities, [800, 600]), of(640, 480));
        capabilities.current_extent = of(u32::MAX, u32::MAX);
        assert_eq!(extent_of(&capabilities, [800, 6000]), of(800, 700));
        assert_eq!(extent_of(&capabilities, [0, 600]), of(1, 600));
    }

    #[test]
    fn modes_have_their_names() {
        for (name, mode) in PresentMode::NAMES {
            assert_eq!(mode.name(), name);
        }
    }
}
