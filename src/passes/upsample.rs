//! upsample: the blobs' smaller picture over the full one.
//!
//! In: the blobs alone in a smaller picture, and where there are surfaces their picture and the
//! depth that both kinds of pixels see. Out: the picture in a buffer, rows from the top, in the
//! film's format. Law: Lagrange's polynomials of degree five through 6 × 6 small pixels, of fewer
//! beside edges of depth, premultiplied "over" (docs/model.md §11 "upsample"). Error: f32's, some
//! forty roundings of what the weights' magnitudes sum to, and the format's once.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::gpu::{TargetFormat, has_depth24};
use crate::layout::record;

record! {
    pub struct Push {
        width: u32,
        height: u32,
        small_width: u32,
        small_height: u32,
        offset_x: u32,
        offset_y: u32,
        n_runs: u32,
        n_pairs: u32,
        last_texel: u32,
    }
}

/// How the two pictures' pixels lie.
#[derive(Debug, Clone, Copy)]
pub struct Extents {
    pub full: [u32; 2],
    /// A multiple of four across.
    pub small: [u32; 2],
    /// Full pixel p lies at (offset + 2p)/2n small pixels from the centre of the first one.
    pub offsets: [u32; 2],
    /// Full pixels along a side of a small one.
    pub n: u32,
}

pub struct Upsample {
    kernel: Kernel,
    push: Push,
    n_invocations: u32,
    behind: bool,
}

impl Upsample {
    /// Between pictures of such `extents`. `behind`: there are surfaces.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        extents: &Extents,
        format: TargetFormat,
        behind: bool,
    ) -> Result<Upsample> {
        let Extents { full: [width, height], small: [small_width, small_height], offsets, n } =
            *extents;
        let [offset_x, offset_y] = offsets;
        let pixel_words = (format.bytes_per_pixel() / 4) as u32;
        let together = 4 / pixel_words;
        let macros = [
            ("N", n),
            ("OFFSET_X", offset_x % (2 * n)),
            // Runs are 4 n pixels wide: four small ones.
            ("SHIFT", (offset_x / (2 * n) - 2) % 4),
            ("PIXEL_WORDS", pixel_words),
            ("TOGETHER", if width.is_multiple_of(together) { together } else { 1 }),
            // Beside edges of depth pixels are stored one by one.
            ("WORDS_64", u32::from(!behind && device.limits().has_int64)),
            ("BEHIND", if behind { 1 + u32::from(has_depth24(device)) } else { 0 }),
        ];
        let kernel = Kernel::with_macros(device, compiler, "upsample", Push::FIELDS, &[], &macros)?;
        let n_runs = width.div_ceil(4 * n);
        let n_small = u64::from(small_width) * u64::from(small_height);
        let last_texel = (n_small * format.bytes_per_pixel() / 16) as u32 - 1;
        // Rows by twos that lie between the same small ones: o + 2 y from a multiple of four on.
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
        Ok(Upsample { kernel, push, n_invocations: n_runs * n_pairs, behind })
    }

    /// `small`: the blobs; `picture`: what becomes of them; with surfaces `under`: theirs, [near/z
    /// of the small pixels, of the full ones].
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        [small, picture]: [&Buffer; 2],
        surfaces: Option<[&Buffer; 3]>,
    ) -> Result<()> {
        let mut buffers = vec![small, picture];
        buffers.extend(surfaces.into_iter().flatten().take(if self.behind { 3 } else { 0 }));
        rec.dispatch(&self.kernel, &buffers, &self.push, self.n_invocations)
    }
}
