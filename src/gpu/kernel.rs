//! Compute pipelines.

use ash::vk;

use super::call::Call;
use super::device::Device;
use super::interface::{Constants, Field, Interface, Pipeline, Stage};
use super::reflect::Reflection;
use super::shader::Compiler;
use crate::error::{Error, Result};

/// A compute pipeline.
pub struct Kernel {
    pub(super) pipeline: Pipeline,
    local_size_x: u32,
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
        let flags = vk::ShaderStageFlags::COMPUTE;
        let stages = [Stage::new(device, compiler, file.clone(), flags, macros)?];
        let [Stage { reflection, .. }] = &stages;
        let local_size_x = reflection.local_size[0];
        check_limits(device, &file, reflection)?;
        let interface = Interface::new(device, name, &stages, push)?;
        let constants = Constants::new(constants);
        let specialization = constants.info();
        let mut stage = stages[0].info(&specialization);
        let mut size = vk::PipelineShaderStageRequiredSubgroupSizeCreateInfo::default()
            .required_subgroup_size(device.limits().subgroup_size);
        // A kernel that takes its workgroup for one subgroup must get exactly one.
        let is_one_subgroup = macros.contains(&("ONE_SUBGROUP", 1));
        if is_one_subgroup && device.limits().can_choose_subgroup_size {
            stage = stage
                .flags(vk::PipelineShaderStageCreateFlags::REQUIRE_FULL_SUBGROUPS)
                .push_next(&mut size);
        }
        let layout = interface.layout.raw;
        let (shared, cache) = (device.shared(), vk::PipelineCache::null());
        let info = [vk::ComputePipelineCreateInfo::default()
            .stage(stage)
            .layout(layout)
            .flags(shared.kernel_flags())];
        let made = unsafe { shared.raw.create_compute_pipelines(cache, &info, None) };
        let raw = made.map_err(|(_, e)| e).of_call("vkCreateComputePipelines", name)?[0];
        let handle = shared.own(raw, name, ash::Device::destroy_pipeline);
        shared.report(raw, name, macros)?;
        let point = vk::PipelineBindPoint::COMPUTE;
        let (rate, indirect_rate) = Default::default();
        let name = name.to_owned();
        let pipeline = Pipeline { handle, point, interface, name, rate, indirect_rate };
        Ok(Kernel { pipeline, local_size_x })
    }

    /// Returns the invocations of one workgroup along x, the only axis that nimbus's kernels use.
    pub fn local_size_x(&self) -> u32 {
        self.local_size_x
    }
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
