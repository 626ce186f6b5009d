//! The window: events of the window system to what is wanted, on the thread that the window system insists on.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use glam::DVec2;
use winit::application::ApplicationHandler;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event::{ElementState, KeyEvent, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, EventLoop, EventLoopProxy};
use winit::keyboard::{Key, NamedKey};
use winit::raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use winit::window::{Window, WindowId};

use super::screen::{LoopTimes, Screen, Shared, Told, lock};
use super::wanted::{Keep, Said, Wanted};
use crate::error::{Error, Result};
use crate::frame::stage::DeviceChoice;
use crate::gpu::{PresentMode, Surface};
use crate::io::image;
use crate::model::scene::Scene;

/// What is shown, and how.
pub struct Options {
    pub scene: Arc<Scene>,
    /// For the command line that draws what is seen.
    pub scene_path: PathBuf,
    pub choice: DeviceChoice,
    pub skip: bool,
    pub mode: PresentMode,
    /// The window closes after so many.
    pub n_frames: Option<u32>,
    /// Whoever sets it closes the window.
    pub stop: &'static AtomicBool,
    pub quiet: bool,
}

/// Opens a window and shows the scene until somebody closes it; the times of each loop that ran.
pub fn run(options: Options) -> Result<Vec<LoopTimes>> {
    let wanted = Wanted::new(options.scene.clone(), options.skip)
        .ok_or_else(|| Error::usage("the scene's camera looks nowhere at its first frame"))?;
    let events = EventLoop::<Told>::with_user_event().build().map_err(|e| no_display(&e.to_string()))?;
    let mut app = App {
        proxy: events.create_proxy(),
        wanted: Arc::new(Mutex::new(wanted)),
        options,
        thread: None,
        window: None,
        pointer: Pointer::default(),
        n_kept: 0,
        failed: None,
    };
    let ran = events.run_app(&mut app).map_err(|e| Error::vulkan("window", e));
    lock(&app.wanted).quits = true;
    // The thread ends before the window that it draws into.
    let drawn = app.thread.take().map(|thread| thread.join().unwrap_or_else(|_| Err(panicked())));
    drop(app.window.take());
    if let Some(error) = app.failed {
        return Err(error);
    }
    ran?;
    drawn.unwrap_or_else(|| Ok(vec![]))
}

fn panicked() -> Error {
    Error::Fault { what: "the drawing thread panicked".to_owned() }
}

fn no_display(why: &str) -> Error {
    let set = |name: &str| std::env::var(name).is_ok_and(|v| !v.is_empty());
    let what = match set("DISPLAY") {
        true => format!("the display {} cannot be opened", std::env::var("DISPLAY").unwrap_or_default()),
        false => "there is no display: DISPLAY is not set".to_owned(),
    };
    Error::vulkan("opening a window", format!("{what} ({why}); `nimbus render SCENE -o FILE.png` needs none"))
}

/// Where the pointer was, and which buttons turn the eye.
#[derive(Default)]
struct Pointer {
    at: Option<DVec2>,
    looks: bool,
    orbits: bool,
}

struct App {
    options: Options,
    wanted: Shared,
    proxy: EventLoopProxy<Told>,
    thread: Option<JoinHandle<Result<Vec<LoopTimes>>>>,
    window: Option<Window>,
    pointer: Pointer,
    /// Pictures kept so far.
    n_kept: u32,
    failed: Option<Error>,
}

impl ApplicationHandler<Told> for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.window.is_some() {
            return;
        }
        if let Err(error) = self.open(events) {
            self.failed = Some(error);
            events.exit();
        }
    }

    fn user_event(&mut self, events: &ActiveEventLoop, told: Told) {
        match told {
            Told::Status(text) => self.window.iter().for_each(|w| w.set_title(&text)),
            Told::Said(text) => self.say(&text),
            Told::Picture { keep, film, rgba } => {
                let said = self.keep(keep, &film, &rgba).unwrap_or_else(|e| e.to_string());
                self.say(&said);
            }
            Told::Ended => events.exit(),
        }
    }

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let mut wanted = lock(&self.wanted);
        match event {
            // The thread hears it, ends and says so.
            WindowEvent::CloseRequested | WindowEvent::Destroyed => wanted.quits = true,
            WindowEvent::Resized(PhysicalSize { width, height }) => wanted.size = [width, height],
            WindowEvent::Focused(false) => wanted.release_all(),
            WindowEvent::KeyboardInput { event, .. } => {
                let said = pressed(&mut wanted, &event);
                drop(wanted);
                self.answer(said);
            }
            WindowEvent::MouseInput { state, button, .. } => {
                let is_down = state == ElementState::Pressed;
                match button {
                    MouseButton::Left => self.pointer.looks = is_down,
                    MouseButton::Right => self.pointer.orbits = is_down,
                    _ => {}
                }
            }
            WindowEvent::CursorMoved { position: PhysicalPosition { x, y }, .. } => {
                let at = DVec2::new(x, y);
                let by = at - self.pointer.at.replace(at).unwrap_or(at);
                if self.pointer.looks || self.pointer.orbits {
                    wanted.drag(by, self.pointer.orbits);
                }
            }
            WindowEvent::CursorLeft { .. } => self.pointer = Pointer::default(),
            WindowEvent::MouseWheel { delta, .. } => wanted.approach(match delta {
                MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
                MouseScrollDelta::PixelDelta(by) => by.y / PIXELS_A_NOTCH,
            }),
            _ => {}
        }
    }
}

const PIXELS_A_NOTCH: f64 = 40.0;

impl App {
    fn open(&mut self, events: &ActiveEventLoop) -> Result<()> {
        let Options { scene, choice, mode, n_frames, stop, .. } = &self.options;
        let title = if scene.title.is_empty() { "nimbus" } else { &scene.title };
        let attributes = Window::default_attributes()
            .with_title(title)
            .with_inner_size(PhysicalSize::new(scene.film.width, scene.film.height));
        let fail = |e: String| Error::vulkan("opening a window", e);
        let window = events.create_window(attributes).map_err(|e| fail(e.to_string()))?;
        let display = window.display_handle().map_err(|e| fail(e.to_string()))?.as_raw();
        let handle = window.window_handle().map_err(|e| fail(e.to_string()))?.as_raw();
        let PhysicalSize { width, height } = window.inner_size();
        lock(&self.wanted).size = [width, height];
        let surface = Surface::open(choice.validation, display, handle)?;
        let proxy = self.proxy.clone();
        let tell = Box::new(move |told| drop(proxy.send_event(told)));
        let screen = Screen::new(surface, choice, *mode, *n_frames, (self.wanted.clone(), tell, stop))?;
        let proxy = self.proxy.clone();
        let draw = move || {
            let drawn = screen.run();
            // Whether it went well is asked when the loop of events has ended.
            drop(proxy.send_event(Told::Ended));
            drawn
        };
        let thread = std::thread::Builder::new().name("draw".into()).spawn(draw);
        self.thread = Some(thread.map_err(|e| fail(e.to_string()))?);
        self.window = Some(window);
        Ok(())
    }

    fn answer(&self, said: Said) {
        match said {
            Said::Nothing => {}
            Said::Text(text) => self.say(&text),
            Said::CommandLine => {
                let path = self.options.scene_path.display().to_string();
                println!("{}", lock(&self.wanted).command_line(&path, &self.options.scene));
            }
        }
    }

    fn say(&self, text: &str) {
        if !self.options.quiet {
            eprintln!("{}", text.trim_end());
        }
    }

    /// Writes a picture under the first name that is free.
    fn keep(&mut self, keep: Keep, film: &crate::model::film::Film, rgba: &[f32]) -> Result<String> {
        let extension = if keep == Keep::Png { "png" } else { "exr" };
        loop {
            self.n_kept += 1;
            let path = PathBuf::from(format!("view-{}.{extension}", self.n_kept));
            if path.symlink_metadata().is_ok() {
                continue;
            }
            image::write(&path, film, film.width, film.height, rgba)?;
            return Ok(format!("kept {}", path.display()));
        }
    }
}

/// What a key means; keys that the window system repeats count once.
fn pressed(wanted: &mut Wanted, event: &KeyEvent) -> Said {
    let Some(name) = name_of(&event.logical_key) else { return Said::Nothing };
    match event.state {
        ElementState::Pressed if event.repeat => Said::Nothing,
        ElementState::Pressed => wanted.press(&name),
        ElementState::Released => {
            wanted.release(&name);
            Said::Nothing
        }
    }
}

/// As [`super::wanted::SHORTCUTS`] has it.
fn name_of(key: &Key) -> Option<String> {
    match key {
        Key::Character(text) => Some(text.to_lowercase()),
        Key::Named(NamedKey::Space) => Some("space".to_owned()),
        Key::Named(NamedKey::Home) => Some("home".to_owned()),
        Key::Named(NamedKey::Escape) => Some("escape".to_owned()),
        Key::Named(NamedKey::F11) => Some("f11".to_owned()),
        Key::Named(NamedKey::F12) => Some("f12".to_owned()),
        _ => None,
    }
}
