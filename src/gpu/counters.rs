//! Counts of what the passes of one submission invoked, from pipeline statistics queries.

use std::sync::Arc;

use ash::vk;
use serde::{Deserialize, Serialize};

use super::buffer::{Buffer, MemoryUsage};
use super::call::Call;
use super::device::{Device, Owned, SharedDevice};
use crate::error::Result;

/// What the commands of a pass invoked on the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Invocations {
    /// Invocations of compute shaders.
    pub compute: u64,
    /// Invocations of vertex shaders. A device may run one again for a vertex of two triangles.
    pub vertex: u64,
    /// Invocations of fragment shaders. A device may run more of them than there are pixels.
    pub fragment: u64,
    /// Triangles that the device clipped to the view: all that were drawn.
    pub primitives: u64,
    /// Triangles that clipping left. A device may cut one into several.
    pub clipped_primitives: u64,
}

/// Numbers of a query, in the order of their bits.
const N_COUNTS: usize = 5;
/// Most queries of a submission. A pass has one in each part in which it is submitted.
const MAX_QUERIES: u32 = 1024;

impl Invocations {
    /// Returns the counts that a query has written.
    fn of(counts: &[u64]) -> Invocations {
        let of = |k: usize| counts.get(k).copied().unwrap_or(0);
        Invocations {
            vertex: of(0),
            primitives: of(1),
            clipped_primitives: of(2),
            fragment: of(3),
            compute: of(4),
        }
    }

    /// Adds the counts of another part of a pass.
    fn add(&mut self, other: &Invocations) {
        self.compute += other.compute;
        self.vertex += other.vertex;
        self.fragment += other.fragment;
        self.primitives += other.primitives;
        self.clipped_primitives += other.clipped_primitives;
    }
}

/// Returns the counts that are asked for; their results come in the order of their bits.
fn wanted() -> vk::QueryPipelineStatisticFlags {
    use vk::QueryPipelineStatisticFlags as Count;
    Count::VERTEX_SHADER_INVOCATIONS
        | Count::CLIPPING_INVOCATIONS
        | Count::CLIPPING_PRIMITIVES
        | Count::FRAGMENT_SHADER_INVOCATIONS
        | Count::COMPUTE_SHADER_INVOCATIONS
}

/// Queries around scopes. Recordings have none until they are switched on.
pub(super) struct Counters {
    /// None unless the device was opened for counts and has counters.
    queries: Option<Queries>,
    is_on: bool,
    /// Names of the scopes of all queries of the recording.
    names: Vec<&'static str>,
    /// Whether the last query is open.
    is_open: bool,
    /// Whether there was no room for a query.
    is_full: bool,
    shared: Arc<SharedDevice>,
}

struct Queries {
    pool: Owned<vk::QueryPool>,
    /// The submission itself copies its counts here, as it does its timestamps.
    counts: Buffer,
}

impl Counters {
    pub fn new(device: &Device, name: &str) -> Result<Counters> {
        let shared = device.shared();
        let queries = match shared.counts_invocations {
            false => None,
            true => {
                let info = vk::QueryPoolCreateInfo::default()
                    .query_type(vk::QueryType::PIPELINE_STATISTICS)
                    .pipeline_statistics(wanted())
                    .query_count(MAX_QUERIES);
                let raw = unsafe { shared.raw.create_query_pool(&info, None) }
                    .of_call("vkCreateQueryPool", name)?;
                let pool = shared.own(raw, name, ash::Device::destroy_query_pool);
                let n = u64::from(MAX_QUERIES) * N_COUNTS as u64;
                let name = format!("{name}.counts");
                let counts = Buffer::new::<u64>(device, &name, n, MemoryUsage::Readback)?;
                Some(Queries { pool, counts })
            }
        };
        let (names, shared) = (vec![], shared.clone());
        Ok(Counters { queries, is_on: false, names, is_open: false, is_full: false, shared })
    }

    /// Switches the queries of the next recordings on or off.
    pub fn switch(&mut self, is_on: bool) {
        self.is_on = is_on;
    }

    /// Returns whether the device has counters and they are switched on.
    fn is_active(&self) -> bool {
        self.is_on && self.queries.is_some()
    }

    /// Forgets all queries.
    pub fn reset(&mut self, commands: vk::CommandBuffer) {
        self.names.clear();
        (self.is_open, self.is_full) = (false, false);
        if let Some(Queries { pool, .. }) = self.queries.as_ref().filter(|_| self.is_on) {
            let raw = &self.shared.raw;
            unsafe { raw.cmd_reset_query_pool(commands, pool.raw, 0, MAX_QUERIES) };
        }
    }

    /// Opens the query of a scope, unless one is open: a scope within a scope counts for that.
    /// Returns whether it did.
    pub fn begin(&mut self, commands: vk::CommandBuffer, name: &'static str) -> bool {
        if !self.is_active() || self.is_open {
            return false;
        }
        self.open(commands, name);
        self.is_open
    }

    /// Closes the query of a scope, if [`Counters::begin`] has opened one.
    pub fn end(&mut self, commands: vk::CommandBuffer, has_begun: bool) {
        if has_begun {
            self.close(commands);
        }
    }

    /// Closes the open query at the end of a command buffer, and returns the name of its scope.
    pub fn pause(&mut self, commands: vk::CommandBuffer) -> Option<&'static str> {
        let name = self.names.last().copied().filter(|_| self.is_open);
        self.close(commands);
        name
    }

    /// Opens a query of the scope that has been paused, in the next command buffer.
    pub fn resume(&mut self, commands: vk::CommandBuffer, paused: Option<&'static str>) {
        if let Some(name) = paused {
            self.open(commands, name);
        }
    }

    fn open(&mut self, commands: vk::CommandBuffer, name: &'static str) {
        let Some(Queries { pool, .. }) = &self.queries else { return };
        let i = self.names.len() as u32;
        if i == MAX_QUERIES {
            self.is_full = true;
            return;
        }
        let flags = vk::QueryControlFlags::empty();
        unsafe { self.shared.raw.cmd_begin_query(commands, pool.raw, i, flags) };
        self.names.push(name);
        self.is_open = true;
    }

    fn close(&mut self, commands: vk::CommandBuffer) {
        let Some(Queries { pool, .. }) = self.queries.as_ref().filter(|_| self.is_open) else {
            return;
        };
        let i = self.names.len() as u32 - 1;
        unsafe { self.shared.raw.cmd_end_query(commands, pool.raw, i) };
        self.is_open = false;
    }

    /// Copies the counts to where `read` finds them.
    pub fn copy(&self, commands: vk::CommandBuffer) {
        let n = self.names.len() as u32;
        let Some(Queries { pool, counts }) = self.queries.as_ref().filter(|_| n > 0) else {
            return;
        };
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        let (raw, pool, counts) = (&self.shared.raw, pool.raw, counts.raw());
        let stride = (N_COUNTS * size_of::<u64>()) as u64;
        unsafe { raw.cmd_copy_query_pool_results(commands, pool, 0, n, counts, 0, stride, flags) };
    }

    /// Returns the counts of every scope of a finished submission, in the order in which the scopes
    /// first began; none where nothing was counted, or a query had no room.
    pub fn read(&self) -> Result<Option<Vec<(&'static str, Invocations)>>> {
        let Some(Queries { counts, .. }) =
            self.queries.as_ref().filter(|_| self.is_on && !self.is_full)
        else {
            return Ok(None);
        };
        let counts: Vec<u64> = counts.read(N_COUNTS * self.names.len())?;
        let mut scopes: Vec<(&'static str, Invocations)> = Vec::new();
        for (name, counts) in self.names.iter().zip(counts.chunks_exact(N_COUNTS)) {
            let part = Invocations::of(counts);
            match scopes.iter_mut().find(|(of, _)| of == name) {
                Some((_, whole)) => whole.add(&part),
                None => scopes.push((name, part)),
            }
        }
        Ok(Some(scopes))
    }
}
