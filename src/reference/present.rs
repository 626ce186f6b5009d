//! A picture as a display shows it, model.md §11 "present". In: premultiplied linear RGBA. Out: sRGB code values before they are
//! rounded down: 255 times what `Film::display` gives, plus the dither.

use glam::{DVec3, DVec4};

use crate::model::film::{Film, dither};

/// Of the pixel in column `x` and row `y`.
pub fn code_values(film: &Film, x: usize, y: usize, pixel: DVec4) -> DVec3 {
    255.0 * film.display(pixel.truncate(), pixel.w) + DVec3::splat(dither(x, y))
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
        // 2 (0.05 + 0.1 · 0.5) = 0.2: sRGB 1.055 · 0.2^{1/2.4} − 0.055 = 0.484529; 123.555; the first threshold is 1/128.
        let value = code_values(&film, 0, 0, DVec4::new(0.05, 0.05, 0.05, 0.9));
        assert!((value - DVec3::splat(123.5549 + 0.0078)).length() < 1e-3, "{value}");
        // Black under nothing, and what is too bright.
        assert_eq!(code_values(&film, 0, 0, DVec4::W), DVec3::splat(0.5 / 64.0));
        assert!(code_values(&film, 5, 3, DVec4::ONE).x > 255.0);
    }
}
