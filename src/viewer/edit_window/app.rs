//! The editor's window: events of the window system to the desk, and what the desk asks for done.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use glam::{DVec2, DVec3};
use winit::application::ApplicationHandler;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event::{ElementState, KeyEvent, MouseButton, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoopProxy};
use winit::keyboard::{Key as WinitKey, ModifiersState, NamedKey};
use winit::window::{Window, WindowId};

use super::panels::{self, Choosing, Shown, Typing};
use super::render_thread::{Easel, Order, Orders, Told};
use crate::error::{Error, Result};
use crate::frame::stage::DeviceChoice;
use crate::io::box_file;
use crate::model::camera::Pose;
use crate::viewer::editor::acceptance::Counted;
use crate::viewer::editor::desk::{Button, Desk, Held, Input, Screen};
use crate::viewer::editor::recent::{self, Recent};
use crate::viewer::editor::scenery::Scenery;
use crate::viewer::editor::session::{Event, Request, Session, Wish, perform};
use crate::viewer::editor::shortcuts::{Chord, Key};
use crate::viewer::editor::state::View;
use crate::viewer::egui_layer::{EguiLayer, SharedWidgets};
use crate::viewer::native_window::{RenderThread, event_loop, open_window, wheel_notches};

/// What is edited, and within what.
pub struct Options {
    pub session: Session,
    pub scenery: Scenery,
    pub choice: DeviceChoice,
    /// Of the window, in pixels.
    pub size: [u32; 2],
    /// Whoever sets it closes the window, and nothing is saved.
    pub stop: &'static AtomicBool,
}

/// Opens a window and edits until somebody closes it.
pub fn run(options: Options) -> Result<()> {
    let events = event_loop::<Told>(
        "a box file is text that any editor changes, and `nimbus render SCENE -o FILE.png` draws it",
    )?;
    let mut app = App::new(options, events.create_proxy())?;
    let ran = events.run_app(&mut app).map_err(|e| Error::vulkan("window", e));
    app.orders.change(|order| order.quits = true);
    // The thread ends before the window that it draws into.
    let drawn = app.thread.take().map(RenderThread::join);
    drop(app.window.take());
    app.rescue();
    if let Some(error) = app.failed {
        return Err(error);
    }
    ran?;
    drawn.unwrap_or(Ok(()))
}

struct App {
    desk: Desk,
    scenery: Scenery,
    choice: DeviceChoice,
    size: [u32; 2],
    stop: &'static AtomicBool,
    orders: Arc<Orders>,
    face: SharedWidgets,
    proxy: EventLoopProxy<Told>,
    thread: Option<RenderThread<()>>,
    window: Option<Window>,
    layer: Option<EguiLayer>,
    held: ModifiersState,
    typing: Typing,
    choosing: Option<Choosing>,
    counted: Vec<Counted>,
    wrong: Option<String>,
    recent: Recent,
    failed: Option<Error>,
    /// By somebody who was asked about what would be lost.
    is_closed: bool,
}

/// So often panels are drawn, and Ctrl-C is looked for, while nobody touches anything.
const STEADY: Duration = Duration::from_millis(250);

impl App {
    fn new(options: Options, proxy: EventLoopProxy<Told>) -> Result<App> {
        let Options { session, scenery, choice, size, stop } = options;
        let document = session.editor().shared_document();
        let scene = scenery.scene(&document);
        let camera = &scene.camera;
        let nowhere = || Error::usage("the scene's camera looks nowhere at its first frame");
        let pose = camera.pose(scene.time.start_s).ok_or_else(nowhere)?;
        let target = camera.keys.first().map_or(DVec3::ZERO, |key| key.target);
        let origin = scenery.origin();
        let pose = Pose { position: pose.position - origin, ..pose };
        let picture = panels::picture_of(size, 1.0);
        let [width, height] = picture.map(f64::from);
        let screen = Screen {
            size_px: DVec2::new(width, height),
            px_per_point: 1.0,
            fov_y_rad: camera.fov_y_rad,
        };
        let desk = Desk::new(
            session,
            (&pose, camera.up, target - origin),
            screen,
            scenery.metres_per_unit(),
        );
        let pose = Pose { position: pose.position + origin, ..pose };
        let orders = Orders::new(Order {
            document,
            pose,
            has_cloud: false,
            size,
            picture,
            n: 0,
            quits: false,
        });
        Ok(App {
            desk,
            scenery,
            choice,
            size,
            stop,
            orders: Arc::new(orders),
            face: SharedWidgets::default(),
            proxy,
            thread: None,
            window: None,
            layer: None,
            held: ModifiersState::empty(),
            typing: Typing::default(),
            choosing: None,
            counted: vec![],
            wrong: None,
            recent: recent::default_place()
                .map_or_else(Recent::default, |place| Recent::load(&place)),
            failed: None,
            is_closed: false,
        })
    }

    /// Where the window ends and nobody was asked, by a device that is lost or by Ctrl-C, what was
    /// not saved is kept beside the file.
    fn rescue(&self) {
        let session = self.desk.session();
        if self.is_closed || !session.is_dirty() {
            return;
        }
        let path = session.path().unwrap_or(Path::new("cloud.dat"));
        let free = (1..)
            .map(|n| path.with_extension(format!("unsaved-{n}.dat")))
            .find(|path| !path.exists());
        let Some(free) = free else { return };
        match box_file::write(&free, session.editor().boxes()) {
            Ok(()) => eprintln!("what was not saved is in {}", free.display()),
            Err(error) => eprintln!("what was not saved is lost: {error}"),
        }
    }

    fn open(&mut self, events: &ActiveEventLoop) -> Result<()> {
        let (window, surface) = open_window(events, "nimbus", self.size, self.choice.validation)?;
        let proxy = self.proxy.clone();
        let tell = Box::new(move |told| drop(proxy.send_event(told)));
        let shared = (self.orders.clone(), self.face.clone());
        let easel =
            Easel::new(surface, &self.choice, self.scenery.clone(), shared, (tell, self.stop))?;
        self.layer = Some(EguiLayer::new(&window, self.face.clone(), STEADY, true));
        let proxy = self.proxy.clone();
        // Whether it went well is asked when the loop of events has ended.
        self.thread = Some(RenderThread::start(
            move || easel.run(),
            move || drop(proxy.send_event(Told::Ended)),
        )?);
        let PhysicalSize { width, height } = window.inner_size();
        let px_per_point = window.scale_factor();
        self.window = Some(window);
        self.resize(width, height, px_per_point);
        Ok(())
    }

    fn resize(&mut self, width: u32, height: u32, px_per_point: f64) {
        self.size = [width, height];
        let [width, height] = panels::picture_of(self.size, px_per_point).map(f64::from);
        let size_px = DVec2::new(width, height);
        self.take(Input::Resized { size_px, px_per_point });
    }

    /// Has the desk take an input, and does what it asks for.
    fn take(&mut self, input: Input) {
        let mut inputs = vec![input];
        while let Some(input) = inputs.pop() {
            let turn = self.desk.after(&input);
            self.desk = turn.desk;
            inputs.extend(turn.requests.iter().filter_map(|request| self.perform(request)));
        }
        if let Some(layer) = &mut self.layer {
            layer.request_update();
        }
        self.order();
    }

    fn perform(&mut self, request: &Request) -> Option<Input> {
        match request {
            Request::ChooseToOpen => self.choosing = Some(Choosing::new(false, None)),
            Request::ChooseToSave => {
                self.choosing = Some(Choosing::new(true, self.desk.session().path()))
            }
            // The panel asks it.
            Request::Ask(_) => {}
            Request::Quit => {
                self.is_closed = true;
                self.orders.change(|order| order.quits = true);
            }
            Request::Open(_) | Request::Save { .. } => {
                let event = perform(request)?;
                if let Event::Opened { path, .. } | Event::Saved { path, .. } = &event {
                    self.remember(path);
                }
                return Some(Input::Event(event));
            }
        }
        None
    }

    fn remember(&mut self, path: &Path) {
        self.recent.push(path);
        if let Some(place) = recent::default_place() {
            // A list that cannot be kept is no reason to stop.
            let _ = self.recent.save(&place);
        }
    }

    /// Tells the drawing thread what is to be seen.
    fn order(&self) {
        let pose = self.desk.flight().pose();
        let pose = Pose { position: pose.position + self.scenery.origin(), ..pose };
        let (document, size) = (self.desk.editor().shared_document(), self.size);
        let picture = self.desk.viewport().size_px.to_array().map(|v| v as u32);
        let has_cloud = self.desk.editor().settings().view != View::Boxes;
        self.orders.change(|order| {
            *order = Order { document, pose, has_cloud, size, picture, ..order.clone() }
        });
    }

    fn held(&self) -> Held {
        Held {
            ctrl: self.held.control_key() || self.held.super_key(),
            shift: self.held.shift_key(),
        }
    }

    fn pressed(&mut self, event: &KeyEvent) {
        if event.state != ElementState::Pressed {
            return;
        }
        if event.logical_key == WinitKey::Named(NamedKey::Enter) {
            self.typing.wants_focus = true;
            self.layer.iter_mut().for_each(EguiLayer::request_update);
            return;
        }
        if let Some(key) = key_of(&event.logical_key) {
            let Held { ctrl, shift } = self.held();
            self.take(Input::Chord(Chord { key, ctrl, shift, alt: self.held.alt_key() }));
        }
    }

    fn show_panels(&mut self) {
        let (Some(layer), Some(window)) = (&mut self.layer, &self.window) else { return };
        if !layer.is_due() {
            return;
        }
        let shown = Shown {
            desk: &self.desk,
            counted: &self.counted,
            recent: self.recent.paths(),
            wrong: self.wrong.as_deref(),
        };
        let (typing, choosing) = (&mut self.typing, &mut self.choosing);
        let mut inputs = vec![];
        layer.update(window, |ui| {
            // egui may ask twice, and is clicked in but once.
            inputs.extend(panels::show(ui, &shown, typing, choosing));
            None
        });
        inputs.into_iter().for_each(|input| self.take(input));
        // What is drawn over the picture has changed, if nothing else.
        self.orders.change(|_| ());
        self.name_window();
    }

    fn name_window(&self) {
        let session = self.desk.session();
        let name = session.path().map_or("new cloud".to_owned(), |path| path.display().to_string());
        let mark = if session.is_dirty() { "*" } else { "" };
        self.window.iter().for_each(|window| window.set_title(&format!("{mark}{name} | nimbus")));
    }
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
            Told::Counted(document, counted) => {
                if document.is_same(self.desk.editor().document()) {
                    self.counted = counted;
                }
            }
            Told::Wrong(wrong) => self.wrong = wrong,
            Told::Ended => events.exit(),
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        if self.stop.load(Ordering::Relaxed) {
            self.orders.change(|order| order.quits = true);
        }
        self.show_panels();
        let due = self.layer.as_ref().and_then(EguiLayer::due);
        events.set_control_flow(ControlFlow::WaitUntil(
            due.unwrap_or_else(|| Instant::now() + STEADY),
        ));
    }

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let (Some(layer), Some(window)) = (&mut self.layer, &self.window) else { return };
        // Keys are for the field that is typed into, or for nobody else; Tab would take one.
        let is_key = matches!(event, WindowEvent::KeyboardInput { .. });
        let is_typing = layer.has_keyboard_focus() || self.choosing.is_some();
        let is_heard = (!is_key || is_typing) && layer.handle(window, &event);
        let px_per_point = window.scale_factor();
        match event {
            WindowEvent::CloseRequested => self.take(Input::Event(Event::Wish(Wish::Quit))),
            WindowEvent::Destroyed => self.orders.change(|order| order.quits = true),
            WindowEvent::Resized(PhysicalSize { width, height }) => {
                self.resize(width, height, px_per_point)
            }
            WindowEvent::ModifiersChanged(held) => self.held = held.state(),
            WindowEvent::Focused(false) => self.take(Input::FocusLost),
            // A drag goes on over panels, and ends there.
            WindowEvent::CursorMoved { position: PhysicalPosition { x, y }, .. } => {
                self.take(Input::PointerMoved { pixel: DVec2::new(x, y), held: self.held() });
            }
            WindowEvent::CursorLeft { .. } => self.take(Input::PointerLeft),
            WindowEvent::MouseInput { state, button, .. } => {
                let is_down = state == ElementState::Pressed;
                if let (Some(which), true) = (button_of(button), !is_down || !is_heard) {
                    // What was typed is for the boxes that were selected while it was.
                    if is_down {
                        self.typing.take().into_iter().for_each(|typed| self.take(typed));
                    }
                    self.take(Input::Button { which, is_down, held: self.held() });
                }
            }
            WindowEvent::MouseWheel { delta, .. } if !is_heard => {
                self.take(Input::Wheel(wheel_notches(delta)))
            }
            WindowEvent::KeyboardInput { event, .. } if !is_typing => self.pressed(&event),
            _ => {}
        }
    }
}

fn button_of(button: MouseButton) -> Option<Button> {
    match button {
        MouseButton::Left => Some(Button::Left),
        MouseButton::Middle => Some(Button::Middle),
        MouseButton::Right => Some(Button::Right),
        _ => None,
    }
}

fn key_of(key: &WinitKey) -> Option<Key> {
    match key {
        WinitKey::Character(text) => text.chars().next().map(Key::Char),
        WinitKey::Named(NamedKey::Delete) => Some(Key::Delete),
        WinitKey::Named(NamedKey::Backspace) => Some(Key::Backspace),
        WinitKey::Named(NamedKey::Escape) => Some(Key::Escape),
        WinitKey::Named(NamedKey::Tab) => Some(Key::Tab),
        _ => None,
    }
}

/// A box file, or a new one in its place; the scene around it.
pub fn session_of(path: Option<&Path>) -> Result<Session> {
    let Some(path) = path else { return Ok(Session::new()) };
    // What cannot be looked at is no new cloud: reading says why.
    if path.symlink_metadata().is_err_and(|e| e.kind() == std::io::ErrorKind::NotFound) {
        return Ok(Session::begun(path));
    }
    Ok(Session::opened(path, box_file::read(path)?))
}
