//! What lies between a device and a window: the surface, its images, and what draws a picture and
//! widgets into them.

use std::sync::Arc;

use super::widgets::{SharedFace, take};
use crate::error::Result;
use crate::frame::render::Renderer;
use crate::frame::stage::{Bed, DeviceChoice};
use crate::gpu::TargetFormat;
use crate::gpu::{
    Buffer, Commands, Instance, MemoryUsage, Overlay, PresentMode, PresentOutcome, Recorder,
    Surface, Swapchain,
};
use crate::model::film::{Film, ToneMap};
use crate::passes::present::{self, Compare, Present};

// Dropped in this order: what lies on the device before the device, that before the surface.
pub struct Pane {
    swapchain: Option<Swapchain>,
    /// None until there is something to draw it into.
    overlay: Option<Overlay>,
    pub bed: Bed,
    surface: Surface,
    modes: Vec<PresentMode>,
    i_mode: usize,
}

impl Pane {
    /// On a window's `surface`; `mode` where there is such, else fifo.
    pub fn open(
        (instance, surface): (Arc<Instance>, Surface),
        choice: &DeviceChoice,
        mode: PresentMode,
    ) -> Result<Pane> {
        let bed = Bed::of_instance(instance, choice, choice.sources()?)?;
        surface.check(&bed.device)?;
        let modes = surface.modes(&bed.device)?;
        let i_mode = modes.iter().position(|m| *m == mode).unwrap_or(0);
        Ok(Pane { swapchain: None, overlay: None, bed, surface, modes, i_mode })
    }

    /// When pictures are shown.
    pub fn mode(&self) -> PresentMode {
        self.modes.get(self.i_mode).copied().unwrap_or(PresentMode::Fifo)
    }

    /// Goes so many modes on, of those that the window has; from the next images on.
    pub fn turn_mode(&mut self, n: usize) {
        self.i_mode = (self.i_mode + n) % self.modes.len().max(1);
    }

    /// Makes the window's images anew; false where nothing of the window is seen. `size` is asked
    /// for where the window system leaves it open.
    pub fn remake(&mut self, size: [u32; 2]) -> Result<bool> {
        // A surface has one swapchain at a time.
        self.swapchain = None;
        self.swapchain = Swapchain::new(&self.bed.device, &self.surface, size, self.mode())?;
        if let Some(chain) = &self.swapchain {
            let mut overlay = match self.overlay.take() {
                Some(overlay) => overlay,
                None => Overlay::new(&self.bed.device, chain.format())?,
            };
            overlay.fit(&self.bed.device, chain)?;
            self.overlay = Some(overlay);
        }
        Ok(self.swapchain.is_some())
    }

    /// Width and height of its images in pixels; none where nothing is seen.
    pub fn size(&self) -> Option<[u32; 2]> {
        self.swapchain.as_ref().map(Swapchain::size)
    }

    /// What shows pictures of `renderer`; none where nothing is seen.
    pub fn showing(&self, renderer: &Renderer, film: &Film) -> Result<Option<Showing>> {
        let Some(chain) = &self.swapchain else { return Ok(None) };
        let (format, n_bytes): (TargetFormat, u64) = renderer.picture_format();
        let Film { width, height, background, exposure, tone_map, .. } = *film;
        let bed = &self.bed;
        let picture = |name| Buffer::new::<u8>(&bed.device, name, n_bytes, MemoryUsage::Device);
        let pictures = [picture("window.picture")?, picture("window.other")?];
        // What nothing was drawn into is all background.
        Commands::new(&bed.device, "window.blank")?.run(|rec| {
            pictures.iter().for_each(|picture| rec.fill(picture, 0));
            Ok(())
        })?;
        Ok(Some(Showing {
            present: Present::new(&bed.device, bed.compiler(), format, chain.format())?,
            pictures,
            shown: present::Shown {
                background: background.as_vec3().to_array(),
                exposure: exposure as f32,
                size: [width, height],
                corner: [0, 0],
                is_neutral: tone_map == ToneMap::Neutral,
                compare: None,
            },
        }))
    }

    /// Shows what `first` drew last, the background alone where there is none, under `face`; and
    /// what `second` did, as `compare` says. False where the window is another by now.
    pub fn show(
        &mut self,
        showing: &Showing,
        [first, second]: [Option<&mut Renderer>; 2],
        compare: Option<Compare>,
        face: &SharedFace,
    ) -> Result<bool> {
        let (Some(swapchain), Some(overlay)) = (&mut self.swapchain, &mut self.overlay) else {
            return Ok(false);
        };
        let widgets = take(face, overlay)?;
        let shown = swapchain.show(|rec, image| {
            let [own_first, own_second] = &showing.pictures;
            let first = picture(rec, first, own_first);
            let second = if second.is_some() { picture(rec, second, own_second) } else { first };
            showing.present.record(
                rec,
                [first, second],
                image,
                &present::Shown { compare, ..showing.shown },
            )?;
            widgets.map_or(Ok(()), |widgets| overlay.record(rec, image, &widgets))
        })?;
        Ok(shown != PresentOutcome::Outdated)
    }

    /// Returns when the last picture has been drawn and handed over to the window system.
    pub fn wait(&self) -> Result<()> {
        self.swapchain.as_ref().map_or(Ok(()), Swapchain::wait)
    }

    /// Pictures that are on their way may use what is dropped next: they are done with after this.
    pub fn finish(&mut self) {
        self.swapchain = None;
    }

    /// Ends it; an error where validation or the leak report had anything to say.
    pub fn close(self) -> Result<()> {
        let Pane { swapchain, overlay, bed, surface, .. } = self;
        drop((swapchain, overlay));
        // The device goes before the surface, the instance after both.
        let closed = bed.close();
        drop(surface);
        closed
    }
}

/// Where a renderer's last picture lies, which is copied to `own` where it lies in no buffer; `own`
/// without a renderer.
fn picture<'a>(
    rec: &mut Recorder<'_>,
    renderer: Option<&'a mut Renderer>,
    own: &'a Buffer,
) -> &'a Buffer {
    let Some(renderer) = renderer else { return own };
    if renderer.picture().is_none() {
        renderer.record_picture(rec, own);
    }
    renderer.picture().unwrap_or(own)
}

/// What takes renderers' pictures to the window.
pub struct Showing {
    present: Present,
    /// Of those that lie in no buffer, or of nothing.
    pictures: [Buffer; 2],
    shown: present::Shown,
}
