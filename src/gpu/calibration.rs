//! The device's clock beside the host's: readings of both at one moment
//! (VK_KHR_calibrated_timestamps, or its predecessor of EXT), and the line through them that lays
//! times of the device onto the host's clock.
//!
//! `Instant` is CLOCK_MONOTONIC on Linux, which is one of the extension's domains; elsewhere
//! nothing is calibrated.

use std::ffi::CStr;
use std::time::Instant;

use ash::{ext, khr, vk};

use super::device::Device;
use super::instance::Instance;
use super::probe::has_extension;
use crate::error::{Error, Result};

/// Both clocks at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockPair {
    /// From the device's own zero, as [`super::ScopeTime`] counts.
    pub device_ns: f64,
    pub host: Instant,
    /// The two may lie so far apart.
    pub deviation_ns: f64,
}

/// Host time as a straight line over device time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockFit {
    /// Means of the readings, through which the line goes.
    device_ns: f64,
    host_ns: f64,
    /// What `host_ns` counts from.
    epoch: Instant,
    /// Host nanoseconds a nanosecond of the device: 1 but for the drift of two oscillators.
    pub rate: f64,
    pub n_pairs: usize,
    /// Greatest distance of a reading from the line and of a reading's two clocks from one another,
    /// added.
    pub deviation_ns: f64,
}

/// Readings less than this apart say nothing of the clocks' rates: at deviations of some 10 µs, 1
/// in 10⁴.
const LEAST_SPAN_NS: f64 = 1e8;

impl ClockFit {
    /// The least squares line through `pairs`. Where they lie too near to one another to tell the
    /// rates apart both clocks are taken to run alike. None without a pair.
    pub fn of(pairs: &[ClockPair]) -> Option<ClockFit> {
        let epoch = pairs.iter().map(|pair| pair.host).min()?;
        let n = pairs.len() as f64;
        let host =
            |pair: &ClockPair| pair.host.saturating_duration_since(epoch).as_secs_f64() * 1e9;
        // A device may have counted for months: the differences are what doubles hold well.
        let first_ns = pairs[0].device_ns;
        let device_ns =
            first_ns + pairs.iter().map(|pair| pair.device_ns - first_ns).sum::<f64>() / n;
        let host_ns = pairs.iter().map(host).sum::<f64>() / n;
        let apart = |pair: &ClockPair| [pair.device_ns - device_ns, host(pair) - host_ns];
        let [mut xx, mut xy] = [0.0; 2];
        let mut span = [f64::INFINITY, f64::NEG_INFINITY];
        for [x, y] in pairs.iter().map(apart) {
            xx += x * x;
            xy += x * y;
            span = [span[0].min(y), span[1].max(y)];
        }
        let rate = if span[1] - span[0] >= LEAST_SPAN_NS && xx > 0.0 { xy / xx } else { 1.0 };
        let off = |pair: &ClockPair| {
            let [x, y] = apart(pair);
            (y - rate * x).abs() + pair.deviation_ns
        };
        let deviation_ns = pairs.iter().map(off).fold(0.0, f64::max);
        Some(ClockFit { device_ns, host_ns, epoch, rate, n_pairs: pairs.len(), deviation_ns })
    }

    /// Nanoseconds from `zero` to when the device's clock showed `device_ns`; before it they are
    /// negative.
    pub fn ns_since(&self, zero: Instant, device_ns: f64) -> f64 {
        let from_epoch = |at: Instant| match at.checked_duration_since(self.epoch) {
            Some(after) => after.as_secs_f64() * 1e9,
            None => -self.epoch.saturating_duration_since(at).as_secs_f64() * 1e9,
        };
        self.host_ns + self.rate * (device_ns - self.device_ns) - from_epoch(zero)
    }
}

/// The extension's names, the one to prefer first.
const NAMES: [&CStr; 2] = [khr::calibrated_timestamps::NAME, ext::calibrated_timestamps::NAME];

/// The extension by which the device can be asked for both clocks at once, if it can.
pub(super) fn probe(instance: &Instance, physical: vk::PhysicalDevice) -> Option<&'static CStr> {
    if !cfg!(target_os = "linux") {
        return None;
    }
    let name = NAMES.into_iter().find(|name| has_extension(instance, physical, name))?;
    let domains = unsafe {
        if name == khr::calibrated_timestamps::NAME {
            khr::calibrated_timestamps::Instance::new(&instance.entry, &instance.raw)
                .get_physical_device_calibrateable_time_domains(physical)
        } else {
            ext::calibrated_timestamps::Instance::new(&instance.entry, &instance.raw)
                .get_physical_device_calibrateable_time_domains(physical)
        }
    };
    let domains = domains.ok()?;
    [vk::TimeDomainKHR::DEVICE, vk::TimeDomainKHR::CLOCK_MONOTONIC]
        .iter()
        .all(|d| domains.contains(d))
        .then_some(name)
}

impl Device {
    /// Both clocks, `n` times; empty where the device cannot
    /// ([`super::DeviceInfo::calibrated_timestamps`]).
    pub fn read_clocks(&self, n: usize) -> Result<Vec<ClockPair>> {
        let Some(name) = self.info().calibrated_timestamps else { return Ok(vec![]) };
        let (instance, raw) = (&self.shared().instance.raw, &self.shared().raw);
        let domain = |domain| vk::CalibratedTimestampInfoKHR::default().time_domain(domain);
        let domains =
            [domain(vk::TimeDomainKHR::DEVICE), domain(vk::TimeDomainKHR::CLOCK_MONOTONIC)];
        let limits = self.limits();
        let read = || {
            let read = unsafe {
                if name == khr::calibrated_timestamps::NAME {
                    khr::calibrated_timestamps::Device::new(instance, raw)
                        .get_calibrated_timestamps(&domains)
                } else {
                    ext::calibrated_timestamps::Device::new(instance, raw)
                        .get_calibrated_timestamps(&domains)
                }
            };
            let (clocks, deviation_ns) =
                read.map_err(|e| Error::vulkan("vkGetCalibratedTimestamps", e))?;
            let (host, reading_ns) = instant_of(clocks[1]);
            let device_ns = limits.ticks_ns(clocks[0]);
            Ok(ClockPair { device_ns, host, deviation_ns: deviation_ns as f64 + reading_ns })
        };
        (0..n).map(|_| read()).collect()
    }
}

/// When CLOCK_MONOTONIC showed `ns`, and how far off that may be: `Instant` does not say what it
/// counts from, so it is read between two readings of the same clock, and where those lay nearest
/// together of several.
#[cfg(target_os = "linux")]
fn instant_of(ns: u64) -> (Instant, f64) {
    use std::time::Duration;
    const N_TRIES: usize = 5;
    let monotonic_ns = || {
        let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
        i128::from(now.tv_sec) * 1_000_000_000 + i128::from(now.tv_nsec)
    };
    let read = |_| (monotonic_ns(), Instant::now(), monotonic_ns());
    let between = |(before, _, after): &(i128, Instant, i128)| after - before;
    let first = read(0);
    let (before, now, after) = (1..N_TRIES)
        .map(read)
        .fold(first, |best, next| if between(&next) < between(&best) { next } else { best });
    let ago = (before + after) / 2 - i128::from(ns);
    let apart = Duration::from_nanos(u64::try_from(ago.unsigned_abs()).unwrap_or(u64::MAX));
    let at = if ago >= 0 { now.checked_sub(apart) } else { now.checked_add(apart) };
    (at.unwrap_or(now), (after - before) as f64)
}

#[cfg(not(target_os = "linux"))]
fn instant_of(_: u64) -> (Instant, f64) {
    (Instant::now(), f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// Host time 3 s + 1.00002 · (device time − 10⁶ s), readings off by ±`error_ns` in turn.
    fn pairs(zero: Instant, at_s: &[f64], error_ns: f64) -> Vec<ClockPair> {
        let pair = |(i, s): (usize, &f64)| {
            let error = if i % 2 == 0 { error_ns } else { -error_ns };
            ClockPair {
                device_ns: 1e15 + s * 1e9,
                host: zero + Duration::from_secs_f64(3.0 + 1.00002 * s + 1e-9 * error),
                deviation_ns: 50.0,
            }
        };
        at_s.iter().enumerate().map(pair).collect()
    }

    #[test]
    fn the_line_is_the_one_that_the_readings_lie_on() {
        let zero = Instant::now();
        let fit = ClockFit::of(&pairs(zero, &[0.0, 0.1, 59.9, 60.0], 0.0)).unwrap();
        // A double holds 10¹⁵ ns to 0.125 ns; an Instant is whole nanoseconds.
        assert!((fit.rate - 1.00002).abs() < 1e-10, "{}", fit.rate);
        for s in [-5.0, 0.0, 30.0, 100.0] {
            let (got, want) = (fit.ns_since(zero, 1e15 + s * 1e9), 1e9 * (3.0 + 1.00002 * s));
            assert!((got - want).abs() < 5.0, "{got} for {want}");
        }
        assert!((50.0..53.0).contains(&fit.deviation_ns) && fit.n_pairs == 4, "{fit:?}");
        // From a zero after the readings times are negative.
        assert!(fit.ns_since(zero + Duration::from_secs(100), 1e15) < 0.0);
    }

    #[test]
    fn what_the_readings_are_off_by_is_told() {
        let fit =
            ClockFit::of(&pairs(Instant::now(), &[0.0, 0.001, 59.999, 60.0], 2000.0)).unwrap();
        // 2 µs each way: the line goes between, and each lies 2 µs off it, and 50 ns by its own
        // account.
        assert!((fit.deviation_ns - 2050.0).abs() < 5.0, "{fit:?}");
        assert!((fit.rate - 1.00002).abs() < 1e-9);
    }

    #[test]
    fn readings_of_one_moment_tell_no_rate() {
        let zero = Instant::now();
        for at_s in [&[7.0][..], &[7.0, 7.01]] {
            let fit = ClockFit::of(&pairs(zero, at_s, 0.0)).unwrap();
            assert_eq!(fit.rate, 1.0);
            let (got, want) = (fit.ns_since(zero, 1e15 + 7e9), 1e9 * (3.0 + 1.00002 * 7.0));
            assert!((got - want).abs() < 200.0, "{got} for {want}");
        }
        assert_eq!(ClockFit::of(&[]), None);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn an_instant_is_the_monotonic_clock() {
        let reading = || rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
        let ns = |t: rustix::time::Timespec| t.tv_sec as u64 * 1_000_000_000 + t.tv_nsec as u64;
        let before = Instant::now();
        let between = ns(reading());
        let after = Instant::now();
        let (at, off_ns) = instant_of(between);
        let slack = Duration::from_nanos(off_ns as u64 + 1);
        assert!(at + slack >= before && at <= after + slack, "{off_ns}");
        // The future too.
        assert!(instant_of(between + 1_000_000_000).0 > after);
    }
}
