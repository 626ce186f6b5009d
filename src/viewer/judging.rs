//! What is seen measured while it stands still: asks for the view's truth, for the pictures, and
//! says how far apart they are.

use std::sync::Arc;
use std::time::Duration;

use super::flight::Flight;
use super::judge::{Judge, Known, Standing, View};
use super::screen::{Read, Shared, lock};
use super::seen::{Judged, SharedSeen, lock as lock_seen};
use super::wanted::Wanted;
use crate::studies::error::records::PictureError;
use crate::studies::reference_cache::default_folder;

/// What of the time of a view is spent on its reference, in all.
const BUDGET: Duration = Duration::from_secs(10);

#[derive(Default)]
pub struct Judging {
    /// None until somebody asks.
    judge: Option<std::result::Result<Judge, String>>,
    /// Where things stood when it was last looked.
    last: Option<Moment>,
    /// By what the pictures were last measured, and at which version of what is set.
    measured: Option<(Arc<Known>, u64)>,
    errors: [Option<PictureError>; 2],
}

/// What a view that stands still keeps.
#[derive(Clone, Copy, PartialEq)]
struct Moment {
    flight: Flight,
    i_frame: u32,
    size: [u32; 2],
}

impl Judging {
    /// Asks for what is still missing, and tells panels where it stands.
    pub fn follow(&mut self, wanted: &Shared, seen: &SharedSeen) {
        let now = lock(wanted).clone();
        if !now.judges {
            if let Some(Ok(judge)) = &self.judge {
                judge.rest();
            }
            (self.last, self.measured, self.errors) = (None, None, [None, None]);
            lock_seen(seen).judged = None;
            return;
        }
        let judge = match self
            .judge
            .get_or_insert_with(|| Judge::new(default_folder(), BUDGET).map_err(|e| e.to_string()))
        {
            Ok(judge) => judge,
            Err(why) => {
                let standing = Standing { failed: Some(why.clone()), ..Standing::default() };
                lock_seen(seen).judged = Some(Judged { standing, ..Judged::default() });
                return;
            }
        };
        let moment = Moment { flight: now.flight, i_frame: now.playback.i_frame(), size: now.size };
        let is_still = self.last.replace(moment) == Some(moment) && now.playback.is_paused();
        if !is_still {
            judge.rest();
            (self.measured, self.errors) = (None, [None, None]);
            lock_seen(seen).judged = Some(Judged::default());
            return;
        }
        judge.ask(view(&now, &moment));
        let standing = judge.standing();
        if let Some(known) = &standing.known {
            let is_measured = |(by, version): &(Arc<Known>, u64)| {
                Arc::ptr_eq(by, known) && *version == now.version
            };
            if !self.measured.as_ref().is_some_and(is_measured) {
                self.measured = Some((known.clone(), now.version));
                self.errors = [None, None];
                lock(wanted).reads = true;
            }
        }
        lock_seen(seen).judged = Some(Judged { standing, errors: self.errors });
    }

    /// A frame's pictures; what is to be said of them.
    pub fn take(&mut self, read: &Read) -> Option<String> {
        let Read { version, flight, i_frame, film, pictures } = read;
        let moment = Moment { flight: *flight, i_frame: *i_frame, size: [film.width, film.height] };
        let is_asked =
            |(_, asked): &&(Arc<Known>, u64)| self.last == Some(moment) && asked == version;
        let Some((known, _)) = self.measured.as_ref().filter(is_asked) else {
            // Those of another moment: others are asked for.
            self.measured = None;
            return None;
        };
        let error =
            |picture: &Option<Vec<f32>>| picture.as_ref().and_then(|rgba| known.error(rgba));
        self.errors = [error(&pictures[0]), error(&pictures[1])];
        let (n, against) = (known.pixels.at.len(), known.view.against);
        let text = |(name, e): (&str, &Option<PictureError>)| {
            let e = e.as_ref()?;
            Some(format!(
                "{name}: RMSE {:.2e}, greatest {:.2e}, at {n} pixels against {against}",
                e.rmse.value, e.max
            ))
        };
        let texts: Vec<String> =
            ["A", "B"].into_iter().zip(&self.errors).filter_map(text).collect();
        (!texts.is_empty()).then(|| texts.join("\n"))
    }
}

fn view(now: &Wanted, moment: &Moment) -> View {
    View {
        scene: now.scene.clone(),
        position: moment.flight.position(),
        target: moment.flight.target(),
        time_s: now.scene.time.at(moment.i_frame),
        size: moment.size,
        against: View::against(&now.scene),
    }
}
