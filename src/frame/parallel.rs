//! Game step and render step in parallel: one thread plays, one draws, one waits for the device.
//! Each frame's packet is moved through a bounded channel; no two threads share a lock.
//!
//! A frame's game step begins when the second frame before it has ended. The device then has its
//! next frame at hand while it draws, unless game step and recording take longer than drawing; and
//! a picture is never older than two frames.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Builder, Scope};
use std::time::Instant;

use super::game::Game;
use super::packet::Packet;
use super::renderer::Renderer;
use super::staging::IN_FLIGHT;
use super::times::{FrameStart, OnFrame};
use crate::error::{Error, Result};
use crate::gpu::Submission;

/// A message to the drawing thread.
enum Event {
    Packet(Box<Packet>),
    /// The oldest frame in flight ended at this time.
    Ended(Instant),
    /// The game thread has no further frame, or failed to make one.
    Played(Result<()>),
    /// The device or a thread failed: no further frame will end.
    Failed(Error),
}

/// Capacity for all events at once, so that no sender waits: a packet and an end for each frame in
/// flight, and the end of either thread.
const EVENTS: usize = 2 * IN_FLIGHT + 2;

/// Runs `frames` and calls `on_frame` with each as it ends. An error or panic of a thread ends all.
///
/// # Errors
/// Fails if a step or `on_frame` fails, or a thread panics.
pub fn run(
    game: &mut Game,
    renderer: &mut Renderer,
    frames: impl Iterator<Item = u32> + Send,
    on_frame: &mut OnFrame<'_>,
) -> Result<()> {
    let drawn = std::thread::scope(|scope| {
        let (events_in, events) = sync_channel::<Event>(EVENTS);
        let (grant, granted) = sync_channel::<()>(IN_FLIGHT);
        let (submit, submitted) = sync_channel::<Submission>(IN_FLIGHT);
        let sender = events_in.clone();
        start(scope, "game", events_in.clone(), move || play(game, frames, &granted, &sender))?;
        let sender = events_in.clone();
        start(scope, "wait", events_in, move || wait(&submitted, &sender))?;
        for _ in 0..IN_FLIGHT {
            // The channel has room for as many.
            let _ = grant.send(());
        }
        // The channel ends that this value owns are dropped at the end of the block, which ends
        // both threads.
        DrawingThread { renderer: &mut *renderer, grant, submit, under_way: VecDeque::new() }
            .run(&events, on_frame)
    });
    renderer.drain();
    drawn
}

/// Starts a thread whose panic is sent as an error.
fn start<'scope>(
    scope: &'scope Scope<'scope, '_>,
    name: &'static str,
    events: SyncSender<Event>,
    work: impl FnOnce() + Send + 'scope,
) -> Result<()> {
    let guarded = move || {
        if let Err(panic) = catch_unwind(AssertUnwindSafe(work)) {
            let text = panic.downcast_ref::<String>().cloned();
            let text = text
                .or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()))
                .unwrap_or_default();
            // Sending fails only after the drawing thread has ended, which makes the error moot.
            let _ = events.send(Event::Failed(Error::Fault {
                what: format!("the {name} thread panicked: {text}"),
            }));
        }
    };
    let started = Builder::new().name(name.into()).spawn_scoped(scope, guarded);
    started.map(|_| ()).map_err(|e| Error::vulkan(format!("starting the {name} thread"), e))
}

/// Runs the game thread: a step for every grant.
fn play(
    game: &mut Game,
    frames: impl Iterator<Item = u32>,
    granted: &Receiver<()>,
    events: &SyncSender<Event>,
) {
    for i_frame in frames {
        // Receiving fails after the drawing thread has ended.
        if granted.recv().is_err() {
            return;
        }
        let event = game
            .step(i_frame)
            .map_or_else(|e| Event::Played(Err(e)), |packet| Event::Packet(Box::new(packet)));
        let is_last = matches!(event, Event::Played(_));
        if events.send(event).is_err() || is_last {
            return;
        }
    }
    let _ = events.send(Event::Played(Ok(())));
}

/// Runs the waiting thread: sends the time at which each submission ended.
fn wait(submitted: &Receiver<Submission>, events: &SyncSender<Event>) {
    while let Ok(pending) = submitted.recv() {
        let event = pending.wait().map_or_else(Event::Failed, |()| Event::Ended(Instant::now()));
        if events.send(event).is_err() {
            return;
        }
    }
}

/// The state of the drawing thread, which is the caller's.
struct DrawingThread<'a> {
    renderer: &'a mut Renderer,
    grant: SyncSender<()>,
    submit: SyncSender<Submission>,
    /// The frames in flight.
    under_way: VecDeque<(FrameStart, Submission)>,
}

impl DrawingThread<'_> {
    fn run(mut self, events: &Receiver<Event>, on_frame: &mut OnFrame<'_>) -> Result<()> {
        let (mut last_end, mut played) = (Instant::now(), None);
        while played.is_none() || !self.under_way.is_empty() {
            // Receiving fails after both threads have ended, and both send an event before.
            let Ok(event) = events.recv() else { break };
            match event {
                Event::Packet(packet) => {
                    let mut start = FrameStart::new(&packet);
                    let pending = self.renderer.begin(*packet)?;
                    for (_, before) in &self.under_way {
                        start.queue_depth += u32::from(!before.is_done()?);
                    }
                    self.under_way.push_back((start, pending.clone()));
                    // The channel has room for every frame in flight. Sending fails after the
                    // waiting thread has ended, which has sent its error.
                    let _ = self.submit.send(pending);
                }
                Event::Ended(end) => {
                    let Some((start, _)) = self.under_way.pop_front() else { continue };
                    let times = start.end(self.renderer.end()?, end, &mut last_end);
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
