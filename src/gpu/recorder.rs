//! Recording of compute dispatches and of copies between buffers.
//!
//! The recorder knows from reflection what each pipeline reads and writes. It places a barrier
//! exactly where a use of a buffer depends on an earlier one.

use ash::vk;
use bytemuck::Pod;
use tracing::info_span;

use super::barriers::{Barriers, Scope, Use, Uses, image_barrier, stage_barrier};
use super::buffer::Buffer;
use super::call::Call;
use super::commands::Commands;
use super::image::Image;
use super::interface::Pipeline;
use super::kernel::Kernel;
use super::reflect::BindingKind;
use super::timer::ScopeTime;
use crate::error::{Error, Result};

/// A number of records.
#[derive(Clone, Copy)]
pub enum RecordCount<'a> {
    /// The host knows the number.
    Known(u32),
    /// The buffer holds the number, written on the device.
    Indirect(&'a Buffer),
}

/// A number of records that the device has written.
#[derive(Clone, Copy)]
pub struct DeviceCount<'a> {
    /// `u32` words.
    pub buffer: &'a Buffer,
    /// Index of the word that holds the number.
    pub i_count: u32,
    /// Index of the first of three words that hold the workgroups for the records: (n, 1, 1).
    pub i_groups: u32,
}

/// Records commands into a command buffer.
pub struct Recorder<'a> {
    pub(super) commands: &'a mut Commands,
    uses: Uses,
    barriers: Barriers,
}

impl Commands {
    /// Records the commands of `f` in place of the last ones. The last submission must have been
    /// waited for.
    ///
    /// # Errors
    /// `f` fails, or the driver is out of memory.
    pub fn record(
        &mut self,
        barriers: Barriers,
        f: impl FnOnce(&mut Recorder<'_>) -> Result<()>,
    ) -> Result<()> {
        let _zone = info_span!("record").entered();
        let (raw, buffer) = (self.shared.raw.clone(), self.buffer);
        self.descriptors.reset()?;
        let flags = vk::CommandPoolResetFlags::empty();
        unsafe { raw.reset_command_pool(self.pool.raw, flags) }
            .of_call("vkResetCommandPool", "")?;
        let begin = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        unsafe { raw.begin_command_buffer(buffer, &begin) }.of_call("vkBeginCommandBuffer", "")?;
        self.timer.reset(buffer);
        // Orders this submission after the earlier ones, which may still be under way.
        // Synchronization validation of 1.3.239 does not look across submissions, so no test would
        // notice if this line were missing.
        stage_barrier(&raw, buffer, Scope::any(), Scope::any());
        f(&mut Recorder { commands: self, uses: Uses::default(), barriers })?;
        self.timer.copy(buffer);
        stage_barrier(&raw, buffer, Scope::any(), Scope::HOST_READ);
        unsafe { raw.end_command_buffer(buffer) }.of_call("vkEndCommandBuffer", "")
    }

    /// Records, submits and waits; returns the times of the scopes.
    ///
    /// # Errors
    /// `f` fails, or the device is lost.
    pub fn run(
        &mut self,
        f: impl FnOnce(&mut Recorder<'_>) -> Result<()>,
    ) -> Result<Vec<ScopeTime>> {
        self.record(Barriers::Placed, f)?;
        self.submit()?;
        self.wait()
    }
}

impl Recorder<'_> {
    /// Runs `f` between two timestamps under `name`.
    ///
    /// # Errors
    /// `f` fails.
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

    /// Dispatches `kernel` with one invocation a record (each.glsl). Workgroups lie in rows where
    /// the device takes fewer along x. `buffers` come by binding number.
    ///
    /// # Errors
    /// Buffers or push constants differ from the shader's.
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

    /// Dispatches `kernel` in `n_groups` workgroups, or in as many as the device takes: the kernel
    /// loops over the rest.
    ///
    /// # Errors
    /// Buffers or push constants differ from the shader's.
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
        if x > 0 {
            self.bind(&kernel.pipeline, buffers, push)?;
            let (device, commands) = self.raw();
            unsafe { device.cmd_dispatch(commands, x, y, 1) };
        }
        Ok(())
    }

    /// Dispatches `kernel` in as many workgroups as the three words from word `i` of `counts` say.
    ///
    /// # Errors
    /// Buffers or push constants differ from the shader's.
    pub fn dispatch_indirect<P: Pod>(
        &mut self,
        kernel: &Kernel,
        buffers: &[&Buffer],
        push: &P,
        (counts, i): (&Buffer, u32),
    ) -> Result<()> {
        self.depend(&[(counts.raw(), Scope::INDIRECT_READ)]);
        self.bind(&kernel.pipeline, buffers, push)?;
        let (device, commands) = self.raw();
        let offset = u64::from(i) * size_of::<u32>() as u64;
        unsafe { device.cmd_dispatch_indirect(commands, counts.raw(), offset) };
        Ok(())
    }

    /// Sets every 32-bit word of `buffer`.
    pub fn fill(&mut self, buffer: &Buffer, word: u32) {
        self.depend(&[(buffer.raw(), Scope::TRANSFER_WRITE)]);
        let (device, commands) = self.raw();
        unsafe { device.cmd_fill_buffer(commands, buffer.raw(), 0, vk::WHOLE_SIZE, word) };
    }

    /// Writes `record`, of 65 536 bytes at most, to the start of `buffer`.
    pub fn update<T: Pod>(&mut self, buffer: &Buffer, record: &T) {
        self.depend(&[(buffer.raw(), Scope::TRANSFER_WRITE)]);
        let (device, commands) = self.raw();
        let bytes = bytemuck::bytes_of(record);
        unsafe { device.cmd_update_buffer(commands, buffer.raw(), 0, bytes) };
    }

    /// Copies the first bytes of `from` that fit into `to`.
    pub fn copy(&mut self, from: &Buffer, to: &Buffer) {
        self.copy_runs(from, to, &[[0, 0, from.bytes().min(to.bytes())]]);
    }

    /// Copies runs of bytes: each has its start in `from`, its start in `to` and its length.
    pub fn copy_runs(&mut self, from: &Buffer, to: &Buffer, runs: &[[u64; 3]]) {
        let region = |[src, dst, n]: &[u64; 3]| {
            vk::BufferCopy::default().src_offset(*src).dst_offset(*dst).size(*n)
        };
        let regions: Vec<_> = runs.iter().filter(|[_, _, n]| *n > 0).map(region).collect();
        if regions.is_empty() {
            return;
        }
        self.depend(&[(from.raw(), Scope::TRANSFER_READ), (to.raw(), Scope::TRANSFER_WRITE)]);
        let (device, commands) = self.raw();
        unsafe { device.cmd_copy_buffer(commands, from.raw(), to.raw(), &regions) };
    }

    /// Binds a pipeline with its buffers and push constants, after the barrier that they need.
    pub(super) fn bind<P: Pod>(
        &mut self,
        pipeline: &Pipeline,
        buffers: &[&Buffer],
        push: &P,
    ) -> Result<()> {
        let Pipeline { interface, point, .. } = pipeline;
        let bytes = bytemuck::bytes_of(push);
        let mismatch = |n_shader: usize, what, n_host: usize| {
            let what = format!("has {n_shader} {what}, the host gives {n_host}");
            Err(Error::Shader { name: pipeline.name.clone(), what })
        };
        if buffers.len() != interface.access.len() {
            return mismatch(interface.access.len(), "bindings", buffers.len());
        }
        if bytes.len() != interface.push_bytes {
            return mismatch(interface.push_bytes, "bytes of push constants", bytes.len());
        }
        let bindings = || buffers.iter().zip(&interface.access);
        let uses: Vec<Use> = bindings()
            .map(|(buffer, access)| (buffer.raw(), Scope::of_binding(interface, access)))
            .collect();
        self.depend(&uses);
        let views = bindings()
            .map(|(buffer, access)| Ok([buffer.texels(access.kind)?]))
            .collect::<Result<Vec<_>>>()?;
        let infos: Vec<_> = buffers
            .iter()
            .map(|b| [vk::DescriptorBufferInfo { buffer: b.raw(), offset: 0, range: b.bytes() }])
            .collect();
        let set = self.commands.descriptors.allocate(interface.set_layout.raw)?;
        let writes: Vec<_> = (0..)
            .zip(&interface.access)
            .map(|(k, access)| {
                let write = vk::WriteDescriptorSet::default()
                    .dst_set(set)
                    .dst_binding(k as u32)
                    .descriptor_type(access.descriptor());
                match access.kind {
                    BindingKind::Storage => write.buffer_info(&infos[k]),
                    _ => write.texel_buffer_view(&views[k]),
                }
            })
            .collect();
        let (device, commands) = self.raw();
        let layout = interface.layout.raw;
        unsafe {
            device.update_descriptor_sets(&writes, &[]);
            device.cmd_bind_pipeline(commands, *point, pipeline.handle.raw);
            device.cmd_bind_descriptor_sets(commands, *point, layout, 0, &[set], &[]);
            if !bytes.is_empty() {
                device.cmd_push_constants(commands, layout, interface.stages, 0, bytes);
            }
        }
        Ok(())
    }

    /// Returns the functions of the device, and the command buffer that they record into.
    pub(super) fn raw(&self) -> (&ash::Device, vk::CommandBuffer) {
        (&self.commands.shared.raw, self.commands.buffer)
    }

    /// Makes the coming uses of buffers wait for the earlier ones that they depend on.
    pub(super) fn depend(&mut self, coming: &[Use]) {
        let before = self.uses.add(coming);
        if let Some(before) = before.filter(|_| self.barriers == Barriers::Placed) {
            let (device, commands) = self.raw();
            stage_barrier(device, commands, before, Scope::any());
        }
    }

    /// Makes the coming use of an image, in layout `to`, wait for the last one.
    pub(super) fn transition(&self, image: &mut Image, to: vk::ImageLayout) {
        let (device, commands) = self.raw();
        image_barrier(device, commands, image, to);
    }
}
