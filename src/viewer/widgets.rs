//! Panels in a window: the window's events to egui's, and its triangles to the thread that draws.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use egui::epaint::textures::TexturesDelta;
use egui::{Context, Ui, ViewportId};
use winit::event::WindowEvent;
use winit::window::Window;

use crate::gpu::{Backdrop, Overlay, Widgets};

/// What is to be drawn over the picture.
#[derive(Default)]
pub struct Face {
    /// None where nothing is.
    pub widgets: Option<Arc<Widgets>>,
    /// What has changed of the textures since it was last taken.
    pub changes: TexturesDelta,
    /// What making the widgets took each time, ms.
    pub made_ms: Vec<f64>,
}

impl Drop for Face {
    fn drop(&mut self) {
        // Nobody will draw them.
        self.changes.clear();
    }
}

pub type SharedFace = Arc<Mutex<Face>>;

/// Nobody panics while it is held; if somebody did, what is in it is whole all the same.
pub fn lock(face: &SharedFace) -> MutexGuard<'_, Face> {
    face.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What is drawn of `face` now, with its textures where `overlay` finds them.
pub fn take(
    face: &SharedFace,
    overlay: &mut Overlay,
) -> crate::error::Result<Option<Arc<Widgets>>> {
    let (widgets, changes) = {
        let mut face = lock(face);
        (face.widgets.clone(), std::mem::take(&mut face.changes))
    };
    overlay.set_textures(changes)?;
    Ok(widgets)
}

/// So often at most panels are made while somebody touches them.
const TOUCHED: Duration = Duration::from_millis(16);

/// Every Vulkan device has textures as large.
const MAX_TEXTURE_SIDE: usize = 4096;

/// egui in a window.
pub struct Layer {
    context: Context,
    state: egui_winit::State,
    pub face: SharedFace,
    steady: Duration,
    last: Option<Instant>,
    /// An event came that changes what is shown.
    is_touched: bool,
}

impl Layer {
    /// What nobody touches is made anew each `steady`; `softens` edges.
    pub fn new(window: &Window, face: SharedFace, (steady, softens): (Duration, bool)) -> Layer {
        let context = Context::default();
        context.set_visuals(egui::Visuals::dark());
        // Soft edges are most of the triangles, and a software device's time goes by those.
        context.tessellation_options_mut(|options| options.feathering = softens);
        let scale = Some(window.scale_factor() as f32);
        let state = egui_winit::State::new(
            context.clone(),
            ViewportId::ROOT,
            window,
            scale,
            None,
            Some(MAX_TEXTURE_SIDE),
        );
        Layer { context, state, face, steady, last: None, is_touched: true }
    }

    /// Whether `event` was for a panel, and for nothing behind it.
    pub fn hears(&mut self, window: &Window, event: &WindowEvent) -> bool {
        let response = self.state.on_window_event(window, event);
        self.is_touched |= response.repaint;
        response.consumed
    }

    /// Whether somebody types into a field.
    pub fn wants_keys(&self) -> bool {
        self.context.egui_wants_keyboard_input()
    }

    /// Puts `text` where others paste it from.
    pub fn copy(&self, text: &str) {
        self.context.copy_text(text.to_owned());
    }

    /// Something is to be shown anew at once.
    pub fn touch(&mut self) {
        self.is_touched = true;
    }

    /// When [`Layer::show`] is to be called next; none: at once.
    pub fn due(&self) -> Option<Instant> {
        let wait = if self.is_touched { TOUCHED } else { self.steady };
        self.last.map(|last| last + wait)
    }

    /// Whether that is now.
    pub fn is_due(&self) -> bool {
        self.due().is_none_or(|due| Instant::now() >= due)
    }

    /// Makes the widgets that `add` wants, over what it says lies behind them.
    pub fn show(&mut self, window: &Window, mut add: impl FnMut(&mut Ui) -> Option<Backdrop>) {
        let begin = Instant::now();
        let input = self.state.take_egui_input(window);
        let mut backdrop = None;
        let output = self.context.run_ui(input, |ui| backdrop = add(ui));
        self.state.handle_platform_output(window, output.platform_output);
        let pixels_per_point = output.pixels_per_point;
        let primitives = self.context.tessellate(output.shapes, pixels_per_point);
        // What egui moves by itself goes on.
        let delay = output.viewport_output.get(&ViewportId::ROOT).map(|v| v.repaint_delay);
        self.is_touched = delay.is_some_and(|delay| delay < self.steady);
        let mut face = lock(&self.face);
        face.widgets = Some(Arc::new(Widgets::new(primitives, pixels_per_point, backdrop)));
        face.changes.append(output.textures_delta);
        face.made_ms.push(begin.elapsed().as_secs_f64() * 1e3);
        self.last = Some(Instant::now());
    }

    /// Nothing is shown until [`Layer::show`] is called again.
    pub fn hide(&mut self) {
        lock(&self.face).widgets = None;
        self.is_touched = true;
    }
}
