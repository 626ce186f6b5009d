//! Graphics pipelines without vertex buffers: the vertex shader pulls from storage buffers.

use std::sync::Arc;

use ash::vk;

use super::call::Call;
use super::device::Device;
use super::image::{TargetFormat, depth_format};
use super::interface::{Constants, Field, Interface, MadePipeline, Pipeline, Stage};
use super::shader::Compiler;
use crate::error::Result;

/// A graphics pipeline that draws strips or points.
pub struct DrawPipeline {
    pub(super) pipeline: Pipeline,
    pub(super) primitives: Primitives,
    /// Whether it draws into a target with depth.
    pub(super) has_depth: bool,
}

/// The primitives that a pipeline draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Primitives {
    /// Triangle strips of four vertices, an instance each.
    Strips,
    /// Points, a vertex each: squares, of [`Limits::max_point_size`](super::Limits) at most.
    Points,
}

/// How a fragment combines with what the target holds.
///
/// Colours are premultiplied. Depth is reversed: the greater one is nearer. Depth tests pass a
/// fragment that is at least as near as the target's depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlendMode {
    /// Blended over the target, which has no depth.
    Over,
    /// Depth-tested and blended over the target; writes no depth.
    OverTested,
    /// Depth-tested and blended under the target; writes no depth.
    UnderTested,
    /// Colours are added, and the greatest alpha is kept; the target has no depth.
    Sum,
    /// The same, depth-tested; writes no depth.
    SumTested,
    /// Depth-tested, replaces colour and depth; of equal depths the last stays.
    Opaque,
    /// Depth-tested, writes depth alone.
    DepthOnly,
}

impl BlendMode {
    fn has_depth(self) -> bool {
        !matches!(self, BlendMode::Over | BlendMode::Sum)
    }

    fn writes_depth(self) -> bool {
        matches!(self, BlendMode::Opaque | BlendMode::DepthOnly)
    }

    fn attachment(self) -> vk::PipelineColorBlendAttachmentState {
        let (src, dst) = match self {
            BlendMode::UnderTested => (vk::BlendFactor::ONE_MINUS_DST_ALPHA, vk::BlendFactor::ONE),
            BlendMode::Sum | BlendMode::SumTested => (vk::BlendFactor::ONE, vk::BlendFactor::ONE),
            _ => (vk::BlendFactor::ONE, vk::BlendFactor::ONE_MINUS_SRC_ALPHA),
        };
        vk::PipelineColorBlendAttachmentState::default()
            .blend_enable(!self.writes_depth())
            .src_color_blend_factor(src)
            .dst_color_blend_factor(dst)
            .src_alpha_blend_factor(src)
            .dst_alpha_blend_factor(dst)
            .alpha_blend_op(match self {
                BlendMode::Sum | BlendMode::SumTested => vk::BlendOp::MAX,
                _ => vk::BlendOp::ADD,
            })
            .color_write_mask(match self {
                BlendMode::DepthOnly => vk::ColorComponentFlags::empty(),
                _ => vk::ColorComponentFlags::RGBA,
            })
    }
}

/// The specialization constants that are 1 for targets of 16-bit floats and of bytes; the shaders'
/// HALF and BYTES.
const HALF: u32 = 7;
const BYTES: u32 = 11;

impl DrawPipeline {
    /// Makes a pipeline of strips from `name.vert` and `name.frag` for targets of `format`.
    ///
    /// `push` are the host's push constants in order; `constants` the specialization constants by
    /// id.
    ///
    /// # Errors
    /// A shader does not compile, or its interface differs from the host's.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        name: &str,
        push: &[Field],
        constants: &[(u32, u32)],
        target: (TargetFormat, BlendMode),
    ) -> Result<DrawPipeline> {
        Self::of(device, compiler, (name, Primitives::Strips), push, constants, target)
    }

    /// Makes the same of `primitives`.
    ///
    /// # Errors
    /// As [`DrawPipeline::new`].
    pub fn of(
        device: &Device,
        compiler: &Compiler,
        (name, primitives): (&str, Primitives),
        push: &[Field],
        constants: &[(u32, u32)],
        (format, mode): (TargetFormat, BlendMode),
    ) -> Result<DrawPipeline> {
        let stage = |extension, flags| {
            let file = format!("{name}.{extension}");
            let words = Stage::compile(device, compiler, &file, &[])?;
            Stage::new(device, file, &words, flags)
        };
        let stages = [
            stage("vert", vk::ShaderStageFlags::VERTEX)?,
            stage("frag", vk::ShaderStageFlags::FRAGMENT)?,
        ];
        let interface = Interface::new(device, name, &stages, push)?;
        let is_half = format == TargetFormat::Rgba16f;
        let is_bytes = matches!(format, TargetFormat::Rgba8 | TargetFormat::Bgra8);
        let of_format = [(HALF, u32::from(is_half)), (BYTES, u32::from(is_bytes))];
        let constants = Constants::new(&[constants, &of_format[..]].concat());
        let specialization = constants.info();
        let infos = stages.each_ref().map(|stage| stage.info(&specialization));
        let raw = create(device, &interface, (name, primitives), &infos, format, mode)?;
        let handle = device.shared().own(raw, name, ash::Device::destroy_pipeline);
        let macros: &[_] = match primitives {
            Primitives::Strips => &[],
            Primitives::Points => &[("POINTS", 1)],
        };
        device.shared().report(raw, name, macros)?;
        let point = vk::PipelineBindPoint::GRAPHICS;
        let (rate, indirect_rate) = Default::default();
        let name = name.to_owned();
        let made = Arc::new(MadePipeline { handle, interface, local_size_x: 0 });
        let pipeline = Pipeline { made, point, name, rate, indirect_rate };
        Ok(DrawPipeline { pipeline, primitives, has_depth: mode.has_depth() })
    }
}

fn create(
    device: &Device,
    interface: &Interface,
    (name, primitives): (&str, Primitives),
    stages: &[vk::PipelineShaderStageCreateInfo<'_>],
    format: TargetFormat,
    mode: BlendMode,
) -> Result<vk::Pipeline> {
    let vertex_input = vk::PipelineVertexInputStateCreateInfo::default();
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(match primitives {
        Primitives::Strips => vk::PrimitiveTopology::TRIANGLE_STRIP,
        Primitives::Points => vk::PrimitiveTopology::POINT_LIST,
    });
    let viewport =
        vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let samples = vk::PipelineMultisampleStateCreateInfo::default()
        .rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let attachments = [mode.attachment()];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
    let depth = vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(mode.has_depth())
        .depth_write_enable(mode.writes_depth())
        .depth_compare_op(vk::CompareOp::GREATER_OR_EQUAL);
    let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
    let formats = [format.raw()];
    let mut rendering =
        vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
    if mode.has_depth() {
        rendering = rendering.depth_attachment_format(depth_format(device));
    }
    let info = vk::GraphicsPipelineCreateInfo::default()
        .flags(device.shared().pipeline_flags())
        .stages(stages)
        .vertex_input_state(&vertex_input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&samples)
        .depth_stencil_state(&depth)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(interface.layout.raw)
        .push_next(&mut rendering);
    let (shared, cache) = (device.shared(), vk::PipelineCache::null());
    let made = unsafe { shared.raw.create_graphics_pipelines(cache, &[info], None) };
    Ok(made.map_err(|(_, e)| e).of_call("vkCreateGraphicsPipelines", name)?[0])
}
