//! present: a finished picture as a display shows it, in a window's image.
//!
//! In: a picture's pixels as they lie in its target, and a second one's that it may be compared
//! with. Out: sRGB code values, 8 bits; black where there is no picture. Law: over the background,
//! times the exposure, tone map, sRGB, ordered dither: what is written as PNG; or the two side by
//! side, or how far they are apart. Source: docs/model.md §11 "present". Error: 8e-6 of the
//! greatest value, so that a code value is another where the exact one is that close to the next;
//! of a difference besides 11 roundings of what it is of.

use crate::error::Result;
use crate::gpu::TargetFormat;
use crate::gpu::{
    BlendMode, Buffer, Compiler, Device, DrawPipeline, Image, InstanceCount, LoadOp, Recorder,
    Target,
};
use crate::layout::record;

record! {
    pub struct Push {
        background: [f32; 3],
        exposure: f32,
        size: [u32; 2],
        corner: [i32; 2],
        tone_map: u32,
        compare: u32,
        split: i32,
        gain: f32,
    }
}

pub struct Present {
    pipeline: DrawPipeline,
}

/// What is shown of two pictures, A and B.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Compare {
    /// A left of this column of the picture, B right of it, a line in it. A column outside leaves
    /// one of them alone.
    Split { column: i32 },
    /// The difference of what is shown, before the tone map, times this; black where they are the
    /// same.
    Difference { gain: f32 },
    /// B alone.
    Second,
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
    /// None: A alone.
    pub compare: Option<Compare>,
}

impl Present {
    /// Of pictures in format `from`, into images of format `to`.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        from: TargetFormat,
        to: TargetFormat,
    ) -> Result<Present> {
        let kind = match from {
            TargetFormat::Rgba8 | TargetFormat::Bgra8 => 0,
            TargetFormat::Rgba16f => 1,
            TargetFormat::Rgba32f => 2,
        };
        let pipeline = DrawPipeline::new(
            device,
            compiler,
            "present",
            Push::FIELDS,
            &[(0, kind)],
            (to, BlendMode::Over),
        )?;
        Ok(Present { pipeline })
    }

    /// Draws `pictures`, A and B, into all of `into`. They have one format and one size; where
    /// nothing is compared, the same twice.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        pictures: [&Buffer; 2],
        into: &mut Image,
        shown: &Shown,
    ) -> Result<()> {
        let Shown { background, exposure, size, corner, is_neutral, compare } = *shown;
        let (compare, split, gain) = match compare {
            None => (0, 0, 0.0),
            Some(Compare::Split { column }) => (1, column, 0.0),
            Some(Compare::Difference { gain }) => (2, 0, gain),
            Some(Compare::Second) => (3, 0, 0.0),
        };
        let tone_map = u32::from(!is_neutral);
        let push = Push { background, exposure, size, corner, tone_map, compare, split, gain };
        rec.draw(
            &self.pipeline,
            Target::color(into),
            LoadOp::DontCare,
            &pictures,
            &push,
            InstanceCount::Known(1),
        )
    }
}
