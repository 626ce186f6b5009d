//! Pictures in a window: the images that go to and fro between it and nimbus.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

use ash::{khr, vk};

use super::device::{Device, Shared};
use super::memory::{Image, TargetFormat};
use super::presenter::{Chain, Drawn, ON_THEIR_WAY, Presenter, Told};
use super::recorder::{Barriers, Commands, Pending, Recorder};
use super::surface::{COLOR_SPACE, PresentMode, Surface};
use crate::error::{Error, Result};

/// What became of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    Yes,
    /// The window system had no image to draw into for [`PATIENCE`]: nothing of the window is seen.
    Late,
    /// The window is of another size by now, or nothing of it is seen: the swapchain is to be made
    /// anew.
    Outdated,
}

/// A window behind others may get no images at all; who waits for one could not be told to stop.
const PATIENCE: Duration = Duration::from_millis(250);

/// The images of a window.
pub struct Swapchain {
    /// One for each picture on its way.
    commands: Vec<Commands>,
    images: Vec<Image>,
    /// By commands: the image may be drawn into.
    ready: Vec<vk::Semaphore>,
    /// By image: it may be shown.
    drawn: Vec<vk::Semaphore>,
    /// Asks for images and shows them; none until all of the above is there.
    presenter: Option<Presenter>,
    raw: vk::SwapchainKHR,
    loader: khr::swapchain::Device,
    format: TargetFormat,
    takes_copies: bool,
    /// The picture that was shown last: when it is drawn, and when the window system has it.
    last: Option<(Pending, Receiver<()>)>,
    /// An image that nothing was drawn into after all: its slot.
    stray: Option<usize>,
    /// The presenter has told how it ended.
    is_over: bool,
    shared: Arc<Shared>,
}

impl Swapchain {
    /// For `surface` as large as it is; `size` where the window system leaves that to us. None
    /// where nothing of the window is seen: it is minimised. The one before must be gone.
    pub fn new(
        device: &Device,
        surface: &Surface,
        size: [u32; 2],
        mode: PresentMode,
    ) -> Result<Option<Swapchain>> {
        let capabilities = surface.capabilities(device)?;
        let extent = extent_of(&capabilities, size);
        if extent.width == 0 || extent.height == 0 {
            return Ok(None);
        }
        let format = surface.format(device)?;
        let most =
            if capabilities.max_image_count == 0 { u32::MAX } else { capabilities.max_image_count };
        let alpha = [vk::CompositeAlphaFlagsKHR::OPAQUE, vk::CompositeAlphaFlagsKHR::INHERIT]
            .into_iter()
            .find(|a| capabilities.supported_composite_alpha.contains(*a))
            .unwrap_or(vk::CompositeAlphaFlagsKHR::PRE_MULTIPLIED);
        // All windows are drawn into, nearly all are copied to as well.
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT
            | (vk::ImageUsageFlags::TRANSFER_DST & capabilities.supported_usage_flags);
        let takes_copies = usage.contains(vk::ImageUsageFlags::TRANSFER_DST);
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(surface.raw)
            .min_image_count((capabilities.min_image_count + 1).min(most))
            .image_format(format.raw())
            .image_color_space(COLOR_SPACE)
            .image_extent(extent)
            .image_array_layers(1)
            .image_usage(usage)
            .pre_transform(capabilities.current_transform)
            .composite_alpha(alpha)
            .present_mode(mode.raw())
            .clipped(true);
        let shared = device.shared().clone();
        let loader = khr::swapchain::Device::new(&shared.instance.raw, &shared.raw);
        let raw = unsafe { loader.create_swapchain(&info, None) }
            .map_err(|e| Error::vulkan("vkCreateSwapchainKHR", e))?;
        let (commands, images, ready, drawn) = (vec![], vec![], vec![], vec![]);
        let mut chain = Swapchain {
            commands,
            images,
            ready,
            drawn,
            presenter: None,
            raw,
            loader,
            format,
            takes_copies,
            last: None,
            stray: None,
            is_over: false,
            shared,
        };
        chain.fill(device, extent)?;
        Ok(Some(chain))
    }

    fn fill(&mut self, device: &Device, extent: vk::Extent2D) -> Result<()> {
        let images = unsafe { self.loader.get_swapchain_images(self.raw) }
            .map_err(|e| Error::vulkan("vkGetSwapchainImagesKHR", e))?;
        for raw in images {
            self.images.push(Image::of_swapchain(
                &self.shared,
                "window.image",
                raw,
                extent,
                self.format,
            )?);
            self.drawn.push(self.semaphore("window.drawn")?);
        }
        for _ in 0..ON_THEIR_WAY {
            self.commands.push(Commands::new(device, "window.show")?);
            self.ready.push(self.semaphore("window.ready")?);
        }
        self.presenter = Some(Presenter::start(Chain {
            raw: self.raw,
            loader: self.loader.clone(),
            ready: std::array::from_fn(|i| self.ready[i]),
            drawn: self.drawn.clone(),
            shared: self.shared.clone(),
        })?);
        Ok(())
    }

    fn semaphore(&self, name: &str) -> Result<vk::Semaphore> {
        let made =
            unsafe { self.shared.raw.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) };
        let semaphore = made.map_err(|e| Error::vulkan("vkCreateSemaphore", e))?;
        self.shared.name(semaphore, name);
        Ok(semaphore)
    }

    pub fn format(&self) -> TargetFormat {
        self.format
    }

    /// Whether images may be copied to its own.
    pub fn takes_copies(&self) -> bool {
        self.takes_copies
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.images.first().map_or([0, 0], |image| image.size().into())
    }

    /// Has `draw` fill all of an image, and has it shown. What `draw` records is with the device
    /// when this returns, ahead of whatever is submitted next.
    pub fn show(
        &mut self,
        draw: impl FnOnce(&mut Recorder<'_>, &mut Image) -> Result<()>,
    ) -> Result<Shown> {
        let Some(presenter) = &self.presenter else { return Ok(Shown::Outdated) };
        let (i_image, i_slot) = match presenter.told.recv_timeout(PATIENCE) {
            Ok(Told::Image { i_image, i_slot }) => (i_image, i_slot),
            Ok(Told::Failed(error)) => {
                self.is_over = true;
                return Err(error);
            }
            Ok(Told::Outdated) => {
                self.is_over = true;
                return Ok(Shown::Outdated);
            }
            Err(RecvTimeoutError::Timeout) => return Ok(Shown::Late),
            // It has told that before, unless it panicked.
            Err(RecvTimeoutError::Disconnected) if self.is_over => return Ok(Shown::Outdated),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Error::Fault { what: "the show thread panicked".to_owned() });
            }
        };
        self.stray = Some(i_slot);
        let (commands, image) = (&mut self.commands[i_slot], &mut self.images[i_image]);
        commands.record(Barriers::Placed, |rec| {
            draw(rec, image)?;
            rec.show(image);
            Ok(())
        })?;
        let done = commands.submit_between(Some(self.ready[i_slot]), Some(self.drawn[i_image]))?;
        self.stray = None;
        let (handed_over, is_handed_over) = sync_channel(0);
        self.last = Some((done.clone(), is_handed_over));
        presenter.show(Drawn { i_image, i_slot, done, handed_over });
        Ok(Shown::Yes)
    }

    /// Returns when the last picture has been drawn and handed over to the window system.
    pub fn wait(&self) -> Result<()> {
        let Some((done, is_handed_over)) = &self.last else { return Ok(()) };
        done.wait()?;
        // Nothing is ever sent: the other end goes when it is, or with the thread that did not come
        // to it. A window system that keeps the thread is not waited for longer than for an image.
        let _ = is_handed_over.recv_timeout(PATIENCE);
        Ok(())
    }

    /// Waits on the device for images that nobody drew into: a semaphore that is still to be
    /// signalled may not go.
    fn take_back(&self, presenter: &Presenter) {
        let told = presenter.told.try_iter().filter_map(|told| match told {
            Told::Image { i_slot, .. } => Some(i_slot),
            Told::Outdated | Told::Failed(_) => None,
        });
        for i_slot in told.chain(self.stray) {
            let wait = [vk::SemaphoreSubmitInfo::default()
                .semaphore(self.ready[i_slot])
                .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
            let info = [vk::SubmitInfo2::default().wait_semaphore_infos(&wait)];
            // A lost device signals nothing any more.
            let _ = unsafe {
                self.shared.raw.queue_submit2(*self.shared.lock_queue(), &info, vk::Fence::null())
            };
        }
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        if let Some(mut presenter) = self.presenter.take() {
            presenter.end();
            self.take_back(&presenter);
        }
        // SAFETY: all that was submitted or shown ends before what it uses; a lost device has ended
        // it.
        unsafe {
            let _ = self.shared.raw.queue_wait_idle(*self.shared.lock_queue());
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
    vk::Extent2D {
        width: size[0].clamp(least.width, most.width),
        height: size[1].clamp(least.height, most.height),
    }
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
}
