//! chunks: what `sprites` draws near to far, a chunk at a time; pixels that are full leave the rest
//! out. Its time stands under `sprites`.
//!
//! In: sorted entries, far to near, and their number; the picture that chunks are composed in (four
//! floats a pixel). Out: the entries near to far, by chunk, and each chunk's draw; depth 1 where
//! the picture lets less through than may be left out; and the picture over what stands behind,
//! premultiplied linear RGBA in the film's format. Law: docs/model.md §11 "chunks". Error: of f32
//! at each layer, of the film's format once, and what is left out behind a full pixel.

use crate::error::Result;
use crate::gpu::TargetFormat;
use crate::gpu::{
    BlendMode, Buffer, Compiler, Device, DrawPipeline, InstanceCount, Kernel, LoadOp, Recorder,
    Target,
};
use crate::layout::record;

record! {
    pub struct OrderPush { n_chunks: u32, stride: u32 }
}

record! {
    pub struct Push { width: u32, saturated: f32 }
}

/// What chunks are composed in: with fewer bits thin layers would leave no trace in a pixel that is
/// nearly full.
pub const FORMAT: TargetFormat = TargetFormat::Rgba32f;

pub struct Chunks {
    order: Kernel,
    pick: DrawPipeline,
    show: DrawPipeline,
}

impl Chunks {
    /// `format`: of the picture that they are shown in.
    pub fn new(device: &Device, compiler: &Compiler, format: TargetFormat) -> Result<Chunks> {
        Ok(Chunks {
            order: Kernel::new(device, compiler, "chunks.order", OrderPush::FIELDS, &[])?,
            pick: DrawPipeline::new(
                device,
                compiler,
                "chunks",
                Push::FIELDS,
                &[(0, 1)],
                (FORMAT, BlendMode::DepthOnly),
            )?,
            show: DrawPipeline::new(
                device,
                compiler,
                "chunks",
                Push::FIELDS,
                &[(0, 0)],
                (format, BlendMode::Over),
            )?,
        })
    }

    /// Orders what `kept` (KeptRecord) counts of `entries` near to far into `nearest`, `stride`
    /// places a chunk, and writes each chunk's draw (four words) to `draws`.
    pub fn record_order(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 4],
        [n_chunks, stride]: [u32; 2],
    ) -> Result<()> {
        // Of `n_chunks` times `stride` at most.
        rec.dispatch(
            &self.order,
            &buffers,
            &OrderPush { n_chunks, stride },
            n_chunks.max(n_chunks * stride),
        )
    }

    /// Sets the depth of `target`, of which `composed` is a copy, to 1 where less than `saturated`
    /// is let through.
    pub fn record_pick(
        &self,
        rec: &mut Recorder<'_>,
        composed: &Buffer,
        target: Target<'_>,
        saturated: f64,
    ) -> Result<()> {
        let push = Push { width: target.color.size().0, saturated: saturated as f32 };
        rec.draw(&self.pick, target, LoadOp::Load, &[composed], &push, InstanceCount::Known(1))
    }

    /// Draws `composed` over `target`, or alone where `start` clears it.
    pub fn record_show(
        &self,
        rec: &mut Recorder<'_>,
        composed: &Buffer,
        (target, start): (Target<'_>, LoadOp),
    ) -> Result<()> {
        let target = Target::color(target.color);
        let push = Push { width: target.color.size().0, saturated: 0.0 };
        rec.draw(&self.show, target, start, &[composed], &push, InstanceCount::Known(1))
    }
}
