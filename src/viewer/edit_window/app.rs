//! The editor's window: passes events of the window system to the controller, and carries out its
//! requests.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use glam::DVec2;
use winit::application::ApplicationHandler;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event::{KeyEvent, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{Key, ModifiersState, NamedKey};
use winit::window::WindowId;

use super::dialogs::FileDialog;
use super::fields::FieldTexts;
use super::keys::{button_of, key_of};
use super::panel_state::PanelState;
use super::panels;
use super::render_thread::{DrawRequests, DrawState, EditRenderer, RenderEvent, RenderLinks};
use super::rescue::Rescue;
use crate::error::{Error, Result};
use crate::frame::DeviceChoice;
use crate::model::camera::Pose;
use crate::viewer::display_loss;
use crate::viewer::editor::{
    BoxAcceptance, Chord, DisplayMode, EditedScene, EditorController, Input, Intent, ModifierKeys,
    PictureArea, RecentFiles, Request, Session, SessionEvent, default_path, perform,
};
use crate::viewer::egui_layer::{EguiLayer, SharedWidgets};
use crate::viewer::fly_camera::FlyCamera;
use crate::viewer::layout::{has_room_for_panels, px_per_point};
use crate::viewer::native_window::{RenderThread, event_loop, open_window, wheel_notches};

/// Options of an editor window.
pub struct Options {
    /// The cloud that is edited, and its file.
    pub session: Session,
    /// The scene around the cloud.
    pub scene: EditedScene,
    /// The device that draws.
    pub choice: DeviceChoice,
    /// Size of the window in pixels.
    pub size: [u32; 2],
    /// Closes the window without saving when set.
    pub stop: &'static AtomicBool,
}

/// Interval between two updates of untouched panels, and between two looks at the stop flag: the
/// window soon ends after Ctrl-C, and an idle window takes little time.
const IDLE_INTERVAL: Duration = Duration::from_millis(250);

/// Opens a window and edits until the user closes it.
///
/// # Errors
/// There is no display, no device can present to it, the device failed, or validation has found a
/// fault.
pub fn run(options: Options) -> Result<()> {
    let alternative = "a box file is text that any editor changes, and `nimbus render SCENE -o \
        FILE.png` draws it";
    let events = event_loop::<RenderEvent>(alternative)?;
    let mut app = App::new(options, &events)?;
    let rescue = app.rescue.clone();
    display_loss::on_loss(move || rescue.write());
    let ran = events.run_app(&mut app).map_err(|e| display_loss::of_loop(&e));
    app.close();
    // The render thread ends before the window that it draws into.
    let rendered = app.thread.take().map(RenderThread::join);
    drop(app.layer.take());
    app.rescue.write();
    if let Some(error) = app.failure {
        return Err(error);
    }
    ran?;
    rendered.unwrap_or(Ok(()))
}

struct App {
    controller: EditorController,
    scene: EditedScene,
    choice: DeviceChoice,
    size: [u32; 2],
    links: RenderLinks,
    thread: Option<RenderThread<()>>,
    layer: Option<EguiLayer>,
    modifiers: ModifiersState,
    texts: FieldTexts,
    dialog: Option<FileDialog>,
    acceptances: Vec<BoxAcceptance>,
    render_failure: Option<String>,
    recent: RecentFiles,
    /// Why the window could not open.
    failure: Option<Error>,
    rescue: Rescue,
    /// Whether the user wants panels; without a choice the size of the window decides.
    wants_panels: Option<bool>,
    /// The user has closed the window, and was asked about unsaved changes.
    is_quitting: bool,
}

impl App {
    fn new(options: Options, events: &EventLoop<RenderEvent>) -> Result<App> {
        let Options { session, scene, choice, size, stop } = options;
        let whole = scene.scene(session.editor().document());
        let camera = FlyCamera::of_scene(&whole, scene.origin()).ok_or_else(|| {
            Error::usage("the scene's camera has no direction at its first frame")
        })?;
        let [width, height] = panels::picture_size(size, 1.0, true).map(f64::from);
        let area = PictureArea {
            size_px: DVec2::new(width, height),
            px_per_point: 1.0,
            fov_y_rad: whole.camera.fov_y_rad,
        };
        let controller = EditorController::new(session, camera, area, scene.metres_per_unit());
        let requests = DrawRequests::new(draw_state(&controller, &scene, size));
        Ok(App {
            controller,
            scene,
            choice,
            size,
            links: RenderLinks {
                requests: Arc::new(requests),
                widgets: SharedWidgets::default(),
                events: events.create_proxy(),
                stop,
            },
            thread: None,
            layer: None,
            modifiers: ModifiersState::empty(),
            texts: FieldTexts::default(),
            dialog: None,
            acceptances: vec![],
            render_failure: None,
            recent: default_path()
                .map_or_else(RecentFiles::default, |path| RecentFiles::load(&path)),
            failure: None,
            rescue: Rescue::default(),
            wants_panels: None,
            is_quitting: false,
        })
    }

    fn close(&self) {
        self.links.requests.change(|state| state.is_closing = true);
    }

    fn open(&mut self, events: &ActiveEventLoop) -> Result<()> {
        let (window, surface) = open_window(events, "nimbus", self.size, self.choice.validation)?;
        let size = window.inner_size();
        let links = self.links.clone();
        let renderer = EditRenderer::new(surface, &self.choice, self.scene.clone(), links.clone())?;
        let widgets = links.widgets.clone();
        self.layer = Some(EguiLayer::new(window, widgets, IDLE_INTERVAL, true));
        let on_end = move || links.send(RenderEvent::Ended);
        self.thread = Some(RenderThread::start(move || renderer.run(), on_end)?);
        self.resize(size);
        Ok(())
    }

    fn display_scale(&self) -> f64 {
        self.layer.as_ref().map_or(1.0, |layer| layer.window.scale_factor())
    }

    fn has_panels(&self) -> bool {
        let has_room = || has_room_for_panels(self.size, self.display_scale());
        self.wants_panels.unwrap_or_else(has_room)
    }

    fn resize(&mut self, size: PhysicalSize<u32>) {
        self.size = size.into();
        self.place_picture();
    }

    /// Gives the picture the part of the window that the panels leave.
    fn place_picture(&mut self) {
        let px_per_point = px_per_point(self.size, self.display_scale());
        let size = panels::picture_size(self.size, px_per_point, self.has_panels());
        let [width, height] = size.map(f64::from);
        self.handle(Input::Resized { size_px: DVec2::new(width, height), px_per_point });
    }

    fn show_panels(&mut self, wanted: bool) {
        self.wants_panels = Some(wanted);
        self.place_picture();
    }

    /// Passes an input to the controller, and carries out the requests that follow.
    fn handle(&mut self, input: Input) {
        let mut next = Some(input);
        while let Some(input) = next {
            let request = self.controller.handle(&input);
            next = request.and_then(|request| self.carry_out(&request));
        }
        if self.is_quitting {
            self.rescue.clear();
        } else {
            self.rescue.update(self.controller.session());
        }
        if let Some(layer) = &mut self.layer {
            layer.request_update();
        }
        self.request_draw();
    }

    fn carry_out(&mut self, request: &Request) -> Option<Input> {
        match request {
            Request::ChooseToOpen => self.dialog = Some(FileDialog::new(false, None)),
            Request::ChooseToSave => {
                self.dialog = Some(FileDialog::new(true, self.controller.session().path()));
            }
            // The panels show the question.
            Request::Ask(_) => {}
            Request::TogglePanels => self.show_panels(!self.has_panels()),
            Request::Quit => {
                // The user was asked about unsaved changes.
                self.is_quitting = true;
                self.close();
            }
            Request::Open(_) | Request::Save { .. } => {
                let event = perform(request)?;
                if let SessionEvent::Opened { path, .. } | SessionEvent::Saved { path, .. } = &event
                {
                    self.recent.push(path);
                    // A list that cannot be saved only loses recent files.
                    let _ = default_path().map(|place| self.recent.save(&place));
                }
                return Some(Input::Event(event));
            }
        }
        None
    }

    fn request_draw(&self) {
        let new = draw_state(&self.controller, &self.scene, self.size);
        self.links.requests.change(|state| {
            let (is_closing, version) = (state.is_closing, state.version);
            *state = DrawState { is_closing, version, ..new };
        });
    }

    fn keys(&self) -> ModifierKeys {
        ModifierKeys {
            ctrl: self.modifiers.control_key() || self.modifiers.super_key(),
            shift: self.modifiers.shift_key(),
        }
    }

    fn press(&mut self, event: &KeyEvent) {
        if event.logical_key == Key::Named(NamedKey::Enter) {
            if !self.has_panels() {
                self.show_panels(true);
            }
            self.texts.wants_focus = true;
            self.update_panels();
        } else if let Some(key) = key_of(&event.logical_key) {
            let (ModifierKeys { ctrl, shift }, alt) = (self.keys(), self.modifiers.alt_key());
            self.handle(Input::Chord(Chord { key, ctrl, shift, alt }));
        }
    }

    /// Updates the panels, and handles the inputs that follow.
    fn update_panels(&mut self) {
        let has_panels = self.has_panels();
        let Some(layer) = &mut self.layer else { return };
        let state = PanelState {
            has_panels,
            controller: &self.controller,
            acceptances: &self.acceptances,
            recent: self.recent.paths(),
            failure: self.render_failure.as_deref(),
        };
        let (texts, dialog) = (&mut self.texts, &mut self.dialog);
        let mut inputs = vec![];
        // egui may run the closure twice, but reports a click once.
        layer.update(|ui| {
            inputs.extend(panels::show(ui, &state, texts, dialog));
            None
        });
        inputs.into_iter().for_each(|input| self.handle(input));
        // The widgets over the picture have changed.
        self.links.requests.change(|_| ());
        self.update_title();
    }

    /// Updates the panels twice: egui moves the focus in one pass and reports the move in the next.
    /// The next event must find the field that has the focus, however fast the user types.
    fn settle_focus(&mut self) {
        self.update_panels();
        self.update_panels();
    }

    fn update_title(&self) {
        let session = self.controller.session();
        let name = session.path().map_or("new cloud".to_owned(), |path| path.display().to_string());
        let mark = if session.is_dirty() { "*" } else { "" };
        let title = format!("{mark}{name} | nimbus");
        self.layer.iter().for_each(|layer| layer.window.set_title(&title));
    }
}

/// Returns the state that the render thread draws, as version 0.
fn draw_state(controller: &EditorController, scene: &EditedScene, size: [u32; 2]) -> DrawState {
    let (pose, editor) = (controller.camera().pose(), controller.editor());
    DrawState {
        document: editor.shared_document(),
        pose: Pose { position: pose.position + scene.origin(), ..pose },
        has_cloud: editor.settings().display != DisplayMode::Boxes,
        size,
        picture: controller.viewport().size_px.to_array().map(|v| v as u32),
        is_closing: false,
        version: 0,
    }
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
            RenderEvent::Acceptances(document, acceptances) => {
                if document.is_same(self.controller.editor().document()) {
                    self.acceptances = acceptances;
                }
            }
            RenderEvent::Failure(failure) => self.render_failure = failure,
            RenderEvent::Ended => events.exit(),
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        if self.links.stop.load(Ordering::Relaxed) {
            self.close();
        }
        if self.layer.as_ref().is_some_and(EguiLayer::is_due) {
            self.update_panels();
        }
        let due = self.layer.as_ref().and_then(EguiLayer::due);
        let due = due.unwrap_or_else(|| Instant::now() + IDLE_INTERVAL);
        events.set_control_flow(ControlFlow::WaitUntil(due));
    }

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        // Panels know the pointer's place and the open dialog only after an update.
        if let WindowEvent::MouseInput { .. } = &event {
            self.update_panels();
        }
        let Some(layer) = &mut self.layer else { return };
        // egui has the keys only while text is entered; else Tab would move its focus.
        let is_key = matches!(event, WindowEvent::KeyboardInput { .. });
        let is_typing = layer.has_keyboard_focus() || self.dialog.is_some();
        let is_consumed = (!is_key || is_typing) && layer.handle(&event);
        match event {
            WindowEvent::CloseRequested => {
                self.handle(Input::Event(SessionEvent::Intend(Intent::Quit)));
            }
            WindowEvent::Destroyed => self.close(),
            WindowEvent::Resized(size) => self.resize(size),
            WindowEvent::ScaleFactorChanged { .. } => self.place_picture(),
            WindowEvent::ModifiersChanged(modifiers) => self.modifiers = modifiers.state(),
            WindowEvent::Focused(false) => self.handle(Input::FocusLost),
            // A drag goes on over the panels, and ends there.
            WindowEvent::CursorMoved { position: PhysicalPosition { x, y }, .. } => {
                self.handle(Input::PointerMoved { pixel: DVec2::new(x, y), keys: self.keys() });
            }
            WindowEvent::CursorLeft { .. } => self.handle(Input::PointerLeft),
            WindowEvent::MouseInput { state, button, .. } => {
                let is_down = state.is_pressed();
                if let (Some(button), true) = (button_of(button), !is_down || !is_consumed) {
                    // Entered text belongs to the boxes that were selected before the click.
                    if is_down {
                        self.texts.take().into_iter().for_each(|typed| self.handle(typed));
                    }
                    self.handle(Input::Button { button, is_down, keys: self.keys() });
                }
            }
            WindowEvent::MouseWheel { delta, .. } if !is_consumed => {
                self.handle(Input::Wheel(wheel_notches(delta)));
            }
            WindowEvent::KeyboardInput { event, .. } if event.state.is_pressed() => {
                if !is_typing {
                    self.press(&event);
                }
                if is_typing || self.texts.wants_focus || self.dialog.is_some() {
                    self.settle_focus();
                }
            }
            _ => {}
        }
    }
}
