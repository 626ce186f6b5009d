//! upsample: resamples the smaller picture of the blobs over the full picture.
//!
//! In: the blobs alone in a smaller picture; the surfaces' full picture and the depth that the
//! pixels of both pictures see. Out: the picture in a buffer, rows from the top, in the film's
//! format. Law: Lagrange polynomials of degree five through 6 × 6 small pixels, fewer beside edges
//! of depth, premultiplied "over" (passes.md "upsample"). Error: about forty f32
//! roundings of the sum of the weights' magnitudes, and one rounding to the format.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder, TargetFormat, has_depth24};
use crate::layout::record;

record! {
    /// Push constants of `upsample.comp`.
    pub struct Push {
        /// Columns of the picture.
        width: u32,
        /// Rows of the picture.
        height: u32,
        /// Columns of the smaller picture.
        small_width: u32,
        /// Rows of the smaller picture.
        small_height: u32,
        /// The x of `Extents::offsets`.
        offset_x: u32,
        /// The y of `Extents::offsets`.
        offset_y: u32,
        /// Runs of pixels in a row.
        n_runs: u32,
        /// Pairs of rows between the same rows of the smaller picture.
        n_pairs: u32,
        /// Last texel of the smaller picture.
        last_texel: u32,
    }
}

/// How the pixels of the two pictures lie.
#[derive(Debug, Clone, Copy)]
pub struct Extents {
    /// Columns and rows of the full picture.
    pub full: [u32; 2],
    /// Columns, a multiple of four, and rows of the smaller picture.
    pub small: [u32; 2],
    /// Full pixel p lies (offset + 2p)/2n small pixels from the center of the first one.
    pub offsets: [u32; 2],
    /// Full pixels along a side of a small one.
    pub n: u32,
}

bindings! {
    /// The buffers of the surfaces beneath the blobs.
    pub struct SolidBuffers {
        /// Pixels of the surfaces' full picture.
        under,
        /// `f32` by small pixel: near/z.
        small_depths,
        /// `f32` by full pixel: near/z.
        depths,
    }
}

/// The pipeline of the pass.
pub struct Upsample {
    kernel: Kernel,
    push: Push,
    n_invocations: u32,
}

impl Upsample {
    /// Creates the pipeline; `over_solids` if surfaces lie beneath the blobs.
    ///
    /// # Errors
    /// Fails if the shader does not compile or the pipeline cannot be created.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        extents: &Extents,
        format: TargetFormat,
        over_solids: bool,
    ) -> Result<Upsample> {
        let Extents { full: [width, height], small: [small_width, small_height], offsets, n } =
            *extents;
        let [offset_x, offset_y] = offsets;
        let pixel_words = (format.bytes_per_pixel() / 4) as u32;
        let together = 4 / pixel_words;
        let macros = [
            ("N", n),
            ("OFFSET_X", offset_x % (2 * n)),
            // A run is 4 n pixels wide, which are four small pixels.
            ("SHIFT", (offset_x / (2 * n) - 2) % 4),
            ("PIXEL_WORDS", pixel_words),
            ("TOGETHER", if width.is_multiple_of(together) { together } else { 1 }),
            // Beside edges of depth, pixels are stored one by one.
            ("WORDS_64", u32::from(!over_solids && device.limits().has_int64)),
            ("BEHIND", if over_solids { 1 + u32::from(has_depth24(device)) } else { 0 }),
        ];
        let kernel = Kernel::with_macros(device, compiler, "upsample", Push::FIELDS, &[], &macros)?;
        let n_runs = width.div_ceil(4 * n);
        let n_small = u64::from(small_width) * u64::from(small_height);
        let last_texel = (n_small * format.bytes_per_pixel() / 16) as u32 - 1;
        // Pairs of rows between the same small rows: o + 2 y from a multiple of four on.
        let n_pairs =
            if height > 0 { (offset_y + 2 * (height - 1)) / 4 - offset_y / 4 + 1 } else { 0 };
        let push = Push {
            width,
            height,
            small_width,
            small_height,
            offset_x,
            offset_y,
            n_runs,
            n_pairs,
            last_texel,
        };
        Ok(Upsample { kernel, push, n_invocations: n_runs * n_pairs })
    }

    /// Writes `picture` from the blobs in `small`, and over `solids` where the pass was created so.
    ///
    /// # Errors
    /// Fails if `solids` are given to a pass that was created without them, or the reverse.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        [small, picture]: [&Buffer; 2],
        solids: Option<SolidBuffers<'_>>,
    ) -> Result<()> {
        let mut buffers = vec![small, picture];
        buffers.extend(solids.iter().flat_map(SolidBuffers::by_binding));
        rec.dispatch(&self.kernel, &buffers, &self.push, self.n_invocations)
    }
}
