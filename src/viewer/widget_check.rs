//! Widgets of a test's pass: every drawn text with its place.

use egui::epaint::{ClippedShape, Shape};
use egui::{Context, Event, FullOutput, MouseWheelUnit, PointerButton, Pos2, RawInput, Rect};
use egui::{Ui, Vec2, vec2};

use super::layout::px_per_point;

/// A drawn text.
#[derive(Debug, Clone)]
pub struct Text {
    /// The text.
    pub text: String,
    /// The place that it covers.
    pub rect: Rect,
    /// The part of the window that shows it.
    pub clip: Rect,
    /// Whether it ends with an ellipsis, because it was too long.
    pub is_cut: bool,
}

/// A window without a display.
pub struct FakeWindow {
    /// egui's state.
    pub context: Context,
    size_points: Vec2,
    px_per_point: f32,
    seconds: f64,
}

impl FakeWindow {
    /// Opens a window of a size in pixels on a display of this scale.
    pub fn new(size: [u32; 2], display_scale: f64) -> FakeWindow {
        let px_per_point = px_per_point(size, display_scale) as f32;
        let size_points = vec2(size[0] as f32, size[1] as f32) / px_per_point;
        FakeWindow { context: Context::default(), size_points, px_per_point, seconds: 0.0 }
    }

    /// Returns the whole window in points.
    pub fn rect(&self) -> Rect {
        Rect::from_min_size(Pos2::ZERO, self.size_points)
    }

    /// Runs one pass with `events`. Returns every drawn text.
    pub fn run(&mut self, events: Vec<Event>, add: impl FnMut(&mut Ui)) -> Vec<Text> {
        self.seconds += 0.1;
        let mut input = RawInput {
            screen_rect: Some(self.rect()),
            events,
            time: Some(self.seconds),
            ..RawInput::default()
        };
        let viewport = input.viewports.entry(input.viewport_id).or_default();
        viewport.native_pixels_per_point = Some(self.px_per_point);
        let mut output = self.context.run_ui(input, add);
        output.textures_delta.clear();
        texts(&output)
    }

    /// Runs passes until animations have ended. Returns the texts of the last one.
    pub fn settle(&mut self, mut add: impl FnMut(&mut Ui)) -> Vec<Text> {
        (0..10).for_each(|_| drop(self.run(vec![], &mut add)));
        self.run(vec![], &mut add)
    }

    /// Turns the wheel at a place through `points`, down. Returns the texts afterwards.
    pub fn scroll(&mut self, at: Pos2, points: f32, mut add: impl FnMut(&mut Ui)) -> Vec<Text> {
        wheel(at, points).into_iter().for_each(|events| drop(self.run(events, &mut add)));
        self.settle(add)
    }
}

/// Returns the events of each pass of a turn of the wheel through `points`, down.
pub fn wheel(at: Pos2, points: f32) -> [Vec<Event>; 2] {
    let wheel = Event::MouseWheel {
        unit: MouseWheelUnit::Point,
        delta: vec2(0.0, -points),
        phase: egui::TouchPhase::Move,
        modifiers: egui::Modifiers::default(),
    };
    [vec![Event::PointerMoved(at)], vec![wheel]]
}

/// Returns the events of each pass of a click.
pub fn click(at: Pos2) -> [Vec<Event>; 3] {
    let button = |pressed| Event::PointerButton {
        pos: at,
        button: PointerButton::Primary,
        pressed,
        modifiers: egui::Modifiers::default(),
    };
    [vec![Event::PointerMoved(at)], vec![button(true)], vec![button(false)]]
}

/// Returns sizes of windows, pixels, and scales of displays, that all have room for panels.
pub fn windows() -> impl Iterator<Item = ([u32; 2], f64)> {
    let small = [[640, 480], [700, 700], [800, 600], [900, 640], [961, 540], [1280, 720]];
    let large = [[1920, 1080], [3840, 2160], [1080, 1920], [2560, 600]];
    small.into_iter().chain(large).flat_map(|size| [1.0, 1.5, 2.0].map(|scale| (size, scale)))
}

/// Returns the drawn text of these words.
pub fn find<'a>(texts: &'a [Text], text: &str) -> &'a Text {
    texts.iter().find(|t| t.text == text).unwrap_or_else(|| panic!("no {text}: {texts:?}"))
}

fn texts(output: &FullOutput) -> Vec<Text> {
    let mut all = vec![];
    for ClippedShape { clip_rect, shape } in &output.shapes {
        collect(shape, *clip_rect, &mut all);
    }
    all
}

fn collect(shape: &Shape, clip: Rect, all: &mut Vec<Text>) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| collect(shape, clip, all)),
        Shape::Text(t) if !t.galley.text().is_empty() => all.push(Text {
            text: t.galley.text().to_owned(),
            rect: Rect::from_min_size(t.pos, t.galley.size())
                .translate(t.galley.rect.min.to_vec2()),
            clip,
            is_cut: t.galley.elided,
        }),
        _ => {}
    }
}

/// Asserts that no text is cut at its left or right end, also by the window's edge.
pub fn assert_whole_lines(texts: &[Text], window: Rect, what: &str) {
    assert!(!texts.is_empty(), "{what}: no text was drawn");
    for t in texts {
        let seen = t.clip.intersect(window);
        let is_inside = t.rect.left() >= seen.left() - 1.0 && t.rect.right() <= seen.right() + 1.0;
        assert!(is_inside && !t.is_cut, "{what}: cut in {seen:?}: {t:?}");
    }
}

/// Returns whether a text is shown completely.
pub fn is_visible(text: &Text, window: Rect) -> bool {
    text.clip.intersect(window).expand(1.0).contains_rect(text.rect)
}
