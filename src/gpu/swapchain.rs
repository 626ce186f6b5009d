//! The images of a window: acquired, drawn into and presented.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use ash::{khr, vk};

use super::barriers::Barriers;
use super::call::Call;
use super::commands::{Commands, Submission};
use super::device::{Device, Owned, SharedDevice};
use super::image::{Image, TargetFormat};
use super::presenter::{Drawn, Event, FRAMES_IN_FLIGHT, PresentQueue, Presenter};
use super::recorder::Recorder;
use super::shown::{Shown, Watcher};
use super::surface::{COLOR_SPACE, PresentMode, Surface};
use crate::error::{Error, Result};

/// The outcome of showing a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PresentOutcome {
    /// The picture is on its way to the window.
    Presented,
    /// The window system had no image to draw into within a quarter of a second: the window is
    /// hidden.
    Late,
    /// The window has another size by now, or is hidden: make a new swapchain.
    Outdated,
}

/// A window behind others may get no images at all; a thread that waited longer for one could not
/// be stopped.
const PATIENCE: Duration = Duration::from_millis(250);

/// The images of a window.
pub struct Swapchain {
    /// By slot: one for each frame in flight.
    commands: Vec<Commands>,
    images: Vec<Image>,
    /// By slot: the image may be drawn into.
    ready: Vec<Owned<vk::Semaphore>>,
    /// By image: it may be presented.
    drawn: Vec<Owned<vk::Semaphore>>,
    /// The thread that acquires and presents; none until all of the above is there.
    presenter: Option<Presenter>,
    /// The thread that learns when pictures are visible, where the device tells.
    watcher: Option<Watcher>,
    raw: vk::SwapchainKHR,
    loader: khr::swapchain::Device,
    format: TargetFormat,
    takes_copies: bool,
    /// The last picture's submission; its channel closes when the window system has the image.
    last: Option<(Submission, Receiver<()>)>,
    /// The slot of an acquired image that was not drawn into, because recording failed.
    i_unused_slot: Option<usize>,
    /// Whether the presenter has reported its end.
    is_over: bool,
    shared: Arc<SharedDevice>,
}

impl Swapchain {
    /// Makes the images of `surface`, as large as the window; `size` counts where the window
    /// system leaves it open. None where the window is minimised. An earlier swapchain of the
    /// surface must be gone.
    ///
    /// # Errors
    /// The device or the surface is lost, or the window takes none of our formats.
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
        // Every window can be drawn into, nearly every one can be copied to.
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT
            | (vk::ImageUsageFlags::TRANSFER_DST & capabilities.supported_usage_flags);
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
        let loader = khr::swapchain::Device::new(&shared.instance.vulkan.raw, &shared.raw);
        let raw =
            unsafe { loader.create_swapchain(&info, None) }.of_call("vkCreateSwapchainKHR", "")?;
        let mut chain = Swapchain {
            commands: vec![],
            images: vec![],
            ready: vec![],
            drawn: vec![],
            presenter: None,
            watcher: None,
            raw,
            loader,
            format,
            takes_copies: usage.contains(vk::ImageUsageFlags::TRANSFER_DST),
            last: None,
            i_unused_slot: None,
            is_over: false,
            shared,
        };
        chain.fill(device, extent)?;
        Ok(Some(chain))
    }

    fn fill(&mut self, device: &Device, extent: vk::Extent2D) -> Result<()> {
        let images = unsafe { self.loader.get_swapchain_images(self.raw) }
            .of_call("vkGetSwapchainImagesKHR", "")?;
        let (shared, kind) = (&self.shared, vk::SemaphoreType::BINARY);
        for raw in images {
            let image = Image::of_swapchain(shared, "window.image", raw, extent, self.format)?;
            self.images.push(image);
            self.drawn.push(shared.semaphore("window.drawn", kind)?);
        }
        for _ in 0..FRAMES_IN_FLIGHT {
            self.commands.push(Commands::whole(device, "window.show")?);
            self.ready.push(shared.semaphore("window.ready", kind)?);
        }
        let watched = shared.tells_shown.then(|| {
            let vulkan = &shared.instance.vulkan.raw;
            Watcher::start(khr::present_wait::Device::new(vulkan, &shared.raw), self.raw)
        });
        let (watcher, presented) = watched.transpose()?.unzip();
        self.watcher = watcher;
        self.presenter = Some(Presenter::start(PresentQueue {
            raw: self.raw,
            loader: self.loader.clone(),
            ready: std::array::from_fn(|i| self.ready[i].raw),
            drawn: self.drawn.iter().map(|semaphore| semaphore.raw).collect(),
            presented,
            shared: self.shared.clone(),
        })?);
        Ok(())
    }

    /// Returns the format of the images.
    pub fn format(&self) -> TargetFormat {
        self.format
    }

    /// Whether the images can be copied to.
    pub fn takes_copies(&self) -> bool {
        self.takes_copies
    }

    /// Returns width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.images.first().map_or([0, 0], |image| image.size().into())
    }

    /// Has `draw` fill an image, and has it presented. When this returns, `draw`'s commands are
    /// submitted, ahead of the next submission. Work on the picture began at `begun`, which
    /// [`Swapchain::take_shown`] returns with its other times.
    ///
    /// # Errors
    /// `draw` fails, or the device is lost.
    pub fn show(
        &mut self,
        begun: Instant,
        draw: impl FnOnce(&mut Recorder<'_>, &mut Image) -> Result<()>,
    ) -> Result<PresentOutcome> {
        let Some(presenter) = &self.presenter else { return Ok(PresentOutcome::Outdated) };
        let event = presenter.events.recv_timeout(PATIENCE);
        let was_over = self.is_over;
        self.is_over |= matches!(event, Ok(Event::Failed(_) | Event::Outdated));
        let (i_image, i_slot) = match event {
            Ok(Event::Acquired { i_image, i_slot }) => (i_image, i_slot),
            Ok(Event::Failed(error)) => return Err(error),
            Ok(Event::Outdated) => return Ok(PresentOutcome::Outdated),
            Err(RecvTimeoutError::Timeout) => return Ok(PresentOutcome::Late),
            // A thread that ended has reported why, unless it panicked.
            Err(RecvTimeoutError::Disconnected) if was_over => return Ok(PresentOutcome::Outdated),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Error::Fault { what: "the show thread panicked".to_owned() });
            }
        };
        self.i_unused_slot = Some(i_slot);
        let (commands, image) = (&mut self.commands[i_slot], &mut self.images[i_image]);
        commands.record(Barriers::Placed, |rec| {
            draw(rec, image)?;
            rec.present(image);
            Ok(())
        })?;
        let (ready, drawn) = (self.ready[i_slot].raw, self.drawn[i_image].raw);
        let submission = commands.submit_between(Some(ready), Some(drawn))?;
        self.i_unused_slot = None;
        let (handed_over, is_handed_over) = sync_channel(0);
        self.last = Some((submission.clone(), is_handed_over));
        presenter.present(Drawn { i_image, i_slot, submission, begun, handed_over });
        Ok(PresentOutcome::Presented)
    }

    /// Takes the pictures that the window system has done with since the last call, in their
    /// order; none where the device does not tell ([`DeviceInfo::tells_shown`]).
    ///
    /// [`DeviceInfo::tells_shown`]: super::DeviceInfo::tells_shown
    pub fn take_shown(&self) -> impl Iterator<Item = Shown> {
        self.watcher.iter().flat_map(|watcher| watcher.shown.try_iter())
    }

    /// Returns when the last picture has been drawn and handed to the window system.
    ///
    /// # Errors
    /// The device is lost.
    pub fn wait(&self) -> Result<()> {
        let Some((submission, is_handed_over)) = &self.last else { return Ok(()) };
        submission.wait()?;
        // Nothing is ever sent: the channel closes when the image is handed over, or with the
        // thread. A window system that blocks the thread is waited for as long as for an image.
        let _ = is_handed_over.recv_timeout(PATIENCE);
        Ok(())
    }

    /// Waits on the device for acquired images that were not drawn into: a semaphore that is yet
    /// to be signalled must not be destroyed.
    fn take_back(&self, presenter: &Presenter) {
        let acquired = presenter.events.try_iter().filter_map(|event| match event {
            Event::Acquired { i_slot, .. } => Some(i_slot),
            Event::Outdated | Event::Failed(_) => None,
        });
        for i_slot in acquired.chain(self.i_unused_slot) {
            let wait = [vk::SemaphoreSubmitInfo::default()
                .semaphore(self.ready[i_slot].raw)
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
        if let Some(watcher) = &mut self.watcher {
            watcher.end();
        }
        if self.shared.is_abandoned() {
            return;
        }
        // SAFETY: all submissions and presents end before the objects that they use; a lost device
        // has ended them.
        unsafe {
            let _ = self.shared.raw.queue_wait_idle(*self.shared.lock_queue());
            self.commands.clear();
            self.images.clear();
            self.loader.destroy_swapchain(self.raw, None);
        }
    }
}

/// Returns the window system's extent; where that is open, `size` within the limits.
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
    fn the_window_systems_size_comes_before_ours() {
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
