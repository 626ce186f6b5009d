//! The thread that acquires a window's images and presents them.
//!
//! A driver may block a present until the device has finished all that was submitted, also what
//! came after the image: software drivers do. The next submission then waits for the queue, but
//! neither the game step nor recording does.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use ash::{khr, vk};

use super::commands::Submission;
use super::device::SharedDevice;
use super::shown::Presented;
use crate::error::{Error, Result};

/// Images that may be on their way to the window: slots, each with a semaphore and commands of its
/// own.
pub(super) const FRAMES_IN_FLIGHT: usize = 2;

/// An event that the thread reports.
pub(super) enum Event {
    /// The image may be drawn into once the slot's semaphore is signalled. The slot's commands have
    /// finished.
    Acquired {
        /// The image's place in the swapchain.
        i_image: usize,
        /// The slot that acquired it.
        i_slot: usize,
    },
    /// The window has another size by now, or is gone. The thread has ended.
    Outdated,
    /// A call failed. The thread has ended.
    Failed(Error),
}

impl From<Error> for Event {
    fn from(error: Error) -> Event {
        Event::Failed(error)
    }
}

/// A result of the thread; its error is the event that ends the thread.
type PresentResult<T> = std::result::Result<T, Event>;

/// An image whose commands were submitted.
pub(super) struct Drawn {
    pub i_image: usize,
    pub i_slot: usize,
    pub submission: Submission,
    /// When work on the picture began.
    pub begun: Instant,
    /// Dropped when the window system has the image.
    pub handed_over: SyncSender<()>,
}

/// The handles that the thread uses. The owner of the swapchain and the semaphores ends the thread
/// before it destroys them.
pub(super) struct PresentQueue {
    pub raw: vk::SwapchainKHR,
    pub loader: khr::swapchain::Device,
    /// By slot: the image may be drawn into.
    pub ready: [vk::Semaphore; FRAMES_IN_FLIGHT],
    /// By image: it may be presented.
    pub drawn: Vec<vk::Semaphore>,
    /// Takes the pictures whose visibility is watched.
    pub presented: Option<SyncSender<Presented>>,
    pub shared: Arc<SharedDevice>,
}

/// A running thread.
pub(super) struct Presenter {
    /// None once the thread is to end.
    drawn: Option<SyncSender<Drawn>>,
    pub events: Receiver<Event>,
    thread: Option<JoinHandle<()>>,
}

impl Presenter {
    pub fn start(queue: PresentQueue) -> Result<Presenter> {
        let (drawn, from_drawing) = sync_channel(FRAMES_IN_FLIGHT);
        // Room for every slot's image and for the last event.
        let (report, events) = sync_channel(FRAMES_IN_FLIGHT + 1);
        let work = move || {
            if let Err(last) = queue.run(&from_drawing, &report) {
                // Sending fails only after the swapchain is dropped: nobody needs the event then.
                let _ = report.send(last);
            }
        };
        let thread = std::thread::Builder::new().name("show".into()).spawn(work);
        let thread = thread.map_err(|e| Error::vulkan("starting the show thread", e))?;
        Ok(Presenter { drawn: Some(drawn), events, thread: Some(thread) })
    }

    /// Has an image presented. A thread that has ended has reported why.
    pub fn present(&self, drawn: Drawn) {
        if let Some(send) = &self.drawn {
            let _ = send.send(drawn);
        }
    }

    /// Returns when the thread has ended.
    pub fn end(&mut self) {
        self.drawn = None;
        // A thread that panicked has ended as well.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// Longest wait for an image in one call, so that a drawn image does not wait longer to be
/// presented.
const ACQUIRE_TIMEOUT: Duration = Duration::from_millis(1);

impl PresentQueue {
    /// Presents and acquires until the swapchain is dropped, or the event that is returned.
    fn run(&self, drawn: &Receiver<Drawn>, report: &SyncSender<Event>) -> PresentResult<()> {
        // Slots without an image, and their last submissions.
        let mut idle: VecDeque<(usize, Option<Submission>)> =
            (0..FRAMES_IN_FLIGHT).map(|i| (i, None)).collect();
        let (mut wait, mut id) = (Duration::ZERO, 0);
        loop {
            // Drawn images are presented before another one is acquired.
            let next = match idle.is_empty() {
                true => drawn.recv().map_err(|_| RecvTimeoutError::Disconnected),
                false => drawn.recv_timeout(std::mem::take(&mut wait)),
            };
            match next {
                Ok(Drawn { i_image, i_slot, submission, begun, handed_over }) => {
                    id += 1;
                    let presented = self.present(i_image, Presented { id, begun });
                    drop(handed_over);
                    presented?;
                    idle.push_back((i_slot, Some(submission)));
                    continue;
                }
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
                Err(RecvTimeoutError::Timeout) => {}
            }
            let Some((i_slot, last)) = idle.front() else { continue };
            // The slot's semaphore is free once the submission that waited for it has finished.
            if let Some(last) = last
                && !last.is_done()?
            {
                wait = ACQUIRE_TIMEOUT;
                continue;
            }
            let i_slot = *i_slot;
            if let Some(i_image) = self.acquire(i_slot)? {
                idle.pop_front();
                if report.send(Event::Acquired { i_image, i_slot }).is_err() {
                    return Ok(());
                }
            }
        }
    }

    /// Returns an image's place in the swapchain; none where the window system has none yet.
    fn acquire(&self, i_slot: usize) -> PresentResult<Option<usize>> {
        let (timeout, ready) = (ACQUIRE_TIMEOUT.as_nanos() as u64, self.ready[i_slot]);
        match unsafe { self.loader.acquire_next_image(self.raw, timeout, ready, vk::Fence::null()) }
        {
            // A suboptimal image is presented all the same: its semaphore is signalled.
            Ok((i_image, _)) => Ok(Some(i_image as usize)),
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => Ok(None),
            Err(e) => Err(failed("vkAcquireNextImageKHR", e)),
        }
    }

    /// Presents an image.
    fn present(&self, i_image: usize, presented: Presented) -> PresentResult<()> {
        let (drawn, chains, images) = ([self.drawn[i_image]], [self.raw], [i_image as u32]);
        let ids = [presented.id];
        let mut numbered = vk::PresentIdKHR::default().present_ids(&ids);
        let mut info = vk::PresentInfoKHR::default()
            .wait_semaphores(&drawn)
            .swapchains(&chains)
            .image_indices(&images);
        if self.presented.is_some() {
            info = info.push_next(&mut numbered);
        }
        let outcome = {
            let queue = self.shared.lock_queue();
            unsafe { self.loader.queue_present(*queue, &info) }
        };
        if let (Ok(_), Some(watcher)) = (&outcome, &self.presented) {
            // A watcher that is behind, or has ended, does without this picture.
            let _ = watcher.try_send(presented);
        }
        match outcome {
            Ok(false) => Ok(()),
            // The window has another size by now.
            Ok(true) => Err(Event::Outdated),
            Err(e) => Err(failed("vkQueuePresentKHR", e)),
        }
    }
}

/// Returns the event of a failed call.
fn failed(call: &str, e: vk::Result) -> Event {
    match e {
        vk::Result::ERROR_OUT_OF_DATE_KHR | vk::Result::ERROR_SURFACE_LOST_KHR => Event::Outdated,
        _ => Event::Failed(Error::vulkan(call, e)),
    }
}
