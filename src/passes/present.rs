//! present: a finished picture as a display shows it, in a window's image.
//!
//! In: a picture's pixels as they lie in its target. Out: sRGB code values, 8 bits; black where there is no picture. Law: over the
//! background, times the exposure, tone map, sRGB, ordered dither: what is written as PNG. Source: docs/model.md §11 "present".
//! Error: 8e-6 of the greatest value, so that a code value is another where the exact one is that close to the next.

use crate::error::Result;
use crate::gpu::memory::TargetFormat;
use crate::gpu::{Buffer, Compiler, Device, DrawPipeline, Image, Instances, Meet, Recorder, Start, Target};
use crate::layout::record;

record! {
    pub struct Push {
        background: [f32; 3],
        exposure: f32,
        size: [u32; 2],
        corner: [i32; 2],
        tone_map: u32,
        unused: u32,
    }
}

pub struct Present {
    pipeline: DrawPipeline,
}

/// Which picture is shown, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown {
    /// Linear RGB.
    pub background: [f32; 3],
    pub exposure: f32,
    /// Columns and rows of the picture.
    pub size: [u32; 2],
    /// Where its top left pixel is in the window.
    pub corner: [i32; 2],
    /// Highlights are compressed, and not cut.
    pub is_neutral: bool,
}

impl Present {
    /// Of pictures in format `from`, into images of format `to`.
    pub fn new(device: &Device, compiler: &Compiler, from: TargetFormat, to: TargetFormat) -> Result<Present> {
        let kind = match from {
            TargetFormat::Rgba8 | TargetFormat::Bgra8 => 0,
            TargetFormat::Rgba16f => 1,
            TargetFormat::Rgba32f => 2,
        };
        let pipeline = DrawPipeline::new(device, compiler, "present", Push::FIELDS, &[(0, kind)], (to, Meet::Over))?;
        Ok(Present { pipeline })
    }

    /// Draws `picture` into all of `into`.
    pub fn record(&self, rec: &mut Recorder<'_>, picture: &Buffer, into: &mut Image, shown: &Shown) -> Result<()> {
        let Shown { background, exposure, size, corner, is_neutral } = *shown;
        let push = Push { background, exposure, size, corner, tone_map: u32::from(!is_neutral), unused: 0 };
        rec.draw(&self.pipeline, Target::color(into), Start::Clear, &[picture], &push, Instances::Known(1))
    }
}
