//! Compute pipelines.

use ash::vk;

use super::call::Call;
use super::device::Device;
use super::interface::{Constants, Field, Interface, MadePipeline, Pipeline, Stage};
use super::kept_pipelines::Key;
use super::reflect::Reflection;
use super::shader::Compiler;
use crate::error::{Error, Result};

/// A compute pipeline.
pub struct Kernel {
    pub(super) pipeline: Pipeline,
}

impl Kernel {
    /// Makes the kernel `room.thing` from `room_thing.comp` (`room` from `room.comp`).
    ///
    /// `push` are the host's push constants in order.
    ///
    /// # Errors
    /// The shader does not compile, its interface differs from the host's, or its workgroup breaks
    /// a limit of the device.
    pub fn new(device: &Device, compiler: &Compiler, name: &str, push: &[Field]) -> Result<Kernel> {
        Kernel::with_macros(device, compiler, name, push, &[], &[])
    }

    /// Makes a variant of the kernel, by specialization constants (id and value) and by macros that
    /// its text asks for.
    ///
    /// # Errors
    /// As for [`Kernel::new`].
    pub fn with_macros(
        device: &Device,
        compiler: &Compiler,
        name: &str,
        push: &[Field],
        constants: &[(u32, u32)],
        macros: &[(&str, u32)],
    ) -> Result<Kernel> {
        let file = format!("{}.comp", name.replace('.', "_"));
        let words = Stage::compile(device, compiler, &file, macros)?;
        // A kernel that takes its workgroup for one subgroup must get exactly one.
        let is_one_subgroup = macros.contains(&("ONE_SUBGROUP", 1));
        let key = Key::new(name, &words, push, constants, is_one_subgroup);
        let shared = device.shared();
        let made = shared
            .pipelines
            .get(key, || make(device, (name, file, &words), push, constants, is_one_subgroup))?;
        shared.report(made.handle.raw, name, macros)?;
        let point = vk::PipelineBindPoint::COMPUTE;
        let (rate, indirect_rate) = Default::default();
        let pipeline = Pipeline { made, point, name: name.to_owned(), rate, indirect_rate };
        Ok(Kernel { pipeline })
    }

    /// Returns the invocations of one workgroup along x, the only axis that nimbus's kernels use.
    pub fn local_size_x(&self) -> u32 {
        self.pipeline.made.local_size_x
    }
}

/// Makes the pipeline of a kernel from the SPIR-V of its file.
fn make(
    device: &Device,
    (name, file, words): (&str, String, &[u32]),
    push: &[Field],
    constants: &[(u32, u32)],
    is_one_subgroup: bool,
) -> Result<MadePipeline> {
    let stages = [Stage::new(device, file.clone(), words, vk::ShaderStageFlags::COMPUTE)?];
    let [Stage { reflection, .. }] = &stages;
    let local_size_x = reflection.local_size[0];
    check_limits(device, &file, reflection)?;
    let interface = Interface::new(device, name, &stages, push)?;
    let constants = Constants::new(constants);
    let specialization = constants.info();
    let mut stage = stages[0].info(&specialization);
    let mut size = vk::PipelineShaderStageRequiredSubgroupSizeCreateInfo::default()
        .required_subgroup_size(device.limits().subgroup_size);
    if is_one_subgroup && device.limits().can_choose_subgroup_size {
        stage = stage
            .flags(vk::PipelineShaderStageCreateFlags::REQUIRE_FULL_SUBGROUPS)
            .push_next(&mut size);
    }
    let (shared, cache) = (device.shared(), vk::PipelineCache::null());
    let info = [vk::ComputePipelineCreateInfo::default()
        .stage(stage)
        .layout(interface.layout.raw)
        .flags(shared.kernel_flags())];
    let made = unsafe { shared.raw.create_compute_pipelines(cache, &info, None) };
    let raw = made.map_err(|(_, e)| e).of_call("vkCreateComputePipelines", name)?[0];
    let handle = shared.own(raw, name, ash::Device::destroy_pipeline);
    Ok(MadePipeline { handle, interface, local_size_x })
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
