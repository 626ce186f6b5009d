//! sprites: draws the particles as thin Gaussian sprites.
//!
//! In: sorted entries and the other buffers of blobs, and the depth of surfaces. Out: premultiplied
//! linear RGBA in the target's format. Law: α = 1 − exp(−√(2π) κ σ e^{−b²/2σ²}), b the distance to
//! the pixel's ray. Source: P §Rendering, model.md §9, passes.md. Error: α to a few 1e-6
//! relative, and the target's rounding at each layer.

use super::blobs::{BlobBuffers, BlobCount, BlobVariant, BlobView};
use crate::error::Result;
use crate::gpu::{
    BlendMode, Compiler, Device, DrawPipeline, InstanceCount, LoadOp, RecordCount, Recorder,
    Target, TargetFormat,
};
use crate::layout::cull::KeptRecord;
use crate::layout::frame::CameraRecord;
use crate::layout::record;

record! {
    /// Push constants of `sprites.vert` and `sprites.frag`.
    pub struct Push {
        /// The camera.
        camera: CameraRecord,
        /// Sides of a pixel, as slopes.
        pixel: [f32; 2],
        /// Radius of a blob's footprint, in σ.
        cutoff: f32,
        /// Facet of the first particle.
        i_first_facet: u32,
        /// One over the optical depth at which a blob ends.
        inv_threshold: f32,
        /// Least b²/(2 σ²) at which a blob ends.
        least_cut: f32,
        /// First entry.
        i_first: u32,
    }
}

/// The specialization constant of `sprites.frag` that asks for sums in place of colours.
const SUMS: u32 = 8;
/// Format of a target of sums. Half floats would lose layers from 2048 on.
pub const SUMS_FORMAT: TargetFormat = TargetFormat::Rgba32f;

/// The pipeline of the pass.
pub struct Sprites {
    pipeline: DrawPipeline,
}

/// A range of the sorted entries.
#[derive(Clone, Copy)]
pub struct Range<'a> {
    /// Number of entries.
    pub instances: InstanceCount<'a>,
    /// Index of the first entry.
    pub i_first: u32,
    /// Facet of the first particle.
    pub i_first_facet: u32,
}

impl Sprites {
    /// Creates the pipeline: `Over` draws far to near into a color target, `OverTested` far to near
    /// over surfaces with depth, and `UnderTested` near to far into a target with depth.
    ///
    /// # Errors
    /// Fails if a shader does not compile or the pipeline cannot be created.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        format: TargetFormat,
        variant: BlobVariant,
        blend: BlendMode,
    ) -> Result<Sprites> {
        let constants =
            [&[(1, u32::from(blend != BlendMode::Over))], &variant.constants()[..]].concat();
        let (fields, blend) = (Push::FIELDS, (format, blend));
        let pipeline = DrawPipeline::new(device, compiler, "sprites", fields, &constants, blend)?;
        Ok(Sprites { pipeline })
    }

    /// Creates the pipeline that sums over the layers of each pixel: it adds up optical depths in
    /// the first channel and layers in the second, and keeps the greatest near/z in the fourth.
    ///
    /// # Errors
    /// Fails if a shader does not compile or the pipeline cannot be created.
    pub fn sums(
        device: &Device,
        compiler: &Compiler,
        variant: BlobVariant,
        has_depth: bool,
    ) -> Result<Sprites> {
        let constants = [&[(1, 1), (SUMS, 1)], &variant.constants()[..]].concat();
        let blend = if has_depth { BlendMode::SumTested } else { BlendMode::Sum };
        let (fields, target) = (Push::FIELDS, (SUMS_FORMAT, blend));
        let pipeline = DrawPipeline::new(device, compiler, "sprites", fields, &constants, target)?;
        Ok(Sprites { pipeline })
    }

    /// Draws the first `count` entries over what `start` leaves of `target`.
    ///
    /// # Errors
    /// Fails if `target` does not fit the pipeline.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &BlobBuffers<'_>,
        (target, start): (Target<'_>, LoadOp),
        view: &BlobView<'_>,
        BlobCount { n, i_first_facet }: BlobCount<'_>,
    ) -> Result<()> {
        let instances = match n {
            RecordCount::Known(n) => InstanceCount::Known(n),
            RecordCount::Indirect(kept) => InstanceCount::Indirect(kept, KeptRecord::I_DRAW),
        };
        let range = Range { instances, i_first: 0, i_first_facet };
        self.record_range(rec, buffers, (target, start), view, range)
    }

    /// Draws a range of the entries over what `start` leaves of `target`.
    ///
    /// # Errors
    /// Fails if `target` does not fit the pipeline.
    pub fn record_range(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &BlobBuffers<'_>,
        (target, start): (Target<'_>, LoadOp),
        view: &BlobView<'_>,
        Range { instances, i_first, i_first_facet }: Range<'_>,
    ) -> Result<()> {
        let (width, height) = target.color.size();
        let push = Push {
            camera: *view.camera,
            pixel: view.camera.pixel_slopes(width, height),
            cutoff: view.cutoff as f32,
            i_first_facet,
            inv_threshold: view.inv_threshold(),
            least_cut: view.least_cut() as f32,
            i_first,
        };
        rec.draw(&self.pipeline, target, start, &buffers.by_binding(), &push, instances)
    }
}
