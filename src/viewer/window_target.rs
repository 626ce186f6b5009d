//! A window as a render target: surface, swapchain images, and the draws that fill them.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::egui_layer::{WidgetFrame, take_widgets};
use crate::error::Result;
use crate::frame::{DeviceChoice, GpuContext, Renderer};
use crate::gpu::{
    Buffer, Commands, Instance, MemoryUsage, Overlay, PresentMode, PresentOutcome, Recorder, Shown,
    Surface, Swapchain,
};
use crate::layout::sky::SkyRecord;
use crate::model::film::Film;
use crate::model::scene::Scene;
use crate::passes::present::{self, Compare, Present};

/// Delay before another attempt while the window has no visible area: too short to notice when the
/// window returns, and long enough not to occupy a core.
pub const HIDDEN_DELAY: Duration = Duration::from_millis(50);

/// A window that a device draws pictures and widgets into.
// Fields are dropped in this order: objects of the device, the device, the surface.
pub struct WindowTarget {
    swapchain: Option<Swapchain>,
    /// `None` until the first swapchain exists.
    overlay: Option<Overlay>,
    /// The device.
    pub gpu: GpuContext,
    surface: Surface,
    modes: Vec<PresentMode>,
    i_mode: usize,
}

impl WindowTarget {
    /// Opens a device for `surface`. Presents by `mode` where the window supports it, else by fifo.
    ///
    /// # Errors
    /// No device can be opened, or it cannot present to the window.
    pub fn open(
        (instance, surface): (Arc<Instance>, Surface),
        choice: &DeviceChoice,
        mode: PresentMode,
    ) -> Result<WindowTarget> {
        let gpu = GpuContext::with_instance(instance, choice, choice.sources()?)?;
        surface.check(&gpu.device)?;
        let modes = surface.modes(&gpu.device)?;
        let i_mode = modes.iter().position(|m| *m == mode).unwrap_or(0);
        Ok(WindowTarget { swapchain: None, overlay: None, gpu, surface, modes, i_mode })
    }

    /// Returns the mode that the next swapchain presents by.
    pub fn mode(&self) -> PresentMode {
        self.modes.get(self.i_mode).copied().unwrap_or(PresentMode::Fifo)
    }

    /// Selects the mode `n` places further in the window's list, for the next swapchain.
    pub fn advance_mode(&mut self, n: usize) {
        self.i_mode = (self.i_mode + n) % self.modes.len().max(1);
    }

    /// Recreates the swapchain. Returns false where the window has no visible area.
    ///
    /// `size`, in pixels, is used where the window system leaves the size open.
    ///
    /// # Errors
    /// Vulkan refuses the swapchain, or the overlay does not fit it.
    pub fn recreate(&mut self, size: [u32; 2]) -> Result<bool> {
        // A surface has one swapchain at a time.
        self.swapchain = None;
        self.swapchain = Swapchain::new(&self.gpu.device, &self.surface, size, self.mode())?;
        let Some(chain) = &self.swapchain else { return Ok(false) };
        if self.overlay.is_none() {
            self.overlay = Some(Overlay::new(&self.gpu.device, chain.format())?);
        }
        if let Some(overlay) = &mut self.overlay {
            overlay.fit(&self.gpu.device, chain)?;
        }
        Ok(true)
    }

    /// Returns width and height of the swapchain's images in pixels; `None` without a swapchain.
    pub fn size(&self) -> Option<[u32; 2]> {
        self.swapchain.as_ref().map(Swapchain::size)
    }

    /// Creates the draw that shows `renderer`'s pictures of `scene`; `None` without a swapchain.
    ///
    /// # Errors
    /// The device has no memory for the pictures, or the shader does not compile.
    pub fn picture_draw(&self, renderer: &Renderer, scene: &Scene) -> Result<Option<PictureDraw>> {
        let Some(chain) = &self.swapchain else { return Ok(None) };
        let (format, n_bytes) = renderer.picture_format();
        let Film { width, height, background, exposure, tone_map, .. } = scene.film;
        let device = &self.gpu.device;
        let picture = |name| Buffer::new::<u8>(device, name, n_bytes, MemoryUsage::Device);
        let pictures = [picture("window.picture")?, picture("window.other")?];
        let no_sky = Buffer::new::<SkyRecord>(device, "window.sky", 1, MemoryUsage::Device)?;
        // A picture that was never drawn is transparent, so the background shows.
        Commands::new(device, "window.blank")?.run(|rec| {
            pictures.iter().chain([&no_sky]).for_each(|buffer| rec.fill(buffer, 0));
            Ok(())
        })?;
        Ok(Some(PictureDraw {
            present: Present::new(
                device,
                self.gpu.compiler(),
                [format, chain.format()],
                scene.sky.is_some(),
            )?,
            pictures,
            no_sky,
            shown: present::Shown {
                background: background.as_vec3().to_array(),
                exposure: exposure as f32,
                size: [width, height],
                corner: [0, 0],
                tone_map: tone_map as u32,
                compare: None,
            },
        }))
    }

    /// Presents the last picture of `first` with `widgets` over it. `compare` adds the last picture
    /// of `second`. Without `first` only the background shows. Work on the picture began at
    /// `begun`.
    ///
    /// Returns false where the swapchain no longer fits the window.
    ///
    /// # Errors
    /// Recording, submission or presentation failed.
    pub fn present(
        &mut self,
        begun: Instant,
        draw: &PictureDraw,
        [first, second]: [Option<&mut Renderer>; 2],
        compare: Option<Compare>,
        widgets: &Mutex<WidgetFrame>,
    ) -> Result<bool> {
        let (Some(swapchain), Some(overlay)) = (&mut self.swapchain, &mut self.overlay) else {
            return Ok(false);
        };
        let widgets = take_widgets(widgets, overlay)?;
        let shown = swapchain.show(begun, |rec, image| {
            let [own_first, own_second] = &draw.pictures;
            let [first, sky] = picture(rec, first, [own_first, &draw.no_sky]);
            let second = match second.is_some() {
                true => picture(rec, second, [own_second, &draw.no_sky])[0],
                false => first,
            };
            let shown = present::Shown { compare, ..draw.shown };
            draw.present.record(rec, [first, second], sky, image, &shown)?;
            widgets.map_or(Ok(()), |widgets| overlay.record(rec, image, &widgets))
        })?;
        Ok(shown != PresentOutcome::Outdated)
    }

    /// Whether the device tells when pictures are visible.
    pub fn tells_shown(&self) -> bool {
        self.gpu.device.info().tells_shown
    }

    /// Takes the pictures that the window system has done with since the last call.
    pub fn take_shown(&self) -> impl Iterator<Item = Shown> {
        self.swapchain.iter().flat_map(Swapchain::take_shown)
    }

    /// Waits until the last picture has been drawn and handed to the window system.
    ///
    /// # Errors
    /// The device is lost.
    pub fn wait(&self) -> Result<()> {
        self.swapchain.as_ref().map_or(Ok(()), Swapchain::wait)
    }

    /// Waits for all pictures in flight and drops the swapchain, so that their sources may be
    /// dropped.
    pub fn finish(&mut self) {
        self.swapchain = None;
    }

    /// Closes the device.
    ///
    /// # Errors
    /// Validation or the leak report has found a fault.
    pub fn close(self) -> Result<()> {
        let WindowTarget { swapchain, overlay, gpu, surface, .. } = self;
        drop((swapchain, overlay));
        // The device is destroyed before the surface, the instance after both.
        let closed = gpu.close();
        drop(surface);
        closed
    }
}

/// Returns the buffers with `renderer`'s last picture and its sky. The picture is the renderer's
/// own, or `copy` after a copy from its image; without a renderer or a sky they are as given.
fn picture<'a>(
    rec: &mut Recorder<'_>,
    renderer: Option<&'a mut Renderer>,
    [copy, no_sky]: [&'a Buffer; 2],
) -> [&'a Buffer; 2] {
    let Some(renderer) = renderer else { return [copy, no_sky] };
    if renderer.picture().is_none() {
        renderer.record_picture(rec, copy);
    }
    [renderer.picture().unwrap_or(copy), renderer.sky().unwrap_or(no_sky)]
}

/// The draw that tone-maps renderers' pictures into a swapchain image.
pub struct PictureDraw {
    present: Present,
    /// Copies of pictures that a renderer holds in no buffer.
    pictures: [Buffer; 2],
    /// The sky until a frame has been drawn.
    no_sky: Buffer,
    shown: present::Shown,
}
