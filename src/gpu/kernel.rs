//! Compute pipelines whose interface is reflected from their SPIR-V and checked against the host's.

use std::sync::Arc;

use ash::vk;

use super::device::{Device, Shared};
use super::reflect::{Binding, BindingKind, Reflection, reflect};
use super::shader::{Compiler, Optimize};
use crate::error::{Error, Result};

/// A push constant as the host declares it: name, offset, bytes.
pub type Field = (&'static str, usize, usize);

/// How a pipeline touches one binding.
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
        }
    }
}

/// What compute and draw pipelines share: layouts, and what the shaders do with each binding.
pub(super) struct Interface {
    pub layout: vk::PipelineLayout,
    pub set_layout: vk::DescriptorSetLayout,
    pub access: Vec<Access>,
    pub push_bytes: usize,
    pub stages: vk::ShaderStageFlags,
    pub shared: Arc<Shared>,
}

pub struct Kernel {
    pub(super) raw: vk::Pipeline,
    pub(super) interface: Interface,
    pub(super) name: String,
    local_size: [u32; 3],
}

impl Kernel {
    /// The kernel `room.thing` from `room_thing.comp` (`room` from `room.comp`). `push` are the
    /// host's push constants in order; `constants` the specialization constants by id.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        name: &str,
        push: &[Field],
        constants: &[(u32, u32)],
    ) -> Result<Kernel> {
        Kernel::with_macros(device, compiler, name, push, constants, &[])
    }

    /// A variant of the kernel, by macros that its text asks for.
    pub fn with_macros(
        device: &Device,
        compiler: &Compiler,
        name: &str,
        push: &[Field],
        constants: &[(u32, u32)],
        macros: &[(&str, u32)],
    ) -> Result<Kernel> {
        let file = format!("{}.comp", name.replace('.', "_"));
        let words = compiler.compile_with(&file, Optimize::Yes, macros)?;
        let found = reflect(&file, &words)?;
        check_push(&file, &found, push)?;
        check_limits(device, &file, &found)?;
        let interface =
            Interface::new(device, name, &[(&found, vk::ShaderStageFlags::COMPUTE)], push)?;
        let module = Module::new(&interface.shared, name, &words)?;
        let (entries, data) = specialization(constants);
        let specialization = vk::SpecializationInfo::default().map_entries(&entries).data(&data);
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module.raw)
            .name(c"main")
            .specialization_info(&specialization);
        // Where the kernel takes its workgroup for one subgroup it must be one.
        let is_together = macros.contains(&("ONE_SUBGROUP", 1));
        let mut size = vk::PipelineShaderStageRequiredSubgroupSizeCreateInfo::default()
            .required_subgroup_size(device.limits().subgroup_size);
        let stage = match is_together && device.limits().subgroup_size_chosen {
            true => stage
                .flags(vk::PipelineShaderStageCreateFlags::REQUIRE_FULL_SUBGROUPS)
                .push_next(&mut size),
            false => stage,
        };
        let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(interface.layout)];
        let made = unsafe {
            interface.shared.raw.create_compute_pipelines(vk::PipelineCache::null(), &info, None)
        };
        let raw =
            made.map_err(|(_, e)| Error::vulkan(format!("vkCreateComputePipelines {name}"), e))?[0];
        interface.shared.name(raw, name);
        drop(module);
        Ok(Kernel { raw, interface, name: name.to_owned(), local_size: found.local_size })
    }

    /// Invocations of one workgroup along x; the only axis nimbus's kernels use.
    pub fn local_size_x(&self) -> u32 {
        self.local_size[0]
    }
}

impl Drop for Kernel {
    fn drop(&mut self) {
        // SAFETY: commands that use the pipeline have been waited for by whoever drops it.
        unsafe { self.interface.shared.raw.destroy_pipeline(self.raw, None) };
    }
}

impl Interface {
    pub fn new(
        device: &Device,
        name: &str,
        stages: &[(&Reflection, vk::ShaderStageFlags)],
        push: &[Field],
    ) -> Result<Interface> {
        let shared = device.shared().clone();
        let all_stages = stages.iter().fold(vk::ShaderStageFlags::empty(), |a, (_, s)| a | *s);
        let used = || stages.iter().flat_map(|(r, _)| r.bindings.iter());
        let n = used().map(|b| b.binding + 1).max().unwrap_or(0);
        let merge = |k: u32| {
            let touched = |f: fn(&Binding) -> bool| used().any(|b| b.binding == k && f(b));
            let kind = used().find(|b| b.binding == k).map_or(BindingKind::Storage, |b| b.kind);
            Access { kind, reads: touched(|b| b.reads), writes: touched(|b| b.writes) }
        };
        let access: Vec<Access> = (0..n).map(merge).collect();
        let bindings: Vec<_> = (0..n)
            .zip(&access)
            .map(|(k, a)| {
                let b = vk::DescriptorSetLayoutBinding::default().binding(k).descriptor_count(1);
                b.descriptor_type(a.descriptor()).stage_flags(all_stages)
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        let set_layout = unsafe { shared.raw.create_descriptor_set_layout(&info, None) }
            .map_err(|e| Error::vulkan(format!("vkCreateDescriptorSetLayout {name}"), e))?;
        let push_bytes =
            push.last().map_or(0, |(_, offset, bytes)| offset + bytes).next_multiple_of(4);
        let ranges =
            [vk::PushConstantRange::default().stage_flags(all_stages).size(push_bytes as u32)];
        let set_layouts = [set_layout];
        let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts);
        if push_bytes > 0 {
            info = info.push_constant_ranges(&ranges);
        }
        let mut interface = Interface {
            layout: vk::PipelineLayout::null(),
            set_layout,
            access,
            push_bytes,
            stages: all_stages,
            shared,
        };
        interface.layout = unsafe { interface.shared.raw.create_pipeline_layout(&info, None) }
            .map_err(|e| Error::vulkan(format!("vkCreatePipelineLayout {name}"), e))?;
        interface.shared.name(interface.layout, name);
        interface.shared.name(set_layout, name);
        Ok(interface)
    }
}

impl Drop for Interface {
    fn drop(&mut self) {
        // SAFETY: outlived by no pipeline: it is a field of the pipeline's owner.
        unsafe {
            self.shared.raw.destroy_pipeline_layout(self.layout, None);
            self.shared.raw.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

/// A shader module, needed only until its pipeline is made.
pub(super) struct Module {
    pub raw: vk::ShaderModule,
    shared: Arc<Shared>,
}

impl Module {
    pub fn new(shared: &Arc<Shared>, name: &str, words: &[u32]) -> Result<Module> {
        let info = vk::ShaderModuleCreateInfo::default().code(words);
        let raw = unsafe { shared.raw.create_shader_module(&info, None) }
            .map_err(|e| Error::vulkan(format!("vkCreateShaderModule {name}"), e))?;
        Ok(Module { raw, shared: shared.clone() })
    }
}

impl Drop for Module {
    fn drop(&mut self) {
        unsafe { self.shared.raw.destroy_shader_module(self.raw, None) };
    }
}

/// Map entries and data of 32-bit specialization constants.
pub(super) fn specialization(
    constants: &[(u32, u32)],
) -> (Vec<vk::SpecializationMapEntry>, Vec<u8>) {
    let entry = |(i, (id, _)): (usize, &(u32, u32))| vk::SpecializationMapEntry {
        constant_id: *id,
        offset: 4 * i as u32,
        size: 4,
    };
    let data = constants.iter().flat_map(|(_, v)| v.to_ne_bytes()).collect();
    (constants.iter().enumerate().map(entry).collect(), data)
}

/// The shader's push constants must lie where the host puts them.
pub(super) fn check_push(file: &str, found: &Reflection, push: &[Field]) -> Result<()> {
    let fail = |what| Err(Error::Shader { name: file.to_owned(), what });
    let members = found.push.as_ref().map_or(&[][..], |s| &s.members[..]);
    if members.len() != push.len() {
        return fail(format!(
            "has {} push constants, the host writes {}",
            members.len(),
            push.len()
        ));
    }
    for (m, (name, offset, bytes)) in members.iter().zip(push) {
        let same_name = m.name.is_empty() || m.name == *name;
        if !same_name || m.offset as usize != *offset || m.bytes as usize != *bytes {
            return fail(format!(
                "push constant {} lies at byte {} ({} bytes), the host writes {name} at {offset} \
                 ({bytes} bytes)",
                m.name, m.offset, m.bytes
            ));
        }
    }
    Ok(())
}

fn check_limits(device: &Device, file: &str, found: &Reflection) -> Result<()> {
    let limits = device.limits();
    let invocations: u32 = found.local_size.iter().product();
    let fail = |what: String| Err(Error::limit(format!("shader {file}: {what}")));
    if invocations == 0 || invocations > limits.max_workgroup_invocations {
        return fail(format!(
            "workgroup of {invocations} invocations, this device takes 1 to {}",
            limits.max_workgroup_invocations
        ));
    }
    if found.shared_bytes > limits.max_shared_memory_bytes {
        return fail(format!(
            "{} bytes of shared memory, this device has {}",
            found.shared_bytes, limits.max_shared_memory_bytes
        ));
    }
    Ok(())
}
