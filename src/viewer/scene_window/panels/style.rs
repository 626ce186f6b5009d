//! Colours and number formats of the panels.

use egui::Color32;

/// Colour of text and lines of less importance.
pub const DIM: Color32 = Color32::from_gray(140);
/// Colour of game steps.
pub const GAME: Color32 = Color32::from_rgb(95, 170, 110);
/// Colour of the recording of frames.
pub const RECORD: Color32 = Color32::from_rgb(215, 160, 70);
/// Colour of waiting for the device.
pub const WAIT: Color32 = Color32::from_rgb(80, 85, 95);

/// Colours of the device's passes, used in turn.
pub const PASSES: [Color32; 8] = [
    Color32::from_rgb(90, 140, 220),
    Color32::from_rgb(170, 120, 210),
    Color32::from_rgb(80, 185, 190),
    Color32::from_rgb(220, 110, 120),
    Color32::from_rgb(150, 180, 80),
    Color32::from_rgb(200, 140, 180),
    Color32::from_rgb(120, 120, 230),
    Color32::from_rgb(210, 190, 90),
];

/// Formats a time with three significant digits, such as "12.3".
pub fn ms(value: f64) -> String {
    let n_decimals = match value {
        v if v >= 100.0 => 0,
        v if v >= 10.0 => 1,
        _ => 2,
    };
    format!("{value:.n_decimals$}")
}
