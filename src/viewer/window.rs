//! The window: events of the window system to what is wanted, on the thread that the window system
//! insists on.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use glam::DVec2;
use winit::application::ApplicationHandler;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event::{ElementState, KeyEvent, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::keyboard::{Key, NamedKey};
use winit::window::{Window, WindowId};

use super::judging::Judging;
use super::opening::{Thread, no_display, open};
use super::origin::Origin;
use super::panels;
use super::screen::{LoopTimes, Screen, Shared, Ties, Told, lock};
use super::seen::{OF_FILES, SharedSeen, lock as lock_seen};
use super::wanted::{Keep, Said, Wanted};
use super::widgets::{Layer, SharedFace, lock as lock_face};
use crate::error::{Error, Result};
use crate::frame::stage::DeviceChoice;
use crate::gpu::PresentMode;
use crate::io::image;

/// What is shown, and how.
pub struct Options {
    pub origin: Origin,
    pub choice: DeviceChoice,
    pub skip: bool,
    pub mode: PresentMode,
    /// The window closes after so many.
    pub n_frames: Option<u32>,
    /// Whoever sets it closes the window.
    pub stop: &'static AtomicBool,
    pub quiet: bool,
    /// Panels are shown at the start.
    pub panels: bool,
}

/// What a window tells when it is closed.
pub struct Ended {
    pub loops: Vec<LoopTimes>,
    /// What making the panels took the window's thread each time, ms.
    pub panels_ms: Vec<f64>,
}

/// Opens a window and shows the scene until somebody closes it; the times of each loop that ran.
pub fn run(options: Options) -> Result<Ended> {
    let mut wanted = Wanted::new(options.origin.first.clone(), options.skip)
        .ok_or_else(|| Error::usage("the scene's camera looks nowhere at its first frame"))?;
    wanted.panels = options.panels;
    let events = EventLoop::<Told>::with_user_event()
        .build()
        .map_err(|e| no_display(&e.to_string(), "`nimbus render SCENE -o FILE.png` needs none"))?;
    let mut app = App {
        proxy: events.create_proxy(),
        wanted: Arc::new(Mutex::new(wanted)),
        options,
        thread: None,
        window: None,
        layer: None,
        seen: SharedSeen::default(),
        face: SharedFace::default(),
        pointer: Pointer::default(),
        judging: Judging::default(),
        n_kept: 0,
        failed: None,
    };
    let ran = events.run_app(&mut app).map_err(|e| Error::vulkan("window", e));
    lock(&app.wanted).quits = true;
    // The thread ends before the window that it draws into.
    let drawn = app.thread.take().map(Thread::end);
    drop(app.window.take());
    if let Some(error) = app.failed {
        return Err(error);
    }
    ran?;
    let loops = drawn.unwrap_or_else(|| Ok(vec![]))?;
    let panels_ms = std::mem::take(&mut lock_face(&app.face).made_ms);
    Ok(Ended { loops, panels_ms })
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
    thread: Option<Thread<Vec<LoopTimes>>>,
    window: Option<Window>,
    layer: Option<Layer>,
    seen: SharedSeen,
    face: SharedFace,
    pointer: Pointer,
    judging: Judging,
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
            Told::Read(read) => {
                let said = self.judging.take(&read);
                said.iter().for_each(|text| self.say(text));
            }
            Told::Wrong => self.layer.iter_mut().for_each(Layer::touch),
            Told::Ended => events.exit(),
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        self.follow_files();
        self.judging.follow(&self.wanted, &self.seen);
        self.show_panels();
        let due = self.layer.as_ref().filter(|_| self.has_widgets()).and_then(Layer::due);
        let look = Instant::now() + STEADY;
        events.set_control_flow(ControlFlow::WaitUntil(due.map_or(look, |due| due.min(look))));
    }

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        // Whoever lets go is heard, wherever the pointer is.
        if let WindowEvent::KeyboardInput { event, .. } = &event
            && event.state == ElementState::Released
            && let Some(name) = name_of(&event.logical_key)
        {
            lock(&self.wanted).release(&name);
        }
        if let WindowEvent::MouseInput { state: ElementState::Released, .. } = &event {
            (self.pointer.looks, self.pointer.orbits) = (false, false);
        }
        if let (Some(layer), Some(window), true) =
            (&mut self.layer, &self.window, lock(&self.wanted).panels)
            && layer.hears(window, &event)
        {
            return;
        }
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

/// So often panels show what is new: faster nobody reads.
const STEADY: Duration = Duration::from_millis(250);
/// Of a wheel that counts pixels.
pub const PIXELS_A_NOTCH: f64 = 40.0;

impl App {
    fn open(&mut self, events: &ActiveEventLoop) -> Result<()> {
        let Options { origin, choice, mode, n_frames, stop, .. } = &self.options;
        let scene = &origin.first;
        let title = if scene.title.is_empty() { "nimbus" } else { &scene.title };
        let (window, surface) =
            open(events, title, [scene.film.width, scene.film.height], choice.validation)?;
        let PhysicalSize { width, height } = window.inner_size();
        lock(&self.wanted).size = [width, height];
        let proxy = self.proxy.clone();
        let tell = Box::new(move |told| drop(proxy.send_event(told)));
        let (wanted, seen, face) = (self.wanted.clone(), self.seen.clone(), self.face.clone());
        let screen = Screen::new(
            surface,
            choice,
            *mode,
            *n_frames,
            Ties { wanted, seen, face, tell, stop },
        )?;
        self.layer = Some(Layer::new(&window, self.face.clone(), (STEADY, false)));
        let proxy = self.proxy.clone();
        // Whether it went well is asked when the loop of events has ended.
        self.thread =
            Some(Thread::start(move || screen.run(), move || drop(proxy.send_event(Told::Ended)))?);
        self.window = Some(window);
        Ok(())
    }

    /// Reads again what has changed on the disk; what is wrong with it is shown, and the last good
    /// picture stays.
    fn follow_files(&mut self) {
        let changed = self.options.origin.poll(Instant::now());
        if changed.shaders {
            lock(&self.wanted).n_shader_loads += 1;
        }
        if !changed.scene {
            return;
        }
        let now = lock(&self.wanted).clone();
        let read = self.options.origin.read(&now);
        lock_seen(&self.seen).wrong[OF_FILES] = read.as_ref().err().map(|e| e.to_string());
        self.say(&match &read {
            Ok(_) => format!("{} has changed", self.options.origin.path.display()),
            Err(error) => error.to_string(),
        });
        if let Ok(scene) = read {
            lock(&self.wanted).reload(scene);
        }
        self.layer.iter_mut().for_each(Layer::touch);
    }

    /// Whether anything is to be drawn over the picture.
    fn has_widgets(&self) -> bool {
        lock(&self.wanted).panels || lock_seen(&self.seen).wrong.iter().any(Option::is_some)
    }

    fn show_panels(&mut self) {
        let has_widgets = self.has_widgets();
        let (Some(layer), Some(window)) = (&mut self.layer, &self.window) else { return };
        if !has_widgets {
            layer.hide();
            return;
        }
        if !layer.is_due() {
            return;
        }
        // Copies: nobody who draws waits for whoever makes panels.
        let (wanted, seen) = (lock(&self.wanted).clone(), lock_seen(&self.seen).clone());
        let mut commands = vec![];
        layer.show(window, |ui| {
            let backdrop = wanted.panels.then(|| {
                let (clicked, backdrop) = panels::show(ui, &wanted, &seen);
                commands.extend(clicked);
                backdrop
            });
            let wrong: Vec<&str> = seen.wrong.iter().flatten().map(String::as_str).collect();
            if !wrong.is_empty() {
                panels::alarm(ui, &wrong.join("\n"));
            }
            backdrop
        });
        if !commands.is_empty() {
            layer.touch();
        }
        for command in commands {
            let said = lock(&self.wanted).act(command);
            self.answer(said);
        }
    }

    fn answer(&self, said: Said) {
        match said {
            Said::Nothing => {}
            Said::Text(text) => self.say(&text),
            Said::CommandLine => {
                let origin = &self.options.origin;
                let line = lock(&self.wanted)
                    .command_line(&origin.path.display().to_string(), &origin.first);
                println!("{line}");
                self.layer.iter().for_each(|layer| layer.copy(&line));
            }
            Said::Scene => {
                let wanted = lock(&self.wanted).clone();
                let saved =
                    self.options.origin.save(&wanted).map(|to| format!("saved {}", to.display()));
                self.say(&saved.unwrap_or_else(|e| e.to_string()));
            }
        }
    }

    fn say(&self, text: &str) {
        if !self.options.quiet {
            eprintln!("{}", text.trim_end());
        }
    }

    /// Writes a picture under the first name that is free.
    fn keep(
        &mut self,
        keep: Keep,
        film: &crate::model::film::Film,
        rgba: &[f32],
    ) -> Result<String> {
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
        Key::Named(NamedKey::F10) => Some("f10".to_owned()),
        Key::Named(NamedKey::F11) => Some("f11".to_owned()),
        Key::Named(NamedKey::F12) => Some("f12".to_owned()),
        _ => None,
    }
}
