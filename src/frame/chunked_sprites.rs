//! Blobs drawn near to far in chunks; between chunks, opaque pixels are excluded
//! (passes.md "chunks").

use crate::error::{Error, Result};
use crate::gpu::{
    BlendMode, Buffer, Compiler, Device, Image, InstanceCount, LoadOp, Primitives, RecordCount,
    Recorder, Target, TargetFormat, buffers,
};
use crate::layout::cull::KeptRecord;
use crate::passes::blobs::{BlobBuffers, BlobCount, BlobVariant, BlobView};
use crate::passes::chunks::{Chunks, FORMAT, OrderBuffers};
use crate::passes::sprites::{Range, Sprites};

buffers! {
    /// The reordered entries and the picture that chunks are composed in.
    pub(super) struct ChunkBuffers(n_pixels: u64, n_max: u32, n_chunks: u32) {
        texels: Buffer => [f32; 4], n_pixels, "chunks.texels", Texels;
        /// Entries near to far.
        nearest: Buffer => [u32; 2],
            u64::from(n_max.div_ceil(n_chunks)) * u64::from(n_chunks), "chunks.nearest";
        /// Arguments of each chunk's draw call.
        draws: Buffer => [u32; 4], n_chunks.into(), "chunks.draws";
        /// Number of entries (`KeptRecord`) where the host knows it.
        known: Buffer => KeptRecord, 1, "chunks.known";
    }
}

/// The pipelines, buffers and images of chunked drawing.
pub struct ChunkedSprites {
    chunks: Chunks,
    sprites: Sprites,
    n_chunks: u32,
    /// Entries of a chunk.
    stride: u32,
    composed: Image,
    /// Depth for targets without one.
    depth: Image,
    buffers: ChunkBuffers,
}

/// The most entries, and the number of chunks that they are divided into.
#[derive(Debug, Clone, Copy)]
pub struct ChunkCount {
    /// The most entries.
    pub n_max: u32,
    /// Number of chunks, at least 1.
    pub n_chunks: u32,
}

impl ChunkedSprites {
    /// Creates chunked drawing into pictures of `size` pixels in `format`.
    ///
    /// # Errors
    /// Fails if a shader does not compile or the device cannot hold pictures of four floats a
    /// pixel.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        [width, height]: [u32; 2],
        format: TargetFormat,
        ChunkCount { n_max, n_chunks }: ChunkCount,
        variant: BlobVariant,
    ) -> Result<ChunkedSprites> {
        let make = || -> Result<ChunkedSprites> {
            // First the image, whose error says whether the device can blend into it.
            let composed = Image::color_target(device, "chunks.composed", width, height, FORMAT)?;
            let way = (BlendMode::UnderTested, Primitives::Strips);
            let n_pixels = u64::from(width) * u64::from(height);
            Ok(ChunkedSprites {
                chunks: Chunks::new(device, compiler, format)?,
                sprites: Sprites::new(device, compiler, FORMAT, variant, way)?,
                n_chunks,
                stride: n_max.div_ceil(n_chunks),
                composed,
                depth: Image::depth(device, "chunks.depth", width, height)?,
                buffers: ChunkBuffers::new(device, n_pixels, n_max, n_chunks)?,
            })
        };
        make().map_err(|error| match error {
            Error::Limit { what } => Error::limit(format!(
                "draw.chunks is composed in floats: {what}; or draw.chunks = 0"
            )),
            error => error,
        })
    }

    /// Draws the first `count` entries over what `start` leaves of `target`, whose depth is
    /// overwritten.
    ///
    /// # Errors
    /// Fails if `target` does not fit the pipelines.
    pub fn record(
        &mut self,
        rec: &mut Recorder<'_>,
        buffers: &BlobBuffers<'_>,
        (target, start): (Target<'_>, LoadOp),
        view: &BlobView<'_>,
        BlobCount { n, i_first_facet }: BlobCount<'_>,
    ) -> Result<()> {
        let ChunkedSprites { chunks, sprites, n_chunks, stride, composed, .. } = self;
        let ChunkBuffers { texels, nearest, draws, known } = &self.buffers;
        let kept = match n {
            RecordCount::Known(n) => {
                rec.update(known, &KeptRecord::of(n, 1));
                known
            }
            RecordCount::Indirect(kept) => kept,
        };
        let order = OrderBuffers { entries: buffers.entries, kept, nearest, draws };
        chunks.record_order(rec, order, *n_chunks, *stride)?;
        let (depth, first) = match target.depth {
            Some(depth) => (depth, LoadOp::ClearColor),
            None => (&mut self.depth, LoadOp::Clear),
        };
        let buffers = BlobBuffers { entries: nearest, ..*buffers };
        for i in 0..*n_chunks {
            let into = Target { color: &mut *composed, depth: Some(&mut *depth) };
            let start = if i == 0 { first } else { LoadOp::Load };
            let instances = InstanceCount::Indirect(draws, 4 * i);
            let range = Range { instances, i_first: i * *stride, i_first_facet };
            sprites.record_range(rec, &buffers, (into, start), view, range)?;
            rec.copy_image(composed, texels);
            if i + 1 < *n_chunks {
                let into = Target { color: &mut *composed, depth: Some(&mut *depth) };
                chunks.record_pick(rec, texels, into, view.saturated)?;
            }
        }
        chunks.record_show(rec, texels, Target::color(target.color), start)
    }
}
