//! A command buffer and its submissions.

use std::sync::Arc;

use ash::vk;
use tracing::info_span;

use super::barriers::{Scope, stage_barrier};
use super::call::Call;
use super::cold::ColdCaches;
use super::counters::{Counters, Invocations};
use super::descriptors::DescriptorPools;
use super::device::{Device, Owned, SharedDevice};
use super::rate::Pace;
use super::stamp::Stamp;
use super::timer::{ScopeTime, Timer};
use crate::error::Result;

/// A submission that takes longer than this is taken for a hang. The driver's watchdog ends most
/// hangs of a GPU long before; a software device may take minutes for a million large sprites.
const TIMEOUT_NS: u64 = 3_600_000_000_000;
/// The same where submissions have a limit, of half a second by default. Tools that check every
/// memory access make it a hundred times longer.
const TIMEOUT_OF_PARTS_NS: u64 = 600_000_000_000;
const MAX_SCOPES: u32 = 32;

/// Command buffers with all that their submissions need: descriptors, timestamps, a timeline
/// semaphore.
///
/// A recording is one command buffer, or several parts that are submitted one after another.
/// Dropping waits for the last submission.
pub struct Commands {
    pool: Owned<vk::CommandPool>,
    /// The parts of the recording, and those of earlier recordings that had more.
    buffers: Vec<vk::CommandBuffer>,
    /// The part that is being recorded; the ones before it have ended.
    i_buffer: usize,
    n_submitted: usize,
    /// Whether a recording may be submitted in parts.
    pub(super) is_divisible: bool,
    pub(super) pace: Pace,
    /// The labels that are open, the outer one first.
    labels: Vec<&'static str>,
    pub(super) descriptors: DescriptorPools,
    pub(super) timer: Timer,
    pub(super) counters: Counters,
    /// The scope whose invocations were counted when the last part ended.
    counted: Option<&'static str>,
    pub(super) stamp: Stamp,
    /// What is written before each scope, where caches are to be cold.
    pub(super) cold: Option<Arc<ColdCaches>>,
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
    /// The device is lost, or is taken for hung.
    pub fn wait(&self) -> Result<()> {
        let _zone = info_span!("wait").entered();
        let (semaphores, values) = ([self.semaphore.raw], [self.value]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        let timeout_ns = match self.shared.max_submit_ns {
            Some(_) => TIMEOUT_OF_PARTS_NS,
            None => TIMEOUT_NS,
        };
        let waited = match self.shared.is_abandoned() {
            true => Err(vk::Result::TIMEOUT),
            false => unsafe { self.shared.raw.wait_semaphores(&info, timeout_ns) },
        };
        if let Err(failure) = waited {
            self.shared.settle(failure);
        }
        self.shared.outcome(waited, "vkWaitSemaphores", &self.name)
    }

    /// Whether the device has finished already.
    ///
    /// # Errors
    /// The device is lost.
    pub fn is_done(&self) -> Result<bool> {
        let reached = unsafe { self.shared.raw.get_semaphore_counter_value(self.semaphore.raw) };
        let reached = self.shared.outcome(reached, "vkGetSemaphoreCounterValue", &self.name)?;
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
        let counters = Counters::new(device, name)?;
        let stamp = Stamp::new(device, name)?;
        let pool = shared.command_pool(name)?;
        let semaphore = Arc::new(shared.semaphore(name, vk::SemaphoreType::TIMELINE)?);
        let descriptors = DescriptorPools::new(shared);
        let (name, shared) = (name.to_owned(), shared.clone());
        Ok(Commands {
            pool,
            buffers: vec![],
            i_buffer: 0,
            n_submitted: 0,
            is_divisible: true,
            pace: Pace::default(),
            labels: vec![],
            descriptors,
            timer,
            counters,
            counted: None,
            stamp,
            cold: None,
            value: 0,
            semaphore,
            name,
            shared,
        })
    }

    /// Makes an empty command buffer whose recordings are submitted whole.
    ///
    /// # Errors
    /// The driver is out of memory.
    #[cfg(feature = "window")]
    pub(super) fn whole(device: &Device, name: &str) -> Result<Commands> {
        let mut commands = Commands::new(device, name)?;
        commands.is_divisible = false;
        Ok(commands)
    }

    /// Makes caches cold before each scope of later recordings; none leaves them as they are.
    pub fn set_cold(&mut self, cold: Option<Arc<ColdCaches>>) {
        self.cold = cold;
    }

    /// Returns the command buffer that is being recorded.
    pub(super) fn buffer(&self) -> vk::CommandBuffer {
        self.buffers.get(self.i_buffer).copied().unwrap_or_default()
    }

    /// Begins an empty recording in place of the last one.
    pub(super) fn begin(&mut self) -> Result<()> {
        self.descriptors.reset()?;
        let flags = vk::CommandPoolResetFlags::empty();
        unsafe { self.shared.raw.reset_command_pool(self.pool.raw, flags) }
            .of_call("vkResetCommandPool", "")?;
        (self.i_buffer, self.n_submitted) = (0, 0);
        self.labels.clear();
        self.pace = Pace::default();
        self.begin_buffer()
    }

    fn begin_buffer(&mut self) -> Result<()> {
        if self.i_buffer == self.buffers.len() {
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(self.pool.raw)
                .command_buffer_count(1);
            let buffer = unsafe { self.shared.raw.allocate_command_buffers(&info) }
                .of_call("vkAllocateCommandBuffers", &self.name)?[0];
            self.shared.name(buffer, &self.name);
            self.buffers.push(buffer);
        }
        let info = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        unsafe { self.shared.raw.begin_command_buffer(self.buffer(), &info) }
            .of_call("vkBeginCommandBuffer", "")
    }

    /// Ends the command buffer that is being recorded, after which the host may read what the
    /// device has written.
    pub(super) fn end(&mut self) -> Result<()> {
        stage_barrier(&self.shared.raw, self.buffer(), Scope::any(), Scope::HOST_READ);
        unsafe { self.shared.raw.end_command_buffer(self.buffer()) }
            .of_call("vkEndCommandBuffer", "")?;
        self.i_buffer += 1;
        Ok(())
    }

    /// Begins a part of the recording, which is submitted apart from what was recorded before.
    pub(super) fn begin_part(&mut self) -> Result<()> {
        self.pace.pending_ns = 0.0;
        self.end_part()?;
        self.continue_part()
    }

    /// Submits what is recorded so far, waits for it, and begins a part.
    pub(super) fn finish_part(&mut self) -> Result<()> {
        self.pace.pending_ns = 0.0;
        self.end_part()?;
        self.submit()?.wait()?;
        self.continue_part()
    }

    /// Ends a command buffer whose labels go on in the next one.
    fn end_part(&mut self) -> Result<()> {
        self.counted = self.counters.pause(self.buffer());
        self.labels.iter().for_each(|_| self.shared.end_label(self.buffer()));
        self.end()
    }

    fn continue_part(&mut self) -> Result<()> {
        self.begin_buffer()?;
        self.labels.iter().for_each(|name| self.shared.begin_label(self.buffer(), name));
        let (buffer, counted) = (self.buffer(), self.counted.take());
        self.counters.resume(buffer, counted);
        Ok(())
    }

    /// Begins a label, which holds until [`Commands::end_label`].
    pub(super) fn begin_label(&mut self, name: &'static str) {
        self.labels.push(name);
        self.shared.begin_label(self.buffer(), name);
    }

    pub(super) fn end_label(&mut self) {
        self.labels.pop();
        self.shared.end_label(self.buffer());
    }

    /// Switches the counting of invocations in the next recordings on or off. It does nothing
    /// unless the device was opened for it and has counters.
    pub fn count_invocations(&mut self, is_on: bool) {
        self.counters.switch(is_on);
    }

    /// Returns what each scope of the last submission, which must have been waited for, invoked;
    /// none if that was not counted.
    ///
    /// # Errors
    /// The device is lost.
    pub fn invocations(&self) -> Result<Option<Vec<(&'static str, Invocations)>>> {
        self.counters.read()
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
        mut ready: Option<vk::Semaphore>,
        drawn: Option<vk::Semaphore>,
    ) -> Result<Submission> {
        let _zone = info_span!("submit").entered();
        let at = |semaphore, stages| {
            vk::SemaphoreSubmitInfo::default().semaphore(semaphore).stage_mask(stages)
        };
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        let color = vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT;
        while self.n_submitted < self.i_buffer {
            let buffer = self.buffers[self.n_submitted];
            let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(buffer)];
            let waits: Vec<_> = ready.take().into_iter().map(|s| at(s, color)).collect();
            let value = self.value + 1;
            let mut signals = vec![at(self.semaphore.raw, all).value(value)];
            if self.n_submitted + 1 == self.i_buffer {
                signals.extend(drawn.map(|semaphore| at(semaphore, all)));
            }
            let info = [vk::SubmitInfo2::default()
                .wait_semaphore_infos(&waits)
                .command_buffer_infos(&buffers)
                .signal_semaphore_infos(&signals)];
            let submitted = unsafe {
                self.shared.raw.queue_submit2(*self.shared.lock_queue(), &info, vk::Fence::null())
            };
            self.shared.outcome(submitted, "vkQueueSubmit2", &self.name)?;
            (self.n_submitted, self.value) = (self.n_submitted + 1, value);
        }
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

    /// Returns the number of parts in which the last recording was submitted.
    pub fn n_parts(&self) -> usize {
        self.n_submitted
    }

    /// Waits for the last submission and returns the times of its scopes.
    ///
    /// # Errors
    /// The device is lost or taken for hung, or a guard band is broken.
    pub fn wait(&mut self) -> Result<Vec<ScopeTime>> {
        self.last_submission().wait()?;
        self.stamp.count()?;
        if let Some(guards) = &self.shared.guards {
            guards.check(&self.name)?;
        }
        let times = self.timer.read()?;
        self.pace.correct(&times);
        Ok(times)
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
