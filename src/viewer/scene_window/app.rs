//! The scene window: passes events of the window system to the view state, and answers commands.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use glam::DVec2;
use winit::application::ApplicationHandler;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event::{ElementState, MouseButton, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::keyboard::{Key, NamedKey};
use winit::window::WindowId;

use super::captures::Captures;
use super::error_meter::ErrorMeter;
use super::file_watch::FileWatch;
use super::frame_loop::{RenderTimes, WindowTimes};
use super::panels;
use super::render_links::{RenderEvent, RenderLinks};
use super::render_thread::SceneRenderer;
use super::scene_source::SceneSource;
use super::status::SharedStatus;
use super::view_state::{Response, ViewState};
use crate::error::{Error, Result};
use crate::frame::DeviceChoice;
use crate::gpu::PresentMode;
use crate::io::console::{self, say};
use crate::viewer::display_loss;
use crate::viewer::egui_layer::{EguiLayer, SharedWidgets};
use crate::viewer::messages::Messages;
use crate::viewer::native_window::{RenderThread, event_loop, open_window, wheel_notches};
use crate::viewer::sync::lock;

/// Options of a scene window.
pub struct Options {
    /// The scene file that is shown.
    pub source: SceneSource,
    /// The device that draws.
    pub choice: DeviceChoice,
    /// Whether frames skip passes that they do not need.
    pub skips: bool,
    /// When frames are presented, where the window supports it.
    pub mode: PresentMode,
    /// Frames until the window closes; `None`: no limit.
    pub n_frames: Option<u32>,
    /// Closes the window when set.
    pub stop: &'static AtomicBool,
    /// Whether no message is printed.
    pub is_quiet: bool,
    /// Whether panels are shown at the start, in a window with room for them.
    pub has_panels: bool,
    /// The folder that pictures and scenes are saved to.
    pub captures: PathBuf,
}

/// Interval of panel updates and of looks at the scene's files: numbers stay long enough to read.
const IDLE_INTERVAL: Duration = Duration::from_millis(250);
/// Time that the hint stays after the first picture if no key ends it: enough for five entries.
const HINT_FOR: Duration = Duration::from_secs(6);

/// Opens a window and shows the scene until the user closes it.
///
/// # Errors
/// There is no display, no device can present to it, the device failed, or validation has found a
/// fault.
pub fn run(options: Options) -> Result<WindowTimes> {
    let mut state = ViewState::new(options.source.first.clone(), options.skips)
        .ok_or_else(|| Error::usage("the scene's camera has no direction at its first frame"))?;
    (state.fits_panels, state.shows_hint) = (options.has_panels, options.has_panels);
    let events = event_loop::<RenderEvent>("`nimbus render SCENE -o FILE.png` needs none")?;
    // A view has nothing to lose.
    display_loss::on_loss(|| {});
    let files = FileWatch::new(&options.source.files, options.choice.shaders.as_deref());
    let links = RenderLinks {
        state: Arc::new(Mutex::new(state)),
        status: SharedStatus::default(),
        widgets: SharedWidgets::default(),
        events: events.create_proxy(),
        stop: options.stop,
    };
    let mut app = App {
        captures: Captures::new(&options.captures, &options.source.path),
        messages: Messages::default(),
        drawn_since: None,
        options,
        links,
        files,
        thread: None,
        layer: None,
        pointer: Pointer::default(),
        error_meter: ErrorMeter::default(),
        failure: None,
    };
    let ran = events.run_app(&mut app).map_err(|e| display_loss::of_loop(&e));
    app.state().is_closing = true;
    // The render thread ends before the window that it draws into.
    let rendered = app.thread.take().map(RenderThread::join);
    drop(app.layer.take());
    if let Some(error) = app.failure {
        return Err(error);
    }
    ran?;
    let frames = rendered.unwrap_or_else(|| Ok(RenderTimes::default()))?;
    let panels_ms = std::mem::take(&mut lock(&app.links.widgets).update_ms);
    let captured = lock(&app.links.status).captured.take();
    Ok(WindowTimes { frames, panels_ms, captured })
}

/// Position of the pointer, and the buttons that turn the camera.
#[derive(Default)]
struct Pointer {
    position: Option<DVec2>,
    looks: bool,
    orbits: bool,
}

struct App {
    options: Options,
    links: RenderLinks,
    files: FileWatch,
    thread: Option<RenderThread<RenderTimes>>,
    layer: Option<EguiLayer>,
    pointer: Pointer,
    error_meter: ErrorMeter,
    captures: Captures,
    messages: Messages,
    /// When the first picture was seen here.
    drawn_since: Option<Instant>,
    /// Why the window could not open.
    failure: Option<Error>,
}

impl ApplicationHandler<RenderEvent> for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.layer.is_none()
            && let Err(error) = self.open(events)
        {
            self.failure = Some(error);
            events.exit();
        }
    }

    fn user_event(&mut self, events: &ActiveEventLoop, event: RenderEvent) {
        match event {
            RenderEvent::Title(text) => {
                self.layer.iter().for_each(|layer| layer.window.set_title(&text));
            }
            RenderEvent::Message(text) => self.tell(&text),
            RenderEvent::Note(text) => self.print(&text),
            RenderEvent::Capture { format, backdrop, rgba } => {
                let saved = self.captures.save_picture(format, &backdrop, &rgba);
                self.tell_saved(saved);
            }
            RenderEvent::Readback(readback) => {
                let message = self.error_meter.compare(&readback);
                message.iter().for_each(|text| self.tell(text));
            }
            RenderEvent::ErrorChanged => self.request_panels(),
            RenderEvent::Ended => events.exit(),
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        self.reload_files();
        self.error_meter.update(&self.links.state, &self.links.status);
        self.end_hint();
        let is_shown = self.update_panels();
        let idle = Instant::now() + IDLE_INTERVAL;
        let due = self.layer.as_ref().filter(|_| is_shown).and_then(EguiLayer::due);
        events.set_control_flow(ControlFlow::WaitUntil(due.map_or(idle, |due| due.min(idle))));
    }

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        // Releases count wherever the pointer is, and whichever widget has the focus.
        match &event {
            WindowEvent::KeyboardInput { event, .. } if !event.state.is_pressed() => {
                if let Some(name) = key_name(&event.logical_key) {
                    self.state().release(&name);
                }
            }
            WindowEvent::MouseInput { state: ElementState::Released, .. } => {
                (self.pointer.looks, self.pointer.orbits) = (false, false);
            }
            _ => {}
        }
        let has_widgets = {
            let state = self.state();
            state.has_panels || state.shows_help
        };
        if has_widgets
            && let Some(layer) = &mut self.layer
            && layer.handle(&event)
        {
            return;
        }
        match event {
            // The render thread ends, and its event closes the window.
            WindowEvent::CloseRequested | WindowEvent::Destroyed => self.state().is_closing = true,
            WindowEvent::Resized(size) => self.resize(size),
            WindowEvent::ScaleFactorChanged { .. } => {
                let size = self.layer.as_ref().map(|layer| layer.window.inner_size());
                size.into_iter().for_each(|size| self.resize(size));
            }
            WindowEvent::Focused(false) => self.state().release_all(),
            WindowEvent::KeyboardInput { event, .. }
                if event.state.is_pressed() && !event.repeat =>
            {
                if let Some(name) = key_name(&event.logical_key) {
                    let response = self.state().press(&name);
                    self.respond(response);
                }
            }
            WindowEvent::MouseInput { state: ElementState::Pressed, button, .. } => match button {
                MouseButton::Left => self.pointer.looks = true,
                MouseButton::Right => self.pointer.orbits = true,
                _ => {}
            },
            WindowEvent::CursorMoved { position: PhysicalPosition { x, y }, .. } => {
                let position = DVec2::new(x, y);
                let before = self.pointer.position.replace(position).unwrap_or(position);
                if self.pointer.looks || self.pointer.orbits {
                    self.state().drag(position - before, self.pointer.orbits);
                }
            }
            WindowEvent::CursorLeft { .. } => self.pointer = Pointer::default(),
            WindowEvent::MouseWheel { delta, .. } => self.state().approach(wheel_notches(delta)),
            _ => {}
        }
    }
}

impl App {
    fn state(&self) -> MutexGuard<'_, ViewState> {
        lock(&self.links.state)
    }

    fn open(&mut self, events: &ActiveEventLoop) -> Result<()> {
        let Options { source, choice, mode, n_frames, .. } = &self.options;
        let scene = &source.first;
        let title = if scene.title.is_empty() { "nimbus" } else { &scene.title };
        let size = [scene.film.width, scene.film.height];
        let (window, surface) = open_window(events, title, size, choice.validation)?;
        self.state().resize(window.inner_size().into(), window.scale_factor());
        let links = self.links.clone();
        let renderer = SceneRenderer::new(surface, choice, *mode, *n_frames, links.clone())?;
        let widgets = links.widgets.clone();
        self.layer = Some(EguiLayer::new(window, widgets, IDLE_INTERVAL, false));
        let on_end = move || links.send(RenderEvent::Ended);
        self.thread = Some(RenderThread::start(move || renderer.run(), on_end)?);
        Ok(())
    }

    /// Reads changed files again. An error is shown over the last good picture.
    fn reload_files(&mut self) {
        let changed = self.files.take_changed();
        if changed.shaders {
            self.state().n_shader_loads += 1;
        }
        if !changed.scene {
            return;
        }
        let state = self.state().clone();
        let read = self.options.source.read(&state);
        self.files.set_scene_files(&self.options.source.files);
        lock(&self.links.status).file_error = read.as_ref().err().map(Error::to_string);
        match read {
            Ok(scene) => {
                self.state().reload(scene);
                self.tell(&format!("{} has changed", self.options.source.path.display()));
            }
            Err(error) => self.print(&error.to_string()),
        }
        self.request_panels();
    }

    fn request_panels(&mut self) {
        self.layer.iter_mut().for_each(EguiLayer::request_update);
    }

    fn resize(&mut self, size: PhysicalSize<u32>) {
        let scale = self.layer.as_ref().map_or(1.0, |layer| layer.window.scale_factor());
        self.state().resize(size.into(), scale);
        self.request_panels();
    }

    /// Hides the hint when the user has seen it for a while.
    fn end_hint(&mut self) {
        if self.drawn_since.is_none() && lock(&self.links.status).has_picture {
            self.drawn_since = Some(Instant::now());
        }
        if self.drawn_since.is_some_and(|since| since.elapsed() >= HINT_FOR) {
            self.state().shows_hint = false;
        }
    }

    /// Returns whether anything is shown over the picture besides messages.
    fn has_widgets(&self) -> bool {
        let state = self.state();
        let by_state = state.has_panels || state.shows_help || state.shows_hint;
        drop(state);
        by_state || lock(&self.links.status).alarm().is_some()
    }

    /// Updates the widgets where due. Returns whether any widget is shown.
    fn update_panels(&mut self) -> bool {
        let messages = self.messages.at(Instant::now());
        let is_shown = self.has_widgets() || !messages.is_empty();
        let Some(layer) = &mut self.layer else { return is_shown };
        if !is_shown {
            layer.hide();
            return false;
        }
        if !layer.is_due() {
            return true;
        }
        // Copies, so that the render thread never waits for the panels.
        let (state, status) = (lock(&self.links.state).clone(), lock(&self.links.status).clone());
        let mut commands = vec![];
        layer.update(|ui| {
            let (clicked, backdrop) = panels::show_all(ui, &state, &status, &messages);
            commands.extend(clicked);
            backdrop
        });
        for command in commands {
            let response = self.state().act(command);
            self.respond(response);
        }
        true
    }

    fn respond(&mut self, response: Response) {
        // A key changes what the panels show.
        self.request_panels();
        match response {
            Response::Nothing => {}
            Response::Message(text) => self.tell(&text),
            Response::PrintCommandLine => {
                let source = &self.options.source;
                let path = source.path.display().to_string();
                let line = self.state().command_line(&path, &source.first);
                console::write_line_to_stdout(&line);
                self.layer.iter().for_each(|layer| layer.copy(&line));
                self.show(&format!("copied, and printed on the terminal: {line}"));
            }
            Response::SaveScene => {
                let state = self.state().clone();
                let source = &self.options.source;
                let saved = self.captures.save_scene(|to| source.text_of_view(&state, to));
                self.tell_saved(saved);
            }
        }
    }

    fn tell_saved(&mut self, saved: Result<PathBuf>) {
        let text = |path: &Path| format!("saved {}", path.display());
        self.tell(&saved.map_or_else(|e| e.to_string(), |path| text(&path)));
    }

    /// Shows a message in the window, and prints it.
    fn tell(&mut self, text: &str) {
        self.print(text);
        self.show(text);
    }

    fn show(&mut self, text: &str) {
        self.messages.push(text, Instant::now());
        self.request_panels();
    }

    fn print(&self, text: &str) {
        if !self.options.is_quiet {
            say!("{}", text.trim_end());
        }
    }
}

/// Returns the name of a key as the shortcuts have it.
fn key_name(key: &Key) -> Option<String> {
    let name = match key {
        Key::Character(text) => return Some(text.to_lowercase()),
        Key::Named(NamedKey::Space) => "space",
        Key::Named(NamedKey::Home) => "home",
        Key::Named(NamedKey::Escape) => "escape",
        Key::Named(NamedKey::F1) => "f1",
        Key::Named(NamedKey::F10) => "f10",
        Key::Named(NamedKey::F11) => "f11",
        Key::Named(NamedKey::F12) => "f12",
        _ => return None,
    };
    Some(name.to_owned())
}
