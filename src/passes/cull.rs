//! cull: keeps the drawn particles that can show in a pixel.
//!
//! In: placed particles, their extinction, the group of each, the drawn part of every group, the
//! camera. Out: sort key and index of every kept particle in ascending index, and their number.
//! Law: near plane, optical depth, bounding rectangle of the silhouette, smallest size. Source:
//! passes.md "cull". Error: none that a pixel shows; the error of a smallest size
//! is bounded there.

use super::blobs::{BlobVariant, BlobView, Depths, KeyPush};
use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder, buffers};
use crate::layout::frame::CameraRecord;
use crate::layout::record;

record! {
    /// Push constants of `cull_test.comp`.
    pub struct TestPush {
        /// The camera.
        camera: CameraRecord,
        /// Sides of a pixel, as slopes.
        pixel: [f32; 2],
        /// Radius of a blob's footprint, in σ.
        cutoff: f32,
        /// One over the optical depth at which a blob ends.
        inv_threshold: f32,
        /// Least b²/(2 σ²) at which a blob ends.
        least_cut: f32,
        /// Least σ over view depth, as a slope.
        smallest: f32,
        /// Number of particles.
        n_particles: u32,
        /// Columns of the picture.
        width: u32,
        /// Rows of the picture.
        height: u32,
    }
}

record! {
    /// Push constants of `cull_scan.comp`.
    pub struct ScanPush {
        /// Tiles of particles.
        n_tiles: u32,
        /// Entries that a workgroup of the sort takes.
        sort_tile: u32,
        /// Splats that a workgroup makes.
        splat_block: u32,
        /// The most workgroups along x of a dispatch.
        max_groups: u32,
    }
}

/// Particles of a tile; the shaders' TILE.
pub const TILE: u32 = 256;
/// Words of a tile's bits; the shaders' WORDS.
pub const WORDS: u32 = TILE / 32;

buffers! {
    /// Scratch of the pass for a number of particles.
    pub struct Scratch(n_max: u64) {
        /// Bits of the kept particles.
        masks: Buffer => [u32; 2], n_tiles(n_max) * u64::from(WORDS), "cull.masks";
        /// Number of kept particles by tile.
        totals: Buffer => u32, n_tiles(n_max), "cull.totals";
    }
}

fn n_tiles(n_max: u64) -> u64 {
    n_max.div_ceil(u64::from(TILE))
}

bindings! {
    /// The buffers of the pass.
    pub struct CullBuffers {
        /// `PlacedRecord` by particle.
        placed,
        /// `ParticleRecord` by particle.
        particles,
        /// `u32` group by particle.
        i_group,
        /// `DrawnRecord` by group.
        drawn,
        /// Output, `[u32; 2]`: sort key and particle.
        entries,
        /// Output, `KeptRecord`: number of entries.
        kept,
    }
}

/// The picture that particles are tested against.
#[derive(Debug, Clone, Copy)]
pub struct CullView<'a> {
    /// Camera and bounds of the picture.
    pub blobs: BlobView<'a>,
    /// Columns and rows of the picture.
    pub size: [u32; 2],
    /// σ on the screen below which a blob is left out, in pixels.
    pub smallest: f64,
}

/// The sort keys of kept particles, and the workgroups of the passes that follow.
#[derive(Debug, Clone, Copy)]
pub struct Order {
    /// The depths that keys are made of.
    pub depths: Depths,
    /// Entries that a workgroup of the sort takes.
    pub sort_tile: u32,
    /// Splats that a workgroup makes.
    pub splat_block: u32,
}

/// The pipelines and scratch buffers of the pass.
pub struct Cull {
    test: Kernel,
    scan: Kernel,
    write: Kernel,
    scratch: Scratch,
    max_groups: u32,
}

impl Cull {
    /// Creates the pipelines, and scratch buffers for `n_max` particles.
    ///
    /// # Errors
    /// Fails if a shader does not compile or the device cannot hold the buffers.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        n_max: u32,
        variant: BlobVariant,
    ) -> Result<Cull> {
        // A tile is one subgroup, which needs no barrier.
        let invocations = device.limits().subgroup_size.clamp(8, 32);
        let is_one_subgroup = u32::from(device.limits().is_one_subgroup(invocations));
        let macros = [("TILE_INVOCATIONS", invocations), ("ONE_SUBGROUP", is_one_subgroup)];
        let (fields, constants) = (TestPush::FIELDS, variant.constants());
        Ok(Cull {
            test: Kernel::with_macros(device, compiler, "cull.test", fields, &constants, &macros)?,
            scan: Kernel::new(device, compiler, "cull.scan", ScanPush::FIELDS)?,
            write: Kernel::new(device, compiler, "cull.write", KeyPush::FIELDS)?,
            scratch: Scratch::new(device, n_max.into())?,
            max_groups: device.limits().max_workgroups_x,
        })
    }

    /// Tests the first `n_particles` and writes the entries of those that are kept.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &CullBuffers<'_>,
        view: &CullView<'_>,
        order: &Order,
        n_particles: u32,
    ) -> Result<()> {
        let CullBuffers { placed, particles, i_group, drawn, entries, kept } = *buffers;
        let Scratch { masks, totals } = &self.scratch;
        let Order { depths, sort_tile, splat_block } = *order;
        let n_tiles = n_particles.div_ceil(TILE);
        let tested = [placed, particles, i_group, drawn, masks, totals];
        rec.dispatch_groups(&self.test, &tested, &view.push(n_particles), n_tiles)?;
        let scan = ScanPush { n_tiles, sort_tile, splat_block, max_groups: self.max_groups };
        rec.dispatch_groups(&self.scan, &[totals, kept], &scan, 1)?;
        let write = depths.push(n_particles);
        rec.dispatch(&self.write, &[placed, masks, totals, entries], &write, n_particles)
    }
}

impl CullView<'_> {
    fn push(&self, n_particles: u32) -> TestPush {
        let CullView { blobs, size: [width, height], smallest } = *self;
        let pixel = blobs.camera.pixel_slopes(width, height);
        TestPush {
            camera: *blobs.camera,
            pixel,
            cutoff: blobs.cutoff as f32,
            inv_threshold: blobs.inv_threshold(),
            least_cut: blobs.least_cut() as f32,
            smallest: (smallest * f64::from(pixel[1])) as f32,
            n_particles,
            width,
            height,
        }
    }
}
