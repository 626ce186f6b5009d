//! The smaller picture that blobs may be drawn into, and how its pixels lie under those of the full
//! one (docs/model.md §11 "upsample").

use glam::DVec2;

/// Taps of the interpolation along an axis.
pub const N_TAPS: u32 = 6;
/// Columns and rows of a smaller picture are a multiple of this, so that its rows begin with a
/// whole texel.
pub const ALIGNED: u32 = 4;
/// Depths that differ by no more than this share of the nearer one are those of one surface.
pub const ALIKE: f64 = 1.0 / 16.0;

/// Pixels of the picture that blobs are drawn into, along a side, for each of the film's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resolution {
    Full,
    Half,
    Quarter,
    /// The fastest whose error at the first frame is small enough.
    Auto,
}

impl Resolution {
    /// The ones that can be drawn, with what a scene file calls them.
    pub const ALL: [(f64, Resolution); 3] =
        [(1.0, Resolution::Full), (0.5, Resolution::Half), (0.25, Resolution::Quarter)];

    /// Full pixels along a side of a pixel; of what is not chosen yet, the most.
    pub fn divisor(self) -> u32 {
        match self {
            Resolution::Full => 1,
            Resolution::Half => 2,
            Resolution::Quarter | Resolution::Auto => 4,
        }
    }

    /// As scene files and results have it.
    pub fn name(self) -> &'static str {
        match self {
            Resolution::Full => "1.0",
            Resolution::Half => "0.5",
            Resolution::Quarter => "0.25",
            Resolution::Auto => "auto",
        }
    }
}

/// A smaller picture about the same centre, with a margin, so that every full pixel has all of its
/// taps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LowResLayout {
    pub full: [u32; 2],
    pub size: [u32; 2],
    /// Full pixels along a side of a small one.
    pub n: u32,
}

impl LowResLayout {
    /// For `full` pixels; `n` full ones along a side of a small one, an even number.
    pub fn of(full: [u32; 2], n: u32) -> LowResLayout {
        let size = full.map(|pixels| (pixels.div_ceil(n) + N_TAPS).next_multiple_of(ALIGNED));
        LowResLayout { full, size, n }
    }

    /// Full pixel p sits at (o + 2p)/2n small pixels from the centre of the first one.
    pub fn offsets(&self) -> [u32; 2] {
        [0, 1].map(|k| 1 + self.size[k] * self.n - self.full[k] - self.n)
    }

    /// What the half widths of the view, as slopes, grow by.
    pub fn widening(&self) -> DVec2 {
        let along = |k: usize| f64::from(self.size[k] * self.n) / f64::from(self.full[k]);
        DVec2::new(along(0), along(1))
    }

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
                // The first tap is two before the pixel's own, the last one three after it.
                assert!(o / (2 * n) >= 2, "{width}/{n}");
                assert!((o + 2 * (width - 1)) / (2 * n) + 3 < size, "{width}/{n}");
                // The first and the last pixel lie as far from the middle of the small picture,
                // whose first pixel's centre is half a pixel from its edge.
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
