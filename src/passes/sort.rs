//! sort: sorts the drawn particles far to near.
//!
//! In: placed particles, group of each, the drawn part of every group, the camera's forward axis.
//! Out: key and particle in ascending key, equal keys in ascending index. Law: stable
//! least-significant-digit radix sort, at most 8 or 9 bits a pass, keys of 16 or 32 bits. Source:
//! model.md §9, passes.md. Error: none in the sort; a key holds the depth to an ulp (32
//! bits) or to 2⁻¹⁶ of the scene (16 bits).

use super::blobs::{Depths, KeyPush};
use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, DeviceCount, Kernel, Recorder, buffers};
use crate::layout::record;

record! {
    /// Push constants of `sort_count.comp`, `sort_scan.comp` and `sort_scatter.comp`.
    pub struct DigitPush {
        /// Number of entries.
        n_entries: u32,
        /// Word that holds the number of entries, or [`NO_COUNT`].
        i_count: u32,
        /// First bit of the digit.
        shift: u32,
    }
}

/// The value of `i_count` where the host knows the number of entries; the shaders' NO_COUNT.
pub const NO_COUNT: u32 = u32::MAX;
/// Entries that a workgroup sorts; the shaders' TILE.
pub const TILE: u32 = 1024;
/// Bits of a pass, the shaders' DIGIT_BITS: the number that every device takes, and the number that
/// may save a pass.
const DIGIT_BITS: u32 = 8;
const MAX_DIGIT_BITS: u32 = 9;

/// Counts of a block of the table; the shaders' COUNTS_OF_BLOCK.
const COUNTS_OF_BLOCK: u64 = 2048;
/// Entries from which on the table is scanned by blocks: one workgroup takes longer then.
const LEAST_BY_BLOCKS: u32 = 1 << 18;

/// Returns the counts of the table.
fn n_counts(n_max: u64, digit_bits: u32) -> u64 {
    n_max.div_ceil(u64::from(TILE)) << digit_bits
}

buffers! {
    /// Scratch of the pass for a number of entries and bits of a digit.
    pub struct Scratch(n_max: u64, digit_bits: u32) {
        /// Number of entries by digit and tile.
        table: Buffer => u32, n_counts(n_max, digit_bits), "sort.table";
        /// Entries on their way between passes.
        swapped: Buffer => [u32; 2], n_max, "sort.swapped";
        /// Sums of the table's blocks.
        sums: Buffer => u32, n_counts(n_max, digit_bits).div_ceil(COUNTS_OF_BLOCK), "sort.sums";
    }
}

impl Scratch {
    /// Lists the sizes of the scratch buffers of [`Sort::new`].
    pub fn specs_of_bytes(n_max: u64) -> Vec<crate::gpu::BufferSpec> {
        Scratch::specs(n_max, DIGIT_BITS)
    }
}

/// A number of entries to sort, and where the device holds it.
#[derive(Clone, Copy)]
pub enum Count<'a> {
    /// The host knows the number.
    Known(u32),
    /// The device has written it, and a workgroup for each tile.
    Counted(DeviceCount<'a>),
}

/// How a device sorts. Both forms give the same order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Form {
    /// Invocations of a subgroup find equal digits by ballots.
    pub ballots: bool,
    /// The table is scanned by blocks, in parallel over the device.
    pub blocks: bool,
}

impl Form {
    /// Returns the form that suits a device and a number of entries. A CPU runs few workgroups at
    /// once, and looks at memory faster than it votes.
    fn of(device: &Device, n_max: u32) -> Form {
        let is_wide = device.info().kind != "cpu";
        let limits = device.limits();
        Form {
            ballots: is_wide && limits.is_one_subgroup(ballot_invocations(device)),
            blocks: is_wide && n_max >= LEAST_BY_BLOCKS,
        }
    }
}

/// Returns the invocations of a workgroup that sorts by ballots.
fn ballot_invocations(device: &Device) -> u32 {
    device.limits().subgroup_size.clamp(8, 64)
}

/// The pipelines and scratch buffers of the pass.
pub struct Sort {
    key: Kernel,
    count: Kernel,
    scan: Scan,
    scatter: Kernel,
    scratch: Scratch,
    digit_bits: u32,
}

/// The kernels that scan the table.
enum Scan {
    /// In one workgroup.
    Alone(Kernel),
    /// Sums of blocks, their scan, and a scan of each block.
    Blocks(Box<[Kernel; 3]>),
}

impl Sort {
    /// Creates a sort of at most `n_max` entries with keys of whole bytes.
    ///
    /// # Errors
    /// Fails if a shader does not compile or the device cannot hold the scratch buffers.
    pub fn new(device: &Device, compiler: &Compiler, n_max: u32) -> Result<Sort> {
        Sort::with_form(device, compiler, n_max, DIGIT_BITS, Form::of(device, n_max))
    }

    /// Creates a sort of at most `n_max` entries with keys of `n_bits`, in as few passes as
    /// possible.
    ///
    /// # Errors
    /// Fails if a shader does not compile or the device cannot hold the scratch buffers.
    pub fn for_bits(device: &Device, compiler: &Compiler, n_max: u32, n_bits: u32) -> Result<Sort> {
        let (limits, form) = (device.limits(), Form::of(device, n_max));
        // By ballots a digit has a word. Otherwise every invocation has the counters of a tile, two
        // a word. Each invocation of a scan has a digit.
        let words = match form.ballots {
            true => 1 << MAX_DIGIT_BITS,
            false => (1 << MAX_DIGIT_BITS) / 2 * limits.subgroup_size.clamp(8, 32),
        };
        let fits = 4 * words <= limits.max_shared_memory_bytes
            && 1 << MAX_DIGIT_BITS <= limits.max_workgroup_invocations;
        let n_passes = n_bits.div_ceil(if fits { MAX_DIGIT_BITS } else { DIGIT_BITS });
        let digit_bits = n_bits.div_ceil(n_passes.max(1)).max(1);
        Sort::with_form(device, compiler, n_max, digit_bits, form)
    }

    /// Creates a sort of a given form, by digits of `digit_bits`.
    ///
    /// # Errors
    /// Fails if a shader does not compile or the device cannot hold the scratch buffers.
    pub fn with_form(
        device: &Device,
        compiler: &Compiler,
        n_max: u32,
        digit_bits: u32,
        form: Form,
    ) -> Result<Sort> {
        // A tile is one subgroup. Without ballots shared memory holds the counters of 32 at most.
        let invocations = match form.ballots {
            true => ballot_invocations(device),
            false => device.limits().subgroup_size.clamp(8, 32),
        };
        let is_one_subgroup = u32::from(device.limits().is_one_subgroup(invocations));
        let macros = [
            ("TILE_INVOCATIONS", invocations),
            ("ONE_SUBGROUP", is_one_subgroup),
            ("DIGIT_BITS", digit_bits),
            ("BALLOT", u32::from(form.ballots)),
        ];
        let kernel = |name, macros: &[_]| {
            Kernel::with_macros(device, compiler, name, DigitPush::FIELDS, &[], macros)
        };
        // A scan has an invocation a digit or eight counts, in whatever subgroups that makes.
        let of_scan = &macros[2..3];
        Ok(Sort {
            key: Kernel::new(device, compiler, "sort.key", KeyPush::FIELDS)?,
            count: kernel("sort.count", &macros[..3])?,
            scan: match form.blocks {
                false => Scan::Alone(kernel("sort.scan", of_scan)?),
                true => Scan::Blocks(Box::new([
                    kernel("sort.sums", of_scan)?,
                    kernel("sort.bases", of_scan)?,
                    kernel("sort.spread", of_scan)?,
                ])),
            },
            scatter: kernel("sort.scatter", &macros)?,
            scratch: Scratch::new(device, n_max.into(), digit_bits)?,
            digit_bits,
        })
    }

    /// Writes the keys of the drawn particles to `entries` (`[u32; 2]`: key and particle).
    ///
    /// `placed`: `PlacedRecord`; `i_group`: `u32` by particle; `drawn`: `DrawnRecord` by group.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record_keys(
        &self,
        rec: &mut Recorder<'_>,
        [placed, i_group, drawn, entries]: [&Buffer; 4],
        depths: &Depths,
        n_particles: u32,
    ) -> Result<()> {
        let (buffers, push) = ([placed, i_group, drawn, entries], depths.push(n_particles));
        rec.dispatch(&self.key, &buffers, &push, n_particles)
    }

    /// Sorts `entries` by the low `n_bits` of their keys and returns the buffer that holds the
    /// result. A sort of [`Sort::new`] takes an even number of passes for 16 and 32 bits, so its
    /// result is in `entries`.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record<'a>(
        &'a self,
        rec: &mut Recorder<'_>,
        entries: &'a Buffer,
        n_bits: u32,
        n: Count<'_>,
    ) -> Result<&'a Buffer> {
        let Scratch { table, swapped, .. } = &self.scratch;
        let (mut from, mut to) = (entries, swapped);
        for shift in (0..n_bits).step_by(self.digit_bits as usize) {
            match n {
                Count::Known(n_entries) => {
                    let push = DigitPush { n_entries, i_count: NO_COUNT, shift };
                    let n = n_entries.div_ceil(TILE);
                    rec.dispatch_groups(&self.count, &[from, from, table], &push, n)?;
                    self.record_scan(rec, from, &push, |rec, kernel, buffers| {
                        rec.dispatch_groups(kernel, buffers, &push, n)
                    })?;
                    rec.dispatch_groups(&self.scatter, &[from, from, table, to], &push, n)?;
                }
                Count::Counted(DeviceCount { buffer, i_count, i_groups }) => {
                    let push = DigitPush { n_entries: 0, i_count, shift };
                    let n = (buffer, i_groups);
                    rec.dispatch_indirect(&self.count, &[buffer, from, table], &push, n)?;
                    self.record_scan(rec, buffer, &push, |rec, kernel, buffers| {
                        rec.dispatch_indirect(kernel, buffers, &push, n)
                    })?;
                    rec.dispatch_indirect(&self.scatter, &[buffer, from, table, to], &push, n)?;
                }
            }
            std::mem::swap(&mut from, &mut to);
        }
        Ok(from)
    }

    /// Scans the table to an exclusive prefix sum. `counted` holds the number of entries, and
    /// `by_tiles` dispatches a kernel with a workgroup a tile of entries. Blocks need fewer.
    fn record_scan<'a>(
        &'a self,
        rec: &mut Recorder<'_>,
        counted: &'a Buffer,
        push: &DigitPush,
        by_tiles: impl Fn(&mut Recorder<'_>, &Kernel, &[&'a Buffer]) -> Result<()>,
    ) -> Result<()> {
        let Scratch { table, sums, .. } = &self.scratch;
        // Of a known number of 0 no workgroup runs.
        let n = if push.i_count == NO_COUNT { push.n_entries.min(1) } else { 1 };
        match &self.scan {
            Scan::Alone(scan) => rec.dispatch_groups(scan, &[counted, table], push, n),
            Scan::Blocks(kernels) => {
                let [of_blocks, bases, spread] = &**kernels;
                by_tiles(rec, of_blocks, &[counted, table, sums])?;
                rec.dispatch_groups(bases, &[counted, sums], push, n)?;
                by_tiles(rec, spread, &[counted, table, sums])
            }
        }
    }
}
