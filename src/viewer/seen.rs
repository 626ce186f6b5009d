//! What the drawing thread tells panels of.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::judge::Standing;
use super::timeline::Timeline;
use crate::frame::FrameTimes;
use crate::frame::counts::Counts;
use crate::frame::plan::Plan;
use crate::gpu::PresentMode;
use crate::model::scene::Threading;
use crate::studies::error::records::PictureError;

#[derive(Debug, Clone, Default)]
pub struct Seen {
    pub timeline: Timeline,
    pub last: Option<Last>,
    /// Of this frame.
    pub counts: Option<(u32, Counts)>,
    pub present: Option<PresentMode>,
    /// Its name.
    pub device: String,
    /// What went wrong since the picture that is shown: with the scene's files, and with drawing
    /// it.
    pub wrong: [Option<String>; 2],
    /// What B's last frame took, ms; none without B.
    pub other_ms: Option<f64>,
    pub judged: Option<Judged>,
}

/// How far what is seen is from the truth.
#[derive(Debug, Clone, Default)]
pub struct Judged {
    pub standing: Standing,
    /// Of A and of B.
    pub errors: [Option<PictureError>; 2],
}

/// Whose errors stand where in [`Seen::wrong`].
pub const OF_FILES: usize = 0;
pub const OF_DRAWING: usize = 1;

/// The frame that ended last.
#[derive(Debug, Clone)]
pub struct Last {
    pub time_s: f64,
    pub n_shown: u32,
    pub n_particles: u64,
    pub plan: Plan,
}

impl Seen {
    pub fn push(&mut self, threading: Threading, times: &FrameTimes, n_particles: u64) {
        self.timeline.push(threading, times);
        let FrameTimes { time_s, plan, .. } = *times;
        self.last = Some(Last { time_s, n_shown: times.n_shown(), n_particles, plan });
    }
}

pub type SharedSeen = Arc<Mutex<Seen>>;

/// Nobody panics while it is held; if somebody did, what is in it is whole all the same.
pub fn lock(seen: &SharedSeen) -> MutexGuard<'_, Seen> {
    seen.lock().unwrap_or_else(PoisonError::into_inner)
}
