//! A picture as a display shows it, passes.md "present".
//!
//! In: premultiplied linear RGBA. Out: sRGB code values before they are rounded down: 255 times
//! `Film::display_over`, plus the dither. Two pictures are shown side by side, or as their
//! difference.

use std::cmp::Ordering;

use glam::{DVec3, DVec4};

use crate::model::film::{Film, dither, srgb_encode};

/// View of two pictures, A and B.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Compared {
    /// A left of this column, B right of it.
    Split(i64),
    /// Their difference times this factor.
    Difference(f64),
    /// B alone.
    Second,
}

/// Returns the code values of the pixel in column `x` and row `y`.
fn code_values(film: &Film, behind: DVec3, x: usize, y: usize, pixel: DVec4) -> DVec3 {
    255.0 * film.display_over(pixel.truncate(), pixel.w, behind) + DVec3::splat(dither(x, y))
}

/// Returns the code values of the pixels `[a, b]` in column `x` and row `y` over the radiance
/// `behind` them, as `compared` says; A alone without it.
pub fn compared_values(
    film: &Film,
    behind: DVec3,
    compared: Option<Compared>,
    x: usize,
    y: usize,
    [a, b]: [DVec4; 2],
) -> DVec3 {
    match compared {
        None => code_values(film, behind, x, y, a),
        Some(Compared::Second) => code_values(film, behind, x, y, b),
        Some(Compared::Difference(gain)) => {
            scaled_difference(film, behind, gain, [a, b]) + DVec3::splat(dither(x, y))
        }
        Some(Compared::Split(column)) => match (x as i64).cmp(&column) {
            Ordering::Less => code_values(film, behind, x, y, a),
            Ordering::Greater => code_values(film, behind, x, y, b),
            Ordering::Equal => DVec3::splat(if (y / 4).is_multiple_of(2) { 255.0 } else { 0.0 }),
        },
    }
}

/// Returns 255 times the encoded gain |difference of the two over the background|.
fn scaled_difference(film: &Film, behind: DVec3, gain: f64, [a, b]: [DVec4; 2]) -> DVec3 {
    let over = |p: DVec4| film.exposure * (p.truncate() + (1.0 - p.w) * behind);
    let far = gain * (over(a) - over(b)).abs();
    DVec3::from(far.to_array().map(|d| 255.0 * srgb_encode(if d.is_nan() { 1.0 } else { d })))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::film::{FilmFormat, ToneMap};

    #[test]
    fn a_grey_over_a_background_by_hand() {
        let film = Film {
            width: 8,
            height: 8,
            format: FilmFormat::Rgba16f,
            background: DVec3::splat(0.5),
            exposure: 2.0,
            tone_map: ToneMap::Clip,
        };
        // 2 (0.05 + 0.1 · 0.5) = 0.2: sRGB 1.055 · 0.2^{1/2.4} − 0.055 = 0.484529; 123.555; the
        // first threshold is 1/128.
        let value = code_values(&film, film.background, 0, 0, DVec4::new(0.05, 0.05, 0.05, 0.9));
        assert!((value - DVec3::splat(123.5549 + 0.0078)).length() < 1e-3, "{value}");
        // Black without background, and a value above 1.
        assert_eq!(code_values(&film, film.background, 0, 0, DVec4::W), DVec3::splat(0.5 / 64.0));
        assert!(code_values(&film, film.background, 5, 3, DVec4::ONE).x > 255.0);
    }

    #[test]
    fn two_pictures_by_hand() {
        let film = Film {
            width: 8,
            height: 8,
            format: FilmFormat::Rgba16f,
            background: DVec3::splat(0.5),
            exposure: 2.0,
            tone_map: ToneMap::Neutral,
        };
        let (a, b) = (DVec4::new(0.05, 0.05, 0.05, 0.9), DVec4::new(0.02, 0.3, 0.05, 0.8));
        let value =
            |compared, x, y| compared_values(&film, film.background, compared, x, y, [a, b]);
        // Over the background 0.10 and (0.12, 0.4, 0.15); with exposure 2 and gain 2: 0.08, 1.2
        // (clamped to 1), 0.2.
        let far = value(Some(Compared::Difference(2.0)), 0, 0);
        // sRGB of 0.08: 1.055 · 0.08^{1/2.4} − 0.055 = 0.313304, of 0.2: 0.484529.
        let expected = DVec3::new(79.8926, 255.0, 123.5549) + DVec3::splat(0.5 / 64.0);
        assert!((far - expected).length() < 1e-3, "{far}");
        // The difference is symmetric.
        assert_eq!(
            compared_values(&film, film.background, Some(Compared::Difference(2.0)), 0, 0, [b, a]),
            far
        );
        let bad = compared_values(
            &film,
            film.background,
            Some(Compared::Difference(2.0)),
            0,
            0,
            [a, DVec4::NAN],
        );
        assert!((bad - DVec3::splat(255.0 + 0.5 / 64.0)).length() < 1e-9, "{bad}");
        // Left, line, right.
        let split = Some(Compared::Split(3));
        assert_eq!(value(split, 2, 0), code_values(&film, film.background, 2, 0, a));
        assert_eq!(value(split, 4, 0), code_values(&film, film.background, 4, 0, b));
        assert_eq!([0, 3, 4, 7, 8].map(|y| value(split, 3, y).x), [255.0, 255.0, 0.0, 0.0, 255.0]);
        assert_eq!(
            value(Some(Compared::Second), 2, 0),
            code_values(&film, film.background, 2, 0, b)
        );
        assert_eq!(value(None, 2, 0), code_values(&film, film.background, 2, 0, a));
    }
}
