//! Measures the error of the view while it stands still: requests the reference, asks the render
//! thread for pictures, and compares the two.

use std::borrow::Cow;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::render_links::Readback;
use super::status::{ErrorStatus, ViewStatus};
use super::view_state::ViewState;
use crate::model::scene::Scene;
use crate::studies::picture_error::PictureError;
use crate::studies::reference_cache::default_folder;
use crate::viewer::error_probe::{ErrorProbe, ProbeRequest, ProbeStatus, ReferencePicture};
use crate::viewer::fly_camera::FlyCamera;
use crate::viewer::sync::lock;

/// Time for the reference of one view: more time gives more pixels, and the user waits for it.
const BUDGET: Duration = Duration::from_secs(10);

/// The error measurement of a scene window.
#[derive(Default)]
pub struct ErrorMeter {
    /// Started when the first measurement is asked for; an error says why it cannot start.
    probe: Option<Result<ErrorProbe, String>>,
    last_view: Option<View>,
    /// The reference and the version of the state that pictures were last asked for.
    measured: Option<(Arc<ReferencePicture>, u64)>,
    status: ErrorStatus,
}

/// Camera, frame and size of a picture.
#[derive(Clone, Copy, PartialEq)]
struct View {
    camera: FlyCamera,
    i_frame: u32,
    size: [u32; 2],
}

impl ErrorMeter {
    /// Updates the request, asks for pictures where they are missing, and writes the status.
    pub fn update(&mut self, state: &Mutex<ViewState>, status: &Mutex<ViewStatus>) {
        let now = lock(state).clone();
        if !now.measures_error {
            if let Some(Ok(probe)) = &self.probe {
                probe.cancel();
            }
            *self = ErrorMeter { probe: self.probe.take(), ..ErrorMeter::default() };
            lock(status).error = None;
            return;
        }
        let start = || ErrorProbe::new(default_folder(), BUDGET).map_err(|e| e.to_string());
        match self.probe.get_or_insert_with(start) {
            Err(why) => {
                self.status.probe =
                    ProbeStatus { failure: Some(why.clone()), ..ProbeStatus::default() };
            }
            Ok(probe) => {
                let view =
                    View { camera: now.camera, i_frame: now.playback.i_frame(), size: now.size };
                let is_still = self.last_view.replace(view) == Some(view);
                if is_still && now.playback.is_paused() {
                    probe.request(request(&now, &view));
                    self.status.probe = probe.status();
                    self.ask_for_pictures(state, now.version);
                } else {
                    probe.cancel();
                    (self.measured, self.status) = (None, ErrorStatus::default());
                }
            }
        }
        lock(status).error = Some(self.status.clone());
    }

    /// Asks for a readback unless the pictures of this reference and version were asked for.
    fn ask_for_pictures(&mut self, state: &Mutex<ViewState>, version: u64) {
        let Some(reference) = &self.status.probe.reference else { return };
        let is_measured = |(by, at): &(Arc<_>, u64)| Arc::ptr_eq(by, reference) && *at == version;
        if !self.measured.as_ref().is_some_and(is_measured) {
            self.measured = Some((reference.clone(), version));
            (self.status.a, self.status.b) = (None, None);
            lock(state).wants_readback = true;
        }
    }

    /// Compares the pictures of a frame with the reference. Returns a message with the errors.
    pub fn compare(&mut self, readback: &Readback) -> Option<String> {
        let Readback { version, camera, i_frame, film, .. } = readback;
        let view = View { camera: *camera, i_frame: *i_frame, size: [film.width, film.height] };
        let is_asked =
            |(_, asked): &&(Arc<_>, u64)| self.last_view == Some(view) && asked == version;
        let Some((reference, _)) = self.measured.as_ref().filter(is_asked) else {
            // The pictures are of another view; the next update asks for new ones.
            self.measured = None;
            return None;
        };
        self.status.a = reference.error(&readback.a);
        self.status.b = readback.b.as_ref().and_then(|rgba| reference.error(rgba));
        let (n, kind) = (reference.pixels.at.len(), reference.request.kind);
        let line = |name: &str, error: &Option<PictureError>| {
            let e = error.as_ref()?;
            let (rmse, max) = (e.rmse.value, e.max);
            Some(format!(
                "{name}: RMSE {rmse:.2e}, greatest {max:.2e}, at {n} pixels against {kind}"
            ))
        };
        let lines = [line("A", &self.status.a), line("B", &self.status.b)];
        let lines: Vec<String> = lines.into_iter().flatten().collect();
        (!lines.is_empty()).then(|| lines.join("\n"))
    }
}

fn lit(scene: &Arc<Scene>) -> Arc<Scene> {
    match scene.lit() {
        Cow::Borrowed(_) => scene.clone(),
        Cow::Owned(lit) => Arc::new(lit),
    }
}

fn request(state: &ViewState, view: &View) -> ProbeRequest {
    ProbeRequest {
        scene: lit(&state.scene),
        position: view.camera.position(),
        target: view.camera.target(),
        time_s: state.scene.time.at(view.i_frame),
        size: view.size,
        kind: ProbeRequest::kind_for(&state.scene),
    }
}
