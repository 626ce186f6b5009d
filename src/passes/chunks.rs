//! chunks: draws blobs near to far in chunks, and skips pixels that are already opaque.
//!
//! Blobs of a chunk are drawn by the sprite pipeline; its time counts as `sprites`. In: sorted
//! entries, far to near, and their number; the picture that chunks are composed in (four floats a
//! pixel). Out: the entries near to far and each chunk's draw call; depth 1 where a pixel's
//! transmittance is below the bound; the composed picture over the target, premultiplied linear
//! RGBA. Source: passes.md "chunks". Error: f32 rounding a layer, one rounding to
//! the target's format, and the light behind opaque pixels.

use crate::error::Result;
use crate::gpu::{
    BlendMode, Buffer, Compiler, Device, DrawPipeline, InstanceCount, Kernel, LoadOp, Recorder,
    Target, TargetFormat,
};
use crate::layout::record;

record! {
    /// Push constants of `chunks_order.comp`.
    pub struct OrderPush {
        /// Number of chunks.
        n_chunks: u32,
        /// Room for the entries of a chunk.
        stride: u32,
    }
}

record! {
    /// Push constants of `chunks.vert` and `chunks.frag`.
    pub struct Push {
        /// Columns of the picture.
        width: u32,
        /// Transmittance below which a pixel is opaque.
        saturated: f32,
    }
}

/// Format of the picture that chunks are composed in. With fewer bits, thin layers would leave no
/// trace in a pixel that is nearly opaque.
pub const FORMAT: TargetFormat = TargetFormat::Rgba32f;

/// The pipelines of the pass.
pub struct Chunks {
    order: Kernel,
    pick: DrawPipeline,
    show: DrawPipeline,
}

bindings! {
    /// The buffers of the reordered entries.
    pub struct OrderBuffers {
        /// `[u32; 2]`: sort key and particle, far to near.
        entries,
        /// `KeptRecord`: number of entries.
        kept,
        /// Output, `[u32; 2]`: the entries near to far, `stride` places a chunk.
        nearest,
        /// Output, `[u32; 4]` by chunk: arguments of its draw call.
        draws,
    }
}

impl Chunks {
    /// Creates the pipelines that show chunks in a target of `format`.
    ///
    /// # Errors
    /// Fails if a shader does not compile or a pipeline cannot be created.
    pub fn new(device: &Device, compiler: &Compiler, format: TargetFormat) -> Result<Chunks> {
        let draw = |is_pick: u32, blend| {
            DrawPipeline::new(device, compiler, "chunks", Push::FIELDS, &[(0, is_pick)], blend)
        };
        Ok(Chunks {
            order: Kernel::new(device, compiler, "chunks.order", OrderPush::FIELDS)?,
            pick: draw(1, (FORMAT, BlendMode::DepthOnly))?,
            show: draw(0, (format, BlendMode::Over))?,
        })
    }

    /// Reorders the entries near to far and writes the draw call of every chunk.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record_order(
        &self,
        rec: &mut Recorder<'_>,
        buffers: OrderBuffers<'_>,
        n_chunks: u32,
        stride: u32,
    ) -> Result<()> {
        let push = OrderPush { n_chunks, stride };
        // At most n_chunks × stride entries.
        let n_records = n_chunks.max(n_chunks * stride);
        rec.dispatch(&self.order, &buffers.by_binding(), &push, n_records)
    }

    /// Sets the depth of `target` to 1 where the transmittance of `composed`, a copy of its color,
    /// is below `saturated`.
    ///
    /// # Errors
    /// Fails if `target` has no depth or another format than [`FORMAT`].
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

    /// Draws `composed` over what `start` leaves of `target`.
    ///
    /// # Errors
    /// Fails if `target` has another format than the pipeline.
    pub fn record_show(
        &self,
        rec: &mut Recorder<'_>,
        composed: &Buffer,
        target: Target<'_>,
        start: LoadOp,
    ) -> Result<()> {
        let push = Push { width: target.color.size().0, saturated: 0.0 };
        rec.draw(&self.show, target, start, &[composed], &push, InstanceCount::Known(1))
    }
}
