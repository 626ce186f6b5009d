//! egui in a window: window events go to egui, and egui's triangles to the render thread.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use egui::epaint::textures::TexturesDelta;
use egui::{Context, Ui, ViewportId};
use winit::event::WindowEvent;
use winit::window::Window;

use super::layout;
use super::sync::lock;
use crate::error::Result;
use crate::gpu::{Backdrop, Overlay, Widgets};

/// The widgets that the render thread draws over the picture.
#[derive(Default)]
pub struct WidgetFrame {
    /// `None` where no widget is shown.
    widgets: Option<Arc<Widgets>>,
    /// Texture changes since the render thread last took them.
    textures: TexturesDelta,
    /// Time that each update of the widgets took, ms.
    pub update_ms: Vec<f64>,
}

impl Drop for WidgetFrame {
    fn drop(&mut self) {
        // A texture change that is dropped with its data makes egui panic.
        self.textures.clear();
    }
}

/// A widget frame shared by the window, which writes it, and the render thread, which reads it.
pub type SharedWidgets = Arc<Mutex<WidgetFrame>>;

/// Returns the widgets to draw now, after `overlay` has taken over their changed textures.
///
/// # Errors
/// The upload of a texture failed.
pub fn take_widgets(
    shared: &Mutex<WidgetFrame>,
    overlay: &mut Overlay,
) -> Result<Option<Arc<Widgets>>> {
    let (widgets, textures) = {
        let mut frame = lock(shared);
        (frame.widgets.clone(), std::mem::take(&mut frame.textures))
    };
    overlay.set_textures(textures)?;
    Ok(widgets)
}

/// Shortest interval between two updates of the panels while the user touches them: about one frame
/// of a 60 Hz display.
const ACTIVE_INTERVAL: Duration = Duration::from_millis(16);

/// Side of the largest texture that every Vulkan device supports.
const MAX_TEXTURE_SIDE: usize = 4096;

/// A window with egui's state in it.
pub struct EguiLayer {
    /// The window.
    pub window: Window,
    context: Context,
    state: egui_winit::State,
    shared: SharedWidgets,
    idle_interval: Duration,
    last_update: Option<Instant>,
    /// An event has changed what the widgets show.
    needs_update: bool,
}

impl EguiLayer {
    /// Creates the layer. Untouched widgets are updated every `idle_interval`.
    ///
    /// `has_feathering` smooths edges. Smooth edges are most of the triangles, and a software
    /// device pays for each of them.
    pub fn new(
        window: Window,
        shared: SharedWidgets,
        idle_interval: Duration,
        has_feathering: bool,
    ) -> EguiLayer {
        let context = Context::default();
        context.set_visuals(egui::Visuals::dark());
        context.tessellation_options_mut(|options| options.feathering = has_feathering);
        // Text has the size that `layout` gives it, and keys of the windows keep their meaning.
        context.options_mut(|options| options.zoom_with_keyboard = false);
        let state = egui_winit::State::new(
            context.clone(),
            ViewportId::ROOT,
            &window,
            Some(window.scale_factor() as f32),
            None,
            Some(MAX_TEXTURE_SIDE),
        );
        let (last_update, needs_update) = (None, true);
        EguiLayer { window, context, state, shared, idle_interval, last_update, needs_update }
    }

    /// Passes `event` to egui. Returns whether egui consumed it.
    pub fn handle(&mut self, event: &WindowEvent) -> bool {
        let response = self.state.on_window_event(&self.window, event);
        self.needs_update |= response.repaint;
        response.consumed
    }

    /// Returns the number of pixels of a point.
    pub fn px_per_point(&self) -> f64 {
        layout::px_per_point(self.window.inner_size().into(), self.window.scale_factor())
    }

    /// Sets the size of text for the next pass.
    fn set_scale(&mut self) {
        set_zoom(&self.context, (self.px_per_point() / self.window.scale_factor()) as f32);
    }

    /// Returns whether a text field has the keyboard focus.
    pub fn has_keyboard_focus(&self) -> bool {
        self.context.egui_wants_keyboard_input()
    }

    /// Copies `text` to the clipboard.
    pub fn copy(&self, text: &str) {
        self.context.copy_text(text.to_owned());
    }

    /// Makes the next update due at once.
    pub fn request_update(&mut self) {
        self.needs_update = true;
    }

    /// Returns when the next [`EguiLayer::update`] is due; `None` means now.
    pub fn due(&self) -> Option<Instant> {
        let interval = if self.needs_update { ACTIVE_INTERVAL } else { self.idle_interval };
        self.last_update.map(|last| last + interval)
    }

    /// Returns whether an update is due now.
    pub fn is_due(&self) -> bool {
        self.due().is_none_or(|due| Instant::now() >= due)
    }

    /// Runs `add`, which adds the widgets and returns the backdrop behind them, and hands the
    /// result to the render thread.
    pub fn update(&mut self, mut add: impl FnMut(&mut Ui) -> Option<Backdrop>) {
        let begin = Instant::now();
        self.set_scale();
        let input = self.state.take_egui_input(&self.window);
        let mut backdrop = None;
        let output = self.context.run_ui(input, |ui| backdrop = add(ui));
        self.state.handle_platform_output(&self.window, output.platform_output);
        let pixels_per_point = output.pixels_per_point;
        let primitives = self.context.tessellate(output.shapes, pixels_per_point);
        // egui asks for early repaints while it animates.
        let delay = output.viewport_output.get(&ViewportId::ROOT).map(|v| v.repaint_delay);
        self.needs_update = delay.is_some_and(|delay| delay < self.idle_interval);
        let mut frame = lock(&self.shared);
        frame.widgets = Some(Arc::new(Widgets::new(primitives, pixels_per_point, backdrop)));
        frame.textures.append(output.textures_delta);
        frame.update_ms.push(begin.elapsed().as_secs_f64() * 1e3);
        self.last_update = Some(Instant::now());
    }

    /// Hides all widgets until the next [`EguiLayer::update`].
    pub fn hide(&mut self) {
        lock(&self.shared).widgets = None;
        self.needs_update = true;
    }
}

/// Sets the zoom that holds from the next pass on.
///
/// `Context::set_zoom_factor` would take effect within that pass. By then the window's size in
/// points and the places of events are computed by the old zoom.
fn set_zoom(context: &Context, zoom: f32) {
    context.options_mut(|options| options.zoom_factor = zoom);
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Pos2, RawInput, Rect, vec2};

    #[test]
    fn a_zoom_holds_from_the_next_pass_on() {
        let context = Context::default();
        for (native, zoom) in [(1.0, 1.0), (2.0, 0.5), (2.0, 0.75), (1.5, 1.0), (1.0, 1.0)] {
            set_zoom(&context, zoom);
            assert_eq!(context.zoom_factor(), zoom);
            let rect = Rect::from_min_size(Pos2::ZERO, vec2(640.0, 480.0) / (native * zoom));
            let mut input = RawInput { screen_rect: Some(rect), ..RawInput::default() };
            let viewport = input.viewports.entry(input.viewport_id).or_default();
            viewport.native_pixels_per_point = Some(native);
            let mut seen = Rect::NOTHING;
            let mut output = context.run_ui(input, |ui| seen = ui.max_rect());
            output.textures_delta.clear();
            assert_eq!(output.pixels_per_point, native * zoom);
            // egui rounds places to fractions of a point.
            let is_whole =
                seen.expand(0.1).contains_rect(rect) && rect.expand(0.1).contains_rect(seen);
            assert!(is_whole, "{native} {zoom}: {seen:?}");
        }
    }
}
