//! Barriers: the stages and accesses of each use of a buffer or image, and what must wait for what.

use std::collections::HashMap;

use ash::vk;
use ash::vk::{AccessFlags2 as Accesses, PipelineStageFlags2 as Stages};

use super::image::Image;
use super::interface::{Access, Interface};
use super::reflect::BindingKind;

/// Whether the recorder places barriers. Tests omit them to prove that validation would notice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Barriers {
    /// Places a barrier where a use depends on an earlier one.
    Placed,
    /// Places none.
    Omitted,
}

/// Pipeline stages, and the memory accesses that they make.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Scope {
    stages: Stages,
    accesses: Accesses,
}

/// Use of a buffer in a scope.
pub(super) type Use = (vk::Buffer, Scope);

impl Scope {
    pub const NONE: Scope = Scope::new(Stages::NONE, Accesses::NONE);
    pub const INDIRECT_READ: Scope =
        Scope::new(Stages::DRAW_INDIRECT, Accesses::INDIRECT_COMMAND_READ);
    pub const TRANSFER_READ: Scope = Scope::new(Stages::ALL_TRANSFER, Accesses::TRANSFER_READ);
    pub const TRANSFER_WRITE: Scope = Scope::new(Stages::ALL_TRANSFER, Accesses::TRANSFER_WRITE);
    pub const HOST_READ: Scope = Scope::new(Stages::HOST, Accesses::HOST_READ);
    const fn new(stages: Stages, accesses: Accesses) -> Scope {
        Scope { stages, accesses }
    }

    /// Returns all stages and accesses by which nimbus uses buffers.
    pub fn any() -> Scope {
        Scope::new(
            Stages::COMPUTE_SHADER
                | Stages::VERTEX_SHADER
                | Stages::FRAGMENT_SHADER
                | Stages::DRAW_INDIRECT
                | Stages::ALL_TRANSFER,
            Accesses::SHADER_STORAGE_READ
                | Accesses::SHADER_STORAGE_WRITE
                | Accesses::SHADER_SAMPLED_READ
                | Accesses::INDIRECT_COMMAND_READ
                | Accesses::TRANSFER_READ
                | Accesses::TRANSFER_WRITE,
        )
    }

    /// Returns the scope in which the shaders of a pipeline access one of its bindings.
    pub fn of_binding(interface: &Interface, access: &Access) -> Scope {
        let when = |is_used, stage| if is_used { stage } else { Stages::NONE };
        let runs = |shader| interface.stages.contains(shader);
        let read = match access.kind {
            BindingKind::Storage => Accesses::SHADER_STORAGE_READ,
            BindingKind::Texels | BindingKind::Floats => Accesses::SHADER_SAMPLED_READ,
        };
        let made = |is_made, access| if is_made { access } else { Accesses::NONE };
        Scope::new(
            when(runs(vk::ShaderStageFlags::COMPUTE), Stages::COMPUTE_SHADER)
                | when(runs(vk::ShaderStageFlags::VERTEX), Stages::VERTEX_SHADER)
                | when(runs(vk::ShaderStageFlags::FRAGMENT), Stages::FRAGMENT_SHADER),
            made(access.reads, read) | made(access.writes, Accesses::SHADER_STORAGE_WRITE),
        )
    }

    /// Returns the scope in which an image is used in a layout.
    fn of_layout(layout: vk::ImageLayout) -> Scope {
        match layout {
            vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL => Scope::new(
                Stages::COLOR_ATTACHMENT_OUTPUT,
                Accesses::COLOR_ATTACHMENT_READ | Accesses::COLOR_ATTACHMENT_WRITE,
            ),
            // Fragment tests read and write depth.
            vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL => Scope::new(
                Stages::EARLY_FRAGMENT_TESTS | Stages::LATE_FRAGMENT_TESTS,
                Accesses::DEPTH_STENCIL_ATTACHMENT_READ | Accesses::DEPTH_STENCIL_ATTACHMENT_WRITE,
            ),
            vk::ImageLayout::TRANSFER_SRC_OPTIMAL => Scope::TRANSFER_READ,
            vk::ImageLayout::TRANSFER_DST_OPTIMAL => Scope::TRANSFER_WRITE,
            _ => Scope::NONE,
        }
    }

    /// Returns the part of the scope's accesses that write.
    fn writes(self) -> Accesses {
        self.accesses & (Accesses::SHADER_STORAGE_WRITE | Accesses::TRANSFER_WRITE)
    }

    fn must_wait_for(self, before: Scope) -> bool {
        let writes = |scope: Scope| scope.writes() != Accesses::NONE;
        writes(before) && self.accesses != Accesses::NONE
            || before.accesses != Accesses::NONE && writes(self)
    }

    fn and(self, other: Scope) -> Scope {
        Scope::new(self.stages | other.stages, self.accesses | other.accesses)
    }
}

/// The uses of buffers since the last barrier.
#[derive(Default)]
pub(super) struct Uses(HashMap<vk::Buffer, Scope>);

impl Uses {
    /// Adds the uses to come. Returns the scope that they must wait for, where they depend on an
    /// earlier use; a barrier after that scope orders all earlier uses, which are then forgotten.
    pub fn add(&mut self, coming: &[Use]) -> Option<Scope> {
        let depends = coming
            .iter()
            .any(|(buffer, scope)| self.0.get(buffer).is_some_and(|b| scope.must_wait_for(*b)));
        let before = depends.then(|| self.0.drain().fold(Scope::NONE, |all, (_, s)| all.and(s)));
        for (buffer, scope) in coming {
            let all = self.0.entry(*buffer).or_default();
            *all = all.and(*scope);
        }
        before
    }
}

/// Makes `after` wait for `before`, and see what it wrote.
pub(super) fn stage_barrier(
    device: &ash::Device,
    commands: vk::CommandBuffer,
    before: Scope,
    after: Scope,
) {
    let barrier = [vk::MemoryBarrier2::default()
        .src_stage_mask(before.stages)
        .src_access_mask(before.writes())
        .dst_stage_mask(after.stages)
        .dst_access_mask(after.accesses)];
    let dependency = vk::DependencyInfo::default().memory_barriers(&barrier);
    unsafe { device.cmd_pipeline_barrier2(commands, &dependency) };
}

/// Makes the coming use of `image`, in layout `to`, wait for the last one.
///
/// The barrier is needed where the layout stays, too: between two draws into one target.
/// Synchronization validation of 1.3.239 does not follow dynamic rendering, so no test would
/// notice if it were missing.
pub(super) fn image_barrier(
    device: &ash::Device,
    commands: vk::CommandBuffer,
    image: &mut Image,
    to: vk::ImageLayout,
) {
    let before = match image.layout {
        // The submission waits for a swapchain's image in this stage.
        vk::ImageLayout::UNDEFINED => Scope::new(Stages::COLOR_ATTACHMENT_OUTPUT, Accesses::NONE),
        layout => Scope::of_layout(layout),
    };
    let after = Scope::of_layout(to);
    let barrier = [vk::ImageMemoryBarrier2::default()
        .src_stage_mask(before.stages)
        .src_access_mask(before.accesses)
        .dst_stage_mask(after.stages)
        .dst_access_mask(after.accesses)
        .old_layout(image.layout)
        .new_layout(to)
        .image(image.raw)
        .subresource_range(image.range)];
    let dependency = vk::DependencyInfo::default().image_memory_barriers(&barrier);
    unsafe { device.cmd_pipeline_barrier2(commands, &dependency) };
    image.layout = to;
}
