//! B: what is drawn beside A's picture, frame by frame from where A's was seen.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use glam::DVec3;

use super::flight::Flight;
use super::pane::Showing;
use super::wanted::Beside;
use crate::error::Result;
use crate::frame::stage::Player;
use crate::model::camera::Pose;
use crate::passes::present::Compare;

/// Where each frame that is under way is seen from, the oldest first.
#[derive(Clone, Default)]
pub struct Poses(Arc<Mutex<VecDeque<Flight>>>);

impl Poses {
    fn lock(&self) -> MutexGuard<'_, VecDeque<Flight>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// One more frame, seen from there.
    pub fn push(&self, flight: Flight) -> Pose {
        let pose = flight.pose();
        self.lock().push_back(flight);
        pose
    }

    /// Of the frame that ended.
    pub fn pop(&self) -> Option<Flight> {
        self.lock().pop_front()
    }

    /// No frame is under way.
    pub fn clear(&self) {
        self.lock().clear();
    }
}

/// All that draws what a window shows. Dropped in this order, once nothing is on its way to the
/// window.
pub struct Cast {
    pub showing: Showing,
    pub player: Player,
    pub other: Option<Second>,
}

pub struct Second {
    pub player: Player,
    seen_from: Arc<Mutex<Pose>>,
}

impl Second {
    pub fn new(player: Player) -> Second {
        // Every frame is told where it is seen from before it is made.
        let seen_from = Arc::new(Mutex::new(Pose {
            position: DVec3::ZERO,
            right: DVec3::X,
            up: DVec3::Y,
            forward: DVec3::NEG_Z,
        }));
        let seen = seen_from.clone();
        let pose = move || *seen.lock().unwrap_or_else(PoisonError::into_inner);
        let player = Player { game: player.game.seen_from(Box::new(pose)), ..player };
        Second { player, seen_from }
    }

    /// Draws A's frame; how long that took, ms.
    pub fn step(&mut self, i_frame: u32, from: &Flight) -> Result<f64> {
        let begin = Instant::now();
        *self.seen_from.lock().unwrap_or_else(PoisonError::into_inner) = from.pose();
        let packet = self.player.game.step(i_frame)?;
        self.player.renderer.step(packet)?;
        Ok(begin.elapsed().as_secs_f64() * 1e3)
    }
}

/// As the pass has it, of a picture so many pixels wide.
pub fn compare_of(beside: Beside, width: u32) -> Compare {
    match beside {
        Beside::Split(share) => {
            Compare::Split { column: (share.clamp(0.0, 1.0) * f64::from(width)) as i32 }
        }
        Beside::Difference(gain) => Compare::Difference { gain: gain as f32 },
        Beside::Other => Compare::Second,
    }
}
