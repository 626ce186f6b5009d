//! Colours that both windows use.

use egui::Color32;

/// Colour behind panels.
pub const PANEL: Color32 = Color32::from_rgb(24, 26, 30);
/// Colour behind messages.
pub const MESSAGE: Color32 = Color32::from_rgb(34, 38, 46);
/// Colour behind errors.
pub const ERROR: Color32 = Color32::from_rgb(150, 40, 40);
