//! The thread that learns when presented pictures are visible (VK_KHR_present_wait).

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use ash::{khr, vk};

use crate::error::{Error, Result};

/// A picture that the window system has done with.
#[derive(Debug, Clone, Copy)]
pub struct Shown {
    /// When work on the picture began.
    pub begun: Instant,
    /// When it became visible; none where a newer picture took its place before.
    pub seen: Option<Instant>,
}

/// A picture that was handed to the window system.
#[derive(Clone, Copy)]
pub(super) struct Presented {
    /// Its number in the swapchain, from 1, ascending.
    pub id: u64,
    /// When work on it began.
    pub begun: Instant,
}

/// Room for pictures on their way to the thread, and for times on their way from it. Pictures that
/// find no room have no times: a window must not stop because nobody reads them.
const MOST: usize = 64;

/// Longest wait for a picture in one call: the thread must end with the swapchain.
const TIMEOUT: Duration = Duration::from_millis(20);

/// A running thread.
pub(super) struct Watcher {
    pub shown: Receiver<Shown>,
    is_ending: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Watcher {
    /// Starts the thread for a swapchain, which must outlive it. Returns it, and where it takes the
    /// pictures from.
    pub fn start(
        loader: khr::present_wait::Device,
        raw: vk::SwapchainKHR,
    ) -> Result<(Watcher, SyncSender<Presented>)> {
        let (presented, from_presenter) = sync_channel(MOST);
        let (report, shown) = sync_channel(MOST);
        let is_ending = Arc::new(AtomicBool::new(false));
        let ends = is_ending.clone();
        let work = move || {
            let wait = |id, timeout: Duration| {
                // SAFETY: the swapchain is destroyed after this thread has ended; other calls may
                // use it meanwhile.
                match unsafe { loader.wait_for_present(raw, id, timeout.as_nanos() as u64) } {
                    Ok(()) | Err(vk::Result::SUBOPTIMAL_KHR) => Waited::Visible,
                    Err(vk::Result::TIMEOUT) if !ends.load(Ordering::Relaxed) => Waited::NotYet,
                    // The swapchain or the device is gone; the thread that presents reports that.
                    Err(_) => Waited::Over,
                }
            };
            watch(&from_presenter, &report, wait);
        };
        let thread = std::thread::Builder::new().name("shown".into()).spawn(work);
        let thread = thread.map_err(|e| Error::vulkan("starting the thread of shown times", e))?;
        Ok((Watcher { shown, is_ending, thread: Some(thread) }, presented))
    }

    /// Returns when the thread has ended. The thread that presents must have ended before.
    pub fn end(&mut self) {
        self.is_ending.store(true, Ordering::Relaxed);
        // A thread that panicked has ended as well.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// The outcome of waiting for a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Waited {
    /// It, or a newer one, is visible.
    Visible,
    /// Not within the time.
    NotYet,
    /// It will never be told.
    Over,
}

/// Reports pictures as they become visible, until no more come or waiting is over.
///
/// A wait ends with the first of its picture and all newer ones, so a picture was replaced where
/// the wait for the next one ends without any time.
fn watch(
    presented: &Receiver<Presented>,
    report: &SyncSender<Shown>,
    wait: impl Fn(u64, Duration) -> Waited,
) {
    let mut next = None;
    while let Some(picture) = next.take().or_else(|| presented.recv().ok()) {
        let waited = loop {
            match wait(picture.id, TIMEOUT) {
                Waited::NotYet => {}
                ended => break ended,
            }
        };
        if waited == Waited::Over {
            return;
        }
        let (mut seen, mut newest) = (Instant::now(), picture);
        let mut told = vec![];
        for newer in presented.try_iter() {
            if wait(newer.id, Duration::ZERO) != Waited::Visible {
                next = Some(newer);
                break;
            }
            told.push(Shown { begun: newest.begun, seen: None });
            // The newer picture may have become visible after the older one was reported.
            (seen, newest) = (Instant::now(), newer);
        }
        told.push(Shown { begun: newest.begun, seen: Some(seen) });
        for shown in told {
            // A full channel loses times, and nothing else.
            let _ = report.try_send(shown);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;

    /// Watches the pictures 1 to `n`; waits return `answers`, in their order. Returns whether each
    /// reported picture was seen, and the numbers that were waited for.
    fn watched(n: u64, answers: &[Waited]) -> (Vec<bool>, Vec<u64>) {
        let (send, presented) = sync_channel(MOST);
        let (report, shown) = sync_channel(MOST);
        let begun = Instant::now();
        (1..=n).for_each(|id| send.send(Presented { id, begun }).expect("room"));
        drop(send);
        let (rest, asked) = (RefCell::new(answers.iter()), RefCell::new(vec![]));
        watch(&presented, &report, |id, _| {
            asked.borrow_mut().push(id);
            rest.borrow_mut().next().copied().unwrap_or(Waited::Over)
        });
        drop(report);
        (shown.iter().map(|s| s.seen.is_some()).collect(), asked.into_inner())
    }

    use Waited::{NotYet, Over, Visible};

    #[test]
    fn each_picture_is_told_when_it_is_visible() {
        let (seen, asked) = watched(2, &[NotYet, NotYet, Visible, NotYet, Visible]);
        assert_eq!((seen, asked), (vec![true, true], vec![1, 1, 1, 2, 2]));
    }

    #[test]
    fn a_picture_whose_successor_is_visible_at_once_was_replaced() {
        let (seen, asked) = watched(4, &[Visible, Visible, Visible, NotYet, Visible]);
        assert_eq!((seen, asked), (vec![false, false, true, true], vec![1, 2, 3, 4, 4]));
    }

    /// The second picture becomes visible while the first one is reported.
    #[test]
    fn no_picture_is_reported_before_it_is_visible() {
        let (send, presented) = sync_channel(MOST);
        let (report, shown) = sync_channel(MOST);
        let begun = Instant::now();
        (1..=2).for_each(|id| send.send(Presented { id, begun }).expect("room"));
        drop(send);
        let visible = RefCell::new(vec![]);
        watch(&presented, &report, |_, _| {
            let before = Instant::now();
            while Instant::now() == before {}
            visible.borrow_mut().push(Instant::now());
            Visible
        });
        drop(report);
        let told: Vec<Option<Instant>> = shown.iter().map(|s| s.seen).collect();
        assert_eq!(told.len(), 2);
        assert!(told[0].is_none() && told[1] >= Some(visible.borrow()[1]));
    }

    #[test]
    fn nothing_is_told_of_a_picture_that_the_window_system_gave_up() {
        let (seen, asked) = watched(3, &[Visible, NotYet, NotYet, Over]);
        assert_eq!((seen, asked), (vec![true], vec![1, 2, 2, 2]));
    }
}
