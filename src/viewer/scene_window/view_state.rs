//! State of the scene window: camera, playback, settings, and what the user has asked for.
//!
//! Input changes the state through [`ViewState`]'s methods, and the render thread draws by it.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::commands::{Command, Comparison, FLYING_KEYS, SHORTCUTS};
use super::knobs::Knob;
use super::playback::Playback;
use crate::io::image::ImageKind;
use crate::model::scene::Scene;
use crate::viewer::digits::format_significant;
use crate::viewer::fly_camera::{FlyCamera, Motion};
#[cfg(feature = "window")]
use crate::viewer::layout;
use crate::viewer::shortcut::Shortcut;

/// Settings that are drawn as B.
#[derive(Debug, Clone)]
pub struct Variant {
    /// The scene with its knobs as they were.
    pub scene: Arc<Scene>,
    /// Whether frames skip passes that they do not need.
    pub skips: bool,
}

/// State of the scene window.
#[derive(Debug, Clone)]
pub struct ViewState {
    /// The camera of A and B.
    pub camera: FlyCamera,
    /// The playback position.
    pub playback: Playback,
    /// The scene with its knobs as set. The window replaces the size of its film.
    pub scene: Arc<Scene>,
    /// Whether frames skip passes that they do not need.
    pub skips: bool,
    /// Counts changes that the running loop cannot follow: of the scene, of skipping, of B.
    pub version: u64,
    /// Counts requests for the next present mode.
    pub n_mode_steps: u32,
    /// Width and height of the window in pixels.
    pub size: [u32; 2],
    /// A picture to save.
    pub capture: Option<ImageKind>,
    /// Whether panels are shown.
    pub has_panels: bool,
    /// Whether panels show and hide with the size of the window, because the user has not chosen.
    pub fits_panels: bool,
    /// Whether the list of keys is shown.
    pub shows_help: bool,
    /// Whether the line with the first keys is shown. The first key press hides it.
    pub shows_hint: bool,
    /// The next frame's values are to be counted.
    pub wants_counts: bool,
    /// The settings that A is compared with.
    pub variant: Option<Variant>,
    /// How A is compared with B.
    pub comparison: Comparison,
    /// Whether the error is measured.
    pub measures_error: bool,
    /// The next frame's pictures are to be read back.
    pub wants_readback: bool,
    /// Counts changes of the shader files.
    pub n_shader_loads: u64,
    /// Whether the window is to close.
    pub is_closing: bool,
    held_keys: BTreeSet<&'static str>,
}

/// Work that a command leaves to the window.
#[derive(Debug, Clone, PartialEq)]
pub enum Response {
    /// No work.
    Nothing,
    /// Shows and prints a message.
    Message(String),
    /// Copies and prints the command that draws this view.
    PrintCommandLine,
    /// Saves the view as a scene file.
    SaveScene,
}

/// Angle that the camera turns when the mouse crosses the window, rad: one stroke looks aside, and
/// small movements still aim well.
const TURN: f64 = std::f64::consts::FRAC_PI_2;

impl ViewState {
    /// Starts at the scene's first frame and camera; `None` where the camera has no direction.
    pub fn new(scene: Arc<Scene>, skips: bool) -> Option<ViewState> {
        Some(ViewState {
            camera: FlyCamera::of_scene(&scene, DVec3::ZERO)?,
            playback: Playback::new(scene.time.n_frames),
            size: [scene.film.width, scene.film.height],
            scene,
            skips,
            version: 0,
            n_mode_steps: 0,
            capture: None,
            has_panels: false,
            fits_panels: false,
            shows_help: false,
            shows_hint: false,
            wants_counts: false,
            variant: None,
            comparison: Comparison::HALVES,
            measures_error: false,
            wants_readback: false,
            n_shader_loads: 0,
            is_closing: false,
            held_keys: BTreeSet::new(),
        })
    }

    /// Replaces the scene, keeps the camera, and drops B.
    pub fn reload(&mut self, scene: Arc<Scene>) {
        self.playback = self.playback.with_n_frames(scene.time.n_frames);
        (self.scene, self.variant) = (scene, None);
        self.version += 1;
    }

    /// Handles a key press; keys are named as in `SHORTCUTS`.
    pub fn press(&mut self, key: &str) -> Response {
        self.shows_hint = false;
        if let Some((name, _)) = FLYING_KEYS.iter().find(|(name, _)| *name == key) {
            self.held_keys.insert(name);
        } else if let Some(command) = Shortcut::command_of(&SHORTCUTS, key) {
            return self.act(command);
        }
        Response::Nothing
    }

    /// Handles the release of a key.
    pub fn release(&mut self, key: &str) {
        self.held_keys.retain(|held| *held != key);
    }

    /// Releases every key, because the window has lost the keyboard.
    pub fn release_all(&mut self) {
        self.held_keys.clear();
    }

    /// Carries out `command`.
    pub fn act(&mut self, command: Command) -> Response {
        match command {
            Command::Advance(knob) => {
                let scene = Arc::make_mut(&mut self.scene);
                let (key, advanced) = (knob.key(), knob.advance(scene));
                let value = knob.value(scene);
                return Response::Message(match advanced {
                    Ok(()) => {
                        self.version += 1;
                        format!("{key} = {value}")
                    }
                    Err(why) => format!("{key} stays {value}: {why}"),
                });
            }
            Command::ToggleSkipping => {
                self.skips = !self.skips;
                self.version += 1;
                let text = if self.skips { "skipping is on" } else { "skipping is off" };
                return Response::Message(text.to_owned());
            }
            Command::ToggleB => {
                self.version += 1;
                let text = if self.variant.take().is_some() {
                    "B is dropped: the window shows A alone"
                } else {
                    self.variant = Some(Variant { scene: self.scene.clone(), skips: self.skips });
                    "the present settings are kept as B; changes from now on are of A"
                };
                return Response::Message(text.to_owned());
            }
            Command::NextComparison if self.variant.is_none() => {
                return Response::Message(
                    "there is no B to compare with: press m to keep the present settings as B"
                        .to_owned(),
                );
            }
            Command::NextComparison => {
                self.comparison = match self.comparison {
                    Comparison::Split(_) => Comparison::DIFFERENCE,
                    Comparison::Difference(_) => Comparison::OnlyB,
                    Comparison::OnlyB => Comparison::HALVES,
                };
            }
            Command::Speed(doublings) => {
                self.camera = self.camera.after(Motion::Speed { doublings });
                let speed = format_significant(self.camera.speed(), 3);
                return Response::Message(format!("flying speed: {speed} scene units a second"));
            }
            Command::NextPresentMode => self.n_mode_steps += 1,
            Command::Seek(seek) => self.playback = self.playback.after(seek),
            Command::Capture(format) => self.capture = Some(format),
            Command::TogglePanels => {
                (self.has_panels, self.fits_panels) = (!self.has_panels, false);
            }
            Command::Count => self.wants_counts = true,
            Command::Compare(comparison) => self.comparison = comparison,
            Command::ToggleError => {
                self.measures_error = !self.measures_error;
                if self.measures_error && !self.playback.is_paused() {
                    return Response::Message(
                        "the error is measured only while the scene is paused: press space to pause"
                            .to_owned(),
                    );
                }
            }
            Command::SaveScene => return Response::SaveScene,
            Command::PrintCommandLine => return Response::PrintCommandLine,
            Command::Help => self.shows_help = !self.shows_help,
            Command::Quit if self.shows_help => self.shows_help = false,
            Command::Quit => self.is_closing = true,
        }
        Response::Nothing
    }

    /// Takes the size of the window in pixels. Until the user shows or hides the panels, they are
    /// shown where the window has room for them.
    #[cfg(feature = "window")]
    pub fn resize(&mut self, size: [u32; 2], display_scale: f64) {
        self.size = size;
        if self.fits_panels {
            self.has_panels = layout::has_room_for_panels(size, display_scale);
        }
    }

    /// Turns the camera after the mouse has moved by `pixels`, right and down, with a button held.
    pub fn drag(&mut self, pixels: DVec2, orbits: bool) {
        let turn = pixels * TURN / f64::from(self.size[0].max(1));
        let motion = match orbits {
            true => Motion::Orbit { right: -turn.x, upward: turn.y },
            false => Motion::Look { right: turn.x, upward: -turn.y },
        };
        self.camera = self.camera.after(motion);
    }

    /// Moves the camera toward its target by notches of the wheel.
    pub fn approach(&mut self, notches: f64) {
        self.camera = self.camera.after(Motion::Approach { notches });
    }

    /// Flies for `seconds` along the held keys.
    pub fn fly(&mut self, seconds: f64) {
        let held = FLYING_KEYS.iter().filter(|(name, _)| self.held_keys.contains(name));
        let along: DVec3 = held.map(|(_, along)| *along).sum();
        if along != DVec3::ZERO {
            self.camera = self.camera.after(Motion::Fly { along, seconds });
        }
    }

    /// Takes the capture and the readback that were asked for, for a frame drawn at `version` of
    /// this state.
    pub fn take_readbacks(&mut self, version: u64) -> (Option<ImageKind>, bool) {
        if self.version != version {
            return (None, false);
        }
        (self.capture.take(), std::mem::take(&mut self.wants_readback))
    }

    /// Returns the knobs that differ from those of `first`, as `--set` takes them.
    pub fn changed_knobs(&self, first: &Scene) -> Vec<String> {
        let changed = Knob::ALL.iter().filter(|knob| knob.value(first) != knob.value(&self.scene));
        changed.map(|knob| format!("{}={}", knob.key(), knob.value(&self.scene))).collect()
    }

    /// Returns the changes that turn `first`, the scene as opened, into this view, as `--set` takes
    /// them: knobs and camera. The size is [`ViewState::size`].
    fn changes(&self, first: &Scene) -> Vec<String> {
        let vector = |v: DVec3| format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z);
        let [position, target] = [self.camera.position(), self.camera.target()].map(vector);
        let mut changes = self.changed_knobs(first);
        if first.camera.keys.len() == 1 {
            changes.push(format!("camera.position={position}"));
            changes.push(format!("camera.target={target}"));
        } else {
            changes.push(format!(
                "camera.path=[{{ time_s = 0.0, position = {position}, target = {target} }}]"
            ));
        }
        changes
    }

    /// Returns the same changes with the window's size.
    pub fn overrides(&self, first: &Scene) -> Vec<String> {
        let [width, height] = self.size;
        let size = [format!("film.width={width}"), format!("film.height={height}")];
        size.into_iter().chain(self.changes(first)).collect()
    }

    /// Returns the command that draws this view of the scene at `path`; `first` is the scene as
    /// opened.
    pub fn command_line(&self, path: &str, first: &Scene) -> String {
        let changes = self.changes(first).into_iter().map(|change| format!(" --set '{change}'"));
        let no_skip = if self.skips { "" } else { " --no-skip" };
        let ([width, height], i_frame) = (self.size, self.playback.i_frame());
        format!(
            "nimbus render {path} -o view.png --frame {i_frame} --size {width}x{height}{no_skip}{}",
            changes.collect::<String>()
        )
    }
}

#[cfg(test)]
mod tests;
