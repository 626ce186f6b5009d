//! sort: the drawn particles far to near.
//!
//! In: placed particles, group of each, what is drawn of the groups, the camera's forward. Out:
//! (key, particle) in ascending key, ties in ascending index. Law: stable least-significant-digit
//! radix sort, 8 or 9 bits a pass at most, keys of 16 or 32 bits. Source: docs/model.md §9, §11.
//! Error: none in the sort; a key holds the depth to an ulp (32 bits) or to 2⁻¹⁶ of the scene (16
//! bits).

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, MemoryUsage, Recorder};
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
    pub struct DigitPush { n_entries: u32, i_count: u32, shift: u32 }
}

/// The shaders' NO_COUNT.
pub const NO_COUNT: u32 = u32::MAX;
/// Entries a workgroup sorts; the shaders' TILE.
pub const TILE: u32 = 1024;
/// Bits of a pass, the shaders' DIGIT_BITS: as many everywhere, and where a pass fewer is to be had
/// by it.
const DIGIT_BITS: u32 = 8;
const MOST_DIGIT_BITS: u32 = 9;

pub struct Sort {
    key: Kernel,
    count: Kernel,
    scan: Kernel,
    scatter: Kernel,
    table: Buffer,
    swapped: Buffer,
    digit_bits: u32,
}

impl Sort {
    /// Room for `n_max` entries, for keys of whole bytes.
    pub fn new(device: &Device, compiler: &Compiler, n_max: u32) -> Result<Sort> {
        Sort::by_digits(device, compiler, n_max, DIGIT_BITS)
    }

    /// Room for `n_max` entries, for keys of `n_bits`: in as few passes as may be, of as few bits.
    pub fn for_bits(device: &Device, compiler: &Compiler, n_max: u32, n_bits: u32) -> Result<Sort> {
        let limits = device.limits();
        // Counters of a tile, two a word, for every invocation; and an invocation a digit.
        let words = (1 << MOST_DIGIT_BITS) / 2 * limits.subgroup_size.clamp(8, 32);
        let fits = 4 * words <= limits.max_shared_memory_bytes
            && 1 << MOST_DIGIT_BITS <= limits.max_workgroup_invocations;
        let n_passes = n_bits.div_ceil(if fits { MOST_DIGIT_BITS } else { DIGIT_BITS });
        Sort::by_digits(device, compiler, n_max, n_bits.div_ceil(n_passes.max(1)).max(1))
    }

    fn by_digits(
        device: &Device,
        compiler: &Compiler,
        n_max: u32,
        digit_bits: u32,
    ) -> Result<Sort> {
        // One subgroup a tile, and no more than shared memory holds counters for.
        let invocations = device.limits().subgroup_size.clamp(8, 32);
        let together = device.limits().is_one_subgroup(invocations);
        let macros = [
            ("TILE_INVOCATIONS", invocations),
            ("ONE_SUBGROUP", u32::from(together)),
            ("DIGIT_BITS", digit_bits),
        ];
        let kernel = |name, push| Kernel::with_macros(device, compiler, name, push, &[], &macros);
        Ok(Sort {
            key: Kernel::new(device, compiler, "sort.key", KeyPush::FIELDS, &[])?,
            count: kernel("sort.count", DigitPush::FIELDS)?,
            // An invocation a digit: as many as that takes, in whatever subgroups.
            scan: Kernel::with_macros(
                device,
                compiler,
                "sort.scan",
                DigitPush::FIELDS,
                &[],
                &macros[2..],
            )?,
            scatter: kernel("sort.scatter", DigitPush::FIELDS)?,
            table: Buffer::new::<u32>(
                device,
                "sort.table",
                u64::from(n_max.div_ceil(TILE)) << digit_bits,
                MemoryUsage::Device,
            )?,
            swapped: Buffer::new::<[u32; 2]>(
                device,
                "sort.swapped",
                u64::from(n_max),
                MemoryUsage::Device,
            )?,
            digit_bits,
        })
    }

    /// Writes the keys of the drawn particles of `placed` (PlacedRecord) to `entries` ([key,
    /// particle]), as `i_group` (u32) and `drawn` (DrawnRecord) say. `radius` bounds |depth| and
    /// places the 16-bit keys' range.
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
        let push =
            KeyPush { forward, n_particles, depth_high: radius as f32, steps_per_depth, n_bits };
        rec.dispatch(&self.key, &[placed, i_group, drawn, entries], &push, n_particles)
    }

    /// Sorts the first `n_entries` of `entries` by the low `n_bits` (16 or 32) of their keys, in
    /// place.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        entries: &Buffer,
        n_entries: u32,
        n_bits: u32,
    ) -> Result<()> {
        // Both key widths take an even number of passes, so the result ends in `entries`.
        self.record_passes(rec, entries, n_bits, Entries::Known(n_entries)).map(|_| ())
    }

    /// Sorts as many of `entries` as a count on the device says, by the low `n_bits` of their keys.
    /// Gives the buffer that they then lie in.
    pub fn record_counted<'a>(
        &'a self,
        rec: &mut Recorder<'_>,
        entries: &'a Buffer,
        n_bits: u32,
        counts: Counts<'_>,
    ) -> Result<&'a Buffer> {
        self.record_passes(rec, entries, n_bits, Entries::Counted(counts))
    }

    fn record_passes<'a>(
        &'a self,
        rec: &mut Recorder<'_>,
        entries: &'a Buffer,
        n_bits: u32,
        n: Entries<'_>,
    ) -> Result<&'a Buffer> {
        let (mut from, mut to) = (entries, &self.swapped);
        for shift in (0..n_bits).step_by(self.digit_bits as usize) {
            match n {
                Entries::Known(n_entries) => {
                    let push = DigitPush { n_entries, i_count: NO_COUNT, shift };
                    let n_tiles = n_entries.div_ceil(TILE);
                    rec.dispatch_groups(&self.count, &[from, from, &self.table], &push, n_tiles)?;
                    rec.dispatch_groups(&self.scan, &[from, &self.table], &push, n_tiles.min(1))?;
                    rec.dispatch_groups(
                        &self.scatter,
                        &[from, from, &self.table, to],
                        &push,
                        n_tiles,
                    )?;
                }
                Entries::Counted(c) => {
                    let push = DigitPush { n_entries: 0, i_count: c.i_count, shift };
                    let tiles = (c.buffer, c.i_groups);
                    rec.dispatch_indirect(
                        &self.count,
                        &[c.buffer, from, &self.table],
                        &push,
                        tiles,
                    )?;
                    rec.dispatch_groups(&self.scan, &[c.buffer, &self.table], &push, 1)?;
                    rec.dispatch_indirect(
                        &self.scatter,
                        &[c.buffer, from, &self.table, to],
                        &push,
                        tiles,
                    )?;
                }
            }
            std::mem::swap(&mut from, &mut to);
        }
        Ok(from)
    }
}

/// A number of entries that the device knows.
#[derive(Clone, Copy)]
pub struct Counts<'a> {
    pub buffer: &'a Buffer,
    /// The word of `buffer` that holds the number of entries.
    pub i_count: u32,
    /// The first of the three that hold the workgroups: (tiles of them, 1, 1).
    pub i_groups: u32,
}

#[derive(Clone, Copy)]
enum Entries<'a> {
    Known(u32),
    Counted(Counts<'a>),
}
