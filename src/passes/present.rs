//! present: shows a finished picture in a window's image.
//!
//! In: a picture's pixels as its target holds them, and a second picture to compare it with. Out:
//! sRGB code values of 8 bits; black outside the picture. Law: over the background, times the
//! exposure, tone map, sRGB, ordered dither, as PNG files are written; or the two pictures side by
//! side, or their difference. Source: passes.md "present". Error: 8e-6 of the
//! greatest value, so that a code value differs only where the exact value is that close to the
//! next; 11 more roundings for a difference.

use crate::error::Result;
use crate::gpu::{
    BlendMode, Buffer, Compiler, Device, DrawPipeline, Image, InstanceCount, LoadOp, Recorder,
    Target, TargetFormat,
};
use crate::layout::record;

record! {
    /// Push constants of `present.vert` and `present.frag`.
    pub struct Push {
        /// Linear RGB.
        background: [f32; 3],
        /// Factor of the radiance.
        exposure: f32,
        /// Columns and rows of the picture.
        size: [u32; 2],
        /// The window's pixel of the picture's top left pixel.
        corner: [i32; 2],
        /// 0: neutral; 1: linear; 2: filmic.
        tone_map: u32,
        /// 0: none; 1: split; 2: difference; 3: the second picture.
        compare: u32,
        /// Column of the dividing line.
        split: i32,
        /// Factor of a difference.
        gain: f32,
    }
}

/// The pipeline of the pass.
pub struct Present {
    pipeline: DrawPipeline,
}

/// How two pictures, A and B, are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Compare {
    /// A left of a column, B right of it, with a line between; a column outside the picture shows
    /// one of them alone.
    Split {
        /// Column of the picture.
        column: i32,
    },
    /// The difference before the tone map; black where the pictures are equal.
    Difference {
        /// Factor of the difference.
        gain: f32,
    },
    /// B alone.
    Second,
}

/// How a picture is shown in a window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown {
    /// Linear RGB.
    pub background: [f32; 3],
    /// Factor of the radiance.
    pub exposure: f32,
    /// Columns and rows of the picture.
    pub size: [u32; 2],
    /// The window's pixel at which the picture's top left pixel is.
    pub corner: [i32; 2],
    /// Number of the tone map: 0 compresses highlights, 1 clips them, 2 is a filmic curve.
    pub tone_map: u32,
    /// The comparison with a second picture; without one, A is shown.
    pub compare: Option<Compare>,
}

impl Present {
    /// Creates the pipeline for pictures in format `from` and images of format `to`. With
    /// `has_sky`, a sky takes the place of the background.
    ///
    /// # Errors
    /// Fails if a shader does not compile or the pipeline cannot be created.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        [from, to]: [TargetFormat; 2],
        has_sky: bool,
    ) -> Result<Present> {
        let kind = match from {
            TargetFormat::Rgba8 | TargetFormat::Bgra8 => 0,
            TargetFormat::Rgba16f => 1,
            TargetFormat::Rgba32f => 2,
        };
        let constants = [(0, kind), (1, u32::from(has_sky))];
        let blend = (to, BlendMode::Over);
        let pipeline =
            DrawPipeline::new(device, compiler, "present", Push::FIELDS, &constants, blend)?;
        Ok(Present { pipeline })
    }

    /// Draws `pictures`, A and B, into all of `into`. Both have the same format and size; without a
    /// comparison B is A. `sky`: `SkyRecord`, one; without a sky it is not read.
    ///
    /// # Errors
    /// Fails if `into` has another format than the pipeline.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        [a, b]: [&Buffer; 2],
        sky: &Buffer,
        into: &mut Image,
        shown: &Shown,
    ) -> Result<()> {
        let Shown { background, exposure, size, corner, tone_map, compare } = *shown;
        let (compare, split, gain) = match compare {
            None => (0, 0, 0.0),
            Some(Compare::Split { column }) => (1, column, 0.0),
            Some(Compare::Difference { gain }) => (2, 0, gain),
            Some(Compare::Second) => (3, 0, 0.0),
        };
        let push = Push { background, exposure, size, corner, tone_map, compare, split, gain };
        let (target, one) = (Target::color(into), InstanceCount::Known(1));
        rec.draw(&self.pipeline, target, LoadOp::DontCare, &[a, b, sky], &push, one)
    }
}
