//! Barriers: the stages and accesses of each use of a buffer or image, and what must wait for what.

use std::collections::HashMap;

use ash::vk;
use ash::vk::{AccessFlags2 as Accesses, PipelineStageFlags2 as Stages};

use super::image::Image;
use super::interface::{Access, Interface};
use super::reflect::BindingKind;

/// Where the recorder places barriers. Tests omit some to prove that validation would notice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Barriers {
    /// Wherever a use depends on an earlier one.
    Placed,
    /// Not before uses of buffers in scopes of this name ("" for those outside of all scopes).
    OmittedIn(&'static str),
}

/// The stages in which shaders run.
const SHADERS: Stages = Stages::from_raw(
    Stages::COMPUTE_SHADER.as_raw()
        | Stages::VERTEX_SHADER.as_raw()
        | Stages::FRAGMENT_SHADER.as_raw(),
);

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
        let stages = SHADERS | Stages::DRAW_INDIRECT | Stages::ALL_TRANSFER;
        Scope::new(stages, Accesses::NONE).widened()
    }

    /// Returns the scope in which the shaders of a pipeline access one of its bindings.
    pub fn of_binding(interface: &Interface, access: &Access) -> Scope {
        let when = |is_used, stage| if is_used { stage } else { Stages::NONE };
        let runs = |shader| interface.stages.contains(shader);
        let read = match access.kind {
            BindingKind::Storage | BindingKind::TexelStores => Accesses::SHADER_STORAGE_READ,
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

    /// Whether the scope has all stages and accesses of `other`.
    fn covers(self, other: Scope) -> bool {
        self.stages.contains(other.stages) && self.accesses.contains(other.accesses)
    }

    fn and(self, other: Scope) -> Scope {
        Scope::new(self.stages | other.stages, self.accesses | other.accesses)
    }

    /// Returns the scope with all accesses that nimbus makes in its stages. A barrier that shows
    /// a write to all of them costs no more, and later uses in the same stages need none.
    fn widened(self) -> Scope {
        let in_stages = |stages, accesses| match self.stages.intersects(stages) {
            true => accesses,
            false => Accesses::NONE,
        };
        let accesses = in_stages(
            SHADERS,
            Accesses::SHADER_STORAGE_READ
                | Accesses::SHADER_STORAGE_WRITE
                | Accesses::SHADER_SAMPLED_READ,
        ) | in_stages(Stages::DRAW_INDIRECT, Accesses::INDIRECT_COMMAND_READ)
            | in_stages(Stages::ALL_TRANSFER, Accesses::TRANSFER_READ | Accesses::TRANSFER_WRITE);
        Scope::new(self.stages, accesses)
    }
}

/// The uses of one buffer that later ones may depend on.
#[derive(Default)]
struct Used {
    /// The last write.
    write: Scope,
    /// Where barriers have shown it.
    shown: Scope,
    /// The reads since.
    reads: Scope,
    /// The stages that barriers have made wait for those reads.
    waiting: Stages,
}

impl Used {
    /// Whether a use in `scope` that depends on the write would see it.
    fn shows_write(&self, scope: Scope) -> bool {
        self.write.stages.is_empty() || self.shown.covers(scope)
    }

    /// Whether a write in `scope` would wait for the reads.
    fn orders_reads(&self, scope: Scope) -> bool {
        self.reads.stages.is_empty() || self.waiting.contains(scope.stages)
    }

    fn allows(&self, scope: Scope) -> bool {
        self.shows_write(scope) && (scope.writes() == Accesses::NONE || self.orders_reads(scope))
    }

    fn add(&mut self, scope: Scope) {
        match scope.writes() {
            Accesses::NONE => {
                self.reads = self.reads.and(scope);
                // No barrier has made anything wait for this read.
                self.waiting = Stages::NONE;
            }
            // Whatever waits for this write has waited for what came before it, too.
            _ => *self = Used { write: scope, ..Used::default() },
        }
    }
}

/// The uses of buffers so far, and what barriers have ordered.
#[derive(Default)]
pub(super) struct Uses(HashMap<vk::Buffer, Used>);

impl Uses {
    /// Adds the uses to come. Returns the two sides of the barrier that they need, if any: it
    /// orders all earlier uses that the stages to come might depend on.
    pub fn add(&mut self, coming: &[Use]) -> Option<[Scope; 2]> {
        let is_allowed = |(buffer, scope): &Use| {
            scope.accesses == Accesses::NONE
                || self.0.get(buffer).is_none_or(|used| used.allows(*scope))
        };
        let barrier = (!coming.iter().all(is_allowed)).then(|| {
            let after = coming.iter().fold(Scope::NONE, |all, (_, s)| all.and(*s)).widened();
            let mut before = Scope::NONE;
            for used in self.0.values_mut() {
                if !used.shows_write(after) {
                    before = before.and(used.write);
                    used.shown = used.shown.and(after);
                }
                if !used.orders_reads(after) {
                    before = before.and(used.reads);
                    used.waiting |= after.stages;
                }
            }
            [before, after]
        });
        for (i, (buffer, _)) in coming.iter().enumerate() {
            // Uses of one buffer by several bindings count as one.
            let of_buffer = |(other, _): &&Use| other == buffer;
            let all = coming.iter().filter(of_buffer);
            let scope = all.fold(Scope::NONE, |all, (_, scope)| all.and(*scope));
            let is_first = !coming[..i].iter().any(|of| of_buffer(&of));
            if is_first && scope.accesses != Accesses::NONE {
                self.0.entry(*buffer).or_default().add(scope);
            }
        }
        barrier
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

#[cfg(test)]
mod tests {
    use ash::vk::Handle;

    use super::*;

    const READ: Scope = Scope::new(Stages::COMPUTE_SHADER, Accesses::SHADER_STORAGE_READ);
    const WRITE: Scope = Scope::new(Stages::COMPUTE_SHADER, Accesses::SHADER_STORAGE_WRITE);

    #[test]
    fn a_write_waits_for_reads_after_the_last_barrier() {
        let [a, b] = [1, 2].map(vk::Buffer::from_raw);
        let mut uses = Uses::default();
        let mut needs = |coming: &[Use]| uses.add(coming).is_some();
        assert!(!needs(&[(a, WRITE), (b, WRITE)]));
        assert!(needs(&[(a, READ), (b, READ)]));
        // The barrier before this write of b orders the reads of a so far, too.
        assert!(needs(&[(a, READ), (b, WRITE)]));
        // The same dispatch has read a again.
        assert!(needs(&[(a, WRITE)]));
        // A second read of what a barrier has shown needs none.
        assert!(needs(&[(a, READ)]));
        assert!(!needs(&[(a, READ)]));
    }
}
