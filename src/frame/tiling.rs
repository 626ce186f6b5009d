//! Blobs drawn by the tile passes: splats, their pairs sorted by bin, and the pictures.

use super::features::blob_variant;
use crate::error::{Error, Result};
use crate::gpu::{
    Buffer, Compiler, Device, MemoryUsage, RecordCount, Recorder, Target, TargetFormat,
};
use crate::model::overlap::MAX_SLICES;
use crate::model::scene::Scene;
use crate::passes::blobs::{BlobBuffers, BlobCount, BlobView};
use crate::passes::sort::{Count, Sort, TILE};
use crate::passes::tiles::{self, Division, Tiles, Variant, invocations};

/// The pass bounds its loops by the slices of a scene.
const _: () = assert!(MAX_SLICES + 2.0 <= tiles::MAX_SLICES as f64);

/// The tile passes and their pictures.
pub struct Tiling {
    tiles: Tiles,
    sort: Sort,
    n_bits: u32,
    /// The pictures, pixels by rows from the top.
    pub pictures: Vec<Buffer>,
}

impl Tiling {
    /// Creates `n_pictures` pictures of `division` for at most `n_max` particles.
    ///
    /// # Errors
    /// Fails if there are too many particles or pixels for the device, or a shader does not
    /// compile.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        division: Division,
        n_max: u32,
        n_pictures: usize,
        variant: &Variant,
    ) -> Result<Tiling> {
        let tiles = Tiles::new(device, compiler, division, n_max, variant)?;
        let bytes = division.n_pixels() * variant.format.bytes_per_pixel();
        let picture =
            |i| Buffer::new::<u8>(device, &format!("tiles.{i}"), bytes, MemoryUsage::Device);
        let n_bits = division.n_bits();
        Ok(Tiling {
            sort: Sort::for_bits(device, compiler, tiles.capacity(), n_bits)?,
            tiles,
            n_bits,
            pictures: (0..n_pictures).map(picture).collect::<Result<_>>()?,
        })
    }

    /// Creates `n_pictures` pictures of `scene` of `size` pixels; `has_under` if they are composed
    /// over another picture.
    pub(super) fn of_scene(
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
        [width, height]: [u32; 2],
        n_pictures: usize,
        (format, has_under): (TargetFormat, bool),
    ) -> Result<Tiling> {
        // A particle takes three texels, the light of a facet four.
        let n_bytes = 16 * (3 * scene.n_particles()).max(4 * scene.n_facets());
        let most = device.limits().max_texel_buffer_bytes(16);
        if n_bytes > most {
            return Err(Error::limit(format!(
                "draw.path = \"tiles\": {n_bytes} bytes of particles or facets are wanted, this \
                 device reads {most} at most (maxTexelBufferElements); expected \"sprites\""
            )));
        }
        let division = Division::new(width, height, invocations(device.limits()))?;
        let variant = Variant {
            blobs: blob_variant(scene),
            format,
            has_under,
            slices: scene.draw.n_parts(),
            sharing: None,
            max_pairs: None,
            max_tiles: None,
        };
        let n_max = scene.n_particles() as u32;
        Tiling::new(device, compiler, division, n_max, n_pictures, &variant)
    }

    /// Draws the first `count` entries into picture `i`, over `under` if there is one.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        i: usize,
        under: Option<Target<'_>>,
        buffers: &BlobBuffers<'_>,
        view: &BlobView<'_>,
        count: BlobCount<'_>,
    ) -> Result<()> {
        let Tiling { tiles, sort, n_bits, pictures } = self;
        let picture = &pictures[i];
        tiles.record_start(rec, under, picture);
        if matches!(count.n, RecordCount::Known(0)) {
            return Ok(());
        }
        tiles.record_splats(rec, buffers, view, count, TILE)?;
        for i_round in 0..tiles.n_rounds(view) {
            let (entries, n) = tiles.record_pairs(rec, i_round, count.n, view)?;
            let sorted = sort.record(rec, entries, *n_bits, Count::Counted(n))?;
            let from = [sorted, picture, buffers.pool, buffers.seen];
            tiles.record_compose(rec, i_round, from, view)?;
        }
        Ok(())
    }
}
