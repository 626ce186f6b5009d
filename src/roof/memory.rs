//! Loads of memory: a set of buffers is read, written and copied by kernels and by transfers.

use super::load::{Load, expect_same, words};
use crate::error::Result;
use crate::gpu::{Buffer, Commands, Compiler, Device, Kernel, MemoryUsage, Recorder};
use crate::layout::roof::{COPY, ELEMENT_BYTES, LANES, MemoryPush, READ, READ_TEXELS, WRITE};

/// Most workgroups of a dispatch: they fill every GPU.
const MOST_GROUPS: u32 = 4096;
/// Most elements that an invocation passes over: drivers end long loops (llvmpipe at 65,535).
const MOST_ITERATIONS: u32 = 60_000;
/// Most commands of a transfer in a recording.
const MOST_TRANSFERS: u32 = 1024;
/// The number that the first buffer's words begin with; the next ones follow.
const SALT: u32 = 0x5a17;
/// The word that transfers fill with.
const WORD: u32 = 0x0f11_ed00;

/// The kernels, of which all sets use the same.
pub(super) struct Kernels {
    read: Kernel,
    /// None on devices that read no texels of buffers.
    read_texels: Option<Kernel>,
    write: Kernel,
    copy: Kernel,
}

impl Kernels {
    /// Makes the kernels.
    ///
    /// # Errors
    /// Fails if a shader does not compile.
    pub fn new(device: &Device, compiler: &Compiler) -> Result<Kernels> {
        let kernel = |mode| {
            let macros = [("MODE", mode)];
            Kernel::with_macros(device, compiler, "roof.memory", MemoryPush::FIELDS, &[], &macros)
        };
        let has_texels = device.limits().has_texel_buffers();
        Ok(Kernels {
            read: kernel(READ)?,
            read_texels: has_texels.then(|| kernel(READ_TEXELS)).transpose()?,
            write: kernel(WRITE)?,
            copy: kernel(COPY)?,
        })
    }
}

/// Buffers of one size, which together are a working set.
pub(super) struct Set<'a> {
    kernels: &'a Kernels,
    buffers: Vec<Buffer>,
    /// By invocation: what a reading kernel has added up.
    sums: Buffer,
    /// Elements of a buffer.
    n: u32,
    n_groups: u32,
    n_block: u32,
}

impl<'a> Set<'a> {
    /// Allocates `bytes`, a power of two of at least 64 KiB, in at least two buffers, and writes
    /// them.
    ///
    /// # Errors
    /// Fails if the device has too little memory.
    pub fn new(
        device: &Device,
        commands: &mut Commands,
        kernels: &'a Kernels,
        bytes: u64,
    ) -> Result<Set<'a>> {
        let most = device.limits().max_storage_buffer_bytes;
        let mut each = bytes / 2;
        while each > most {
            each /= 2;
        }
        let n = (each / ELEMENT_BYTES) as u32;
        let buffer =
            |name, n: u32| Buffer::new::<[u32; 4]>(device, name, u64::from(n), MemoryUsage::Device);
        // A power of two, as the elements: all are accessed equally often.
        let n_groups = MOST_GROUPS.min(1 << device.limits().max_workgroups_x.max(1).ilog2());
        let buffers = (0..bytes / each).map(|_| buffer("roof.set", n)).collect::<Result<_>>()?;
        let sums = buffer("roof.sums", n_groups * LANES)?;
        let n_block = (n / LANES / n_groups).max(1);
        let set = Set { kernels, buffers, sums, n, n_groups, n_block };
        commands.run(|rec| set.write(rec, 1))?;
        Ok(set)
    }

    /// Returns the loads of the set.
    pub fn loads(&self) -> Vec<MemoryLoad<'_>> {
        let has_texels = self.kernels.read_texels.is_some();
        let all = [Way::Read, Way::ReadTexels, Way::Write, Way::Fill, Way::Copy, Way::Transfer];
        let is_there = |way: &Way| has_texels || *way != Way::ReadTexels;
        all.into_iter().filter(is_there).map(|way| MemoryLoad { set: self, way }).collect()
    }

    fn push(&self, n_repeat: u32, salt: u32) -> MemoryPush {
        MemoryPush { last: self.n - 1, n_block: self.n_block, n_repeat, salt }
    }

    fn dispatch(
        &self,
        rec: &mut Recorder<'_>,
        kernel: &Kernel,
        buffers: &[&Buffer],
        push: MemoryPush,
    ) -> Result<()> {
        rec.dispatch_blocks(kernel, buffers, &push, self.n_groups)
    }

    /// Writes every buffer with its own numbers.
    fn write(&self, rec: &mut Recorder<'_>, n_repeat: u32) -> Result<()> {
        (SALT..).zip(&self.buffers).try_for_each(|(salt, buffer)| {
            self.dispatch(rec, &self.kernels.write, &[buffer], self.push(n_repeat, salt))
        })
    }

    /// Returns the buffers that are copied from, and those that they are copied to.
    fn halves(&self) -> impl Iterator<Item = (&Buffer, &Buffer)> {
        let (from, to) = self.buffers.split_at(self.buffers.len() / 2);
        from.iter().zip(to)
    }

    /// Returns how often `n_repeat` blocks of all workgroups pass over an element.
    fn passes(&self, n_repeat: u32) -> u32 {
        // All are powers of two but for the repeats.
        let per_repeat = u64::from(self.n_groups) * u64::from(LANES * self.n_block);
        (per_repeat / u64::from(self.n)) as u32 * n_repeat
    }

    /// Returns the sum over a buffer whose words are consecutive numbers from `salt` on, each
    /// element as often as `n_repeat` blocks pass over it.
    fn sum_of_numbers(&self, salt: u32, n_repeat: u32) -> [u32; 4] {
        // Sum of 4 i for i < n.
        let n = self.n;
        let of_places = n.wrapping_mul(n - 1).wrapping_mul(2);
        [0, 1, 2, 3].map(|j| {
            let once = of_places.wrapping_add(n.wrapping_mul(salt + j));
            once.wrapping_mul(self.passes(n_repeat))
        })
    }

    /// Reads what the kernel that read last has added up.
    fn read_sum(&self, device: &Device, commands: &mut Commands) -> Result<[u32; 4]> {
        let n = (self.n_groups * LANES) as usize;
        let all = words(device, commands, &self.sums, 4 * n)?;
        let mut sum = [0u32; 4];
        for element in all.chunks_exact(4) {
            (0..4).for_each(|j| sum[j] = sum[j].wrapping_add(element[j]));
        }
        Ok(sum)
    }

    /// Adds a buffer up by the reading kernel.
    fn sum_of(&self, device: &Device, commands: &mut Commands, of: &Buffer) -> Result<[u32; 4]> {
        let push = self.push(1, 0);
        commands.run(|rec| self.dispatch(rec, &self.kernels.read, &[of, &self.sums], push))?;
        self.read_sum(device, commands)
    }
}

/// The ways in which memory is accessed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    Read,
    ReadTexels,
    Write,
    Fill,
    Copy,
    Transfer,
}

/// A set, accessed in one way. A unit of work passes over each of its buffers once or more often.
pub(super) struct MemoryLoad<'a> {
    set: &'a Set<'a>,
    way: Way,
}

impl MemoryLoad<'_> {
    fn is_transfer(&self) -> bool {
        matches!(self.way, Way::Fill | Way::Transfer)
    }
}

impl Load for MemoryLoad<'_> {
    fn name(&self) -> (&'static str, Option<&'static str>) {
        match self.way {
            Way::Read => ("read", Some("storage")),
            Way::ReadTexels => ("read", Some("texels")),
            Way::Write => ("write", Some("storage")),
            Way::Fill => ("write", Some("transfer")),
            Way::Copy => ("copy", Some("storage")),
            Way::Transfer => ("copy", Some("transfer")),
        }
    }

    fn set_bytes(&self) -> Option<u64> {
        Some(self.set.buffers.iter().map(Buffer::bytes).sum())
    }

    fn amount(&self, n: u32) -> f64 {
        let set = self.set;
        let accesses = if self.is_transfer() { 1 } else { set.passes(1) };
        let elements = f64::from(set.n) * f64::from(accesses) * f64::from(n);
        // A copy reads half of the buffers and writes the others.
        elements * ELEMENT_BYTES as f64 * set.buffers.len() as f64
    }

    fn most(&self) -> u32 {
        match self.is_transfer() {
            true => (MOST_TRANSFERS / self.set.buffers.len() as u32).max(1),
            false => (MOST_ITERATIONS / self.set.n_block).max(1),
        }
    }

    fn prepare(&self, _: &mut Recorder<'_>) -> Result<()> {
        Ok(())
    }

    fn record(&self, rec: &mut Recorder<'_>, n: u32) -> Result<()> {
        let (set, kernels) = (self.set, self.set.kernels);
        match self.way {
            Way::Write => set.write(rec, n),
            Way::Fill => {
                (0..n).for_each(|_| set.buffers.iter().for_each(|buffer| rec.fill(buffer, WORD)));
                Ok(())
            }
            Way::Transfer => {
                (0..n).for_each(|_| set.halves().for_each(|(from, to)| rec.copy(from, to)));
                Ok(())
            }
            Way::Copy => set.halves().try_for_each(|(from, to)| {
                set.dispatch(rec, &kernels.copy, &[from, to], set.push(n, 0))
            }),
            Way::Read | Way::ReadTexels => {
                let texels = kernels.read_texels.as_ref().filter(|_| self.way == Way::ReadTexels);
                let kernel = texels.unwrap_or(&kernels.read);
                set.buffers.iter().try_for_each(|buffer| {
                    set.dispatch(rec, kernel, &[buffer, &set.sums], set.push(n, 0))
                })
            }
        }
    }

    fn check(&self, device: &Device, commands: &mut Commands, n: u32) -> Result<()> {
        let (set, (name, _)) = (self.set, self.name());
        let salt_of = |i: usize| SALT + i as u32;
        if matches!(self.way, Way::Read | Way::ReadTexels) {
            let last = salt_of(set.buffers.len() - 1);
            let found = set.read_sum(device, commands)?;
            return expect_same(name, found, set.sum_of_numbers(last, n));
        }
        let n_half = set.buffers.len() / 2;
        for (i, buffer) in set.buffers.iter().enumerate() {
            let found = set.sum_of(device, commands, buffer)?;
            let expected = match self.way {
                Way::Fill => [set.n.wrapping_mul(WORD).wrapping_mul(set.passes(1)); 4],
                Way::Write => set.sum_of_numbers(salt_of(i), 1),
                _ => set.sum_of_numbers(salt_of(i % n_half), 1),
            };
            expect_same(name, found, expected)?;
        }
        // The loads that follow find the numbers again.
        commands.run(|rec| set.write(rec, 1)).map(|_| ())
    }
}
