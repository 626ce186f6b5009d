//! Times of the scopes of one submission, from GPU timestamps.

use std::sync::Arc;
use std::time::Instant;

use ash::vk;

use super::buffer::{Buffer, MemoryUsage};
use super::call::Call;
use super::device::{Device, Owned, SharedDevice};
use super::pass_times::PassTimes;
use crate::error::Result;

/// The GPU time of one named scope.
#[derive(Debug, Clone, PartialEq)]
pub struct ScopeTime {
    /// Name of the scope.
    pub name: &'static str,
    /// Beginning, in nanoseconds from the device's own zero.
    pub begin_ns: f64,
    /// End, in nanoseconds from the device's own zero.
    pub end_ns: f64,
}

impl ScopeTime {
    /// Returns the length in milliseconds.
    pub fn ms(&self) -> f64 {
        (self.end_ns - self.begin_ns) * 1e-6
    }
}

/// Timestamps, two a scope. On a queue without timestamps it records nothing.
pub(super) struct Timer {
    queries: Option<Queries>,
    names: Vec<&'static str>,
    max_scopes: u32,
    shared: Arc<SharedDevice>,
}

struct Queries {
    pool: Owned<vk::QueryPool>,
    /// The submission itself copies its timestamps here: some drivers make a query of the pool
    /// wait for all later submissions (lavapipe waits for the whole device).
    ticks: Buffer,
}

impl Timer {
    pub fn new(device: &Device, name: &str, max_scopes: u32) -> Result<Timer> {
        let (shared, n) = (device.shared(), 2 * max_scopes);
        let queries = match device.limits().timestamp_valid_bits {
            0 => None,
            _ => {
                let info = vk::QueryPoolCreateInfo::default()
                    .query_type(vk::QueryType::TIMESTAMP)
                    .query_count(n);
                let pool = unsafe { shared.raw.create_query_pool(&info, None) }
                    .of_call("vkCreateQueryPool", name)?;
                let pool = shared.own(pool, name, ash::Device::destroy_query_pool);
                let (name, usage) = (format!("{name}.ticks"), MemoryUsage::Readback);
                Some(Queries { pool, ticks: Buffer::new::<u64>(device, &name, n.into(), usage)? })
            }
        };
        Ok(Timer { queries, names: vec![], max_scopes, shared: shared.clone() })
    }

    /// Forgets all scopes.
    pub fn reset(&mut self, commands: vk::CommandBuffer) {
        self.names.clear();
        if let Some(Queries { pool, .. }) = &self.queries {
            let n = 2 * self.max_scopes;
            unsafe { self.shared.raw.cmd_reset_query_pool(commands, pool.raw, 0, n) };
        }
    }

    /// Opens a scope; none where there are no timestamps or no room for one more.
    pub fn begin(&mut self, commands: vk::CommandBuffer, name: &'static str) -> Option<u32> {
        let i = self.names.len() as u32;
        if self.queries.is_none() || i >= self.max_scopes {
            return None;
        }
        self.names.push(name);
        self.write(commands, 2 * i);
        Some(i)
    }

    /// Closes a scope.
    pub fn end(&mut self, commands: vk::CommandBuffer, scope: Option<u32>) {
        if let Some(i) = scope {
            self.write(commands, 2 * i + 1);
        }
    }

    fn write(&self, commands: vk::CommandBuffer, query: u32) {
        let Some(Queries { pool, .. }) = &self.queries else { return };
        let raw = &self.shared.raw;
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        unsafe { raw.cmd_write_timestamp2(commands, all, pool.raw, query) };
        if self.shared.pass_times != PassTimes::Drained {
            return;
        }
        // An execution barrier after each timestamp keeps the next pass out of the scope: without
        // it some drivers (lavapipe) add a graphics pass to its neighbour's time.
        let barrier = [vk::MemoryBarrier2::default().src_stage_mask(all).dst_stage_mask(all)];
        let dependency = vk::DependencyInfo::default().memory_barriers(&barrier);
        unsafe { raw.cmd_pipeline_barrier2(commands, &dependency) };
    }

    /// Copies the timestamps to where `read` finds them; the last command but for a barrier.
    pub fn copy(&self, commands: vk::CommandBuffer) {
        let n = 2 * self.names.len() as u32;
        if let Some(Queries { pool, ticks }) = self.queries.as_ref().filter(|_| n > 0) {
            let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
            let (raw, pool, ticks) = (&self.shared.raw, pool.raw, ticks.raw());
            unsafe { raw.cmd_copy_query_pool_results(commands, pool, 0, n, ticks, 0, 8, flags) };
        }
    }

    /// Returns the times of a finished submission.
    pub fn read(&self) -> Result<Vec<ScopeTime>> {
        let Some(Queries { ticks, .. }) = &self.queries else { return Ok(vec![]) };
        let ticks: Vec<u64> = ticks.read(2 * self.names.len())?;
        let ns = self.shared.tick_clock.ns(&ticks, Instant::now());
        let of = |(name, ns): (&&'static str, &[f64])| {
            let [begin_ns, end_ns] = [ns[0], ns[1]];
            ScopeTime { name, begin_ns, end_ns }
        };
        let times = self.names.iter().zip(ns.chunks_exact(2)).map(of);
        Ok(times.collect())
    }
}
