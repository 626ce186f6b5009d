//! Game step and render step side by side: a thread plays, one draws, one waits for the device. An
//! owned packet a frame crosses, through bounded channels, and there is no lock that two of them
//! take.
//!
//! A frame's game step may begin when the second frame before it has ended. So the device has the
//! next frame at hand, recorded while it draws, wherever game step and recording take less than it
//! does; and a picture is never older than two frames.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Builder, Scope};
use std::time::Instant;

use super::feed::IN_FLIGHT;
use super::game::Game;
use super::packet::Packet;
use super::render::Renderer;
use super::{OnFrame, Started};
use crate::error::{Error, Result};
use crate::gpu::Submission;

/// What the drawing thread is told.
enum Event {
    Packet(Box<Packet>),
    /// The oldest frame in flight was finished at this time.
    Ended(Instant),
    /// There is no further frame; an error where there should have been one.
    Played(Result<()>),
    /// The device, or a thread: nothing more will end.
    Failed(Error),
}

/// Room for all that can be told at once, so that nobody who tells has to wait: a packet and an end
/// for each frame in flight, and how either thread ends.
const EVENTS: usize = 2 * IN_FLIGHT + 2;

/// Runs `frames`; `on_frame` sees each as it ends. An error or panic on either side ends both.
pub fn run(
    game: &mut Game,
    renderer: &mut Renderer,
    frames: impl Iterator<Item = u32> + Send,
    on_frame: &mut OnFrame<'_>,
) -> Result<()> {
    let drawn = std::thread::scope(|scope| {
        let (tell, events) = sync_channel::<Event>(EVENTS);
        let (grant, granted) = sync_channel::<()>(IN_FLIGHT);
        let (submit, submitted) = sync_channel::<Submission>(IN_FLIGHT);
        let teller = tell.clone();
        start(scope, "game", tell.clone(), move || play(game, frames, &granted, &teller))?;
        let teller = tell.clone();
        start(scope, "wait", tell, move || wait(&submitted, &teller))?;
        for _ in 0..IN_FLIGHT {
            // There is room for as many.
            let _ = grant.send(());
        }
        // What is still owned here ends with this block, and with it both threads.
        Drawing {
            renderer: &mut *renderer,
            grant,
            submit,
            started: VecDeque::new(),
            under_way: VecDeque::new(),
        }
        .run(&events, on_frame)
    });
    renderer.drain();
    drawn
}

/// Starts a thread whose panic is told as an error.
fn start<'scope>(
    scope: &'scope Scope<'scope, '_>,
    name: &'static str,
    tell: SyncSender<Event>,
    work: impl FnOnce() + Send + 'scope,
) -> Result<()> {
    let guarded = move || {
        if let Err(panic) = catch_unwind(AssertUnwindSafe(work)) {
            let text = panic.downcast_ref::<String>().cloned();
            let text = text
                .or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()))
                .unwrap_or_default();
            // Nobody listens when the drawing thread has ended.
            let _ = tell.send(Event::Failed(Error::Fault {
                what: format!("the {name} thread panicked: {text}"),
            }));
        }
    };
    let started = Builder::new().name(name.into()).spawn_scoped(scope, guarded);
    started.map(|_| ()).map_err(|e| Error::vulkan(format!("starting the {name} thread"), e))
}

/// The game thread: a step for every grant.
fn play(
    game: &mut Game,
    frames: impl Iterator<Item = u32>,
    granted: &Receiver<()>,
    tell: &SyncSender<Event>,
) {
    for i_frame in frames {
        // The other side has ended where it grants nothing any more, or hears nothing.
        if granted.recv().is_err() {
            return;
        }
        let event = game
            .step(i_frame)
            .map_or_else(|e| Event::Played(Err(e)), |packet| Event::Packet(Box::new(packet)));
        let is_last = matches!(event, Event::Played(_));
        if tell.send(event).is_err() || is_last {
            return;
        }
    }
    let _ = tell.send(Event::Played(Ok(())));
}

/// The waiting thread: tells when each submission was finished.
fn wait(submitted: &Receiver<Submission>, tell: &SyncSender<Event>) {
    while let Ok(pending) = submitted.recv() {
        let event = pending.wait().map_or_else(Event::Failed, |()| Event::Ended(Instant::now()));
        if tell.send(event).is_err() {
            return;
        }
    }
}

/// The drawing thread, which is the caller's.
struct Drawing<'a> {
    renderer: &'a mut Renderer,
    grant: SyncSender<()>,
    submit: SyncSender<Submission>,
    started: VecDeque<Started>,
    /// Of the same frames.
    under_way: VecDeque<Submission>,
}

impl Drawing<'_> {
    fn run(mut self, events: &Receiver<Event>, on_frame: &mut OnFrame<'_>) -> Result<()> {
        let (mut last_end, mut played) = (Instant::now(), None);
        while played.is_none() || !self.started.is_empty() {
            // Nobody tells anything any more: both threads have ended, and said so before.
            let Ok(event) = events.recv() else { break };
            match event {
                Event::Packet(packet) => {
                    let mut started = Started::of(&packet, 0);
                    let pending = self.renderer.begin(*packet)?;
                    for before in &self.under_way {
                        started.queue_depth += u32::from(!before.is_done()?);
                    }
                    self.started.push_back(started);
                    self.under_way.push_back(pending.clone());
                    // There is room for every frame in flight; a waiting thread that is gone has
                    // told why.
                    let _ = self.submit.send(pending);
                }
                Event::Ended(end) => {
                    let Some(started) = self.started.pop_front() else { continue };
                    self.under_way.pop_front();
                    let times = started.ended(self.renderer.end()?, end, &mut last_end);
                    if !on_frame(times, self.renderer)? {
                        return Ok(());
                    }
                    let _ = self.grant.send(());
                }
                Event::Played(how) => played = Some(how),
                Event::Failed(error) => return Err(error),
            }
        }
        played.unwrap_or(Ok(()))
    }
}
