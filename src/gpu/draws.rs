//! Recording of draws into images, and of copies from images.

use ash::vk;
use bytemuck::Pod;

use super::barriers::Scope;
use super::buffer::Buffer;
use super::draw_pipeline::{DrawPipeline, Primitives};
use super::image::Image;
use super::rate::Units;
use super::recorder::Recorder;
use crate::error::{Error, Result};

/// The images that a draw writes.
pub struct Target<'a> {
    /// The colour image.
    pub color: &'a mut Image,
    /// The depth image, of the colour's extent. Depth is reversed: near/z, so 0 is infinitely far.
    pub depth: Option<&'a mut Image>,
}

/// A number of strips or points.
#[derive(Clone, Copy)]
pub enum InstanceCount<'a> {
    /// The host knows the number.
    Known(u32),
    /// The four words from this word of the buffer, written on the device: vertices, instances,
    /// first vertex, first instance.
    Indirect(&'a Buffer, u32),
}

/// The content of a target when drawing starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoadOp {
    /// Zeros: black, infinitely far.
    Clear,
    /// Black; depth keeps its content.
    ClearColor,
    /// The content it has.
    Load,
    /// Undefined: every pixel is drawn over.
    DontCare,
}

impl<'a> Target<'a> {
    /// Returns a target without depth.
    pub fn color(color: &'a mut Image) -> Target<'a> {
        Target { color, depth: None }
    }

    fn check(&self, pipeline: &DrawPipeline) -> Result<()> {
        let (w, h) = self.color.size();
        let what = match &self.depth {
            Some(_) if !pipeline.has_depth => "is not made for a target with depth".to_owned(),
            None if pipeline.has_depth => {
                "is made for a target with depth, the host gives none".to_owned()
            }
            Some(depth) if depth.size() != (w, h) => {
                let (x, y) = depth.size();
                format!("draws {w}×{h} pixels, the host gives depth for {x}×{y}")
            }
            _ => return Ok(()),
        };
        Err(Error::Shader { name: pipeline.pipeline.name.clone(), what })
    }
}

impl Recorder<'_> {
    /// Draws strips or points into `target`.
    ///
    /// # Errors
    /// Target, buffers or push constants differ from the pipeline's.
    pub fn draw<P: Pod>(
        &mut self,
        pipeline: &DrawPipeline,
        target: Target<'_>,
        load: LoadOp,
        buffers: &[&Buffer],
        push: &P,
        instances: InstanceCount<'_>,
    ) -> Result<()> {
        target.check(pipeline)?;
        let counts = match instances {
            InstanceCount::Known(_) => None,
            InstanceCount::Indirect(counts, _) => Some(counts),
        };
        let Target { color, mut depth } = target;
        let n_rows = color.extent.height;
        self.paced(&pipeline.pipeline, Units::Apart(n_rows), |rec, first, n| {
            rec.bind(&pipeline.pipeline, buffers, push, counts)?;
            let load = if first == 0 { load } else { LoadOp::Load };
            let target = Target { color: &mut *color, depth: depth.as_deref_mut() };
            rec.render(target, load, |device, commands, area| {
                let (width, height) = (area.extent.width as f32, area.extent.height as f32);
                let viewport = vk::Viewport { width, height, max_depth: 1.0, ..Default::default() };
                let rows = vk::Rect2D {
                    offset: vk::Offset2D { x: 0, y: first as i32 },
                    extent: vk::Extent2D { width: area.extent.width, height: n },
                };
                unsafe {
                    device.cmd_set_viewport(commands, 0, &[viewport]);
                    device.cmd_set_scissor(commands, 0, &[rows]);
                    match (instances, pipeline.primitives) {
                        (InstanceCount::Known(n), Primitives::Strips) => {
                            device.cmd_draw(commands, 4, n, 0, 0)
                        }
                        (InstanceCount::Known(n), Primitives::Points) => {
                            device.cmd_draw(commands, n, 1, 0, 0)
                        }
                        (InstanceCount::Indirect(counts, word), _) => {
                            let offset = 4 * u64::from(word);
                            device.cmd_draw_indirect(commands, counts.raw(), offset, 1, 0)
                        }
                    }
                }
                Ok(())
            })
        })
    }

    /// Has `draw` record its own draws into `target`, all of whose area it is given.
    pub(super) fn render(
        &mut self,
        target: Target<'_>,
        load: LoadOp,
        draw: impl FnOnce(&ash::Device, vk::CommandBuffer, vk::Rect2D) -> Result<()>,
    ) -> Result<()> {
        let Target { color, depth } = target;
        self.transition(color, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
        let on_color = [attachment(color, load)];
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: color.extent };
        let mut info = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&on_color);
        let on_depth;
        if let Some(depth) = depth {
            self.transition(depth, vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL);
            on_depth =
                attachment(depth, if load == LoadOp::ClearColor { LoadOp::Load } else { load });
            info = info.depth_attachment(&on_depth);
        }
        let (device, commands) = self.raw();
        unsafe { device.cmd_begin_rendering(commands, &info) };
        let drawn = draw(device, commands, area);
        unsafe { device.cmd_end_rendering(commands) };
        drawn
    }

    /// Copies the whole image, rows from the top, tightly packed.
    pub fn copy_image(&mut self, from: &mut Image, to: &Buffer) {
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        self.transition(from, layout);
        self.depend(&[(to.raw(), Scope::TRANSFER_WRITE)]);
        let region = [vk::BufferImageCopy::default()
            .image_subresource(from.layers())
            .image_extent(from.extent.into())];
        let (device, commands) = self.raw();
        unsafe { device.cmd_copy_image_to_buffer(commands, from.raw, layout, to.raw(), &region) };
    }

    /// Copies `area` of an image to the same place of another one of the same format.
    #[cfg(feature = "window")]
    pub(super) fn copy_area(&mut self, from: &mut Image, to: &mut Image, area: vk::Rect2D) {
        self.transition(from, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
        self.transition(to, vk::ImageLayout::TRANSFER_DST_OPTIMAL);
        let at = vk::Offset3D { x: area.offset.x, y: area.offset.y, z: 0 };
        let region = [vk::ImageCopy::default()
            .src_subresource(from.layers())
            .src_offset(at)
            .dst_subresource(to.layers())
            .dst_offset(at)
            .extent(area.extent.into())];
        let (device, commands) = self.raw();
        unsafe {
            device.cmd_copy_image(commands, from.raw, from.layout, to.raw, to.layout, &region)
        };
    }

    /// Hands a swapchain's `image` to the window.
    #[cfg(feature = "window")]
    pub(super) fn present(&self, image: &mut Image) {
        self.transition(image, vk::ImageLayout::PRESENT_SRC_KHR);
        // When the image comes back its content is not wanted.
        image.layout = vk::ImageLayout::UNDEFINED;
    }
}

/// Describes an attachment; a clear value defaults to zeros.
fn attachment(image: &Image, load: LoadOp) -> vk::RenderingAttachmentInfo<'static> {
    vk::RenderingAttachmentInfo::default()
        .image_view(image.view())
        .image_layout(image.layout)
        .load_op(match load {
            LoadOp::Clear | LoadOp::ClearColor => vk::AttachmentLoadOp::CLEAR,
            LoadOp::Load => vk::AttachmentLoadOp::LOAD,
            LoadOp::DontCare => vk::AttachmentLoadOp::DONT_CARE,
        })
        .store_op(vk::AttachmentStoreOp::STORE)
}
