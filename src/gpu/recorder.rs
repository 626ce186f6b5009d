//! Recording and submitting commands. The recorder knows from reflection what each pipeline reads
//! and writes, and puts a barrier exactly where a later use depends on an earlier one.

use std::collections::HashMap;
use std::sync::Arc;

use ash::vk;
use bytemuck::Pod;
use tracing::info_span;

use super::device::{Device, Shared};
use super::kernel::{Interface, Kernel};
use super::memory::Buffer;
use super::reflect::BindingKind;
use super::timer::{ScopeTime, Timer};
use crate::error::{Error, Result};

/// A submission that takes longer than an hour is taken for a hang. A hung GPU is lost to its
/// driver's watchdog long before; a software device may honestly take minutes for a million large
/// sprites.
const TIMEOUT_NS: u64 = 3_600_000_000_000;
const SETS_PER_POOL: u32 = 64;
const MAX_SCOPES: u32 = 32;

/// Whether the recorder places barriers. `Omitted` exists for the tests that prove that validation
/// would notice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Barriers {
    Placed,
    Omitted,
}

/// One command buffer with all that a submission needs: descriptors, timestamps, a timeline
/// semaphore.
pub struct Commands {
    pool: vk::CommandPool,
    pub(super) buffer: vk::CommandBuffer,
    semaphore: vk::Semaphore,
    submitted: u64,
    descriptors: Vec<vk::DescriptorPool>,
    timer: Timer,
    name: String,
    pub(super) shared: Arc<Shared>,
}

/// A submission that any thread can wait for, as long as its commands are there.
#[derive(Clone)]
pub struct Pending {
    shared: Arc<Shared>,
    semaphore: vk::Semaphore,
    value: u64,
    name: String,
}

impl Pending {
    /// Returns when the device has done it all.
    pub fn wait(&self) -> Result<()> {
        let _zone = info_span!("wait").entered();
        let (semaphores, values) = ([self.semaphore], [self.value]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        unsafe { self.shared.raw.wait_semaphores(&info, TIMEOUT_NS) }
            .map_err(|e| Error::vulkan(format!("vkWaitSemaphores {}", self.name), e))
    }
}

impl Pending {
    /// Whether the device has done it already.
    pub fn is_done(&self) -> Result<bool> {
        let reached = unsafe { self.shared.raw.get_semaphore_counter_value(self.semaphore) };
        let failed = |e| Error::vulkan(format!("vkGetSemaphoreCounterValue {}", self.name), e);
        Ok(reached.map_err(failed)? >= self.value)
    }
}

impl Commands {
    pub fn new(device: &Device, name: &str) -> Result<Commands> {
        let shared = device.shared().clone();
        let fail = |call: &'static str| move |e| Error::vulkan(call, e);
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(shared.queue_family);
        let timer = Timer::new(device, name, MAX_SCOPES)?;
        let pool = unsafe { shared.raw.create_command_pool(&info, None) }
            .map_err(fail("vkCreateCommandPool"))?;
        let (buffer, semaphore) = (vk::CommandBuffer::null(), vk::Semaphore::null());
        let mut commands = Commands {
            pool,
            buffer,
            semaphore,
            submitted: 0,
            descriptors: vec![],
            timer,
            name: name.to_owned(),
            shared,
        };
        let info =
            vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        commands.buffer = unsafe { commands.shared.raw.allocate_command_buffers(&info) }
            .map_err(fail("vkAllocateCommandBuffers"))?[0];
        let mut kind =
            vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        commands.semaphore = unsafe { commands.shared.raw.create_semaphore(&info, None) }
            .map_err(fail("vkCreateSemaphore"))?;
        commands.add_descriptor_pool()?;
        commands.shared.name(commands.semaphore, name);
        commands.shared.name(commands.buffer, name);
        Ok(commands)
    }

    /// Records anew what `f` asks for. The previous submission must have been waited for.
    pub fn record(
        &mut self,
        barriers: Barriers,
        f: impl FnOnce(&mut Recorder<'_>) -> Result<()>,
    ) -> Result<()> {
        let _zone = info_span!("record").entered();
        let raw = self.shared.raw.clone();
        unsafe {
            for pool in &self.descriptors {
                let reset = raw.reset_descriptor_pool(*pool, vk::DescriptorPoolResetFlags::empty());
                reset.map_err(|e| Error::vulkan("vkResetDescriptorPool", e))?;
            }
            raw.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())
                .map_err(|e| Error::vulkan("vkResetCommandPool", e))?;
            let begin = vk::CommandBufferBeginInfo::default()
                .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
            raw.begin_command_buffer(self.buffer, &begin)
                .map_err(|e| Error::vulkan("vkBeginCommandBuffer", e))?;
        }
        self.timer.reset(self.buffer);
        let mut recorder = Recorder { commands: self, uses: HashMap::new(), i_pool: 0, barriers };
        // What earlier submissions wrote and read, which may still be under way: this alone orders
        // them before this one. Synchronization validation of 1.3.239 does not look across
        // submissions, so no test would notice if this line went.
        recorder.barrier(WRITES, STAGES, READS | WRITES);
        f(&mut recorder)?;
        recorder.commands.timer.copy(recorder.commands.buffer);
        recorder.make_visible_to_host();
        unsafe { raw.end_command_buffer(self.buffer) }
            .map_err(|e| Error::vulkan("vkEndCommandBuffer", e))
    }

    /// Starts the recorded commands; returns at once.
    pub fn submit(&mut self) -> Result<Pending> {
        self.submit_between(None, None)
    }

    /// The same, drawing once `ready` is signalled, and signalling `drawn` at its end.
    pub(super) fn submit_between(
        &mut self,
        ready: Option<vk::Semaphore>,
        drawn: Option<vk::Semaphore>,
    ) -> Result<Pending> {
        let _zone = info_span!("submit").entered();
        let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(self.buffer)];
        let at = |semaphore, stages| {
            vk::SemaphoreSubmitInfo::default().semaphore(semaphore).stage_mask(stages)
        };
        let waits: Vec<_> = ready
            .map(|s| at(s, vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT))
            .into_iter()
            .collect();
        let value = self.submitted + 1;
        let signal = vk::SemaphoreSubmitInfo::default().semaphore(self.semaphore).value(value);
        let mut signals = vec![signal.stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        signals.extend(drawn.map(|s| at(s, vk::PipelineStageFlags2::ALL_COMMANDS)));
        let info = [vk::SubmitInfo2::default()
            .wait_semaphore_infos(&waits)
            .command_buffer_infos(&buffers)
            .signal_semaphore_infos(&signals)];
        unsafe {
            self.shared.raw.queue_submit2(*self.shared.lock_queue(), &info, vk::Fence::null())
        }
        .map_err(|e| Error::vulkan(format!("vkQueueSubmit2 {}", self.name), e))?;
        self.submitted = value;
        Ok(self.pending())
    }

    fn pending(&self) -> Pending {
        Pending {
            shared: self.shared.clone(),
            semaphore: self.semaphore,
            value: self.submitted,
            name: self.name.clone(),
        }
    }

    /// Waits for the last submission and gives its scopes' times.
    pub fn wait(&mut self) -> Result<Vec<ScopeTime>> {
        self.pending().wait()?;
        self.timer.read()
    }

    /// Records, submits and waits.
    pub fn run(
        &mut self,
        f: impl FnOnce(&mut Recorder<'_>) -> Result<()>,
    ) -> Result<Vec<ScopeTime>> {
        self.record(Barriers::Placed, f)?;
        self.submit()?;
        self.wait()
    }

    fn add_descriptor_pool(&mut self) -> Result<()> {
        let size =
            |ty, a_set: u32| vk::DescriptorPoolSize { ty, descriptor_count: a_set * SETS_PER_POOL };
        let sizes = [
            size(vk::DescriptorType::STORAGE_BUFFER, 8),
            size(vk::DescriptorType::UNIFORM_TEXEL_BUFFER, 2),
        ];
        let info =
            vk::DescriptorPoolCreateInfo::default().max_sets(SETS_PER_POOL).pool_sizes(&sizes);
        let pool = unsafe { self.shared.raw.create_descriptor_pool(&info, None) }
            .map_err(|e| Error::vulkan("vkCreateDescriptorPool", e))?;
        self.descriptors.push(pool);
        Ok(())
    }
}

impl Drop for Commands {
    fn drop(&mut self) {
        // A submission still under way (after an error) must end before its memory goes; a lost
        // device ends it too.
        let (semaphores, values) = ([self.semaphore], [self.submitted]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        unsafe {
            if self.submitted > 0 {
                let _ = self.shared.raw.wait_semaphores(&info, TIMEOUT_NS);
            }
            for pool in self.descriptors.drain(..) {
                self.shared.raw.destroy_descriptor_pool(pool, None);
            }
            self.shared.raw.destroy_semaphore(self.semaphore, None);
            self.shared.raw.destroy_command_pool(self.pool, None);
        }
    }
}

/// How many records there are.
#[derive(Clone, Copy)]
pub enum Amount<'a> {
    Known(u32),
    /// As the buffer says, written on the device.
    Counted(&'a Buffer),
}

/// How a buffer was used since the last barrier.
#[derive(Default, Clone, Copy)]
struct Use {
    read: bool,
    written: bool,
}

/// Stages in which nimbus touches memory.
const STAGES: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::from_raw(
    vk::PipelineStageFlags2::COMPUTE_SHADER.as_raw()
        | vk::PipelineStageFlags2::VERTEX_SHADER.as_raw()
        | vk::PipelineStageFlags2::FRAGMENT_SHADER.as_raw()
        | vk::PipelineStageFlags2::DRAW_INDIRECT.as_raw()
        | vk::PipelineStageFlags2::ALL_TRANSFER.as_raw(),
);
const WRITES: vk::AccessFlags2 = vk::AccessFlags2::from_raw(
    vk::AccessFlags2::SHADER_STORAGE_WRITE.as_raw() | vk::AccessFlags2::TRANSFER_WRITE.as_raw(),
);
const READS: vk::AccessFlags2 = vk::AccessFlags2::from_raw(
    vk::AccessFlags2::SHADER_STORAGE_READ.as_raw()
        | vk::AccessFlags2::SHADER_SAMPLED_READ.as_raw()
        | vk::AccessFlags2::INDIRECT_COMMAND_READ.as_raw()
        | vk::AccessFlags2::TRANSFER_READ.as_raw(),
);

pub struct Recorder<'a> {
    pub(super) commands: &'a mut Commands,
    uses: HashMap<vk::Buffer, Use>,
    i_pool: usize,
    barriers: Barriers,
}

impl Recorder<'_> {
    /// Runs `f` between two timestamps under `name`.
    pub fn scope(
        &mut self,
        name: &'static str,
        f: impl FnOnce(&mut Self) -> Result<()>,
    ) -> Result<()> {
        let _zone = info_span!("record", name).entered();
        let i = self.commands.timer.begin(self.commands.buffer, name);
        let done = f(self);
        self.commands.timer.end(self.commands.buffer, i);
        done
    }

    /// Runs `kernel` with one invocation a record (each.glsl), in rows of workgroups where the
    /// device takes fewer along x than that are. `buffers` by binding number.
    pub fn dispatch<P: Pod>(
        &mut self,
        kernel: &Kernel,
        buffers: &[&Buffer],
        push: &P,
        n_records: u32,
    ) -> Result<()> {
        let n_groups = n_records.div_ceil(kernel.local_size_x());
        // Every device takes 65 535 along y, too: more than any number of records needs.
        let n_rows = n_groups.div_ceil(self.commands.shared.limits.max_workgroups_x);
        self.dispatch_rows(kernel, buffers, push, [n_groups.div_ceil(n_rows.max(1)), n_rows])
    }

    /// Runs `kernel` in `n_groups` workgroups, or as many as the device takes; it goes on from
    /// there by itself.
    pub fn dispatch_groups<P: Pod>(
        &mut self,
        kernel: &Kernel,
        buffers: &[&Buffer],
        push: &P,
        n_groups: u32,
    ) -> Result<()> {
        let n_groups = n_groups.min(self.commands.shared.limits.max_workgroups_x);
        self.dispatch_rows(kernel, buffers, push, [n_groups, 1])
    }

    fn dispatch_rows<P: Pod>(
        &mut self,
        kernel: &Kernel,
        buffers: &[&Buffer],
        push: &P,
        [x, y]: [u32; 2],
    ) -> Result<()> {
        if x == 0 {
            return Ok(());
        }
        self.bind(
            vk::PipelineBindPoint::COMPUTE,
            kernel.raw,
            &kernel.interface,
            &kernel.name,
            buffers,
            push,
        )?;
        unsafe { self.commands.shared.raw.cmd_dispatch(self.commands.buffer, x, y, 1) };
        Ok(())
    }

    /// Runs `kernel` in as many workgroups as the three words from word `i` of `counts` say,
    /// written on the device.
    pub fn dispatch_counted<P: Pod>(
        &mut self,
        kernel: &Kernel,
        buffers: &[&Buffer],
        push: &P,
        (counts, i): (&Buffer, u32),
    ) -> Result<()> {
        self.depend(&[(counts.raw, true, false)]);
        self.bind(
            vk::PipelineBindPoint::COMPUTE,
            kernel.raw,
            &kernel.interface,
            &kernel.name,
            buffers,
            push,
        )?;
        let offset = u64::from(i) * size_of::<u32>() as u64;
        unsafe {
            self.commands.shared.raw.cmd_dispatch_indirect(self.commands.buffer, counts.raw, offset)
        };
        Ok(())
    }

    /// Sets every 32-bit word of `buffer`.
    pub fn fill(&mut self, buffer: &Buffer, word: u32) {
        self.depend(&[(buffer.raw, false, true)]);
        unsafe {
            self.commands.shared.raw.cmd_fill_buffer(
                self.commands.buffer,
                buffer.raw,
                0,
                vk::WHOLE_SIZE,
                word,
            )
        };
    }

    /// Writes `record`, of 65 536 bytes at most, to the start of `buffer`.
    pub fn update<T: Pod>(&mut self, buffer: &Buffer, record: &T) {
        self.depend(&[(buffer.raw, false, true)]);
        let bytes = bytemuck::bytes_of(record);
        unsafe {
            self.commands.shared.raw.cmd_update_buffer(self.commands.buffer, buffer.raw, 0, bytes)
        };
    }

    /// Copies the first bytes of `from` that fit into `to`.
    pub fn copy(&mut self, from: &Buffer, to: &Buffer) {
        self.depend(&[(from.raw, true, false), (to.raw, false, true)]);
        let region = [vk::BufferCopy::default().size(from.bytes().min(to.bytes()))];
        unsafe {
            self.commands.shared.raw.cmd_copy_buffer(
                self.commands.buffer,
                from.raw,
                to.raw,
                &region,
            )
        };
    }

    /// Copies runs of bytes from one buffer to another: each by its beginning there and here, and
    /// its length.
    pub fn copy_runs(&mut self, from: &Buffer, to: &Buffer, runs: &[[u64; 3]]) {
        let regions = runs.iter().filter(|[_, _, n]| *n > 0);
        let regions: Vec<_> = regions
            .map(|[src, dst, n]| {
                vk::BufferCopy::default().src_offset(*src).dst_offset(*dst).size(*n)
            })
            .collect();
        if regions.is_empty() {
            return;
        }
        self.depend(&[(from.raw, true, false), (to.raw, false, true)]);
        unsafe {
            self.commands.shared.raw.cmd_copy_buffer(
                self.commands.buffer,
                from.raw,
                to.raw,
                &regions,
            )
        };
    }

    pub(super) fn bind<P: Pod>(
        &mut self,
        point: vk::PipelineBindPoint,
        pipeline: vk::Pipeline,
        interface: &Interface,
        name: &str,
        buffers: &[&Buffer],
        push: &P,
    ) -> Result<()> {
        let mismatch = |what| Err(Error::Shader { name: name.to_owned(), what });
        if buffers.len() != interface.access.len() {
            return mismatch(format!(
                "has {} bindings, the host gives {}",
                interface.access.len(),
                buffers.len()
            ));
        }
        let bytes = bytemuck::bytes_of(push);
        if bytes.len() != interface.push_bytes {
            return mismatch(format!(
                "has {} bytes of push constants, the host gives {}",
                interface.push_bytes,
                bytes.len()
            ));
        }
        let uses: Vec<_> = buffers
            .iter()
            .zip(&interface.access)
            .map(|(b, a)| (b.raw, a.reads, a.writes))
            .collect();
        self.depend(&uses);
        let mut views = vec![];
        for (buffer, access) in buffers.iter().zip(&interface.access) {
            views.push([buffer.texels(access.kind)?]);
        }
        let set = self.descriptor_set(interface.set_layout)?;
        let infos: Vec<_> = buffers
            .iter()
            .map(|b| [vk::DescriptorBufferInfo { buffer: b.raw, offset: 0, range: b.bytes() }])
            .collect();
        let writes: Vec<_> = infos
            .iter()
            .zip(&views)
            .zip(&interface.access)
            .enumerate()
            .map(|(k, ((info, view), access))| {
                let write = vk::WriteDescriptorSet::default().dst_set(set).dst_binding(k as u32);
                let write = write.descriptor_type(access.descriptor());
                if access.kind == BindingKind::Storage {
                    write.buffer_info(info)
                } else {
                    write.texel_buffer_view(view)
                }
            })
            .collect();
        let (raw, commands) = (&self.commands.shared.raw, self.commands.buffer);
        unsafe {
            raw.update_descriptor_sets(&writes, &[]);
            raw.cmd_bind_pipeline(commands, point, pipeline);
            raw.cmd_bind_descriptor_sets(commands, point, interface.layout, 0, &[set], &[]);
            if !bytes.is_empty() {
                raw.cmd_push_constants(commands, interface.layout, interface.stages, 0, bytes);
            }
        }
        Ok(())
    }

    /// A set from the pools; a new pool when they are used up, which happens in the first frame or
    /// never.
    fn descriptor_set(&mut self, layout: vk::DescriptorSetLayout) -> Result<vk::DescriptorSet> {
        loop {
            if self.i_pool == self.commands.descriptors.len() {
                self.commands.add_descriptor_pool()?;
            }
            let layouts = [layout];
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(self.commands.descriptors[self.i_pool])
                .set_layouts(&layouts);
            match unsafe { self.commands.shared.raw.allocate_descriptor_sets(&info) } {
                Ok(sets) => return Ok(sets[0]),
                Err(vk::Result::ERROR_OUT_OF_POOL_MEMORY | vk::Result::ERROR_FRAGMENTED_POOL) => {
                    self.i_pool += 1
                }
                Err(e) => return Err(Error::vulkan("vkAllocateDescriptorSets", e)),
            }
        }
    }

    /// Makes the coming use of (buffer, reads, writes) wait for what it depends on.
    pub(super) fn depend(&mut self, coming: &[(vk::Buffer, bool, bool)]) {
        let hazard = coming.iter().any(|(b, reads, writes)| {
            let before = self.uses.get(b).copied().unwrap_or_default();
            (before.written && (*reads || *writes)) || (before.read && *writes)
        });
        if hazard {
            if self.barriers == Barriers::Placed {
                self.barrier(WRITES, STAGES, READS | WRITES);
            }
            self.uses.clear();
        }
        for (b, reads, writes) in coming {
            let u = self.uses.entry(*b).or_default();
            u.read |= reads;
            u.written |= writes;
        }
    }

    fn barrier(
        &self,
        src: vk::AccessFlags2,
        dst_stages: vk::PipelineStageFlags2,
        dst: vk::AccessFlags2,
    ) {
        let barrier = vk::MemoryBarrier2::default().src_stage_mask(STAGES).src_access_mask(src);
        let barrier = [barrier.dst_stage_mask(dst_stages).dst_access_mask(dst)];
        let dependency = vk::DependencyInfo::default().memory_barriers(&barrier);
        unsafe {
            self.commands.shared.raw.cmd_pipeline_barrier2(self.commands.buffer, &dependency)
        };
    }

    fn make_visible_to_host(&self) {
        self.barrier(WRITES, vk::PipelineStageFlags2::HOST, vk::AccessFlags2::HOST_READ);
    }
}
