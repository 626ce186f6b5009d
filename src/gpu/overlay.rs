//! Widgets over a window's picture: egui's triangles, drawn by its renderer for ash.

use std::sync::Arc;

use ash::vk;
use egui::epaint::textures::TexturesDelta;
use egui::{ClippedPrimitive, TextureId};
use egui_ash_renderer::allocator::GpuAllocator;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer};

use super::call::Call;
use super::device::{Device, Owned, SharedDevice};
use super::draws::{LoadOp, Target};
use super::image::{Image, TargetFormat};
use super::presenter::FRAMES_IN_FLIGHT;
use super::recorder::Recorder;
use super::swapchain::Swapchain;
use crate::error::{Error, Result};

/// Widgets to draw, tessellated by egui.
#[derive(Debug, Clone)]
pub struct Widgets {
    /// Widgets inside the backdrop: drawn once, then copied to every picture.
    pub within: Vec<ClippedPrimitive>,
    /// Widgets drawn over the rest.
    pub above: Vec<ClippedPrimitive>,
    /// Pixels per point.
    pub pixels_per_point: f32,
    /// A rectangle that hides the picture.
    pub backdrop: Option<Backdrop>,
}

impl Widgets {
    /// Sorts `primitives` into those inside the backdrop and the others.
    pub fn new(
        primitives: Vec<ClippedPrimitive>,
        pixels_per_point: f32,
        backdrop: Option<Backdrop>,
    ) -> Widgets {
        let is_within =
            |p: &ClippedPrimitive| backdrop.is_some_and(|b| b.room.contains_rect(p.clip_rect));
        let (within, above) = primitives.into_iter().partition(is_within);
        Widgets { within, above, pixels_per_point, backdrop }
    }
}

/// A rectangle of one colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Backdrop {
    /// The rectangle, in points from the window's upper left corner.
    pub room: egui::Rect,
    /// Its colour, in code values.
    pub color: egui::Color32,
}

impl Backdrop {
    /// Returns the part inside the image in pixels; none where that is empty.
    fn area(&self, pixels_per_point: f32, extent: vk::Extent2D) -> Option<vk::Rect2D> {
        // Casts saturate where the rectangle reaches beyond the pixels.
        let px = |points: f32, most: u32| ((points * pixels_per_point).round() as u32).min(most);
        let (left, right) = (px(self.room.min.x, extent.width), px(self.room.max.x, extent.width));
        let (top, bottom) =
            (px(self.room.min.y, extent.height), px(self.room.max.y, extent.height));
        let area = vk::Rect2D {
            offset: vk::Offset2D { x: left as i32, y: top as i32 },
            extent: vk::Extent2D {
                width: right.checked_sub(left)?,
                height: bottom.checked_sub(top)?,
            },
        };
        (area.extent.width > 0 && area.extent.height > 0).then_some(area)
    }
}

/// Draws widgets. Submissions that show them must have finished before it is dropped.
// Fields drop in order: the renderer before the pool.
pub struct Overlay {
    renderer: Renderer<GpuAllocator>,
    /// For the uploads of textures.
    pool: Owned<vk::CommandPool>,
    /// Textures that the next change frees: the last picture may still show them.
    to_free: Vec<TextureId>,
    /// None where the window's images cannot be copied to.
    cached: Option<CachedWidgets>,
    shared: Arc<SharedDevice>,
}

/// A picture of the widgets inside a backdrop: copying it takes a tenth of the time of drawing it.
struct CachedWidgets {
    image: Image,
    of: Option<Arc<Widgets>>,
}

/// Each picture draws widgets twice at most.
const MAX_DRAWS: usize = 2 * FRAMES_IN_FLIGHT;

fn failed(what: &'static str) -> impl Fn(egui_ash_renderer::RendererError) -> Error {
    move |e| Error::vulkan(format!("window.widgets: {what}"), e)
}

impl Overlay {
    /// Makes an overlay for images of `format`.
    ///
    /// # Errors
    /// The renderer or a driver's object cannot be made.
    pub fn new(device: &Device, format: TargetFormat) -> Result<Overlay> {
        let shared = device.shared().clone();
        let mode = RenderMode::DynamicRendering(DynamicRendering {
            color_attachment_format: format.raw(),
            depth_attachment_format: None,
            stencil_attachment_format: None,
        });
        // The image holds code values, and so do blended widgets.
        let options =
            Options { in_flight_frames: MAX_DRAWS, srgb_framebuffer: false, ..Options::default() };
        let allocator = Arc::clone(&shared.allocator);
        let renderer = Renderer::with_gpu_allocator(allocator, shared.raw.clone(), mode, options)
            .map_err(failed("making its renderer"))?;
        let pool = shared.command_pool("window.widgets")?;
        Ok(Overlay { renderer, pool, to_free: vec![], cached: None, shared })
    }

    /// Uploads changed textures. Waits for the device where any has changed, which is rare.
    ///
    /// # Errors
    /// An upload fails, or the device is lost.
    pub fn set_textures(&mut self, mut changes: TexturesDelta) -> Result<()> {
        if changes.is_empty() && self.to_free.is_empty() {
            return Ok(());
        }
        let queue = self.shared.lock_queue();
        // Pictures in flight may show the old textures.
        unsafe { self.shared.raw.queue_wait_idle(*queue) }.of_call("vkQueueWaitIdle", "")?;
        for id in self.to_free.drain(..) {
            self.renderer.free_texture(id).map_err(failed("freeing a texture"))?;
        }
        for (id, deltas) in std::mem::take(&mut changes.set) {
            for delta in &deltas {
                self.renderer
                    .set_texture(*queue, self.pool.raw, id, delta)
                    .map_err(failed("a texture"))?;
            }
        }
        self.to_free.extend(std::mem::take(&mut changes.free));
        Ok(())
    }

    /// Prepares for the images of another swapchain. No submission that drew widgets may be in
    /// flight.
    ///
    /// # Errors
    /// The device has too little memory.
    pub fn fit(&mut self, device: &Device, chain: &Swapchain) -> Result<()> {
        self.cached = None;
        if chain.takes_copies() {
            let [width, height] = chain.size();
            let image =
                Image::color_target(device, "window.widgets", width, height, chain.format())?;
            self.cached = Some(CachedWidgets { image, of: None });
        }
        Ok(())
    }

    /// Draws widgets over the content of `image`.
    ///
    /// # Errors
    /// The renderer fails.
    pub fn record(
        &mut self,
        rec: &mut Recorder<'_>,
        image: &mut Image,
        widgets: &Arc<Widgets>,
    ) -> Result<()> {
        let Overlay { renderer, cached, .. } = self;
        let scale = widgets.pixels_per_point;
        let area = widgets.backdrop.and_then(|b| Some((b.area(scale, image.extent)?, b.color)));
        let mut draw =
            |rec: &mut Recorder<'_>, image: &mut Image, clear, primitives: &[ClippedPrimitive]| {
                rec.render(Target::color(image), LoadOp::Load, |device, commands, all| {
                    if let Some((area, color)) = clear {
                        fill(device, commands, area, color);
                    }
                    renderer
                        .cmd_draw(commands, all.extent, scale, primitives)
                        .map_err(failed("drawing"))
                })
            };
        match (cached, area) {
            (Some(cached), Some((place, _))) => {
                if !cached.of.as_ref().is_some_and(|of| Arc::ptr_eq(of, widgets)) {
                    draw(rec, &mut cached.image, area, &widgets.within)?;
                    cached.of = Some(widgets.clone());
                }
                rec.copy_area(&mut cached.image, image, place);
            }
            _ if area.is_some() || !widgets.within.is_empty() => {
                draw(rec, image, area, &widgets.within)?
            }
            _ => {}
        }
        if widgets.above.is_empty() { Ok(()) } else { draw(rec, image, None, &widgets.above) }
    }
}

/// Fills `area` of the target with one colour.
fn fill(device: &ash::Device, commands: vk::CommandBuffer, area: vk::Rect2D, color: egui::Color32) {
    let float32 = color.to_array().map(|v| f32::from(v) / 255.0);
    let clear = vk::ClearAttachment {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        color_attachment: 0,
        clear_value: vk::ClearValue { color: vk::ClearColorValue { float32 } },
    };
    let rect = vk::ClearRect { rect: area, base_array_layer: 0, layer_count: 1 };
    unsafe { device.cmd_clear_attachments(commands, &[clear], &[rect]) };
}

impl Drop for Overlay {
    fn drop(&mut self) {
        if self.shared.is_abandoned() {
            return;
        }
        // The renderer's buffers may be in use; a lost device has ended that.
        let _ = unsafe { self.shared.raw.queue_wait_idle(*self.shared.lock_queue()) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Color32, Rect, pos2};

    #[test]
    fn a_backdrop_is_cut_at_the_images_edges() {
        let of = |min, max, scale| {
            let backdrop = Backdrop { room: Rect::from_min_max(min, max), color: Color32::BLACK };
            let area = backdrop.area(scale, vk::Extent2D { width: 100, height: 80 })?;
            Some((area.offset.x, area.offset.y, area.extent.width, area.extent.height))
        };
        assert_eq!(of(pos2(60.0, 0.0), pos2(100.0, 80.0), 1.0), Some((60, 0, 40, 80)));
        assert_eq!(of(pos2(30.0, -5.0), pos2(500.0, 10.0), 2.0), Some((60, 0, 40, 20)));
        assert_eq!(of(pos2(60.0, 0.0), pos2(60.0, 80.0), 1.0), None);
        assert_eq!(of(pos2(160.0, 0.0), pos2(260.0, 80.0), 1.0), None);
        assert_eq!(of(pos2(60.0, 0.0), pos2(20.0, 80.0), 1.0), None);
    }
}
