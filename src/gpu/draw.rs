//! A graphics pipeline without vertex buffers: the vertex shader pulls from storage buffers;
//! premultiplied "over" or "under", opaque with depth, or depth alone.

use std::sync::Arc;

use ash::vk;

use super::device::{Device, Shared};
use super::kernel::{Field, Interface, Module, check_push, specialization};
use super::memory::{TargetFormat, depth_format};
use super::reflect::reflect;
use super::shader::{Compiler, Optimize};
use crate::error::{Error, Result};

pub struct DrawPipeline {
    pub(super) raw: vk::Pipeline,
    pub(super) interface: Interface,
    pub(super) name: String,
    /// Whether it draws into a target with depth.
    pub(super) has_depth: bool,
    shared: Arc<Shared>,
}

/// How a fragment meets what the target holds. Depth is reversed: the greater one is nearer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Meet {
    /// Blended premultiplied over it.
    Over,
    /// Blended over it where it is as near as what wrote depth, which it does not.
    OverNearer,
    /// Blended under it where it is as near as what wrote depth, which it does not.
    UnderNearer,
    /// In its place, with its depth, where it is as near; of equally near ones the last stays.
    Replace,
    /// Not seen, and hides what is behind its depth.
    Hide,
}

impl DrawPipeline {
    /// `name.vert` and `name.frag`, drawn as triangle strips into a target of `format`, which they
    /// meet as `meet` says.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        name: &str,
        push: &[Field],
        constants: &[(u32, u32)],
        (format, meet): (TargetFormat, Meet),
    ) -> Result<DrawPipeline> {
        let (vert_file, frag_file) = (format!("{name}.vert"), format!("{name}.frag"));
        let vert = compiler.compile(&vert_file, Optimize::Yes)?;
        let frag = compiler.compile(&frag_file, Optimize::Yes)?;
        let (in_vert, in_frag) = (reflect(&vert_file, &vert)?, reflect(&frag_file, &frag)?);
        // One of the two may ask for none of them.
        for (file, found) in [(&vert_file, &in_vert), (&frag_file, &in_frag)] {
            if found.push.is_some() || in_vert.push.is_none() && in_frag.push.is_none() {
                check_push(file, found, push)?;
            }
        }
        let stages =
            [(&in_vert, vk::ShaderStageFlags::VERTEX), (&in_frag, vk::ShaderStageFlags::FRAGMENT)];
        let interface = Interface::new(device, name, &stages, push)?;
        let shared = device.shared().clone();
        let modules =
            [Module::new(&shared, &vert_file, &vert)?, Module::new(&shared, &frag_file, &frag)?];
        let formats = (format.raw(), depth_format(device));
        let raw = create(&interface, name, &modules, constants, formats, meet)?;
        shared.name(raw, name);
        Ok(DrawPipeline {
            raw,
            interface,
            name: name.to_owned(),
            has_depth: meet != Meet::Over,
            shared,
        })
    }
}

impl Drop for DrawPipeline {
    fn drop(&mut self) {
        // SAFETY: commands that use the pipeline have been waited for by whoever drops it.
        unsafe { self.shared.raw.destroy_pipeline(self.raw, None) };
    }
}

fn create(
    interface: &Interface,
    name: &str,
    [vert, frag]: &[Module; 2],
    constants: &[(u32, u32)],
    (color_format, depth_format): (vk::Format, vk::Format),
    meet: Meet,
) -> Result<vk::Pipeline> {
    let (entries, data) = specialization(constants);
    let specialization = vk::SpecializationInfo::default().map_entries(&entries).data(&data);
    let stage = |module: &Module, stage| {
        let info = vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module.raw);
        info.name(c"main").specialization_info(&specialization)
    };
    let stages =
        [stage(vert, vk::ShaderStageFlags::VERTEX), stage(frag, vk::ShaderStageFlags::FRAGMENT)];
    let vertex_input = vk::PipelineVertexInputStateCreateInfo::default();
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
        .topology(vk::PrimitiveTopology::TRIANGLE_STRIP);
    let viewport =
        vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let samples = vk::PipelineMultisampleStateCreateInfo::default()
        .rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let attachments = [blending(meet)];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
    let depth = depth_test(meet);
    let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
    let formats = [color_format];
    let mut rendering =
        vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
    if meet != Meet::Over {
        rendering = rendering.depth_attachment_format(depth_format);
    }
    let info = vk::GraphicsPipelineCreateInfo::default()
        .stages(&stages)
        .vertex_input_state(&vertex_input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&samples)
        .depth_stencil_state(&depth)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(interface.layout)
        .push_next(&mut rendering);
    let made = unsafe {
        interface.shared.raw.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None)
    };
    Ok(made.map_err(|(_, e)| Error::vulkan(format!("vkCreateGraphicsPipelines {name}"), e))?[0])
}

fn blending(meet: Meet) -> vk::PipelineColorBlendAttachmentState {
    let (src, dst) = match meet {
        Meet::UnderNearer => (vk::BlendFactor::ONE_MINUS_DST_ALPHA, vk::BlendFactor::ONE),
        _ => (vk::BlendFactor::ONE, vk::BlendFactor::ONE_MINUS_SRC_ALPHA),
    };
    vk::PipelineColorBlendAttachmentState {
        blend_enable: vk::Bool32::from(!matches!(meet, Meet::Replace | Meet::Hide)),
        src_color_blend_factor: src,
        dst_color_blend_factor: dst,
        color_blend_op: vk::BlendOp::ADD,
        src_alpha_blend_factor: src,
        dst_alpha_blend_factor: dst,
        alpha_blend_op: vk::BlendOp::ADD,
        color_write_mask: match meet {
            Meet::Hide => vk::ColorComponentFlags::empty(),
            _ => vk::ColorComponentFlags::RGBA,
        },
    }
}

fn depth_test(meet: Meet) -> vk::PipelineDepthStencilStateCreateInfo<'static> {
    vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(meet != Meet::Over)
        .depth_write_enable(matches!(meet, Meet::Replace | Meet::Hide))
        .depth_compare_op(vk::CompareOp::GREATER_OR_EQUAL)
}
