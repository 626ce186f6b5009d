//! Film: composition of linear radiance over the background, tone map and sRGB encoding.

use glam::DVec3;

use super::named::named;

named! {
    /// Format of the render target.
    pub enum FilmFormat {
        /// Linear values 0 to 1 in steps of 1/255. Every blended layer is clamped to that range.
        Rgba8 = "rgba8",
        /// Half floats.
        Rgba16f = "rgba16f",
        /// Single floats.
        Rgba32f = "rgba32f",
    }
}

impl FilmFormat {
    /// Returns the unit round-off of a stored channel: half of the spacing of numbers in [1, 2).
    /// For rgba8 it is half of a step, whatever the number.
    pub fn unit_roundoff(self) -> f64 {
        match self {
            FilmFormat::Rgba8 => 0.5 / 255.0,
            FilmFormat::Rgba16f => 2f64.powi(-11),
            FilmFormat::Rgba32f => 2f64.powi(-24),
        }
    }
}

named! {
    /// Tone map of the display. Shaders have the same numbers.
    pub enum ToneMap {
        /// Khronos PBR Neutral: the identity for displayable values, with highlights compressed.
        Neutral = "neutral",
        /// Clamps to 1.
        Clip = "clip",
        /// The curve of the Academy's reference as Narkowicz 2016 fits it, by channel: a toe, and a
        /// shoulder that bright colours fade to white on.
        Filmic = "filmic",
    }
}

named! {
    /// Light that the exposure goes by.
    pub enum Metering {
        /// None.
        None = "none",
        /// That of suns and skies.
        Sunlit = "sunlit",
    }
}

/// Picture size, format and display settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Film {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Format of the render target.
    pub format: FilmFormat,
    /// Background, linear RGB.
    pub background: DVec3,
    /// Factor before the tone map.
    pub exposure: f64,
    /// Tone map.
    pub tone_map: ToneMap,
}

impl Film {
    /// Returns the display value in [0, 1]³ of a premultiplied linear pixel (alpha = 1 −
    /// transmittance).
    pub fn display(&self, rgb: DVec3, alpha: f64) -> DVec3 {
        self.display_over(rgb, alpha, self.background)
    }

    /// Returns the same over another radiance than the background's.
    pub fn display_over(&self, rgb: DVec3, alpha: f64, behind: DVec3) -> DVec3 {
        let linear = self.exposure * (rgb + (1.0 - alpha) * behind);
        let mapped = match self.tone_map {
            ToneMap::Neutral => neutral(linear),
            ToneMap::Clip => linear,
            ToneMap::Filmic => linear.map(filmic),
        };
        DVec3::new(srgb_encode(mapped.x), srgb_encode(mapped.y), srgb_encode(mapped.z))
    }
}

/// Applies the Khronos PBR Neutral tone mapper with its published constants. The Fresnel offset is
/// left out: it removes the 4 % specular reflection of a dielectric, which a cloud does not have.
fn neutral(color: DVec3) -> DVec3 {
    const START_COMPRESSION: f64 = 0.8;
    const DESATURATION: f64 = 0.15;
    let peak = color.max_element();
    if peak.is_nan() || peak < START_COMPRESSION {
        return color;
    }
    // The limit of the curve; its quotient would be ∞·0.
    if peak == f64::INFINITY {
        return DVec3::ONE;
    }
    let d = 1.0 - START_COMPRESSION;
    let new_peak = 1.0 - d * d / (peak + d - START_COMPRESSION);
    let gray = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    (color * (new_peak / peak)).lerp(DVec3::splat(new_peak), gray)
}

/// Applies the fit of the filmic curve. *Source*: Narkowicz, "ACES Filmic Tone Mapping Curve",
/// 2016.
fn filmic(x: f64) -> f64 {
    // Beyond, the curve is above 1 by 3 %, and the quotient would be ∞/∞.
    const WHITE: f64 = 1e6;
    let x = if x > 0.0 { x.min(WHITE) } else { 0.0 };
    (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)
}

/// Encodes a linear value as sRGB, clamped to [0, 1]; NaN becomes 0. *Source*: IEC 61966-2-1.
pub fn srgb_encode(linear: f64) -> f64 {
    let v = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

/// Returns the ordered dither added to a code value before it is rounded down.
///
/// It is (B + ½)/64 with Bayer's 8×8 matrix B: between 0 and 1 and ½ on average, so that values
/// round to nearest with ±½ of ordered noise. Without it the soft gradients of clouds show bands.
/// The pattern is ordered, so that equal pixels give equal files, and the same for all channels, so
/// that grey stays grey. Exact code values are unchanged.
pub fn dither(x: usize, y: usize) -> f64 {
    // Bayer's recursion unrolled: bits of x ^ y and y interleaved, the lowest with the greatest
    // weight.
    let (a, b) = ((x ^ y) & 7, y & 7);
    let bayer = (0..3).fold(0, |sum, i| sum << 2 | (a >> i & 1) << 1 | (b >> i & 1));
    (bayer as f64 + 0.5) / 64.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(tone_map: ToneMap) -> Film {
        let background = DVec3::new(0.2, 0.4, 0.6);
        Film {
            width: 1,
            height: 1,
            format: FilmFormat::Rgba16f,
            background,
            exposure: 1.0,
            tone_map,
        }
    }

    #[test]
    fn srgb_at_published_points() {
        assert_eq!(srgb_encode(0.0), 0.0);
        assert!((srgb_encode(1.0) - 1.0).abs() < 1e-12);
        // 18 % grey is 118/255 in sRGB, within half a code value.
        assert!((srgb_encode(0.18) * 255.0 - 118.0).abs() < 0.5);
        assert_eq!(srgb_encode(f64::NAN), 0.0);
        assert_eq!(srgb_encode(7.0), srgb_encode(1.0));
    }

    #[test]
    fn background_shows_where_nothing_covers_it() {
        let shown = film(ToneMap::Clip).display(DVec3::ZERO, 0.0);
        assert_eq!(shown.y, srgb_encode(0.4));
        assert_eq!(film(ToneMap::Clip).display(DVec3::ONE, 1.0), DVec3::splat(srgb_encode(1.0)));
    }

    #[test]
    fn neutral_is_the_identity_below_its_knee_and_monotone_above() {
        assert_eq!(neutral(DVec3::splat(0.79)), DVec3::splat(0.79));
        let peaks: Vec<f64> =
            (0..100).map(|i| neutral(DVec3::splat(0.8 + 0.1 * f64::from(i))).x).collect();
        assert!(peaks.windows(2).all(|w| w[0] < w[1]) && peaks[99] < 1.0);
    }

    #[test]
    fn the_filmic_curve_by_hand() {
        // At 1: (2.51 + 0.03)/(2.43 + 0.59 + 0.14) = 2.54/3.16; it rises, and has a toe.
        assert!((filmic(1.0) - 2.54 / 3.16).abs() < 1e-15);
        assert!(filmic(0.01) < 0.01 && filmic(0.18) > 0.18);
        let all: Vec<f64> = (0..200).map(|i| filmic(0.1 * f64::from(i))).collect();
        assert!(all.windows(2).all(|w| w[0] < w[1]));
        assert_eq!((filmic(-1.0), filmic(f64::NAN)), (0.0, 0.0));
    }

    #[test]
    fn infinite_radiance_is_white() {
        for tone_map in [ToneMap::Neutral, ToneMap::Clip, ToneMap::Filmic] {
            let white = film(tone_map).display(DVec3::INFINITY, 1.0);
            assert_eq!(white, DVec3::splat(srgb_encode(1.0)));
        }
        // A single infinite channel desaturates as any highlight does.
        assert_eq!(neutral(DVec3::new(f64::INFINITY, 0.2, 0.0)), DVec3::ONE);
        assert!((neutral(DVec3::new(1e30, 0.2, 0.0)) - DVec3::ONE).length() < 1e-12);
    }
}
