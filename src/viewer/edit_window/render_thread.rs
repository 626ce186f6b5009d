//! The render thread of the editor: it draws a frame when the document or the view has changed.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use winit::event_loop::EventLoopProxy;

use crate::error::{Error, Result};
use crate::frame::DeviceChoice;
use crate::gpu::{Instance, PresentMode, Surface};
use crate::model::camera::Pose;
use crate::model::film::Film;
use crate::model::scene::Scene;
use crate::viewer::editor::{BoxAcceptance, Document, EditedScene, box_acceptances};
use crate::viewer::egui_layer::SharedWidgets;
use crate::viewer::posed_player::PosedPlayer;
use crate::viewer::sync::lock;
use crate::viewer::window_target::{HIDDEN_DELAY, PictureDraw, WindowTarget};

/// State that the render thread draws.
#[derive(Debug, Clone)]
pub struct DrawState {
    /// The boxes and the seed.
    pub document: Arc<Document>,
    /// The camera in the scene's coordinates.
    pub pose: Pose,
    /// Whether the cloud is shown. The boxes are widgets.
    pub has_cloud: bool,
    /// Size of the window in pixels.
    pub size: [u32; 2],
    /// Size of the picture in pixels, from the window's upper left corner.
    pub picture: [u32; 2],
    /// Whether the thread is to end.
    pub is_closing: bool,
    /// Counts the changes.
    pub version: u64,
}

/// A draw state that the window changes and the render thread waits for.
pub struct DrawRequests {
    state: Mutex<DrawState>,
    changed: Condvar,
}

impl DrawRequests {
    /// Creates requests that begin with `state`.
    pub fn new(state: DrawState) -> DrawRequests {
        DrawRequests { state: Mutex::new(state), changed: Condvar::new() }
    }

    /// Changes the state, and has it drawn.
    pub fn change(&self, change: impl FnOnce(&mut DrawState)) {
        let mut state = lock(&self.state);
        change(&mut state);
        state.version += 1;
        self.changed.notify_one();
    }

    /// Waits for another version of the state, for at most [`MAX_WAIT`].
    fn next(&self, version: u64) -> DrawState {
        let is_old = |state: &mut DrawState| state.version == version;
        let waited = self.changed.wait_timeout_while(lock(&self.state), MAX_WAIT, is_old);
        waited.unwrap_or_else(PoisonError::into_inner).0.clone()
    }
}

/// Interval of looks at the stop flag, which Ctrl-C sets: too short for the user to wait.
const MAX_WAIT: Duration = Duration::from_millis(200);

/// An event that the render thread sends to the window.
#[derive(Debug)]
pub enum RenderEvent {
    /// The acceptance of each box of this document.
    Acceptances(Arc<Document>, Vec<BoxAcceptance>),
    /// Why the picture does not show the document; `None` when it does again.
    Failure(Option<String>),
    /// The thread has ended.
    Ended,
}

/// State that the window and its render thread share.
#[derive(Clone)]
pub struct RenderLinks {
    /// The state that the thread draws.
    pub requests: Arc<DrawRequests>,
    /// The widgets over the picture.
    pub widgets: SharedWidgets,
    /// Events to the window.
    pub events: EventLoopProxy<RenderEvent>,
    /// Ends the thread when set.
    pub stop: &'static AtomicBool,
}

impl RenderLinks {
    /// Sends an event to the window.
    pub fn send(&self, event: RenderEvent) {
        // Sending fails only after the event loop has ended, when no event matters any more.
        drop(self.events.send_event(event));
    }
}

/// Renders the edited cloud into a window. Fields are dropped in this order.
pub struct EditRenderer {
    active: Option<ActiveDocument>,
    /// Whether the window shows a failure.
    has_failed: bool,
    target: WindowTarget,
    edited: EditedScene,
    links: RenderLinks,
}

/// A document on the device.
struct ActiveDocument {
    draw: PictureDraw,
    scene: PosedPlayer,
    document: Arc<Document>,
    /// Size of its pictures.
    picture: [u32; 2],
    /// Camera of the document's last frame; `None` before the first.
    drawn: Option<Pose>,
}

impl EditRenderer {
    /// Opens a device for `surface`.
    ///
    /// # Errors
    /// No device can be opened, or it cannot present to the window.
    pub fn new(
        surface: (Arc<Instance>, Surface),
        choice: &DeviceChoice,
        edited: EditedScene,
        links: RenderLinks,
    ) -> Result<EditRenderer> {
        let target = WindowTarget::open(surface, choice, PresentMode::Fifo)?;
        Ok(EditRenderer { active: None, has_failed: false, target, edited, links })
    }

    /// Renders until the window closes.
    ///
    /// # Errors
    /// The device failed, or validation has found a fault.
    pub fn run(mut self) -> Result<()> {
        let ended = self.render();
        self.target.finish();
        let EditRenderer { active, target, .. } = self;
        drop(active);
        let closed = target.close();
        ended.and(closed)
    }

    fn render(&mut self) -> Result<()> {
        let mut version = u64::MAX;
        let mut is_current = false;
        loop {
            let state = self.links.requests.next(version);
            if state.is_closing || self.links.stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            if is_current && state.version == version {
                continue;
            }
            if !is_current || self.target.size() != Some(state.size) {
                self.target.finish();
                self.active = None;
                match self.target.recreate(state.size) {
                    Ok(true) => {}
                    Ok(false) => {
                        std::thread::sleep(HIDDEN_DELAY);
                        continue;
                    }
                    // The window is too large for the device. It may become smaller.
                    Err(error @ Error::Limit { .. }) => {
                        if !std::mem::replace(&mut self.has_failed, true) {
                            self.links.send(RenderEvent::Failure(Some(error.to_string())));
                        }
                        is_current = false;
                        std::thread::sleep(HIDDEN_DELAY);
                        continue;
                    }
                    Err(error) => return Err(error),
                }
            }
            match self.update(&state) {
                Ok(()) if std::mem::take(&mut self.has_failed) => {
                    self.links.send(RenderEvent::Failure(None));
                }
                Ok(()) => {}
                // The user keeps editing a document that the device cannot draw.
                Err(error @ (Error::Limit { .. } | Error::Usage { .. })) => {
                    self.has_failed = true;
                    self.links.send(RenderEvent::Failure(Some(error.to_string())));
                }
                Err(error) => return Err(error),
            }
            is_current = self.present(&state)?;
            version = state.version;
        }
    }

    /// Updates the document on the device and draws it, where either has changed.
    fn update(&mut self, state: &DrawState) -> Result<()> {
        // Panels that are shown or hidden change the picture and not the window.
        if self.active.as_ref().is_some_and(|active| active.picture != state.picture) {
            self.target.finish();
            self.active = None;
        }
        let is_new = self.active.is_none();
        if is_new {
            self.active = match self.activate(state) {
                // An empty cloud lets the panels show the error over the background.
                Err(error @ Error::Limit { .. }) => {
                    let seed = state.document.seed;
                    let document = Arc::new(Document { boxes: vec![], seed });
                    self.active = Some(self.activate(&DrawState { document, ..state.clone() })?);
                    return Err(error);
                }
                active => Some(active?),
            };
        }
        let scene = self.scene(state);
        let Some(active) = &mut self.active else { return Ok(()) };
        let is_same = active.document.is_same(&state.document);
        if !is_same {
            let boxes = state.document.regenerated_since(&active.document);
            let groups = self.edited.groups(&boxes);
            active.scene.player.reshape(&self.target.gpu, scene, &groups)?;
            (active.document, active.drawn) = (state.document.clone(), None);
        }
        if active.drawn == Some(state.pose) || is_same && !is_new && !state.has_cloud {
            return Ok(());
        }
        active.scene.step(0, state.pose)?;
        active.drawn = Some(state.pose);
        if !is_same || is_new {
            let statuses = active.scene.player.renderer.status(&self.target.gpu.device)?;
            let boxes = &state.document.boxes;
            let acceptances = box_acceptances(boxes, self.edited.statuses(boxes, &statuses));
            let event = RenderEvent::Acceptances(state.document.clone(), acceptances);
            self.links.send(event);
        }
        Ok(())
    }

    fn activate(&self, state: &DrawState) -> Result<ActiveDocument> {
        let player = self.target.gpu.player(self.scene(state), true)?;
        let draw = self.target.picture_draw(&player.renderer, &player.scene)?;
        let draw = draw.ok_or_else(|| Error::usage("the window has no visible area"))?;
        let scene = PosedPlayer::new(player, state.pose);
        let (document, picture) = (state.document.clone(), state.picture);
        Ok(ActiveDocument { draw, scene, document, picture, drawn: None })
    }

    /// Returns the scene with the state's document and size.
    fn scene(&self, state: &DrawState) -> Arc<Scene> {
        let mut scene = self.edited.scene(&state.document);
        let ([width, height], film) = (state.picture, scene.film);
        Arc::make_mut(&mut scene).film = Film { width, height, ..film };
        scene
    }

    /// Presents the last frame. Returns false where the swapchain no longer fits the window.
    fn present(&mut self, state: &DrawState) -> Result<bool> {
        let Some(active) = &mut self.active else { return Ok(false) };
        let is_shown = state.has_cloud && active.drawn.is_some();
        let renderer = is_shown.then_some(&mut active.scene.player.renderer);
        let begun = Instant::now();
        self.target.present(begun, &active.draw, [renderer, None], None, &self.links.widgets)
    }
}
