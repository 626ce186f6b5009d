//! The low-resolution picture that blobs may be drawn into, and how its pixels lie under the full
//! one's (passes.md "upsample").

use glam::DVec2;

/// Number of taps of the interpolation along an axis.
const N_TAPS: u32 = 6;
/// Columns and rows of a low-resolution picture are a multiple of this, so that rows begin with a
/// whole texel.
const ALIGNED: u32 = 4;
/// Relative difference of depths up to which two pixels show one surface; a share of the nearer
/// depth.
pub const ALIKE: f64 = 1.0 / 16.0;

/// Resolution of the picture that blobs are drawn into, along a side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resolution {
    /// The film's resolution.
    Full,
    /// One pixel for 2 × 2 of the film.
    Half,
    /// One pixel for 4 × 4 of the film.
    Quarter,
    /// The fastest whose error at the first frame is small enough.
    Auto,
}

impl Resolution {
    /// The resolutions that can be drawn, with their value in scene files.
    pub const ALL: [(f64, Resolution); 3] =
        [(1.0, Resolution::Full), (0.5, Resolution::Half), (0.25, Resolution::Quarter)];

    /// Returns the number of full pixels along a side of a pixel; the greatest if it is not chosen
    /// yet.
    pub fn divisor(self) -> u32 {
        match self {
            Resolution::Full => 1,
            Resolution::Half => 2,
            Resolution::Quarter | Resolution::Auto => 4,
        }
    }

    /// Returns the name in scene files and results.
    pub fn name(self) -> &'static str {
        match self {
            Resolution::Full => "1.0",
            Resolution::Half => "0.5",
            Resolution::Quarter => "0.25",
            Resolution::Auto => "auto",
        }
    }
}

/// Layout of a low-resolution picture about the full one's centre. Its margin gives every full
/// pixel all of its taps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LowResLayout {
    /// Columns and rows of the full picture.
    pub full: [u32; 2],
    /// Columns and rows of the low-resolution picture.
    pub size: [u32; 2],
    /// Number of full pixels along a side of a small one.
    pub n: u32,
}

impl LowResLayout {
    /// Returns the layout under `full` pixels, with an even number `n` of full pixels along a side
    /// of a small one.
    pub fn of(full: [u32; 2], n: u32) -> LowResLayout {
        let size = full.map(|pixels| (pixels.div_ceil(n) + N_TAPS).next_multiple_of(ALIGNED));
        LowResLayout { full, size, n }
    }

    /// Returns o for both axes: full pixel p lies (o + 2p)/2n small pixels from the centre of the
    /// first one.
    pub fn offsets(&self) -> [u32; 2] {
        [0, 1].map(|k| 1 + self.size[k] * self.n - self.full[k] - self.n)
    }

    /// Returns the growth of the view's half widths, as slopes.
    pub fn widening(&self) -> DVec2 {
        let along = |k: usize| f64::from(self.size[k] * self.n) / f64::from(self.full[k]);
        DVec2::new(along(0), along(1))
    }

    /// Returns the number of pixels of the low-resolution picture.
    pub fn n_pixels(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_has_its_taps_and_the_centres_coincide() {
        for n in [2, 4] {
            for width in 1..70 {
                let small = LowResLayout::of([width, 1], n);
                let (o, size) = (small.offsets()[0], small.size[0]);
                // The first tap lies two pixels before the pixel's own, the last one three after
                // it.
                assert!(o / (2 * n) >= 2, "{width}/{n}");
                assert!((o + 2 * (width - 1)) / (2 * n) + 3 < size, "{width}/{n}");
                // The first and the last pixel are equally far from the middle of the small
                // picture. Its first pixel's centre is half a pixel from its edge.
                let at = |p: u32| f64::from(o + 2 * p) / f64::from(2 * n) + 0.5;
                assert_eq!(at(0) + at(width - 1), f64::from(size), "{width}/{n}");
                assert!(size % ALIGNED == 0 && size < width.div_ceil(n) + N_TAPS + ALIGNED);
            }
        }
    }

    #[test]
    fn the_view_grows_with_the_margin() {
        // 1280/2 + 6 = 646, the next multiple of 4 is 648, as wide as 1296 full pixels.
        let small = LowResLayout::of([1280, 720], 2);
        assert_eq!((small.size, small.offsets()), ([648, 368], [15, 15]));
        assert_eq!(small.widening(), DVec2::new(1296.0 / 1280.0, 736.0 / 720.0));
    }
}
