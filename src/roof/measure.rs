//! Measures all roofs of a device.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::arithmetic::{Atomics, arithmetic};
use super::load::Load;
use super::memory::{Kernels, Set};
use crate::error::{Error, Result};
use crate::frame::GpuContext;
use crate::gpu::{Commands, Device};
use crate::measure::stats::Summary;
use crate::timing::caches::last_level_bytes;
use crate::timing::machine;
use crate::timing::roofs::{BYTES_PER_S, OPERATIONS_PER_S, Roof, Roofs};

/// Sets that fit into the caches of most devices, in bytes.
const SMALL_SETS: [u64; 3] = [1 << 18, 1 << 21, 1 << 24];
/// Ways in which a set is accessed, and arithmetic with atomics: the most loads of each.
const N_WAYS: u64 = 6;
const N_ARITHMETIC: u64 = 7;
/// The largest set is this many times the last cache level …
const CACHES_OF_LARGEST: u64 = 4;
/// … and has at least and at most these bytes.
const LARGEST_SET: [u64; 2] = [1 << 28, 1 << 30];
/// Samples that are taken where the time allows it, and the most.
const N_SAMPLES: [usize; 2] = [5, 101];
/// Samples that are taken in any case.
const LEAST_SAMPLES: usize = 3;
/// The samples agree if the 5th and the 95th percentile are this near, relative to the median.
const SPREAD: f64 = 0.03;
/// Length of a sample, in seconds, beside which the time of a submission is small.
const SAMPLE_S: f64 = 0.02;
/// Share of the limit of a submission that a sample may take.
const SHARE_OF_LIMIT: f64 = 0.25;

/// The limits within which roofs are measured.
#[derive(Debug, Clone, Copy)]
pub struct Budget {
    /// Time for all samples. Compilation and a load's least samples come on top.
    pub time: Duration,
    /// Most milliseconds that a submission is to take, if there is a limit.
    pub max_submit_ms: Option<f64>,
}

/// Measures the roofs of `context`'s device. `tick` is called with the number of loads that are
/// done and their whole number.
///
/// # Errors
/// Fails if the device computes a wrong result, has too little memory or is lost, or if `stop` is
/// set.
pub fn measure(
    context: &GpuContext,
    budget: Budget,
    stop: &AtomicBool,
    tick: &mut dyn FnMut(u64, u64),
) -> Result<Roofs> {
    let (device, begin, date) = (&context.device, Instant::now(), machine::utc_now());
    let info = device.info();
    let cache_bytes = last_level_bytes(info);
    let sets = sets(cache_bytes, device.limits().device_memory_bytes);
    let n_loads = sets.len() as u64 * N_WAYS + N_ARITHMETIC;
    let mut sampler = Sampler {
        device,
        commands: Commands::new(device, "roof")?,
        end: begin + budget.time,
        n_left: n_loads,
        sample_s: budget
            .max_submit_ms
            .map_or(SAMPLE_S, |ms| SAMPLE_S.min(1e-3 * SHARE_OF_LIMIT * ms)),
        stop,
    };
    let mut n_done = 0;
    let mut measured = |sampler: &mut Sampler<'_>, load: &dyn Load| {
        let roof = sampler.roof(load)?;
        n_done += 1;
        tick(n_done, n_loads);
        Ok::<Roof, Error>(roof)
    };
    // Arithmetic comes first: on a slow device the large sets take more than their share of time.
    let mut of_arithmetic = Vec::new();
    let (loads, mut absent) = arithmetic(device, context.compiler())?;
    for load in &loads {
        of_arithmetic.push(measured(&mut sampler, load)?);
    }
    for is_spread in [false, true] {
        let atomics = Atomics::new(device, context.compiler(), is_spread)?;
        of_arithmetic.push(measured(&mut sampler, &atomics)?);
    }
    let mut roofs = Vec::new();
    let kernels = Kernels::new(device, context.compiler())?;
    for bytes in sets {
        let set = Set::new(device, &mut sampler.commands, &kernels, bytes)?;
        for load in set.loads() {
            roofs.push(measured(&mut sampler, &load)?);
        }
    }
    roofs.append(&mut of_arithmetic);
    if !device.limits().has_texel_buffers() {
        absent.push("read by texels: the device reads few texels of a buffer".to_owned());
    }
    Ok(Roofs {
        schema: Roofs::SCHEMA,
        nimbus: env!("CARGO_PKG_VERSION").to_owned(),
        date,
        device: machine::device_record(info),
        cpu: machine::cpu(),
        environment: machine::environment(),
        cache_bytes,
        seconds: begin.elapsed().as_secs_f64(),
        roofs,
        absent,
    })
}

/// Returns the sizes of the sets: some that fit into caches, and one well beyond the last level, as
/// far as an eighth of the device's memory allows.
fn sets(cache_bytes: u64, memory_bytes: u64) -> Vec<u64> {
    let [least, most] = LARGEST_SET;
    let wanted = (CACHES_OF_LARGEST * cache_bytes).next_power_of_two().clamp(least, most);
    let mut largest = wanted;
    while largest > memory_bytes / 8 && largest > SMALL_SETS[0] {
        largest /= 2;
    }
    SMALL_SETS.into_iter().filter(|set| *set < largest).chain([largest]).collect()
}

/// Takes samples of loads.
struct Sampler<'a> {
    device: &'a Device,
    commands: Commands,
    /// The time at which all loads are to be done.
    end: Instant,
    /// Loads that are not done.
    n_left: u64,
    /// Length of a sample.
    sample_s: f64,
    stop: &'a AtomicBool,
}

impl Sampler<'_> {
    /// Measures a load until its samples agree or its time is up, and checks its results.
    fn roof(&mut self, load: &dyn Load) -> Result<Roof> {
        // Each load takes its share of the time that is left. One that takes longer by itself,
        // as all do on a slow device, gives its samples up first.
        let begin = Instant::now();
        let time = self.end.saturating_duration_since(begin).div_f64(self.n_left.max(1) as f64);
        self.n_left = self.n_left.saturating_sub(1);
        let n = self.units(load)?;
        let mut rates = Vec::new();
        let (summary, is_stable) = loop {
            rates.push(load.amount(n) / self.seconds(load, n)?);
            let summary = Summary::of(&rates).filter(|_| rates.len() >= LEAST_SAMPLES);
            let Some(summary) = summary else { continue };
            let is_stable =
                rates.len() >= N_SAMPLES[0] && summary.p95 - summary.p5 <= SPREAD * summary.p50;
            if is_stable || begin.elapsed() >= time || rates.len() >= N_SAMPLES[1] {
                break (summary, is_stable);
            }
        };
        load.check(self.device, &mut self.commands, n)?;
        let ((name, way), set_bytes) = (load.name(), load.set_bytes());
        let unit = if set_bytes.is_some() { BYTES_PER_S } else { OPERATIONS_PER_S };
        Ok(Roof {
            name: name.to_owned(),
            way: way.map(str::to_owned),
            set_bytes,
            unit: unit.to_owned(),
            n: summary.n,
            p50: summary.p50,
            p5: summary.p5,
            p95: summary.p95,
            max: summary.max,
            is_stable,
        })
    }

    /// Returns the units of work that take the length of a sample. The samples on the way there
    /// warm the device up.
    fn units(&mut self, load: &dyn Load) -> Result<u32> {
        let mut n = 1;
        loop {
            let seconds = self.seconds(load, n)?;
            if seconds >= 0.5 * self.sample_s || n == load.most() {
                return Ok(n);
            }
            let wanted = f64::from(n) * self.sample_s / seconds;
            // A short time is mostly that of the submission: at most 16 times as much at once.
            n = (wanted.min(16.0 * f64::from(n)) as u32).clamp(n + 1, load.most());
        }
    }

    /// Runs `n` units of work and returns the time that they take, by the device's clock where it
    /// has one.
    fn seconds(&mut self, load: &dyn Load, n: u32) -> Result<f64> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(Error::Interrupted);
        }
        let begin = Instant::now();
        let scopes = self.commands.run(|rec| {
            load.prepare(rec)?;
            rec.scope("roof", |rec| load.record(rec, n))
        })?;
        let wall_s = begin.elapsed().as_secs_f64();
        let device_s = scopes.first().map(|scope| 1e-3 * scope.ms());
        Ok(device_s.filter(|s| *s > 0.0).unwrap_or(wall_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_set_is_beyond_the_caches_and_within_the_memory() {
        const GIB: u64 = 1 << 30;
        let small = || SMALL_SETS.to_vec();
        assert_eq!(sets(32 << 20, 24 * GIB), [small(), vec![1 << 28]].concat());
        assert_eq!(sets(100 << 20, 24 * GIB), [small(), vec![1 << 29]].concat());
        assert_eq!(sets(256 << 20, 80 * GIB), [small(), vec![GIB]].concat());
        // A device with 1 GiB gives an eighth of it.
        assert_eq!(sets(256 << 20, GIB), [small(), vec![1 << 27]].concat());
        assert_eq!(sets(256 << 20, 1 << 24), [1 << 18, 1 << 21]);
        assert_eq!(sets(256 << 20, 0), [1 << 18]);
    }
}
