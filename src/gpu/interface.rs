//! The interface of a pipeline, reflected from its shaders and checked against the host's.

use std::sync::Arc;

use ash::vk;

use super::call::Call;
use super::device::{Device, Owned, SharedDevice};
use super::limits::Limits;
use super::rate::Rate;
use super::reflect::{Binding, BindingKind, Reflection, reflect};
use super::shader::{Compiler, Optimize};
use crate::error::{Error, Result};

/// A push constant as the host declares it: name, offset, bytes.
pub type Field = (&'static str, usize, usize);

/// How a pipeline accesses one binding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Access {
    pub kind: BindingKind,
    pub reads: bool,
    pub writes: bool,
}

impl Access {
    pub fn descriptor(&self) -> vk::DescriptorType {
        match self.kind {
            BindingKind::Storage => vk::DescriptorType::STORAGE_BUFFER,
            BindingKind::Texels | BindingKind::Floats => vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
            BindingKind::TexelStores => vk::DescriptorType::STORAGE_TEXEL_BUFFER,
        }
    }
}

/// A compiled shader; its module is needed only until the pipeline is made.
pub(super) struct Stage {
    pub flags: vk::ShaderStageFlags,
    pub module: Owned<vk::ShaderModule>,
    pub reflection: Reflection,
    file: String,
}

impl Stage {
    /// Compiles `file` with `macros` defined.
    pub fn compile(
        device: &Device,
        compiler: &Compiler,
        file: &str,
        macros: &[(&str, u32)],
    ) -> Result<Vec<u32>> {
        let no_texels = (!device.limits().has_texel_buffers()).then_some(("TEXEL_BUFFERS", 0));
        let macros: Vec<_> = macros.iter().copied().chain(no_texels).collect();
        compiler.compile(file, Optimize::Yes, &macros)
    }

    /// Makes the stage of the SPIR-V `words` of `file`.
    pub fn new(
        device: &Device,
        file: String,
        words: &[u32],
        flags: vk::ShaderStageFlags,
    ) -> Result<Stage> {
        let reflection = reflect(&file, words)?;
        let shared = device.shared();
        let info = vk::ShaderModuleCreateInfo::default().code(words);
        let module = unsafe { shared.raw.create_shader_module(&info, None) }
            .of_call("vkCreateShaderModule", &file)?;
        let module = shared.own(module, &file, ash::Device::destroy_shader_module);
        Ok(Stage { flags, module, reflection, file })
    }

    /// Returns what a pipeline is made from.
    pub fn info<'a>(
        &self,
        specialization: &'a vk::SpecializationInfo<'a>,
    ) -> vk::PipelineShaderStageCreateInfo<'a> {
        vk::PipelineShaderStageCreateInfo::default()
            .stage(self.flags)
            .module(self.module.raw)
            .name(c"main")
            .specialization_info(specialization)
    }

    /// Checks that the shader's push constants lie where the host puts them.
    fn check_push(&self, push: &[Field]) -> Result<()> {
        let fail = |what| Err(Error::Shader { name: self.file.clone(), what });
        let members = self.reflection.push.as_ref().map_or(&[][..], |s| &s.members[..]);
        if members.len() != push.len() {
            return fail(format!(
                "has {} push constants, the host writes {}",
                members.len(),
                push.len()
            ));
        }
        for (m, (name, offset, bytes)) in members.iter().zip(push) {
            let has_name = m.name.is_empty() || m.name == *name;
            if !has_name || m.offset as usize != *offset || m.bytes as usize != *bytes {
                return fail(format!(
                    "push constant {} lies at byte {} ({} bytes), the host writes {name} at \
                     {offset} ({bytes} bytes)",
                    m.name, m.offset, m.bytes
                ));
            }
        }
        Ok(())
    }
}

/// The layouts of a pipeline, and how its shaders access each binding.
// Fields drop in order: the pipeline's layout before the set's.
pub(super) struct Interface {
    pub layout: Owned<vk::PipelineLayout>,
    pub set_layout: Owned<vk::DescriptorSetLayout>,
    pub access: Vec<Access>,
    pub push_bytes: usize,
    pub stages: vk::ShaderStageFlags,
}

impl Interface {
    /// Makes the layouts of a pipeline of `stages`.
    ///
    /// # Errors
    /// A shader's push constants differ from the host's, `push`.
    pub fn new(device: &Device, name: &str, stages: &[Stage], push: &[Field]) -> Result<Interface> {
        // One of two stages may use no push constants.
        let is_pushed = stages.iter().any(|s| s.reflection.push.is_some());
        for stage in stages.iter().filter(|s| s.reflection.push.is_some() || !is_pushed) {
            stage.check_push(push)?;
        }
        let shared = device.shared();
        let flags = stages.iter().fold(vk::ShaderStageFlags::empty(), |all, s| all | s.flags);
        let used = || stages.iter().flat_map(|s| s.reflection.bindings.iter());
        let n = used().map(|b| b.binding + 1).max().unwrap_or(0);
        let merge = |k: u32| {
            let any = |f: fn(&Binding) -> bool| used().any(|b| b.binding == k && f(b));
            let kind = used().find(|b| b.binding == k).map_or(BindingKind::Storage, |b| b.kind);
            Access { kind, reads: any(|b| b.reads), writes: any(|b| b.writes) }
        };
        let access: Vec<Access> = (0..n).map(merge).collect();
        let push_bytes =
            push.last().map_or(0, |(_, offset, bytes)| offset + bytes).next_multiple_of(4);
        check_limits(device.limits(), name, &access, push_bytes)?;
        let set_layout = set_layout(shared, name, &access, flags)?;
        let ranges = [vk::PushConstantRange::default().stage_flags(flags).size(push_bytes as u32)];
        let set_layouts = [set_layout.raw];
        let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts);
        if push_bytes > 0 {
            info = info.push_constant_ranges(&ranges);
        }
        let layout = unsafe { shared.raw.create_pipeline_layout(&info, None) }
            .of_call("vkCreatePipelineLayout", name)?;
        let layout = shared.own(layout, name, ash::Device::destroy_pipeline_layout);
        Ok(Interface { layout, set_layout, access, push_bytes, stages: flags })
    }
}

fn check_limits(limits: &Limits, name: &str, access: &[Access], push_bytes: usize) -> Result<()> {
    let fail = |n: usize, what, most: u32, limit| {
        let what = format!("{name}: {n} {what}, this device takes {most} ({limit})");
        Err(Error::limit(what))
    };
    let n = access.iter().filter(|a| a.kind == BindingKind::Storage).count();
    if n > limits.max_storage_buffers as usize {
        let limit = "maxPerStageDescriptorStorageBuffers";
        return fail(n, "storage buffers", limits.max_storage_buffers, limit);
    }
    if push_bytes > limits.max_push_constant_bytes as usize {
        let limit = "maxPushConstantsSize";
        let what = "bytes of push constants";
        return fail(push_bytes, what, limits.max_push_constant_bytes, limit);
    }
    Ok(())
}

fn set_layout(
    shared: &Arc<SharedDevice>,
    name: &str,
    access: &[Access],
    stages: vk::ShaderStageFlags,
) -> Result<Owned<vk::DescriptorSetLayout>> {
    let binding = |(k, access): (u32, &Access)| {
        vk::DescriptorSetLayoutBinding::default()
            .binding(k)
            .descriptor_count(1)
            .descriptor_type(access.descriptor())
            .stage_flags(stages)
    };
    let bindings: Vec<_> = (0..).zip(access).map(binding).collect();
    let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
    let raw = unsafe { shared.raw.create_descriptor_set_layout(&info, None) }
        .of_call("vkCreateDescriptorSetLayout", name)?;
    Ok(shared.own(raw, name, ash::Device::destroy_descriptor_set_layout))
}

/// A pipeline and its layouts.
// Fields drop in order: the pipeline before its layouts.
pub(super) struct MadePipeline {
    pub handle: Owned<vk::Pipeline>,
    pub interface: Interface,
    /// Invocations of a workgroup along x; 0 of a pipeline that draws.
    pub local_size_x: u32,
}

/// A pipeline, as the recorder binds it.
pub(super) struct Pipeline {
    pub made: Arc<MadePipeline>,
    pub point: vk::PipelineBindPoint,
    pub name: String,
    /// The time that a workgroup takes, or a row of the picture.
    pub rate: Rate,
    /// The time that an indirect dispatch takes.
    pub indirect_rate: Rate,
}

/// Map entries and data of 32-bit specialization constants, by id.
pub(super) struct Constants(Vec<vk::SpecializationMapEntry>, Vec<u8>);

impl Constants {
    pub fn new(constants: &[(u32, u32)]) -> Constants {
        let entry = |(i, (id, _)): (usize, &(u32, u32))| {
            vk::SpecializationMapEntry::default().constant_id(*id).offset(4 * i as u32).size(4)
        };
        let data = constants.iter().flat_map(|(_, value)| value.to_ne_bytes()).collect();
        Constants(constants.iter().enumerate().map(entry).collect(), data)
    }

    pub fn info(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default().map_entries(&self.0).data(&self.1)
    }
}
