//! Widgets over a window's picture: egui's triangles, drawn by its renderer for ash into the
//! window's image.

use std::sync::Arc;

use ash::vk;
use egui::epaint::textures::TexturesDelta;
use egui::{ClippedPrimitive, TextureId};
use egui_ash_renderer::allocator::GpuAllocator;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer};

use super::device::{Device, Shared};
use super::memory::{Image, TargetFormat};
use super::presenter::ON_THEIR_WAY;
use super::recorder::Recorder;
use super::swapchain::Swapchain;
use crate::error::{Error, Result};

/// What is drawn: egui's, tessellated.
#[derive(Debug, Clone)]
pub struct Widgets {
    /// What lies within the backdrop: drawn once, and copied to every picture then.
    pub within: Vec<ClippedPrimitive>,
    /// What is drawn over all.
    pub above: Vec<ClippedPrimitive>,
    pub pixels_per_point: f32,
    /// Below it nothing of the picture is seen.
    pub backdrop: Option<Backdrop>,
}

impl Widgets {
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
    /// Points from the window's upper left corner.
    pub room: egui::Rect,
    /// Code values.
    pub color: egui::Color32,
}

impl Backdrop {
    /// In pixels, as far as it lies in the image; none where nothing of it does.
    fn area(&self, pixels_per_point: f32, extent: vk::Extent2D) -> Option<vk::Rect2D> {
        // Beyond the picture's pixels casts stop at their ends.
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

/// Draws widgets. Pictures that show them must be done before it goes.
pub struct Overlay {
    /// None only while it is dropped: it goes before the pool.
    renderer: Option<Renderer<GpuAllocator>>,
    /// For textures on their way.
    pool: vk::CommandPool,
    /// What the picture after the next change does not show any more.
    to_free: Vec<TextureId>,
    /// None where the window's images cannot be copied to.
    kept: Option<Kept>,
    shared: Arc<Shared>,
}

/// A picture of what lies within a backdrop: a copy costs a tenth of drawing it anew.
struct Kept {
    image: Image,
    of: Option<Arc<Widgets>>,
}

/// Each picture draws twice at most, and as many may be on their way.
const DRAWS: usize = 2 * ON_THEIR_WAY;

fn failed(what: &'static str) -> impl Fn(egui_ash_renderer::RendererError) -> Error {
    move |e| Error::vulkan(format!("window.widgets: {what}"), e)
}

impl Overlay {
    /// Over images of `format`.
    pub fn new(device: &Device, format: TargetFormat) -> Result<Overlay> {
        let shared = device.shared().clone();
        let mode = RenderMode::DynamicRendering(DynamicRendering {
            color_attachment_format: format.raw(),
            depth_attachment_format: None,
            stencil_attachment_format: None,
        });
        // The image holds code values, and so do blended widgets.
        let options =
            Options { in_flight_frames: DRAWS, srgb_framebuffer: false, ..Options::default() };
        let allocator = Arc::clone(&shared.allocator);
        let renderer = Renderer::with_gpu_allocator(allocator, shared.raw.clone(), mode, options);
        let renderer = Some(renderer.map_err(failed("making its renderer"))?);
        let mut overlay = Overlay {
            renderer,
            pool: vk::CommandPool::null(),
            to_free: vec![],
            kept: None,
            shared,
        };
        let info =
            vk::CommandPoolCreateInfo::default().queue_family_index(overlay.shared.queue_family);
        overlay.pool = unsafe { overlay.shared.raw.create_command_pool(&info, None) }
            .map_err(|e| Error::vulkan("vkCreateCommandPool window.widgets", e))?;
        Ok(overlay)
    }

    /// Takes over what of its textures has changed. Waits for the device where anything has: hardly
    /// ever.
    pub fn set_textures(&mut self, mut changes: TexturesDelta) -> Result<()> {
        let Some(renderer) = &mut self.renderer else { return Ok(()) };
        if changes.is_empty() && self.to_free.is_empty() {
            return Ok(());
        }
        let queue = self.shared.lock_queue();
        // Pictures on their way may show what is replaced.
        unsafe { self.shared.raw.queue_wait_idle(*queue) }
            .map_err(|e| Error::vulkan("vkQueueWaitIdle", e))?;
        for id in self.to_free.drain(..) {
            renderer.free_texture(id).map_err(failed("freeing a texture"))?;
        }
        for (id, deltas) in std::mem::take(&mut changes.set) {
            for delta in &deltas {
                renderer.set_texture(*queue, self.pool, id, delta).map_err(failed("a texture"))?;
            }
        }
        self.to_free.extend(std::mem::take(&mut changes.free));
        Ok(())
    }

    /// For images of another size from now on. None that it has drawn into may be on its way.
    pub fn fit(&mut self, device: &Device, chain: &Swapchain) -> Result<()> {
        self.kept = None;
        if chain.takes_copies() {
            let [width, height] = chain.size();
            let image =
                Image::color_target(device, "window.widgets", width, height, chain.format())?;
            self.kept = Some(Kept { image, of: None });
        }
        Ok(())
    }

    /// Draws over what is in `image`.
    pub fn record(
        &mut self,
        rec: &mut Recorder<'_>,
        image: &mut Image,
        widgets: &Arc<Widgets>,
    ) -> Result<()> {
        let Overlay { renderer: Some(renderer), kept, shared, .. } = self else { return Ok(()) };
        let scale = widgets.pixels_per_point;
        let area = widgets.backdrop.and_then(|b| Some((b.area(scale, image.extent)?, b.color)));
        let mut draw = |rec: &mut Recorder<'_>,
                        image: &mut Image,
                        clear,
                        primitives: &[ClippedPrimitive]| {
            rec.draw_over(image, |commands, extent| {
                if let Some((area, color)) = clear {
                    fill(shared, commands, area, color);
                }
                renderer.cmd_draw(commands, extent, scale, primitives).map_err(failed("drawing"))
            })
        };
        match (kept, area) {
            (Some(kept), Some((place, _))) => {
                if !kept.of.as_ref().is_some_and(|of| Arc::ptr_eq(of, widgets)) {
                    draw(rec, &mut kept.image, area, &widgets.within)?;
                    kept.of = Some(widgets.clone());
                }
                rec.copy_part(&mut kept.image, image, place);
            }
            _ if area.is_some() || !widgets.within.is_empty() => {
                draw(rec, image, area, &widgets.within)?
            }
            _ => {}
        }
        if widgets.above.is_empty() { Ok(()) } else { draw(rec, image, None, &widgets.above) }
    }
}

/// Makes `area` of what is drawn into one colour.
fn fill(shared: &Shared, commands: vk::CommandBuffer, area: vk::Rect2D, color: egui::Color32) {
    let float32 = color.to_array().map(|v| f32::from(v) / 255.0);
    let clear = vk::ClearAttachment {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        color_attachment: 0,
        clear_value: vk::ClearValue { color: vk::ClearColorValue { float32 } },
    };
    let rect = vk::ClearRect { rect: area, base_array_layer: 0, layer_count: 1 };
    unsafe { shared.raw.cmd_clear_attachments(commands, &[clear], &[rect]) };
}

impl Drop for Overlay {
    fn drop(&mut self) {
        // SAFETY: pictures are done; uploads were waited for.
        unsafe {
            let _ = self.shared.raw.queue_wait_idle(*self.shared.lock_queue());
            drop(self.renderer.take());
            self.shared.raw.destroy_command_pool(self.pool, None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Color32, Rect, pos2};

    #[test]
    fn a_backdrop_ends_where_the_image_does() {
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
