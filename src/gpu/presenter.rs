//! The thread that shows. It asks the window system for images and gives them back to be seen. A
//! driver may keep whoever shows a picture until the device is done with all that it was handed,
//! also with what came after the picture: software ones do. Then the next submission waits for the
//! queue, but neither the game step nor recording does.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

use ash::{khr, vk};

use super::device::Shared;
use super::recorder::Pending;
use crate::error::{Error, Result};

/// So many pictures may be on their way to the window: slots, each with a semaphore and commands of
/// its own.
pub(super) const ON_THEIR_WAY: usize = 2;

/// What the thread tells.
pub(super) enum Told {
    /// May be drawn into once the slot's semaphore is signalled. Commands of the slot have been
    /// done.
    Image {
        i_image: usize,
        i_slot: usize,
    },
    /// The window is of another size by now, or gone: nothing more is told.
    Outdated,
    Failed(Error),
}

/// A picture whose commands are with the device.
pub(super) struct Drawn {
    pub i_image: usize,
    pub i_slot: usize,
    pub done: Pending,
    /// Dropped when the window system has it.
    pub handed_over: SyncSender<()>,
}

/// What the thread works with. Whoever owns the swapchain and the semaphores ends it before them.
pub(super) struct Chain {
    pub raw: vk::SwapchainKHR,
    pub loader: khr::swapchain::Device,
    /// By slot: the image may be drawn into.
    pub ready: [vk::Semaphore; ON_THEIR_WAY],
    /// By image: it may be shown.
    pub drawn: Vec<vk::Semaphore>,
    pub shared: Arc<Shared>,
}

pub(super) struct Presenter {
    /// None once it is to end.
    drawn: Option<SyncSender<Drawn>>,
    pub told: Receiver<Told>,
    thread: Option<JoinHandle<()>>,
}

impl Presenter {
    pub fn start(chain: Chain) -> Result<Presenter> {
        let (drawn, from_drawing) = sync_channel(ON_THEIR_WAY);
        // Every slot's image, and how it ended.
        let (tell, told) = sync_channel(ON_THEIR_WAY + 1);
        let work = move || {
            let ended = match chain.run(&from_drawing, &tell) {
                Ok(End::Outdated) => Told::Outdated,
                Ok(End::NotWanted) => return,
                Err(error) => Told::Failed(error),
            };
            // Nobody listens where nothing is wanted any more.
            let _ = tell.send(ended);
        };
        let thread = std::thread::Builder::new().name("show".into()).spawn(work);
        let thread = thread.map_err(|e| Error::vulkan("starting the show thread", e))?;
        Ok(Presenter { drawn: Some(drawn), told, thread: Some(thread) })
    }

    /// Has it shown. A thread that has ended has told why.
    pub fn show(&self, drawn: Drawn) {
        if let Some(send) = &self.drawn {
            let _ = send.send(drawn);
        }
    }

    /// Returns when the thread has ended.
    pub fn end(&mut self) {
        self.drawn = None;
        // One that panicked has ended as well.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// Why the thread ends.
enum End {
    NotWanted,
    Outdated,
}

/// The window system is asked for so long at once, so that what is drawn meanwhile does not wait
/// longer.
const PATIENCE: Duration = Duration::from_millis(1);

impl Chain {
    fn run(&self, drawn: &Receiver<Drawn>, tell: &SyncSender<Told>) -> Result<End> {
        // Slots without an image, and their last commands.
        let mut idle: VecDeque<(usize, Option<Pending>)> =
            (0..ON_THEIR_WAY).map(|i| (i, None)).collect();
        let mut wait = Duration::ZERO;
        loop {
            // What is drawn is shown before more is asked for.
            let next = match idle.is_empty() {
                true => drawn.recv().map_err(|_| RecvTimeoutError::Disconnected),
                false => drawn.recv_timeout(std::mem::take(&mut wait)),
            };
            match next {
                Ok(Drawn { i_image, i_slot, done, handed_over }) => {
                    let is_shown = self.present(i_image);
                    drop(handed_over);
                    if !is_shown? {
                        return Ok(End::Outdated);
                    }
                    idle.push_back((i_slot, Some(done)));
                    continue;
                }
                Err(RecvTimeoutError::Disconnected) => return Ok(End::NotWanted),
                Err(RecvTimeoutError::Timeout) => {}
            }
            let Some((i_slot, last)) = idle.front() else { continue };
            // Its semaphore is free once what waited for it is done.
            if let Some(last) = last
                && !last.is_done()?
            {
                wait = PATIENCE;
                continue;
            }
            let i_slot = *i_slot;
            match self.acquire(i_slot)? {
                Acquired::Image(i_image) => {
                    idle.pop_front();
                    if tell.send(Told::Image { i_image, i_slot }).is_err() {
                        return Ok(End::NotWanted);
                    }
                }
                Acquired::Late => {}
                Acquired::Outdated => return Ok(End::Outdated),
            }
        }
    }

    fn acquire(&self, i_slot: usize) -> Result<Acquired> {
        let (timeout, ready) = (PATIENCE.as_nanos() as u64, self.ready[i_slot]);
        match unsafe { self.loader.acquire_next_image(self.raw, timeout, ready, vk::Fence::null()) }
        {
            // A picture that does not quite fit is shown all the same: its semaphore is signalled.
            Ok((i_image, _)) => Ok(Acquired::Image(i_image as usize)),
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => Ok(Acquired::Late),
            Err(e) if is_outdated(e) => Ok(Acquired::Outdated),
            Err(e) => Err(Error::vulkan("vkAcquireNextImageKHR", e)),
        }
    }

    /// False where the window is another by now.
    fn present(&self, i_image: usize) -> Result<bool> {
        let (drawn, chains, images) = ([self.drawn[i_image]], [self.raw], [i_image as u32]);
        let info = vk::PresentInfoKHR::default()
            .wait_semaphores(&drawn)
            .swapchains(&chains)
            .image_indices(&images);
        let queue = self.shared.lock_queue();
        match unsafe { self.loader.queue_present(*queue, &info) } {
            Ok(is_suboptimal) => Ok(!is_suboptimal),
            Err(e) if is_outdated(e) => Ok(false),
            Err(e) => Err(Error::vulkan("vkQueuePresentKHR", e)),
        }
    }
}

enum Acquired {
    Image(usize),
    Late,
    Outdated,
}

fn is_outdated(e: vk::Result) -> bool {
    matches!(e, vk::Result::ERROR_OUT_OF_DATE_KHR | vk::Result::ERROR_SURFACE_LOST_KHR)
}
