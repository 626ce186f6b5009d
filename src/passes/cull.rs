//! cull: of the drawn particles those that can show in a pixel.
//!
//! In: placed particles, particles (κ), group of each, what is drawn of the groups, the camera.
//! Out: (key, particle) of the kept ones in ascending index, and their number. Law: near plane,
//! optical depth, silhouette's rectangle, smallest size. Source: docs/model.md §11 "cull". Error:
//! none that a pixel shows; with a smallest size, what is left out for it is bounded there.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, MemoryUsage, Recorder};
use crate::layout::frame::CameraRecord;
use crate::layout::record;

record! {
    pub struct TestPush {
        camera: CameraRecord,
        pixel: [f32; 2],
        cutoff: f32,
        inv_threshold: f32,
        smallest: f32,
        n_particles: u32,
        width: u32,
        height: u32,
    }
}

record! {
    pub struct ScanPush { n_tiles: u32, sort_tile: u32, splat_block: u32, max_groups: u32 }
}

record! {
    pub struct WritePush {
        forward: [f32; 3],
        n_particles: u32,
        depth_high: f32,
        steps_per_depth: f32,
        n_bits: u32,
    }
}

/// Particles of a tile; the shaders' TILE.
pub const TILE: u32 = 256;
/// Words of a tile's bits; the shaders' WORDS.
pub const WORDS: u32 = TILE / 32;

/// What is seen, and what of it counts.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    pub camera: &'a CameraRecord,
    pub width: u32,
    pub height: u32,
    /// Sprites end at this many σ.
    pub cutoff: f64,
    /// And where their optical depth falls under this.
    pub threshold: f64,
    /// σ on the screen that is too small, pixels.
    pub smallest: f64,
}

/// How kept particles are keyed, as the sort asks for it, and dealt to what comes after.
#[derive(Debug, Clone, Copy)]
pub struct Order {
    /// Bounds |depth| and places the 16-bit keys' range.
    pub radius: f64,
    pub n_bits: u32,
    /// Entries that a workgroup of the sort takes, and splats that one makes.
    pub sort_tile: u32,
    pub splat_block: u32,
}

pub struct Cull {
    test: Kernel,
    scan: Kernel,
    write: Kernel,
    masks: Buffer,
    totals: Buffer,
    max_groups: u32,
}

impl Cull {
    /// Room for `n_max` particles. `weighted`: κ has factors; `threshold`: there is one;
    /// `ellipsoids`: not all are balls.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        n_max: u32,
        [weighted, threshold, ellipsoids]: [bool; 3],
    ) -> Result<Cull> {
        // One subgroup a tile: it waits for itself alone.
        let invocations = device.limits().subgroup_size.clamp(8, 32);
        let together = device.limits().is_one_subgroup(invocations);
        let macros = [("TILE_INVOCATIONS", invocations), ("ONE_SUBGROUP", u32::from(together))];
        let constants =
            [(3, u32::from(weighted)), (5, u32::from(threshold)), (6, u32::from(ellipsoids))];
        let n_tiles = u64::from(n_max.div_ceil(TILE));
        Ok(Cull {
            test: Kernel::with_macros(
                device,
                compiler,
                "cull.test",
                TestPush::FIELDS,
                &constants,
                &macros,
            )?,
            scan: Kernel::new(device, compiler, "cull.scan", ScanPush::FIELDS, &[])?,
            write: Kernel::new(device, compiler, "cull.write", WritePush::FIELDS, &[])?,
            masks: Buffer::new::<[u32; 2]>(
                device,
                "cull.masks",
                n_tiles * u64::from(WORDS),
                MemoryUsage::Device,
            )?,
            totals: Buffer::new::<u32>(device, "cull.totals", n_tiles, MemoryUsage::Device)?,
            max_groups: device.limits().max_workgroups_x,
        })
    }

    /// Of the drawn ones of the first `n_particles` of `placed` (PlacedRecord) those that can show
    /// go to `entries` ([key, particle]), and their number to `kept` (KeptRecord). `particles`:
    /// ParticleRecord; `i_group`: u32 by particle; `drawn`: DrawnRecord.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        [placed, particles, i_group, drawn, entries, kept]: [&Buffer; 6],
        view: &View<'_>,
        order: &Order,
        n_particles: u32,
    ) -> Result<()> {
        let Order { radius, n_bits, sort_tile, splat_block } = *order;
        let (n_tiles, test) = (n_particles.div_ceil(TILE), view.push(n_particles));
        let tested = [placed, particles, i_group, drawn, &self.masks, &self.totals];
        rec.dispatch_groups(&self.test, &tested, &test, n_tiles)?;
        let scan = ScanPush { n_tiles, sort_tile, splat_block, max_groups: self.max_groups };
        rec.dispatch_groups(&self.scan, &[&self.totals, kept], &scan, 1)?;
        // A scene without extent has one depth: any finite factor gives one key.
        let steps_per_depth = if radius > 0.0 { (65536.0 / (2.0 * radius)) as f32 } else { 0.0 };
        let forward = view.camera.forward;
        let write =
            WritePush { forward, n_particles, depth_high: radius as f32, steps_per_depth, n_bits };
        rec.dispatch(
            &self.write,
            &[placed, &self.masks, &self.totals, entries],
            &write,
            n_particles,
        )
    }
}

impl View<'_> {
    fn push(&self, n_particles: u32) -> TestPush {
        let View { camera, width, height, cutoff, threshold, smallest } = *self;
        let pixel = [2.0 * camera.tan_x / width as f32, 2.0 * camera.tan_y / height as f32];
        TestPush {
            camera: *camera,
            pixel,
            cutoff: cutoff as f32,
            inv_threshold: (1.0 / threshold) as f32,
            smallest: (smallest * f64::from(pixel[1])) as f32,
            n_particles,
            width,
            height,
        }
    }
}
