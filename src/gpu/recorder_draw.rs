//! Recording of draws into images, and of copies from them: attachments, layouts, image barriers.

use ash::vk;
use bytemuck::Pod;

use super::draw::DrawPipeline;
use super::memory::{Buffer, Image};
use super::recorder::Recorder;
use crate::error::{Error, Result};

/// What is drawn into.
pub struct Target<'a> {
    pub color: &'a mut Image,
    /// Of the colour's extent. Reversed: near/z, so 0 is infinitely far.
    pub depth: Option<&'a mut Image>,
}

/// How many strips of four vertices are drawn.
#[derive(Clone, Copy)]
pub enum Instances<'a> {
    Known(u32),
    /// By the four words from this word of a buffer (vertices, instances, first vertex, first
    /// instance), written on the device.
    Counted(&'a Buffer, u32),
}

/// What a target holds when drawing starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// Zeros: black, infinitely far.
    Clear,
    /// Black; the depth of what was drawn before.
    ClearColor,
    /// What was drawn before.
    Load,
    /// Anything: every pixel is drawn over.
    Overwrite,
}

impl<'a> Target<'a> {
    pub fn color(color: &'a mut Image) -> Target<'a> {
        Target { color, depth: None }
    }
}

/// Fragment tests, where depth is read and written.
const DEPTH_STAGES: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::from_raw(
    vk::PipelineStageFlags2::EARLY_FRAGMENT_TESTS.as_raw()
        | vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS.as_raw(),
);

impl Recorder<'_> {
    /// Draws strips of four vertices into `target`.
    pub fn draw<P: Pod>(
        &mut self,
        pipeline: &DrawPipeline,
        target: Target<'_>,
        start: Start,
        buffers: &[&Buffer],
        push: &P,
        instances: Instances<'_>,
    ) -> Result<()> {
        let Target { color, depth } = target;
        check(pipeline, color, depth.as_deref())?;
        self.transition(color, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
        let on_color = [attachment(color, start)];
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: color.extent };
        let info = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&on_color);
        let on_depth;
        let info = match depth {
            Some(depth) => {
                self.transition(depth, vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL);
                on_depth =
                    attachment(depth, if start == Start::ClearColor { Start::Load } else { start });
                info.depth_attachment(&on_depth)
            }
            None => info,
        };
        if let Instances::Counted(counts, _) = instances {
            self.depend(&[(counts.raw, true, false)]);
        }
        self.bind(
            vk::PipelineBindPoint::GRAPHICS,
            pipeline.raw,
            &pipeline.interface,
            &pipeline.name,
            buffers,
            push,
        )?;
        let (width, height) = (color.extent.width as f32, color.extent.height as f32);
        let viewport =
            vk::Viewport { x: 0.0, y: 0.0, width, height, min_depth: 0.0, max_depth: 1.0 };
        let (raw, commands) = (&self.commands.shared.raw, self.commands.buffer);
        unsafe {
            raw.cmd_begin_rendering(commands, &info);
            raw.cmd_set_viewport(commands, 0, &[viewport]);
            raw.cmd_set_scissor(commands, 0, &[area]);
            match instances {
                Instances::Known(n) => raw.cmd_draw(commands, 4, n, 0, 0),
                Instances::Counted(counts, word) => {
                    raw.cmd_draw_indirect(commands, counts.raw, 4 * u64::from(word), 1, 0)
                }
            }
            raw.cmd_end_rendering(commands);
        }
        Ok(())
    }

    /// Copies the whole image, rows from the top, tightly packed.
    pub fn copy_image(&mut self, from: &mut Image, to: &Buffer) {
        self.transition(from, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
        self.depend(&[(to.raw, false, true)]);
        let layers = vk::ImageSubresourceLayers {
            aspect_mask: from.range.aspect_mask,
            mip_level: 0,
            base_array_layer: 0,
            layer_count: 1,
        };
        let region = [vk::BufferImageCopy::default()
            .image_subresource(layers)
            .image_extent(from.extent.into())];
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        unsafe {
            self.commands.shared.raw.cmd_copy_image_to_buffer(
                self.commands.buffer,
                from.raw,
                layout,
                to.raw,
                &region,
            )
        };
    }

    /// Has `draw` record draws of its own over what is in `image`; it is given the commands, and
    /// how much there is.
    #[cfg(feature = "window")]
    pub(super) fn draw_over(
        &mut self,
        image: &mut Image,
        draw: impl FnOnce(vk::CommandBuffer, vk::Extent2D) -> Result<()>,
    ) -> Result<()> {
        self.transition(image, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
        let on_color = [attachment(image, Start::Load)];
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: image.extent };
        let info = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&on_color);
        let (raw, commands) = (&self.commands.shared.raw, self.commands.buffer);
        unsafe { raw.cmd_begin_rendering(commands, &info) };
        let drawn = draw(commands, image.extent);
        unsafe { raw.cmd_end_rendering(commands) };
        drawn
    }

    /// Copies `area` of an image to the same place of another in the same format.
    #[cfg(feature = "window")]
    pub(super) fn copy_part(&mut self, from: &mut Image, to: &mut Image, area: vk::Rect2D) {
        self.transition(from, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
        self.transition(to, vk::ImageLayout::TRANSFER_DST_OPTIMAL);
        let layers = vk::ImageSubresourceLayers::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .layer_count(1);
        let at = vk::Offset3D { x: area.offset.x, y: area.offset.y, z: 0 };
        let region = [vk::ImageCopy::default()
            .src_subresource(layers)
            .src_offset(at)
            .dst_subresource(layers)
            .dst_offset(at)
            .extent(area.extent.into())];
        let (raw, commands) = (&self.commands.shared.raw, self.commands.buffer);
        unsafe { raw.cmd_copy_image(commands, from.raw, from.layout, to.raw, to.layout, &region) };
    }

    /// Hands `image`, of a swapchain, to the window.
    #[cfg(feature = "window")]
    pub(super) fn show(&self, image: &mut Image) {
        self.transition(image, vk::ImageLayout::PRESENT_SRC_KHR);
        // What is in it is not wanted any more when it comes back.
        image.layout = vk::ImageLayout::UNDEFINED;
    }

    /// Orders the coming use of `image` after the last one, also where the layout stays: two draws
    /// into one target. Synchronization validation of 1.3.239 does not look at what dynamic
    /// rendering draws into, so no test would notice if those stood without.
    fn transition(&self, image: &mut Image, to: vk::ImageLayout) {
        let side = |layout| match layout {
            vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL => (
                vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
                vk::AccessFlags2::COLOR_ATTACHMENT_READ | vk::AccessFlags2::COLOR_ATTACHMENT_WRITE,
            ),
            vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL => (
                DEPTH_STAGES,
                vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ
                    | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE,
            ),
            vk::ImageLayout::TRANSFER_SRC_OPTIMAL => {
                (vk::PipelineStageFlags2::ALL_TRANSFER, vk::AccessFlags2::TRANSFER_READ)
            }
            vk::ImageLayout::TRANSFER_DST_OPTIMAL => {
                (vk::PipelineStageFlags2::ALL_TRANSFER, vk::AccessFlags2::TRANSFER_WRITE)
            }
            _ => (vk::PipelineStageFlags2::NONE, vk::AccessFlags2::NONE),
        };
        // An image of a swapchain is waited for where it is drawn into.
        let (src_stage, src_access) = match image.layout {
            vk::ImageLayout::UNDEFINED => {
                (vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT, vk::AccessFlags2::NONE)
            }
            layout => side(layout),
        };
        let (dst_stage, dst_access) = side(to);
        let barrier = vk::ImageMemoryBarrier2::default()
            .src_stage_mask(src_stage)
            .src_access_mask(src_access)
            .dst_stage_mask(dst_stage)
            .dst_access_mask(dst_access)
            .old_layout(image.layout)
            .new_layout(to)
            .image(image.raw)
            .subresource_range(image.range);
        let barriers = [barrier];
        let dependency = vk::DependencyInfo::default().image_memory_barriers(&barriers);
        unsafe {
            self.commands.shared.raw.cmd_pipeline_barrier2(self.commands.buffer, &dependency)
        };
        image.layout = to;
    }
}

/// Clears to zeros, which is what a clear value defaults to.
fn attachment(image: &Image, start: Start) -> vk::RenderingAttachmentInfo<'static> {
    let load = match start {
        Start::Clear | Start::ClearColor => vk::AttachmentLoadOp::CLEAR,
        Start::Load => vk::AttachmentLoadOp::LOAD,
        Start::Overwrite => vk::AttachmentLoadOp::DONT_CARE,
    };
    vk::RenderingAttachmentInfo::default()
        .image_view(image.view)
        .image_layout(image.layout)
        .load_op(load)
        .store_op(vk::AttachmentStoreOp::STORE)
}

fn check(pipeline: &DrawPipeline, color: &Image, depth: Option<&Image>) -> Result<()> {
    let mismatch = |what| Err(Error::Shader { name: pipeline.name.clone(), what });
    match depth {
        Some(_) if !pipeline.has_depth => {
            mismatch("is not made for a target with depth".to_owned())
        }
        None if pipeline.has_depth => {
            mismatch("is made for a target with depth, the host gives none".to_owned())
        }
        Some(depth) if depth.extent != color.extent => {
            let ((w, h), (x, y)) = (color.size(), depth.size());
            mismatch(format!("draws {w}×{h} pixels, the host gives depth for {x}×{y}"))
        }
        _ => Ok(()),
    }
}
