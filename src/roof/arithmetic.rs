//! Loads of arithmetic and of atomics.

use super::load::{Load, expect_same, words};
use crate::error::Result;
use crate::gpu::{Buffer, Commands, Compiler, Device, Kernel, Limits, MemoryUsage, Recorder};
use crate::layout::roof::{ArithmeticPush, AtomicsPush, CHAINS, LANES, STEPS};
use crate::timing::roofs::F32;

/// A kind of number.
struct Kind {
    name: &'static str,
    /// `KIND` of the shader.
    number: u32,
    /// Loops of an invocation. Half floats count to 2048 without a gap.
    n_loops: u32,
    is_there: fn(&Limits) -> bool,
    /// The feature that a device without this kind lacks.
    feature: &'static str,
}

const KINDS: [Kind; 5] = [
    Kind { name: F32, number: 0, n_loops: 1024, is_there: |_| true, feature: "" },
    Kind {
        name: "f64",
        number: 1,
        n_loops: 1024,
        is_there: |limits| limits.has_float64,
        feature: "shaderFloat64",
    },
    Kind {
        name: "f16",
        number: 2,
        n_loops: 64,
        is_there: |limits| limits.has_float16,
        feature: "shaderFloat16",
    },
    Kind { name: "i32", number: 3, n_loops: 1024, is_there: |_| true, feature: "" },
    Kind {
        name: "i64",
        number: 4,
        n_loops: 1024,
        is_there: |limits| limits.has_int64,
        feature: "shaderInt64",
    },
];

/// Most workgroups of a dispatch, which every device takes.
const MOST_GROUPS: u32 = 65_535;

/// Multiply-adds of one kind of number. A unit of work is a workgroup.
pub(super) struct Arithmetic {
    kernel: Kernel,
    kind: &'static Kind,
    sums: Buffer,
}

/// Returns a load for each kind of number that the device has, and a sentence for each other one.
///
/// # Errors
/// Fails if a shader does not compile or the device has too little memory.
pub(super) fn arithmetic(
    device: &Device,
    compiler: &Compiler,
) -> Result<(Vec<Arithmetic>, Vec<String>)> {
    let (mut loads, mut absent) = (Vec::new(), Vec::new());
    for kind in &KINDS {
        if !(kind.is_there)(device.limits()) {
            absent.push(format!("{}: the device has no {}", kind.name, kind.feature));
            continue;
        }
        let (fields, macros) = (ArithmeticPush::FIELDS, [("KIND", kind.number)]);
        let name = "roof.arithmetic";
        let kernel = Kernel::with_macros(device, compiler, name, fields, &[], &macros)?;
        let n = u64::from(MOST_GROUPS * LANES);
        let sums = Buffer::new::<u32>(device, "roof.sums", n, MemoryUsage::Device)?;
        loads.push(Arithmetic { kernel, kind, sums });
    }
    Ok((loads, absent))
}

impl Arithmetic {
    fn n_steps(&self) -> u32 {
        self.kind.n_loops * STEPS
    }

    fn n_chains(&self) -> u32 {
        CHAINS[usize::from(!self.kind.name.ends_with("64"))]
    }
}

impl Load for Arithmetic {
    fn name(&self) -> (&'static str, Option<&'static str>) {
        (self.kind.name, None)
    }

    fn set_bytes(&self) -> Option<u64> {
        None
    }

    fn amount(&self, n: u32) -> f64 {
        2.0 * f64::from(n) * f64::from(LANES) * f64::from(self.n_steps() * self.n_chains())
    }

    fn most(&self) -> u32 {
        MOST_GROUPS
    }

    fn prepare(&self, _: &mut Recorder<'_>) -> Result<()> {
        Ok(())
    }

    fn record(&self, rec: &mut Recorder<'_>, n: u32) -> Result<()> {
        let push = ArithmeticPush { n_loops: self.kind.n_loops, a: 1, b: 1 };
        rec.dispatch_blocks(&self.kernel, &[&self.sums], &push, n)
    }

    fn check(&self, device: &Device, commands: &mut Commands, n: u32) -> Result<()> {
        let found = words(device, commands, &self.sums, (n * LANES) as usize)?;
        // Chains start at their numbers, and each lane at its own among eight.
        let n_chains = self.n_chains();
        let of_chains = n_chains * (n_chains - 1) / 2;
        for (lane, found) in (0..).zip(found) {
            let expected = of_chains + n_chains * (lane % 8 + self.n_steps());
            expect_same(self.kind.name, found, expected)?;
        }
        Ok(())
    }
}

/// Counters that neighbours have for themselves: more than the invocations that run at once.
const N_SPREAD: u32 = 1 << 20;
/// Additions of an invocation.
const N_ADDITIONS: u32 = 64;

/// Additions to counters. A unit of work is a workgroup.
pub(super) struct Atomics {
    kernel: Kernel,
    counters: Buffer,
    is_spread: bool,
}

impl Atomics {
    /// Makes the additions to one counter, or to one for each of the invocations that run at once.
    ///
    /// # Errors
    /// Fails if the shader does not compile or the device has too little memory.
    pub fn new(device: &Device, compiler: &Compiler, is_spread: bool) -> Result<Atomics> {
        let kernel = Kernel::new(device, compiler, "roof.atomics", AtomicsPush::FIELDS)?;
        let n = if is_spread { N_SPREAD } else { 1 };
        let counters =
            Buffer::new::<u32>(device, "roof.counters", u64::from(n), MemoryUsage::Device)?;
        Ok(Atomics { kernel, counters, is_spread })
    }

    fn n_counters(&self) -> u32 {
        if self.is_spread { N_SPREAD } else { 1 }
    }
}

impl Load for Atomics {
    fn name(&self) -> (&'static str, Option<&'static str>) {
        (if self.is_spread { "atomics, spread" } else { "atomics, one address" }, None)
    }

    fn set_bytes(&self) -> Option<u64> {
        None
    }

    fn amount(&self, n: u32) -> f64 {
        f64::from(n) * f64::from(LANES * N_ADDITIONS)
    }

    fn most(&self) -> u32 {
        MOST_GROUPS
    }

    fn prepare(&self, rec: &mut Recorder<'_>) -> Result<()> {
        rec.fill(&self.counters, 0);
        Ok(())
    }

    fn record(&self, rec: &mut Recorder<'_>, n: u32) -> Result<()> {
        let push = AtomicsPush { last: self.n_counters() - 1, n_loops: N_ADDITIONS };
        rec.dispatch_blocks(&self.kernel, &[&self.counters], &push, n)
    }

    fn check(&self, device: &Device, commands: &mut Commands, n: u32) -> Result<()> {
        let counters = words(device, commands, &self.counters, self.n_counters() as usize)?;
        let sum = counters.into_iter().fold(0, u32::wrapping_add);
        expect_same(self.name().0, sum, n.wrapping_mul(LANES * N_ADDITIONS))
    }
}
