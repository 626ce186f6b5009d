//! Recording of compute dispatches and of copies between buffers.
//!
//! The recorder knows from reflection what each pipeline reads and writes. It places a barrier
//! exactly where a use of a buffer depends on an earlier one.

use ash::vk;
use bytemuck::Pod;
use tracing::info_span;

use super::barriers::{Barriers, Scope, Use, Uses, image_barrier, stage_barrier};
use super::buffer::Buffer;
use super::commands::Commands;
use super::image::Image;
use super::interface::Pipeline;
use super::kernel::Kernel;
use super::rate::Units;
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
    /// The scope that is open, "" for none, and its place among the times.
    scope: &'static str,
    pub(super) i_scope: Option<u32>,
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
        self.begin()?;
        self.timer.reset(self.buffer());
        let buffer = self.buffer();
        self.counters.reset(buffer);
        // Orders this submission after the earlier ones, which may still be under way.
        // Synchronization validation of 1.3.239 does not look across submissions, so no test would
        // notice if this line were missing.
        stage_barrier(&self.shared.raw, self.buffer(), Scope::any(), Scope::any());
        let (uses, scope, i_scope) = (Uses::default(), "", None);
        f(&mut Recorder { commands: self, uses, barriers, scope, i_scope })?;
        self.timer.copy(self.buffer());
        self.counters.copy(self.buffer());
        let buffer = self.buffer();
        self.stamp.write(buffer);
        self.end()
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
    /// Runs `f` between two timestamps, under a label `name` for the tools that read such labels.
    ///
    /// # Errors
    /// `f` fails, or a guard band is broken.
    pub fn scope(
        &mut self,
        name: &'static str,
        f: impl FnOnce(&mut Self) -> Result<()>,
    ) -> Result<()> {
        let _zone = info_span!("record", name).entered();
        if self.scope.is_empty() {
            self.make_cold()?;
        }
        let commands = &mut self.commands;
        commands.begin_label(name);
        let buffer = commands.buffer();
        let i = commands.timer.begin(buffer, name);
        let is_counted = commands.counters.begin(buffer, name);
        let outer = (self.scope, self.i_scope);
        (self.scope, self.i_scope) = (name, i);
        let done = f(self);
        (self.scope, self.i_scope) = outer;
        let buffer = self.commands.buffer();
        self.commands.counters.end(buffer, is_counted);
        self.commands.timer.end(buffer, i);
        self.commands.end_label();
        done?;
        let Commands { is_divisible, shared, .. } = &*self.commands;
        match shared.clone().guards.as_ref().filter(|_| *is_divisible) {
            Some(guards) => {
                self.commands.finish_part()?;
                guards.check(name)
            }
            None => Ok(()),
        }
    }

    /// Writes the buffers that make caches cold, if there are any.
    fn make_cold(&mut self) -> Result<()> {
        let Some(cold) = self.commands.cold.clone() else { return Ok(()) };
        cold.buffers.iter().try_for_each(|buffer| {
            self.dispatch_blocks(&cold.kernel, &[buffer], &cold.push, cold.n_groups)
        })
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
        let groups = [n_groups.div_ceil(n_rows.max(1)), n_rows];
        self.dispatch_rows(kernel, buffers, push, groups, true)
    }

    /// Dispatches `kernel` in `n_groups` workgroups, of which each does its own part of the work.
    ///
    /// # Errors
    /// Buffers or push constants differ from the shader's, or there are more workgroups than the
    /// device takes.
    pub fn dispatch_blocks<P: Pod>(
        &mut self,
        kernel: &Kernel,
        buffers: &[&Buffer],
        push: &P,
        n_groups: u32,
    ) -> Result<()> {
        let most = self.commands.shared.limits.max_workgroups_x;
        if n_groups > most {
            let name = &kernel.pipeline.name;
            return Err(Error::limit(format!(
                "{name}: {n_groups} workgroups are wanted, this device takes {most} \
                 (maxComputeWorkGroupCount)"
            )));
        }
        self.dispatch_rows(kernel, buffers, push, [n_groups, 1], true)
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
        self.dispatch_rows(kernel, buffers, push, [n_groups, 1], false)
    }

    /// Dispatches rows of workgroups; `is_divisible`: workgroups can be dispatched apart.
    fn dispatch_rows<P: Pod>(
        &mut self,
        kernel: &Kernel,
        buffers: &[&Buffer],
        push: &P,
        [x, y]: [u32; 2],
        is_divisible: bool,
    ) -> Result<()> {
        if x == 0 {
            return Ok(());
        }
        // Shaders number workgroups by the length of a row, so that only whole rows are apart.
        let n_units = if y > 1 { y } else { x };
        let units = if is_divisible { Units::Apart(n_units) } else { Units::Together(n_units) };
        self.paced(&kernel.pipeline, units, |rec, first, n| {
            rec.bind(&kernel.pipeline, buffers, push, None)?;
            let (device, commands) = rec.raw();
            let ([x0, y0], [nx, ny]) =
                if y > 1 { ([0, first], [x, n]) } else { ([first, 0], [n, 1]) };
            // Only pipelines of devices with a limit take a base other than 0.
            match first {
                0 => unsafe { device.cmd_dispatch(commands, nx, ny, 1) },
                _ => unsafe {
                    device.cmd_dispatch_base(commands, x0, y0, 0, nx, ny, 1);
                    // Lavapipe adds the last base to the workgroups of an indirect dispatch. A
                    // direct one sets it to 0, even if it has no workgroups.
                    device.cmd_dispatch(commands, 0, 1, 1);
                },
            }
            Ok(())
        })
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
        self.paced(&kernel.pipeline, Units::Indirect, |rec, _, _| {
            rec.bind(&kernel.pipeline, buffers, push, Some(counts))?;
            let (device, commands) = rec.raw();
            let offset = u64::from(i) * size_of::<u32>() as u64;
            unsafe { device.cmd_dispatch_indirect(commands, counts.raw(), offset) };
            Ok(())
        })
    }

    /// Sets every 32-bit word of `buffer`.
    pub fn fill(&mut self, buffer: &Buffer, word: u32) {
        self.depend(&[(buffer.raw(), Scope::TRANSFER_WRITE)]);
        let (device, commands) = self.raw();
        let n_bytes = buffer.bytes();
        unsafe { device.cmd_fill_buffer(commands, buffer.raw(), 0, n_bytes, word) };
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

    /// Binds a pipeline with its buffers and push constants, after the barrier that they and
    /// `counts`, the buffer of an indirect call, need.
    pub(super) fn bind<P: Pod>(
        &mut self,
        pipeline: &Pipeline,
        buffers: &[&Buffer],
        push: &P,
        counts: Option<&Buffer>,
    ) -> Result<()> {
        let (interface, point) = (&pipeline.made.interface, &pipeline.point);
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
            .chain(counts.map(|counts| (counts.raw(), Scope::INDIRECT_READ)))
            .collect();
        self.depend(&uses);
        let views = bindings()
            .map(|(buffer, access)| Ok([buffer.texels(access.kind)?]))
            .collect::<Result<Vec<_>>>()?;
        let infos = bindings()
            .map(|(buffer, access)| match access.kind {
                BindingKind::Storage => Ok([buffer.records()?]),
                _ => Ok([vk::DescriptorBufferInfo::default()]),
            })
            .collect::<Result<Vec<_>>>()?;
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
            device.cmd_bind_pipeline(commands, *point, pipeline.made.handle.raw);
            device.cmd_bind_descriptor_sets(commands, *point, layout, 0, &[set], &[]);
            if !bytes.is_empty() {
                device.cmd_push_constants(commands, layout, interface.stages, 0, bytes);
            }
        }
        Ok(())
    }

    /// Returns the functions of the device, and the command buffer that they record into.
    pub(super) fn raw(&self) -> (&ash::Device, vk::CommandBuffer) {
        (&self.commands.shared.raw, self.commands.buffer())
    }

    /// Makes the coming uses of buffers wait for the earlier ones that they depend on.
    pub(super) fn depend(&mut self, coming: &[Use]) {
        let barrier = self.uses.add(coming);
        let is_placed = self.barriers != Barriers::OmittedIn(self.scope);
        if let Some([before, after]) = barrier.filter(|_| is_placed) {
            let (device, commands) = self.raw();
            stage_barrier(device, commands, before, after);
        }
    }

    /// Makes the coming use of an image, in layout `to`, wait for the last one.
    pub(super) fn transition(&self, image: &mut Image, to: vk::ImageLayout) {
        let (device, commands) = self.raw();
        image_barrier(device, commands, image, to);
    }
}
