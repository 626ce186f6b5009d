//! Sizes of panels and text, from the size of a window and the scale of its display.

/// Size of the smallest window that has all panels at their usual text size, points. Tests check
/// the panels from this size on.
const LEAST: [f64; 2] = [640.0, 480.0];
/// Width below which the panels begin hidden, points: a third of it holds no line of theirs.
const LEAST_FOR_PANELS: f64 = 600.0;
/// Text is scaled in steps of this, because glyphs of arbitrary sizes are blurred.
const SCALE_STEP: f64 = 0.25;

/// Returns the number of pixels of a point.
///
/// It is the scale of the display where the window is large enough. In a window that is small for
/// its display the panels shrink, but text never shrinks below a pixel a point.
pub fn px_per_point([width, height]: [u32; 2], display_scale: f64) -> f64 {
    let is_scale = display_scale.is_finite() && display_scale > 0.0;
    let scale = if is_scale { display_scale } else { 1.0 };
    let fit = (f64::from(width) / LEAST[0]).min(f64::from(height) / LEAST[1]);
    let fit = (fit / SCALE_STEP).floor() * SCALE_STEP;
    scale.min(fit.max(1.0))
}

/// Returns whether a window is large enough to begin with panels.
pub fn has_room_for_panels(size: [u32; 2], display_scale: f64) -> bool {
    f64::from(size[0]) / px_per_point(size, display_scale) >= LEAST_FOR_PANELS
}

/// Returns the width of a panel, points: `usual`, but at most `share` of the window. Where the
/// user shows panels in a window without room for them, they keep the width that their text needs.
pub fn panel_width(window_points: f64, usual: f64, share: f64) -> f64 {
    let least = (share * LEAST_FOR_PANELS).min(window_points);
    // egui rounds a fraction of a point up.
    usual.min(share * window_points).max(least).floor()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_follows_the_display_where_the_window_has_room() {
        for (size, scale, expected) in [
            ([640, 480], 1.0, 1.0),
            ([3840, 2160], 1.0, 1.0),
            ([3840, 2160], 2.0, 2.0),
            ([1280, 960], 2.0, 2.0),
            ([1280, 720], 2.0, 1.5),
            ([640, 480], 2.0, 1.0),
            ([800, 600], 1.5, 1.25),
            ([64, 48], 3.0, 1.0),
            ([0, 0], 2.0, 1.0),
            ([640, 480], 0.5, 0.5),
            ([640, 480], f64::NAN, 1.0),
            ([640, 480], -2.0, 1.0),
        ] {
            assert_eq!(px_per_point(size, scale), expected, "{size:?} at {scale}");
        }
    }

    #[test]
    fn panels_take_at_most_their_share_where_they_have_room() {
        for width in (600..4000).step_by(7) {
            for scale in [1.0, 1.5, 2.0, 3.0] {
                let size = [width, width * 3 / 4];
                assert!(has_room_for_panels(size, scale), "{size:?} at {scale}");
                let points = f64::from(width) / px_per_point(size, scale);
                let panel = panel_width(points, 270.0, 1.0 / 3.0);
                assert!((200.0..=270.0).contains(&panel) && panel <= points / 3.0 + 1e-9);
            }
        }
        assert!(!has_room_for_panels([599, 480], 1.0) && !has_room_for_panels([0, 0], 2.0));
        assert_eq!(panel_width(400.0, 270.0, 1.0 / 3.0), 200.0);
        assert_eq!(panel_width(90.0, 270.0, 1.0 / 3.0), 90.0);
    }
}
