//! The loop over frames of a scene window: draw, present, measure, and read back what was asked
//! for.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::comparison::{CameraQueue, compare_of};
use super::render_links::{Readback, RenderEvent, RenderLinks};
use super::shown_times::{ShownClock, ShownFrame, ShownTimes};
use super::view_state::ViewState;
use crate::error::Result;
use crate::frame::{Counts, FrameTimes, Game, Renderer, parallel, serial};
use crate::gpu::{Captured, Shown};
use crate::measure::stats::Summary;
use crate::model::backdrop::Backdrop;
use crate::model::scene::{Scene, Threading};
use crate::viewer::fly_camera::FlyCamera;
use crate::viewer::posed_player::PosedPlayer;
use crate::viewer::sync::lock;
use crate::viewer::window_target::{PictureDraw, WindowTarget};

/// The times of the frames of a window.
#[derive(Debug, Default)]
pub struct RenderTimes {
    /// Frame times of each loop that ran.
    pub loops: Vec<LoopTimes>,
    /// Times at which pictures became visible; `None` where the device does not tell.
    pub shown: Option<ShownTimes>,
}

/// The results of a window that was open.
pub struct WindowTimes {
    /// Times of its frames.
    pub frames: RenderTimes,
    /// Time that each update of the panels took on the window's thread, ms.
    pub panels_ms: Vec<f64>,
    /// The result of the capture that was asked for; none if its frame was not drawn.
    pub captured: Option<Captured>,
}

/// Frame times of one loop.
#[derive(Debug, Clone, Copy)]
pub struct LoopTimes {
    /// The loop.
    pub threading: Threading,
    /// Whether panels were shown beside the picture.
    pub has_panels: bool,
    /// Statistics of the frame times, ms.
    pub frame_ms: Summary,
}

/// Frames after a start whose times are not counted: the warm-up that a bench has by default.
const N_WARM_UP: u32 = 10;
/// Interval between two updates of the title: numbers that change faster cannot be read.
const TITLE_INTERVAL: Duration = Duration::from_millis(500);
/// Longest time that a held key flies in one step, s: a slow frame must not throw the camera far.
const MAX_STEP_S: f64 = 0.25;

/// Frame times by loop and by whether panels were shown.
pub type LoopSamples = BTreeMap<(Threading, bool), Vec<f64>>;

/// Returns the statistics of each loop that ran, serial loops first.
pub fn loop_times(samples: &LoopSamples) -> Vec<LoopTimes> {
    let of = |(&(threading, has_panels), ms): (&(Threading, bool), &Vec<f64>)| {
        Summary::of(ms).map(|frame_ms| LoopTimes { threading, has_panels, frame_ms })
    };
    samples.iter().filter_map(of).collect()
}

/// Everything that the loop over frames draws with.
pub struct FrameLoop<'a> {
    /// The window that frames are presented in.
    pub target: &'a mut WindowTarget,
    /// State shared with the window.
    pub links: &'a RenderLinks,
    /// Frame times so far.
    pub samples: &'a mut LoopSamples,
    /// Times at which pictures became visible.
    pub shown: &'a mut ShownTimes,
    /// The clock of this loop's pictures.
    pub shown_clock: ShownClock,
    /// The beginning of the first frame that counts; `None` before it.
    pub counts_from: Option<Instant>,
    /// Frames until the window closes; `None`: no limit.
    pub n_left: &'a mut Option<u32>,
    /// The draw that shows a picture.
    pub draw: &'a PictureDraw,
    /// The scene of A, with the size of the window.
    pub scene: &'a Scene,
    /// B, drawn after each frame.
    pub variant: Option<PosedPlayer>,
    /// Cameras of A's frames in flight.
    pub cameras: CameraQueue,
    /// The state at which the loop begins.
    pub begun: &'a ViewState,
}

impl FrameLoop<'_> {
    /// Runs frames until the window closes, or until its state asks for something that this loop
    /// cannot follow.
    ///
    /// # Errors
    /// A step of a frame failed.
    pub fn run(&mut self, game: &mut Game, renderer: &mut Renderer) -> Result<()> {
        let threading = self.scene.threads.mode;
        let mut n_warm_up = N_WARM_UP;
        let mut title = Title { since: Instant::now(), frame_ms: vec![] };
        loop {
            if std::mem::take(&mut lock(&self.links.state).wants_counts) {
                self.count(game, renderer)?;
            }
            self.cameras.clear();
            let frames = Frames { state: self.links.state.clone(), last: Instant::now() };
            let mut on_frame = |times: FrameTimes, renderer: &mut Renderer| {
                if let Some(text) = title.update(self.scene, &times) {
                    self.links.send(RenderEvent::Title(text));
                }
                let is_warm = n_warm_up == 0;
                n_warm_up = n_warm_up.saturating_sub(1);
                self.on_frame(&times, renderer, is_warm)
            };
            match threading {
                Threading::Serial => serial::run(game, renderer, frames, &mut on_frame)?,
                Threading::Parallel => parallel::run(game, renderer, frames, &mut on_frame)?,
            }
            if !lock(&self.links.state).wants_counts {
                return Ok(());
            }
        }
    }

    /// Draws one frame outside the loop and counts its non-finite and clipped values.
    fn count(&self, game: &mut Game, renderer: &mut Renderer) -> Result<()> {
        let i_frame = lock(&self.links.state).playback.i_frame();
        renderer.step(game.step(i_frame)?)?;
        let counts = Counts::new(renderer, &self.target.gpu.device, self.scene)?;
        self.links.message(format!("frame {i_frame}: {}", counts.text()));
        lock(&self.links.status).counts = Some((i_frame, counts));
        Ok(())
    }

    /// Presents a frame that has ended. Returns whether the loop goes on.
    fn on_frame(
        &mut self,
        times: &FrameTimes,
        renderer: &mut Renderer,
        is_warm: bool,
    ) -> Result<bool> {
        let (threading, camera) = (self.scene.threads.mode, self.cameras.pop());
        let now = lock(&self.links.state).clone();
        if let (Some(variant), Some(camera)) = (&mut self.variant, &camera) {
            let ms = variant.step(times.i_frame, camera.pose())?;
            lock(&self.links.status).variant_ms = Some(ms);
        }
        let second = self.variant.as_mut().map(|variant| &mut variant.player.renderer);
        let compare = second.as_ref().map(|_| compare_of(now.comparison, self.scene.film.width));
        let renderers = [Some(&mut *renderer), second];
        let [begun, _] = times.marks.game;
        let widgets = &self.links.widgets;
        let is_current = self.target.present(begun, self.draw, renderers, compare, widgets)?;
        // In the serial loop no game step may run beside the presentation.
        if threading == Threading::Serial {
            self.target.wait()?;
        }
        // With B, a frame draws two pictures, so its time is not that of the scene.
        let counts = is_warm && self.variant.is_none();
        if counts {
            self.counts_from.get_or_insert(begun);
        }
        let shown = self.take_shown();
        if counts {
            self.samples.entry((threading, now.has_panels)).or_default().push(times.frame_ms);
        }
        let mut status = lock(&self.links.status);
        status.has_picture = true;
        if now.has_panels {
            status.timeline.push(times);
            status.timeline.push_shown(&shown);
        }
        drop(status);
        if let Some(n) = self.n_left {
            *n = n.saturating_sub(1);
        }
        self.read_back(renderer, camera, times.i_frame)?;
        let restarts = |s: &ViewState| (s.version, s.n_shader_loads, s.size, s.n_mode_steps);
        Ok(is_current
            && restarts(&now) == restarts(self.begun)
            && !now.wants_counts
            && !self.links.is_closing()
            && *self.n_left != Some(0))
    }

    /// Returns the times of the pictures that became visible since the last call, and keeps those
    /// of frames that count.
    fn take_shown(&mut self) -> Vec<ShownFrame> {
        let all: Vec<Shown> = self.target.take_shown().collect();
        let mut frames = Vec::new();
        for shown in all {
            let counts = self.counts_from.is_some_and(|from| shown.begun >= from);
            let frame = self.shown_clock.times(&shown);
            frames.extend(frame);
            if counts {
                self.shown.frames.extend(frame);
                self.shown.n_replaced += usize::from(frame.is_none());
            }
        }
        frames
    }

    /// Reads the frame's pictures back where the window has asked for them.
    fn read_back(
        &mut self,
        renderer: &mut Renderer,
        camera: Option<FlyCamera>,
        i_frame: u32,
    ) -> Result<()> {
        let (version, film) = (self.begun.version, self.scene.film);
        let (capture, wants_readback) = lock(&self.links.state).take_readbacks(version);
        if let Some(format) = capture {
            let time_s = self.scene.time.at(i_frame);
            let backdrop = Box::new(match camera {
                Some(camera) => Backdrop::seen(self.scene, &camera.pose(), time_s),
                None => Backdrop::of(self.scene, time_s),
            });
            self.links.send(RenderEvent::Capture { format, backdrop, rgba: renderer.image()? });
        }
        if let (true, Some(camera)) = (wants_readback, camera) {
            let b = self.variant.as_mut().map(|variant| variant.player.renderer.image());
            let (a, b) = (renderer.image()?, b.transpose()?);
            let readback = Readback { version, camera, i_frame, film, a, b };
            self.links.send(RenderEvent::Readback(readback));
        }
        Ok(())
    }
}

/// The numbers of the frames to draw. The camera flies on at each of them.
struct Frames {
    state: Arc<Mutex<ViewState>>,
    last: Instant,
}

impl Iterator for Frames {
    type Item = u32;

    fn next(&mut self) -> Option<u32> {
        let seconds = self.last.elapsed().as_secs_f64().min(MAX_STEP_S);
        self.last = Instant::now();
        let mut state = lock(&self.state);
        state.fly(seconds);
        Some(state.playback.next_frame())
    }
}

/// The window title, with the frame times since its last update.
struct Title {
    since: Instant,
    frame_ms: Vec<f64>,
}

impl Title {
    /// Adds a frame. Returns the new title where it is due.
    fn update(&mut self, scene: &Scene, last: &FrameTimes) -> Option<String> {
        self.frame_ms.push(last.frame_ms);
        if self.since.elapsed() < TITLE_INTERVAL {
            return None;
        }
        self.since = Instant::now();
        let title = if scene.title.is_empty() { "nimbus" } else { &scene.title };
        let (name, i_frame, n) = (scene.threads.mode.name(), last.i_frame, last.n_shown());
        let times = Summary::of(&std::mem::take(&mut self.frame_ms)).map_or(String::new(), |s| {
            format!(" | {:.1} ms p50, {:.1} p99 of {}", s.p50, s.p99, s.n)
        });
        Some(format!("{title} | {name}{times} | frame {i_frame} | {n} particles | ? for keys"))
    }
}
