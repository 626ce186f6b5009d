//! Blobs drawn near to far in chunks, what is full left out from one to the next (docs/model.md §11
//! "chunks").

use crate::error::{Error, Result};
use crate::gpu::TargetFormat;
use crate::gpu::{
    Buffer, Compiler, Device, Image, InstanceCount, LoadOp, MemoryUsage, RecordCount, Recorder,
    Target,
};
use crate::layout::cull::KeptRecord;
use crate::layout::frame::CameraRecord;
use crate::passes::chunks::{Chunks as Pass, FORMAT};
use crate::passes::sprites::{Chunk, Sprites};

/// What is drawn, and how it ends.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    pub camera: &'a CameraRecord,
    /// Sprites end at this many σ, and where their optical depth falls under this.
    pub cuts: [f64; 2],
    /// What lies behind a pixel that lets less than this through may be left out.
    pub saturated: f64,
}

/// What they are composed in, and what orders them.
pub struct Chunks {
    pass: Pass,
    sprites: Sprites,
    n_chunks: u32,
    /// Places of each.
    stride: u32,
    composed: Image,
    /// Where no surface is drawn.
    depth: Image,
    texels: Buffer,
    /// Entries, near to far.
    nearest: Buffer,
    /// A draw's four words a chunk.
    draws: Buffer,
    /// What the host knows of the number of entries, where it does.
    known: Buffer,
}

impl Chunks {
    /// For pictures of `size` in `format`, of at most `n_max` particles in `n_chunks`. `variant` as
    /// in [`Sprites::under`].
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        [width, height]: [u32; 2],
        format: TargetFormat,
        [n_max, n_chunks]: [u32; 2],
        variant: [bool; 6],
    ) -> Result<Chunks> {
        let named = |error| match error {
            Error::Limit { what } => Error::limit(format!(
                "draw.chunks is composed in floats: {what}; or draw.chunks = 0"
            )),
            error => error,
        };
        let stride = n_max.div_ceil(n_chunks);
        let (n_texels, n_places) =
            (u64::from(width) * u64::from(height), u64::from(stride) * u64::from(n_chunks));
        let image = |name| Image::color_target(device, name, width, height, FORMAT);
        // First: it tells whether the device can blend into it.
        let composed = image("chunks.composed").map_err(named)?;
        Ok(Chunks {
            pass: Pass::new(device, compiler, format)?,
            sprites: Sprites::under(device, compiler, FORMAT, variant)?,
            n_chunks,
            stride,
            composed,
            depth: Image::depth(device, "chunks.depth", width, height).map_err(named)?,
            texels: Buffer::new::<[f32; 4]>(device, "chunks.texels", n_texels, MemoryUsage::Device)
                .map_err(named)?,
            nearest: Buffer::new::<[u32; 2]>(
                device,
                "chunks.nearest",
                n_places,
                MemoryUsage::Device,
            )
            .map_err(named)?,
            draws: Buffer::new::<[u32; 4]>(
                device,
                "chunks.draws",
                n_chunks.into(),
                MemoryUsage::Device,
            )?,
            known: Buffer::new::<KeptRecord>(device, "chunks.known", 1, MemoryUsage::Device)?,
        })
    }

    /// Draws what is sorted over `target`, or alone where `start` clears it. `buffers` as in
    /// `sprites`. The depth of `target` is spent.
    pub fn record(
        &mut self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 9],
        (target, start): (Target<'_>, LoadOp),
        view: &View<'_>,
        (n, i_first_facet): (RecordCount<'_>, u32),
    ) -> Result<()> {
        let Chunks { pass, sprites, composed, texels, nearest, draws, known, .. } = self;
        let (n_chunks, stride) = (self.n_chunks, self.stride);
        let kept = match n {
            RecordCount::Known(n) => {
                rec.update(known, &KeptRecord::of(n, 1));
                &*known
            }
            RecordCount::Indirect(kept) => kept,
        };
        let [entries, of_particles @ ..] = buffers;
        pass.record_order(rec, [entries, kept, nearest, draws], [n_chunks, stride])?;
        let (depth, first) = match target.depth {
            Some(depth) => (depth, LoadOp::ClearColor),
            None => (&mut self.depth, LoadOp::Clear),
        };
        for i in 0..n_chunks {
            let into = Target { color: &mut *composed, depth: Some(&mut *depth) };
            let start = if i == 0 { first } else { LoadOp::Load };
            let instances = InstanceCount::Indirect(draws, 4 * i);
            let chunk = Chunk { instances, i_first: i * stride, i_first_facet };
            let [placed, particles, lit, i_facet, i_group, drawn, textured, pool] = of_particles;
            let from = [&*nearest, placed, particles, lit, i_facet, i_group, drawn, textured, pool];
            sprites.record_chunk(rec, from, (into, start), view.camera, view.cuts, chunk)?;
            rec.copy_image(composed, texels);
            if i + 1 < n_chunks {
                let into = Target { color: &mut *composed, depth: Some(&mut *depth) };
                pass.record_pick(rec, texels, into, view.saturated)?;
            }
        }
        pass.record_show(rec, texels, (Target::color(target.color), start))
    }
}
