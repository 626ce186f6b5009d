//! The device's clock beside the host's.
//!
//! The device reads both clocks at one moment (VK_KHR_calibrated_timestamps, or its predecessor of
//! EXT). A line through several readings converts times of the device to the host's clock. Devices
//! that cannot read a clock of this system (gpu/host_clock.rs) are not calibrated.

use std::time::Instant;

use ash::{ext, khr, vk};

use super::call::Call;
use super::device::Device;
use super::host_clock::instant_of;
use crate::error::Result;

/// Both clocks at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockSample {
    /// Nanoseconds from the device's own zero, as in [`super::ScopeTime`].
    pub device_ns: f64,
    /// The host's clock.
    pub host: Instant,
    /// Greatest distance of the two readings, in nanoseconds.
    pub deviation_ns: f64,
}

/// Host time as a straight line over device time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockFit {
    /// Means of the samples, through which the line goes.
    device_ns: f64,
    host_ns: f64,
    /// The zero of `host_ns`.
    epoch: Instant,
    /// Host nanoseconds per nanosecond of the device: 1 but for the drift of two oscillators.
    pub rate: f64,
    /// Number of samples.
    pub n_samples: usize,
    /// Greatest sum of a sample's distance from the line and its own deviation, in nanoseconds.
    pub deviation_ns: f64,
}

/// Samples that span less than this do not show the clocks' rates: at deviations of some 10 µs the
/// rate's error would be 1 in 10⁴.
const MIN_SPAN_NS: f64 = 1e8;

impl ClockFit {
    /// Fits a least squares line through `samples`; none without samples. Samples that lie too near
    /// together to show the rates give the rate 1.
    pub fn from_samples(samples: &[ClockSample]) -> Option<ClockFit> {
        let epoch = samples.iter().map(|sample| sample.host).min()?;
        let n = samples.len() as f64;
        let host =
            |sample: &ClockSample| sample.host.saturating_duration_since(epoch).as_secs_f64() * 1e9;
        // A device may have counted for months: doubles hold the differences well.
        let first_ns = samples[0].device_ns;
        let device_ns = first_ns + samples.iter().map(|s| s.device_ns - first_ns).sum::<f64>() / n;
        let host_ns = samples.iter().map(host).sum::<f64>() / n;
        let from_mean =
            |sample: &ClockSample| [sample.device_ns - device_ns, host(sample) - host_ns];
        let [mut xx, mut xy] = [0.0; 2];
        let mut span = [f64::INFINITY, f64::NEG_INFINITY];
        for [x, y] in samples.iter().map(from_mean) {
            xx += x * x;
            xy += x * y;
            span = [span[0].min(y), span[1].max(y)];
        }
        let rate = if span[1] - span[0] >= MIN_SPAN_NS && xx > 0.0 { xy / xx } else { 1.0 };
        let deviation = |sample: &ClockSample| {
            let [x, y] = from_mean(sample);
            (y - rate * x).abs() + sample.deviation_ns
        };
        let deviation_ns = samples.iter().map(deviation).fold(0.0, f64::max);
        Some(ClockFit { device_ns, host_ns, epoch, rate, n_samples: samples.len(), deviation_ns })
    }

    /// Returns the nanoseconds from `zero` to the moment when the device's clock showed
    /// `device_ns`; negative before `zero`.
    pub fn ns_since(&self, zero: Instant, device_ns: f64) -> f64 {
        let from_epoch = |at: Instant| match at.checked_duration_since(self.epoch) {
            Some(after) => after.as_secs_f64() * 1e9,
            None => -self.epoch.saturating_duration_since(at).as_secs_f64() * 1e9,
        };
        self.host_ns + self.rate * (device_ns - self.device_ns) - from_epoch(zero)
    }
}

impl Device {
    /// Reads both clocks `n` times; empty on a device without
    /// [`super::DeviceInfo::clock_calibration`].
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn read_clocks(&self, n: usize) -> Result<Vec<ClockSample>> {
        let Some(calibration) = self.info().clock_calibration else { return Ok(vec![]) };
        let (instance, raw) = (&self.shared().instance.vulkan.raw, &self.shared().raw);
        let domain = |domain| vk::CalibratedTimestampInfoKHR::default().time_domain(domain);
        let domains = [domain(vk::TimeDomainKHR::DEVICE), domain(calibration.domain)];
        let read = || {
            let (clocks, deviation_ns) = unsafe {
                if calibration.extension == khr::calibrated_timestamps::NAME {
                    khr::calibrated_timestamps::Device::new(instance, raw)
                        .get_calibrated_timestamps(&domains)
                } else {
                    ext::calibrated_timestamps::Device::new(instance, raw)
                        .get_calibrated_timestamps(&domains)
                }
            }
            .of_call("vkGetCalibratedTimestamps", "")?;
            let (host, reading_ns) = instant_of(calibration.domain, clocks[1]);
            let device_ns = self.shared().tick_clock.ns(&clocks[..1], host)[0];
            Ok(ClockSample { device_ns, host, deviation_ns: deviation_ns as f64 + reading_ns })
        };
        (0..n).map(|_| read()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// Returns samples of host time = 3 s + 1.00002 · (device time − 10⁶ s), with errors of
    /// ±`error_ns` in turn.
    fn samples(zero: Instant, at_s: &[f64], error_ns: f64) -> Vec<ClockSample> {
        let sample = |(i, s): (usize, &f64)| {
            let error = if i % 2 == 0 { error_ns } else { -error_ns };
            ClockSample {
                device_ns: 1e15 + s * 1e9,
                host: zero + Duration::from_secs_f64(3.0 + 1.00002 * s + 1e-9 * error),
                deviation_ns: 50.0,
            }
        };
        at_s.iter().enumerate().map(sample).collect()
    }

    #[test]
    fn the_fit_recovers_the_line_that_the_samples_lie_on() {
        let zero = Instant::now();
        let fit = ClockFit::from_samples(&samples(zero, &[0.0, 0.1, 59.9, 60.0], 0.0)).unwrap();
        // A double holds 10¹⁵ ns to 0.125 ns; an Instant is whole nanoseconds.
        assert!((fit.rate - 1.00002).abs() < 1e-10, "{}", fit.rate);
        for s in [-5.0, 0.0, 30.0, 100.0] {
            let (got, want) = (fit.ns_since(zero, 1e15 + s * 1e9), 1e9 * (3.0 + 1.00002 * s));
            assert!((got - want).abs() < 5.0, "{got} for {want}");
        }
        assert!((50.0..53.0).contains(&fit.deviation_ns) && fit.n_samples == 4, "{fit:?}");
        // Times before the zero are negative.
        assert!(fit.ns_since(zero + Duration::from_secs(100), 1e15) < 0.0);
    }

    #[test]
    fn the_deviation_covers_the_errors_of_the_samples() {
        let fit =
            ClockFit::from_samples(&samples(Instant::now(), &[0.0, 0.001, 59.999, 60.0], 2000.0))
                .unwrap();
        // The line goes between errors of ±2 µs. Each sample adds its own deviation, 50 ns.
        assert!((fit.deviation_ns - 2050.0).abs() < 5.0, "{fit:?}");
        assert!((fit.rate - 1.00002).abs() < 1e-9);
    }

    #[test]
    fn samples_of_one_moment_give_the_rate_1() {
        let zero = Instant::now();
        for at_s in [&[7.0][..], &[7.0, 7.01]] {
            let fit = ClockFit::from_samples(&samples(zero, at_s, 0.0)).unwrap();
            assert_eq!(fit.rate, 1.0);
            let (got, want) = (fit.ns_since(zero, 1e15 + 7e9), 1e9 * (3.0 + 1.00002 * 7.0));
            assert!((got - want).abs() < 200.0, "{got} for {want}");
        }
        assert_eq!(ClockFit::from_samples(&[]), None);
    }
}
