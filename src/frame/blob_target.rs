//! A target that blobs are drawn into. The full picture, the smaller one of `draw.resolution` and
//! impostor layers are such targets.

use super::chunked_sprites::{ChunkBuffers, ChunkCount, ChunkedSprites};
use super::features::blob_variant;
use super::tiling::Tiling;
use crate::error::{Error, Result};
use crate::gpu::{
    BlendMode, Buffer, BufferSpec, Compiler, DEPTH_BYTES_PER_PIXEL, Device, Image, LoadOp,
    Primitives, Recorder, Target, TargetFormat,
};
use crate::model::scene::{Chunks, DrawPath, Scene};
use crate::passes::blobs::{BlobBuffers, BlobCount, BlobView};
use crate::passes::chunks;
use crate::passes::sprites::Sprites;

/// The size and format of a target, and what is drawn into it.
#[derive(Debug, Clone, Copy)]
pub(super) struct TargetSpec {
    /// Columns and rows.
    pub size: [u32; 2],
    pub format: TargetFormat,
    /// Pictures of this size: one is drawn while the other is read.
    pub n_pictures: usize,
    /// Surfaces or terrain are drawn first, with depth.
    pub has_depth: bool,
    /// An impostor layer may be drawn first.
    pub has_layer: bool,
    /// Blobs are drawn.
    pub has_blobs: bool,
    /// Chunks that sprites are drawn in, near to far; 0 draws them far to near.
    pub n_chunks: u32,
}

impl TargetSpec {
    /// Returns whether the graphics pipeline draws into the target.
    fn has_images(&self, path: DrawPath) -> bool {
        let draws_sprites = self.has_blobs && path != DrawPath::Tiles;
        draws_sprites || self.has_depth || self.has_layer
    }

    /// Lists the sizes of the images and of the buffers that chunks take.
    pub fn specs(&self, scene: &Scene) -> Vec<BufferSpec> {
        let n_pixels = u64::from(self.size[0]) * u64::from(self.size[1]);
        let image = |name, record_bytes, n_copies| BufferSpec {
            name,
            n: n_pixels,
            record_bytes,
            n_copies,
            texels: None,
        };
        let mut specs = vec![];
        if self.has_images(scene.draw.path) {
            specs.push(image("picture", self.format.bytes_per_pixel(), self.n_pictures as u64));
        }
        if self.has_depth {
            specs.push(image("surfaces.depth", DEPTH_BYTES_PER_PIXEL, 1));
        }
        if self.has_blobs && scene.draw.path == DrawPath::Tiles {
            specs.push(image("tiles", self.format.bytes_per_pixel(), self.n_pictures as u64));
        } else if self.has_blobs && self.n_chunks > 0 {
            let n_max = scene.n_particles() as u32;
            specs.push(image("chunks.composed", chunks::FORMAT.bytes_per_pixel(), 1));
            specs.push(image("chunks.depth", DEPTH_BYTES_PER_PIXEL, 1));
            specs.extend(ChunkBuffers::specs(n_pixels, n_max, self.n_chunks));
        }
        specs
    }
}

/// Returns the number of chunks of `draw.chunks`.
pub(super) fn n_chunks(scene: &Scene) -> u32 {
    match scene.draw.chunks {
        Chunks::Of(n) => n,
        Chunks::Auto => 0,
    }
}

/// The way in which blobs are drawn.
enum Method {
    /// Far to near.
    Sprites(Box<Sprites>),
    /// Near to far.
    Chunks(Box<ChunkedSprites>),
    /// In compute shaders, near to far.
    Tiles(Box<Tiling>),
}

/// A target and the pipelines that draw blobs into it.
pub(super) struct BlobTarget {
    /// Color images, by picture; empty if only compute shaders draw.
    images: Vec<Image>,
    /// Depth of surfaces and terrain.
    depth: Option<Image>,
    method: Option<Method>,
}

impl BlobTarget {
    /// Creates a target for `scene`, in which no knob is "auto".
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
        spec: &TargetSpec,
    ) -> Result<BlobTarget> {
        let TargetSpec { size, format, n_pictures, has_depth, has_layer, n_chunks, .. } = *spec;
        let [width, height] = size;
        let (path, variant) = (scene.draw.path, blob_variant(scene));
        let image = |i| Image::color_target(device, &format!("picture.{i}"), width, height, format);
        let method = || -> Result<Method> {
            if path == DrawPath::Tiles {
                let under = (format, has_depth || has_layer);
                let tiling = Tiling::of_scene(device, compiler, scene, size, n_pictures, under)?;
                return Ok(Method::Tiles(Box::new(tiling)));
            }
            if n_chunks > 0 {
                let count = ChunkCount { n_max: scene.n_particles() as u32, n_chunks };
                let chunks = ChunkedSprites::new(device, compiler, size, format, count, variant)?;
                return Ok(Method::Chunks(Box::new(chunks)));
            }
            let blend = if has_depth { BlendMode::OverTested } else { BlendMode::Over };
            let way = (blend, Primitives::Points);
            let sprites = Sprites::new(device, compiler, format, variant, way)?;
            Ok(Method::Sprites(Box::new(sprites)))
        };
        let depth = || Image::depth(device, "surfaces.depth", width, height);
        let n_images = if spec.has_images(path) { n_pictures } else { 0 };
        Ok(BlobTarget {
            method: spec.has_blobs.then(method).transpose()?,
            images: (0..n_images).map(image).collect::<Result<_>>()?,
            depth: has_depth.then(depth).transpose()?,
        })
    }

    /// Returns picture `i` as the graphics pipeline draws into it.
    pub fn target(&mut self, i: usize) -> Option<Target<'_>> {
        self.images.get_mut(i).map(|color| Target { color, depth: self.depth.as_mut() })
    }

    /// Returns the depth that surfaces and terrain have drawn.
    pub fn depth(&mut self) -> Option<&mut Image> {
        self.depth.as_mut()
    }

    /// Draws the first `count` entries into picture `i`: over what it holds if it has depth or
    /// `has_layer` says that an impostor layer has been drawn, else over nothing.
    pub fn record_blobs(
        &mut self,
        rec: &mut Recorder<'_>,
        i: usize,
        has_layer: bool,
        buffers: &BlobBuffers<'_>,
        view: &BlobView<'_>,
        count: BlobCount<'_>,
    ) -> Result<()> {
        let is_over = self.depth.is_some() || has_layer;
        let start = if is_over { LoadOp::Load } else { LoadOp::Clear };
        let target =
            self.images.get_mut(i).map(|color| Target { color, depth: self.depth.as_mut() });
        match (&mut self.method, target) {
            (Some(Method::Tiles(tiling)), target) => {
                tiling.record(rec, i, target.filter(|_| is_over), buffers, view, count)
            }
            (Some(Method::Sprites(sprites)), Some(target)) => {
                sprites.record(rec, buffers, (target, start), view, count)
            }
            (Some(Method::Chunks(chunks)), Some(target)) => {
                chunks.record(rec, buffers, (target, start), view, count)
            }
            _ => Err(Error::usage("the target has no pipeline that draws blobs")),
        }
    }

    /// Returns the buffer of picture `i`, if tiles draw it.
    pub fn buffer(&self, i: usize) -> Option<&Buffer> {
        match &self.method {
            Some(Method::Tiles(tiling)) => Some(&tiling.pictures[i]),
            _ => None,
        }
    }

    /// Copies picture `i` with its blobs to a buffer.
    pub fn record_copy(&mut self, rec: &mut Recorder<'_>, i: usize, to: &Buffer) {
        match (&self.method, self.images.get_mut(i)) {
            (Some(Method::Tiles(tiling)), _) => rec.copy(&tiling.pictures[i], to),
            (_, Some(image)) => rec.copy_image(image, to),
            _ => {}
        }
    }

    /// Copies the colors and the depth that surfaces and terrain have drawn.
    pub fn record_copy_solids(
        &mut self,
        rec: &mut Recorder<'_>,
        i: usize,
        colors: Option<&Buffer>,
        depths: &Buffer,
    ) {
        if let Some(Target { color, depth: Some(depth) }) = self.target(i) {
            if let Some(colors) = colors {
                rec.copy_image(color, colors);
            }
            rec.copy_image(depth, depths);
        }
    }
}
