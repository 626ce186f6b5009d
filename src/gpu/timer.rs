//! Times of the scopes of one submission, from GPU timestamps.

use std::sync::Arc;

use ash::vk;

use super::device::{Device, Shared};
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
    names: Vec<&'static str>,
    max_scopes: u32,
    shared: Arc<Shared>,
}

impl Timer {
    pub fn new(device: &Device, name: &str, max_scopes: u32) -> Result<Timer> {
        let shared = device.shared().clone();
        let mut timer =
            Timer { pool: vk::QueryPool::null(), names: Vec::with_capacity(max_scopes as usize), max_scopes, shared };
        if device.limits().timestamp_valid_bits > 0 {
            let info =
                vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(2 * max_scopes);
            timer.pool = unsafe { timer.shared.raw.create_query_pool(&info, None) }
                .map_err(|e| Error::vulkan(format!("vkCreateQueryPool {name}"), e))?;
            timer.shared.name(timer.pool, name);
        }
        Ok(timer)
    }

    pub fn reset(&mut self, commands: vk::CommandBuffer) {
        self.names.clear();
        if self.pool != vk::QueryPool::null() {
            unsafe { self.shared.raw.cmd_reset_query_pool(commands, self.pool, 0, 2 * self.max_scopes) };
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
        // An execution barrier after each timestamp keeps the next pass out of the scope: without it some drivers
        // (lavapipe) book a graphics pass to its neighbour.
        let barrier = [vk::MemoryBarrier2::default().src_stage_mask(all).dst_stage_mask(all)];
        let dependency = vk::DependencyInfo::default().memory_barriers(&barrier);
        unsafe {
            raw.cmd_write_timestamp2(commands, all, self.pool, query);
            raw.cmd_pipeline_barrier2(commands, &dependency);
        }
    }

    /// Times of a finished submission.
    pub fn read(&self) -> Result<Vec<ScopeTime>> {
        if self.names.is_empty() {
            return Ok(vec![]);
        }
        let mut ticks = vec![0u64; 2 * self.names.len()];
        unsafe {
            self.shared.raw.get_query_pool_results(
                self.pool,
                0,
                &mut ticks,
                vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT,
            )
        }
        .map_err(|e| Error::vulkan("vkGetQueryPoolResults", e))?;
        let limits = &self.shared.limits;
        let mask = u64::MAX.checked_shr(64 - limits.timestamp_valid_bits).unwrap_or(0);
        let times = self.names.iter().zip(ticks.chunks_exact(2)).map(|(name, t)| {
            let (begin, end) = (t[0] & mask, t[1] & mask);
            // The counter wraps at its valid bits; a difference modulo them is right all the same.
            let length = end.wrapping_sub(begin) & mask;
            let begin_ns = begin as f64 * limits.timestamp_period_ns;
            ScopeTime { name, begin_ns, end_ns: begin_ns + length as f64 * limits.timestamp_period_ns }
        });
        Ok(times.collect())
    }
}

impl Drop for Timer {
    fn drop(&mut self) {
        unsafe { self.shared.raw.destroy_query_pool(self.pool, None) };
    }
}
