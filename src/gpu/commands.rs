//! A command buffer and its submissions.

use std::sync::Arc;

use ash::vk;
use tracing::info_span;

use super::call::Call;
use super::descriptors::DescriptorPools;
use super::device::{Device, Owned, SharedDevice};
use super::timer::{ScopeTime, Timer};
use crate::error::Result;

/// A submission that takes longer than an hour is taken for a hang. The driver's watchdog ends a
/// GPU's hang long before; a software device may take minutes for a million large sprites.
const TIMEOUT_NS: u64 = 3_600_000_000_000;
const MAX_SCOPES: u32 = 32;

/// A command buffer with all that its submissions need: descriptors, timestamps, a timeline
/// semaphore.
///
/// Dropping it waits for the last submission.
pub struct Commands {
    pub(super) pool: Owned<vk::CommandPool>,
    pub(super) buffer: vk::CommandBuffer,
    pub(super) descriptors: DescriptorPools,
    pub(super) timer: Timer,
    /// The value that the semaphore has after the last submission.
    value: u64,
    semaphore: Arc<Owned<vk::Semaphore>>,
    name: String,
    pub(super) shared: Arc<SharedDevice>,
}

/// A submission, which any thread can wait for.
#[derive(Clone)]
pub struct Submission {
    semaphore: Arc<Owned<vk::Semaphore>>,
    value: u64,
    name: String,
    shared: Arc<SharedDevice>,
}

impl Submission {
    /// Returns when the device has finished.
    ///
    /// # Errors
    /// The device is lost, or an hour has passed.
    pub fn wait(&self) -> Result<()> {
        let _zone = info_span!("wait").entered();
        let (semaphores, values) = ([self.semaphore.raw], [self.value]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        unsafe { self.shared.raw.wait_semaphores(&info, TIMEOUT_NS) }
            .of_call("vkWaitSemaphores", &self.name)
    }

    /// Whether the device has finished already.
    ///
    /// # Errors
    /// The device is lost.
    pub fn is_done(&self) -> Result<bool> {
        let reached = unsafe { self.shared.raw.get_semaphore_counter_value(self.semaphore.raw) }
            .of_call("vkGetSemaphoreCounterValue", &self.name)?;
        Ok(reached >= self.value)
    }
}

impl Commands {
    /// Makes an empty command buffer.
    ///
    /// # Errors
    /// The driver is out of memory.
    pub fn new(device: &Device, name: &str) -> Result<Commands> {
        let shared = device.shared();
        let timer = Timer::new(device, name, MAX_SCOPES)?;
        let pool = shared.command_pool(name)?;
        let info =
            vk::CommandBufferAllocateInfo::default().command_pool(pool.raw).command_buffer_count(1);
        let buffer = unsafe { shared.raw.allocate_command_buffers(&info) }
            .of_call("vkAllocateCommandBuffers", name)?[0];
        shared.name(buffer, name);
        let semaphore = Arc::new(shared.semaphore(name, vk::SemaphoreType::TIMELINE)?);
        let descriptors = DescriptorPools::new(shared);
        let (name, shared) = (name.to_owned(), shared.clone());
        Ok(Commands { pool, buffer, descriptors, timer, value: 0, semaphore, name, shared })
    }

    /// Starts the recorded commands and returns at once.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn submit(&mut self) -> Result<Submission> {
        self.submit_between(None, None)
    }

    /// Starts the recorded commands. Drawing waits for `ready`; `drawn` is signalled at the end.
    pub(super) fn submit_between(
        &mut self,
        ready: Option<vk::Semaphore>,
        drawn: Option<vk::Semaphore>,
    ) -> Result<Submission> {
        let _zone = info_span!("submit").entered();
        let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(self.buffer)];
        let at = |semaphore, stages| {
            vk::SemaphoreSubmitInfo::default().semaphore(semaphore).stage_mask(stages)
        };
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        let color = vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT;
        let waits: Vec<_> = ready.into_iter().map(|semaphore| at(semaphore, color)).collect();
        let value = self.value + 1;
        let mut signals = vec![at(self.semaphore.raw, all).value(value)];
        signals.extend(drawn.map(|semaphore| at(semaphore, all)));
        let info = [vk::SubmitInfo2::default()
            .wait_semaphore_infos(&waits)
            .command_buffer_infos(&buffers)
            .signal_semaphore_infos(&signals)];
        unsafe {
            self.shared.raw.queue_submit2(*self.shared.lock_queue(), &info, vk::Fence::null())
        }
        .of_call("vkQueueSubmit2", &self.name)?;
        self.value = value;
        Ok(self.last_submission())
    }

    fn last_submission(&self) -> Submission {
        Submission {
            semaphore: self.semaphore.clone(),
            value: self.value,
            name: self.name.clone(),
            shared: self.shared.clone(),
        }
    }

    /// Waits for the last submission and returns the times of its scopes.
    ///
    /// # Errors
    /// The device is lost, or an hour has passed.
    pub fn wait(&mut self) -> Result<Vec<ScopeTime>> {
        self.last_submission().wait()?;
        self.timer.read()
    }
}

impl Drop for Commands {
    fn drop(&mut self) {
        // A submission still under way (after an error) must end before its memory goes; a lost
        // device ends it too.
        if self.value > 0 {
            let _ = self.last_submission().wait();
        }
    }
}
