//! The render thread of the scene window. It makes the scene ready on the device and runs the frame
//! loop. If a change cannot be drawn, it falls back to the last good scene.

use std::sync::Arc;

use super::comparison::CameraQueue;
use super::frame_loop::{FrameLoop, LoopSamples, RenderTimes, loop_times};
use super::render_links::{RenderEvent, RenderLinks};
use super::shown_times::{ShownClock, ShownTimes};
use super::view_state::{Variant, ViewState};
use crate::error::{Error, Result};
use crate::frame::{DeviceChoice, Player, chosen_texts};
use crate::gpu::{Compiler, Instance, PresentMode, Surface};
use crate::model::film::Film;
use crate::model::scene::Scene;
use crate::viewer::posed_player::PosedPlayer;
use crate::viewer::sync::lock;
use crate::viewer::window_target::{HIDDEN_DELAY, PictureDraw, WindowTarget};

/// A scene on the device, and the draw that shows it. Fields are dropped in this order.
struct ActiveScene {
    draw: PictureDraw,
    player: Player,
    variant: Option<PosedPlayer>,
}

/// A scene, and its variant B, that could be drawn in a window of this size.
struct GoodScene {
    scene: Arc<Scene>,
    variant: Option<Variant>,
    size: [u32; 2],
}

/// The part of a state that could not be drawn.
#[derive(Debug, Clone, Copy)]
struct Attempt {
    version: u64,
    n_shader_loads: u64,
    /// The size of the window, if the size is the fault. Other faults do not depend on it.
    size: Option<[u32; 2]>,
}

impl Attempt {
    fn of(state: &ViewState) -> Attempt {
        Attempt { version: state.version, n_shader_loads: state.n_shader_loads, size: None }
    }

    fn of_size(state: &ViewState) -> Attempt {
        Attempt { size: Some(state.size), ..Attempt::of(state) }
    }

    /// Returns whether `state` has the same fault.
    fn is_of(&self, state: &ViewState) -> bool {
        self.version == state.version
            && self.n_shader_loads == state.n_shader_loads
            && self.size.is_none_or(|size| size == state.size)
    }
}

/// Renders a scene into a window.
pub struct SceneRenderer {
    target: WindowTarget,
    choice: DeviceChoice,
    links: RenderLinks,
    n_shader_loads: u64,
    n_mode_steps: u32,
    /// The state that could not be drawn.
    failed_at: Option<Attempt>,
    /// Frames until the window closes; `None`: no limit.
    n_left: Option<u32>,
    samples: LoopSamples,
    shown: ShownTimes,
}

impl SceneRenderer {
    /// Opens a device for `surface`. Presents by `mode` where the window supports it, else by fifo.
    ///
    /// # Errors
    /// No device can be opened, or it cannot present to the window.
    pub fn new(
        surface: (Arc<Instance>, Surface),
        choice: &DeviceChoice,
        mode: PresentMode,
        n_frames: Option<u32>,
        links: RenderLinks,
    ) -> Result<SceneRenderer> {
        let target = WindowTarget::open(surface, choice, mode)?;
        if target.mode() != mode {
            let (mode, used) = (mode.name(), target.mode().name());
            links.message(format!("this window does not support {mode}; it uses {used}"));
        }
        lock(&links.status).device_name = target.gpu.device.info().name.clone();
        Ok(SceneRenderer {
            target,
            choice: choice.clone(),
            links,
            n_shader_loads: 0,
            n_mode_steps: 0,
            failed_at: None,
            n_left: n_frames,
            samples: LoopSamples::default(),
            shown: ShownTimes::default(),
        })
    }

    /// Renders until the window closes. Returns the times of its frames.
    ///
    /// # Errors
    /// The device failed, or the first scene cannot be drawn.
    pub fn run(mut self) -> Result<RenderTimes> {
        let mut good: Option<GoodScene> = None;
        while !self.links.is_closing() && self.n_left != Some(0) {
            let state = lock(&self.links.state).clone();
            match self.recreate_target(&state) {
                Ok(true) => {}
                Ok(false) => {
                    std::thread::sleep(HIDDEN_DELAY);
                    continue;
                }
                Err(error @ Error::Limit { .. }) if good.is_some() => {
                    self.wait_for_other_size(&error, &state);
                    continue;
                }
                Err(error) => return Err(error),
            }
            let old_shaders = self.reload_shaders(&state);
            match self.activate(&state) {
                Ok(Some(active)) => {
                    // The error stays visible until a state without the same fault is drawn.
                    if self.failed_at.is_some_and(|at| !at.is_of(&state)) {
                        self.failed_at = None;
                        lock(&self.links.status).render_error = None;
                    }
                    let (scene, variant) = (state.scene.clone(), state.variant.clone());
                    good = Some(GoodScene { scene, variant, size: state.size });
                    self.play(active, &state)?;
                }
                Ok(None) => {}
                Err(error @ (Error::Limit { .. } | Error::Shader { .. })) => {
                    self.fall_back(error, old_shaders, good.as_ref(), &state)?;
                }
                Err(error) => return Err(error),
            }
        }
        lock(&self.links.status).captured = self.target.gpu.device.captured();
        let shown = self.target.tells_shown().then_some(self.shown);
        self.target.close()?;
        Ok(RenderTimes { loops: loop_times(&self.samples), shown })
    }

    /// Recreates the swapchain by the state's size and present mode. Returns false where the window
    /// has no visible area.
    fn recreate_target(&mut self, state: &ViewState) -> Result<bool> {
        let n_before = std::mem::replace(&mut self.n_mode_steps, state.n_mode_steps);
        let n_steps = state.n_mode_steps.wrapping_sub(n_before) as usize;
        self.target.advance_mode(n_steps);
        if n_steps > 0 {
            self.links.message(format!("present mode: {}", self.target.mode().name()));
        }
        lock(&self.links.status).present_mode = Some(self.target.mode());
        self.target.recreate(state.size)
    }

    /// Reads the shaders again where they have changed. Returns the compiler of the old ones, if
    /// they were replaced. Shaders that cannot be read are reported, and the old ones stay.
    fn reload_shaders(&mut self, state: &ViewState) -> Option<Compiler> {
        let n_before = std::mem::replace(&mut self.n_shader_loads, state.n_shader_loads);
        if n_before == state.n_shader_loads {
            return None;
        }
        let sources = self.choice.sources();
        let replaced = sources.and_then(|sources| self.target.gpu.set_sources(sources));
        replaced.map_err(|error| self.report_kept(&error, state)).ok()
    }

    /// Reports that a state cannot be drawn, and that the last good one is drawn in its place.
    fn report_kept(&mut self, error: &Error, state: &ViewState) {
        let error = error.to_string();
        self.report(Attempt::of(state), format!("{}; the last good state stays", error.trim_end()));
    }

    fn report(&mut self, failed: Attempt, text: String) {
        self.failed_at = Some(failed);
        lock(&self.links.status).render_error = Some(text.clone());
        self.links.send(RenderEvent::ErrorChanged);
        // The window shows the error until something can be drawn again.
        self.links.note(text);
    }

    /// Reports that the window is too large for the device, and waits for a while. The window shows
    /// pictures again when it is smaller.
    fn wait_for_other_size(&mut self, error: &Error, state: &ViewState) {
        let is_known = |at: &Attempt| at.size.is_some() && at.is_of(state);
        if !self.failed_at.as_ref().is_some_and(is_known) {
            let text = format!("the window is too large: {error}");
            self.report(Attempt::of_size(state), text.clone());
            self.links.send(RenderEvent::Title(text));
        }
        std::thread::sleep(HIDDEN_DELAY);
    }

    /// Restores the old shaders, or else the last good scene, or else waits until the window has
    /// another size.
    ///
    /// # Errors
    /// Returns `error` if none of these can help.
    fn fall_back(
        &mut self,
        error: Error,
        old_shaders: Option<Compiler>,
        good: Option<&GoodScene>,
        failed: &ViewState,
    ) -> Result<()> {
        match (old_shaders, good) {
            (Some(compiler), _) => self.target.gpu.set_compiler(compiler),
            (None, Some(GoodScene { scene, variant, .. }))
                if *scene != failed.scene || variant.is_none() && failed.variant.is_some() =>
            {
                let mut state = lock(&self.links.state);
                // A newer change by the user is tried as it is.
                if state.version == failed.version {
                    (state.scene, state.variant) = (scene.clone(), variant.clone());
                }
            }
            (None, Some(GoodScene { size, .. }))
                if *size != failed.size && matches!(error, Error::Limit { .. }) =>
            {
                self.wait_for_other_size(&error, failed);
                return Ok(());
            }
            _ => return Err(error),
        }
        self.report_kept(&error, failed);
        Ok(())
    }

    /// Makes the state's scenes ready on the device; `None` without a visible area.
    fn activate(&self, state: &ViewState) -> Result<Option<ActiveScene>> {
        let gpu = &self.target.gpu;
        let player = gpu.player(self.with_window_size(&state.scene), state.skips)?;
        let variant = state.variant.as_ref().map(|v| {
            let player = gpu.player(self.with_window_size(&v.scene), v.skips)?;
            Ok(PosedPlayer::new(player, state.camera.pose()))
        });
        let variant = variant.transpose()?;
        let draw = self.target.picture_draw(&player.renderer, &player.scene)?;
        Ok(draw.map(|draw| ActiveScene { draw, player, variant }))
    }

    fn with_window_size(&self, scene: &Arc<Scene>) -> Arc<Scene> {
        let mut scene = scene.clone();
        if let Some([width, height]) = self.target.size() {
            let film = scene.film;
            Arc::make_mut(&mut scene).film = Film { width, height, ..film };
        }
        scene
    }

    /// Runs the frame loop until the state asks for something that it cannot follow.
    fn play(&mut self, active: ActiveScene, state: &ViewState) -> Result<()> {
        let ActiveScene { draw, player, variant } = active;
        let Player { mut renderer, game, scene, light_choice, choices, impostor_choice } = player;
        let chosen = chosen_texts(light_choice, &choices, impostor_choice);
        chosen.into_iter().for_each(|text| self.links.note(text));
        let (shared, cameras) = (self.links.state.clone(), CameraQueue::default());
        let queue = cameras.clone();
        let mut game = game.with_viewpoint(Box::new(move || queue.push(lock(&shared).camera)));
        let mut frames = FrameLoop {
            target: &mut self.target,
            links: &self.links,
            samples: &mut self.samples,
            shown: &mut self.shown,
            shown_clock: ShownClock::default(),
            counts_from: None,
            n_left: &mut self.n_left,
            draw: &draw,
            scene: &scene,
            variant,
            cameras,
            begun: state,
        };
        let ended = frames.run(&mut game, &mut renderer);
        self.target.finish();
        lock(&self.links.status).variant_ms = None;
        ended
    }
}
