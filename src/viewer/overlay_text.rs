//! Text over a picture that both windows show: messages, errors, and the list of keys.

use egui::text::{LayoutJob, TextWrapping};
use egui::{
    Align, Align2, Color32, FontId, Label, Layout, Rect, RichText, ScrollArea, TextFormat, Ui,
    Vec2, Window, pos2, vec2,
};

/// Number of rows of a message: the whole path of a file in the narrowest picture beside panels.
pub const MESSAGE_ROWS: usize = 8;
/// Distance of banners from each other and from the picture's edges, points: enough to tell them
/// apart.
const GAP: f32 = 8.0;
/// Distance of a banner's text from its edge, points. Lines have space above and below already, so
/// the second distance is smaller.
const MARGIN: Vec2 = vec2(8.0, 5.0);
/// Size of a banner's text, points: legible at one pixel a point, the smallest scale.
const TEXT: f32 = 13.0;
/// Largest number of characters of a banner that are laid out. A huge message would slow the window
/// down.
const MAX_CHARS: usize = 2000;
/// Smallest share that text of narrow panels shrinks to: smaller text is hard to read.
const LEAST_TEXT: f32 = 0.85;
/// Width of the list of keys, points: the longest description takes two lines.
const KEYS_WIDTH: f32 = 480.0;
/// Smallest width of the list of keys, points. Below it a description has one word a line.
const LEAST_KEYS_WIDTH: f32 = 60.0;
/// Width of the column of keys, points: the longest name of a key takes one line.
const KEY_WIDTH: f32 = 118.0;
/// Space beside the list of keys, points: the window's margins, and as much of the picture.
const BESIDE_KEYS: f32 = 40.0;
/// Space above and below the list of keys, points: the window's title and margins.
const ABOVE_KEYS: f32 = 80.0;
/// Smallest height of the list of keys, points: two lines, so that it can be scrolled.
const LEAST_KEYS_HEIGHT: f32 = 40.0;

/// A group of keys with its title: each key with what it does.
pub type KeyGroup = (&'static str, Vec<(&'static str, &'static str)>);

/// Draws `text` on a filled rectangle in the lower left corner of `area`, in at most `max_rows`
/// rows. Returns the area above it.
pub fn banner(ui: &Ui, area: Rect, text: &str, fill: Color32, max_rows: usize) -> Rect {
    let width = area.width() - 2.0 * (GAP + MARGIN.x);
    if width <= 0.0 || area.height() <= 0.0 {
        return area;
    }
    let format = TextFormat::simple(FontId::proportional(TEXT), Color32::WHITE);
    let cut: String = text.chars().take(MAX_CHARS).collect();
    let wrap = TextWrapping { max_width: width, max_rows, ..TextWrapping::default() };
    let job = LayoutJob { wrap, ..LayoutJob::single_section(cut, format) };
    let painter = ui.painter();
    let galley = painter.layout_job(job);
    let size = galley.size() + 2.0 * MARGIN;
    let place = pos2(area.left() + GAP, area.bottom() - GAP);
    let frame = Align2::LEFT_BOTTOM.anchor_size(place, size);
    painter.rect_filled(frame, 4.0, fill);
    painter.galley(frame.min + MARGIN, galley, Color32::WHITE);
    Rect::from_min_max(area.min, pos2(area.right(), frame.top()))
}

/// Makes all text of `ui` smaller by `share`, within bounds that stay legible.
pub fn shrink_text(ui: &mut Ui, share: f32) {
    let share = share.clamp(LEAST_TEXT, 1.0);
    for font in ui.style_mut().text_styles.values_mut() {
        font.size *= share;
    }
}

/// Returns the number of rows of text that fill a third of `area`, at least one.
pub fn rows_of_third(area: Rect) -> usize {
    ((area.height() / 3.0 / (1.3 * TEXT)) as usize).max(1)
}

/// Shows the list of keys in the middle of `area`. Returns whether its close button was clicked.
pub fn keys(ui: &Ui, area: Rect, groups: &[KeyGroup]) -> bool {
    let mut is_open = true;
    let width = KEYS_WIDTH.min(area.width() - BESIDE_KEYS).max(LEAST_KEYS_WIDTH);
    let height = (area.height() - ABOVE_KEYS).max(LEAST_KEYS_HEIGHT);
    let window = Window::new("Keys").open(&mut is_open).collapsible(false).resizable(false);
    let at = area.center() - ui.ctx().content_rect().center();
    window.anchor(Align2::CENTER_CENTER, at).show(ui.ctx(), |ui| {
        ui.set_width(width);
        ScrollArea::vertical().max_height(height).show(ui, |ui| {
            ui.set_width(width);
            for (title, keys) in groups {
                ui.label(RichText::new(*title).strong());
                keys.iter().for_each(|(key, what)| row(ui, width, key, what));
                ui.add_space(4.0);
            }
        });
    });
    !is_open
}

fn row(ui: &mut Ui, width: f32, key: &str, what: &str) {
    let key_width = KEY_WIDTH.min(0.4 * width);
    ui.horizontal_top(|ui| {
        let (size, layout) = (vec2(key_width, 0.0), Layout::left_to_right(Align::Min));
        ui.allocate_ui_with_layout(size, layout, |ui| {
            ui.set_width(key_width);
            ui.add(Label::new(RichText::new(key).monospace()).wrap());
        });
        ui.add(Label::new(what).wrap());
    });
}
