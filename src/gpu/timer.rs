//! Times of the scopes of one submission, from GPU timestamps.

use std::sync::Arc;

use ash::vk;

use super::device::{Device, Shared};
use super::memory::{Buffer, Place};
use crate::error::{Error, Result};

/// GPU time of one named scope.
#[derive(Debug, Clone, PartialEq)]
pub struct ScopeTime {
    pub name: &'static str,
    /// From the device's own zero.
    pub begin_ns: f64,
    pub end_ns: f64,
}

impl ScopeTime {
    pub fn ms(&self) -> f64 {
        (self.end_ns - self.begin_ns) * 1e-6
    }
}

/// A pool of timestamps, two a scope. On a queue without timestamps it records nothing.
pub(super) struct Timer {
    pool: vk::QueryPool,
    /// Where the submission itself copies them: to ask the pool is to wait for all later
    /// submissions on some drivers (lavapipe waits for the whole device).
    ticks: Option<Buffer>,
    names: Vec<&'static str>,
    max_scopes: u32,
    shared: Arc<Shared>,
}

impl Timer {
    pub fn new(device: &Device, name: &str, max_scopes: u32) -> Result<Timer> {
        let shared = device.shared().clone();
        let mut timer = Timer {
            pool: vk::QueryPool::null(),
            ticks: None,
            names: Vec::with_capacity(max_scopes as usize),
            max_scopes,
            shared,
        };
        if device.limits().timestamp_valid_bits > 0 {
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(2 * max_scopes);
            timer.pool = unsafe { timer.shared.raw.create_query_pool(&info, None) }
                .map_err(|e| Error::vulkan(format!("vkCreateQueryPool {name}"), e))?;
            timer.shared.name(timer.pool, name);
            let n = u64::from(2 * max_scopes);
            timer.ticks =
                Some(Buffer::new::<u64>(device, &format!("{name}.ticks"), n, Place::Readback)?);
        }
        Ok(timer)
    }

    pub fn reset(&mut self, commands: vk::CommandBuffer) {
        self.names.clear();
        if self.pool != vk::QueryPool::null() {
            unsafe {
                self.shared.raw.cmd_reset_query_pool(commands, self.pool, 0, 2 * self.max_scopes)
            };
        }
    }

    /// Opens a scope; `None` where there are no timestamps or no room for one more.
    pub fn begin(&mut self, commands: vk::CommandBuffer, name: &'static str) -> Option<u32> {
        if self.pool == vk::QueryPool::null() || self.names.len() as u32 >= self.max_scopes {
            return None;
        }
        let i = self.names.len() as u32;
        self.names.push(name);
        self.write(commands, 2 * i);
        Some(i)
    }

    pub fn end(&mut self, commands: vk::CommandBuffer, scope: Option<u32>) {
        if let Some(i) = scope {
            self.write(commands, 2 * i + 1);
        }
    }

    fn write(&self, commands: vk::CommandBuffer, query: u32) {
        let raw = &self.shared.raw;
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        // An execution barrier after each timestamp keeps the next pass out of the scope: without
        // it some drivers (lavapipe) book a graphics pass to its neighbour.
        let barrier = [vk::MemoryBarrier2::default().src_stage_mask(all).dst_stage_mask(all)];
        let dependency = vk::DependencyInfo::default().memory_barriers(&barrier);
        unsafe {
            raw.cmd_write_timestamp2(commands, all, self.pool, query);
            raw.cmd_pipeline_barrier2(commands, &dependency);
        }
    }

    /// Copies the scopes' times to where `read` finds them; the last command of a submission but
    /// for its barrier.
    pub fn copy(&self, commands: vk::CommandBuffer) {
        let n = 2 * self.names.len() as u32;
        if let Some(ticks) = self.ticks.as_ref().filter(|_| n > 0) {
            let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
            unsafe {
                self.shared
                    .raw
                    .cmd_copy_query_pool_results(commands, self.pool, 0, n, ticks.raw, 0, 8, flags)
            };
        }
    }

    /// Times of a finished submission.
    pub fn read(&self) -> Result<Vec<ScopeTime>> {
        let Some(ticks) = self.ticks.as_ref().filter(|_| !self.names.is_empty()) else {
            return Ok(vec![]);
        };
        let ticks: Vec<u64> = ticks.read(2 * self.names.len())?;
        let limits = &self.shared.limits;
        let mask = limits.tick_mask();
        let times = self.names.iter().zip(ticks.chunks_exact(2)).map(|(name, t)| {
            let (begin, end) = (t[0] & mask, t[1] & mask);
            // The counter wraps at its valid bits; a difference modulo them is right all the same.
            let length = end.wrapping_sub(begin) & mask;
            let begin_ns = limits.ticks_ns(begin);
            ScopeTime {
                name,
                begin_ns,
                end_ns: begin_ns + length as f64 * limits.timestamp_period_ns,
            }
        });
        Ok(times.collect())
    }
}

impl Drop for Timer {
    fn drop(&mut self) {
        unsafe { self.shared.raw.destroy_query_pool(self.pool, None) };
    }
}
