//! sort: the drawn particles far to near.
//!
//! In: placed particles, group of each, what is drawn of the groups, the camera's forward. Out: (key, particle) in ascending key, ties in ascending index. Law:
//! stable least-significant-digit radix sort, 8 bits a pass, keys of 16 or 32 bits. Source: docs/model.md §9, §11.
//! Error: none in the sort; a key holds the depth to an ulp (32 bits) or to 2⁻¹⁶ of the scene (16 bits).

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Place, Recorder};
use crate::layout::record;

record! {
    pub struct KeyPush {
        forward: [f32; 3],
        n_particles: u32,
        depth_high: f32,
        steps_per_depth: f32,
        n_bits: u32,
    }
}

record! {
    pub struct DigitPush { n_entries: u32, n_tiles: u32, shift: u32 }
}

/// Entries a workgroup sorts; the shaders' TILE.
const TILE: u32 = 1024;
const DIGIT_BITS: u32 = 8;
const N_DIGITS: u64 = 1 << DIGIT_BITS;

pub struct Sort {
    key: Kernel,
    count: Kernel,
    scan: Kernel,
    scatter: Kernel,
    table: Buffer,
    swapped: Buffer,
}

impl Sort {
    /// Room for `n_max` entries.
    pub fn new(device: &Device, compiler: &Compiler, n_max: u32) -> Result<Sort> {
        // One subgroup a tile, and no more than shared memory holds counters for.
        let macros = [("TILE_INVOCATIONS", device.limits().subgroup_size.clamp(8, 32))];
        let kernel = |name, push| Kernel::with_macros(device, compiler, name, push, &[], &macros);
        Ok(Sort {
            key: kernel("sort.key", KeyPush::FIELDS)?,
            count: kernel("sort.count", DigitPush::FIELDS)?,
            scan: kernel("sort.scan", DigitPush::FIELDS)?,
            scatter: kernel("sort.scatter", DigitPush::FIELDS)?,
            table: Buffer::new::<u32>(device, "sort.table", N_DIGITS * u64::from(n_max.div_ceil(TILE)), Place::Device)?,
            swapped: Buffer::new::<[u32; 2]>(device, "sort.swapped", u64::from(n_max), Place::Device)?,
        })
    }

    /// Writes the keys of the drawn particles of `placed` (PlacedRecord) to `entries` ([key, particle]), as `i_group` (u32) and
    /// `drawn` (DrawnRecord) say. `radius` bounds |depth| and places the 16-bit keys' range.
    pub fn record_keys(
        &self,
        rec: &mut Recorder<'_>,
        [placed, i_group, drawn, entries]: [&Buffer; 4],
        forward: [f32; 3],
        n_particles: u32,
        radius: f64,
        n_bits: u32,
    ) -> Result<()> {
        // A scene without extent has one depth: any finite factor gives one key.
        let steps_per_depth = if radius > 0.0 { (65536.0 / (2.0 * radius)) as f32 } else { 0.0 };
        let push = KeyPush { forward, n_particles, depth_high: radius as f32, steps_per_depth, n_bits };
        rec.dispatch(&self.key, &[placed, i_group, drawn, entries], &push, n_particles)
    }

    /// Sorts the first `n_entries` of `entries` by the low `n_bits` (16 or 32) of their keys, in place.
    pub fn record(&self, rec: &mut Recorder<'_>, entries: &Buffer, n_entries: u32, n_bits: u32) -> Result<()> {
        let n_tiles = n_entries.div_ceil(TILE);
        let (mut from, mut to) = (entries, &self.swapped);
        // Both key widths take an even number of passes, so the result ends in `entries`.
        for shift in (0..n_bits).step_by(DIGIT_BITS as usize) {
            let push = DigitPush { n_entries, n_tiles, shift };
            rec.dispatch_groups(&self.count, &[from, &self.table], &push, n_tiles)?;
            rec.dispatch_groups(&self.scan, &[&self.table], &push, 1)?;
            rec.dispatch_groups(&self.scatter, &[from, &self.table, to], &push, n_tiles)?;
            std::mem::swap(&mut from, &mut to);
        }
        Ok(())
    }
}
