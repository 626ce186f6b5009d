//! The clocks of the host that Vulkan can read together with a device's own.
//!
//! Vulkan names them by time domains. A domain counts in a unit of the system: nanoseconds of
//! clock_gettime, or ticks of QueryPerformanceCounter on Windows.

use std::ffi::CStr;
use std::time::{Duration, Instant};

use ash::vk;

/// The way in which a device reads its clock and the host's at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockCalibration {
    /// The extension that reads both clocks.
    pub extension: &'static CStr,
    /// The host's clock.
    pub domain: vk::TimeDomainKHR,
}

/// Returns the clock of this system that a device with these time domains can be calibrated
/// against; none without one, or where the device cannot read its own clock.
pub fn domain_among(domains: &[vk::TimeDomainKHR]) -> Option<vk::TimeDomainKHR> {
    let is_there = |domain: &vk::TimeDomainKHR| domains.contains(domain);
    let host = system::DOMAINS.iter().copied().find(is_there);
    host.filter(|_| is_there(&vk::TimeDomainKHR::DEVICE))
}

/// Returns the `Instant` when the clock of `domain` showed `reading`, and its possible error in
/// nanoseconds. `domain` is one of [`domain_among`], and `reading` has the domain's unit.
///
/// `Instant` does not tell its zero, so it is read between two readings of the same clock. The
/// closest of several such pairs counts.
pub fn instant_of(domain: vk::TimeDomainKHR, reading: u64) -> (Instant, f64) {
    const N_TRIES: usize = 5;
    let ticks_per_s = system::ticks_per_s();
    let now_ns = || to_ns(system::read(domain), ticks_per_s);
    let read = |_| (now_ns(), Instant::now(), now_ns());
    let between = |(before, _, after): &(i128, Instant, i128)| after - before;
    let first = read(0);
    let (before, now, after) = (1..N_TRIES)
        .map(read)
        .fold(first, |best, next| if between(&next) < between(&best) { next } else { best });
    let ago = (before + after) / 2 - to_ns(reading, ticks_per_s);
    let apart = Duration::from_nanos(u64::try_from(ago.unsigned_abs()).unwrap_or(u64::MAX));
    let at = if ago >= 0 { now.checked_sub(apart) } else { now.checked_add(apart) };
    // Two readings within a tick are equal, and the moment between them is unknown to a tick.
    (at.unwrap_or(now), (after - before + to_ns(1, ticks_per_s)) as f64)
}

/// Converts ticks of a clock to nanoseconds, rounded down. No product overflows: a reading is below
/// 2⁶⁴, and 10⁹ is below 2³⁰.
fn to_ns(ticks: u64, ticks_per_s: u64) -> i128 {
    i128::from(ticks) * 1_000_000_000 / i128::from(ticks_per_s)
}

/// Linux and other Unix systems. `Instant` is CLOCK_MONOTONIC there, so that clock comes first:
/// CLOCK_MONOTONIC_RAW, which only Linux has, drifts against `Instant`.
#[cfg(all(unix, not(target_os = "macos")))]
mod system {
    use ash::vk::TimeDomainKHR as Domain;
    use rustix::time::{ClockId, clock_gettime};

    #[cfg(target_os = "linux")]
    pub const DOMAINS: &[Domain] = &[Domain::CLOCK_MONOTONIC, Domain::CLOCK_MONOTONIC_RAW];
    #[cfg(not(target_os = "linux"))]
    pub const DOMAINS: &[Domain] = &[Domain::CLOCK_MONOTONIC];

    pub fn read(domain: Domain) -> u64 {
        let clock = match domain {
            #[cfg(target_os = "linux")]
            Domain::CLOCK_MONOTONIC_RAW => ClockId::MonotonicRaw,
            _ => ClockId::Monotonic,
        };
        let now = clock_gettime(clock);
        now.tv_sec as u64 * ticks_per_s() + now.tv_nsec as u64
    }

    pub fn ticks_per_s() -> u64 {
        1_000_000_000
    }
}

/// macOS. `Instant` counts as CLOCK_UPTIME_RAW does, without the time that the machine sleeps; both
/// clocks here count that time too, so a calibration holds until the machine sleeps.
#[cfg(target_os = "macos")]
mod system {
    use ash::vk::TimeDomainKHR as Domain;

    pub const DOMAINS: &[Domain] = &[Domain::CLOCK_MONOTONIC_RAW, Domain::CLOCK_MONOTONIC];

    /// The clocks' numbers in time.h. rustix has no CLOCK_MONOTONIC_RAW for macOS.
    const CLOCK_MONOTONIC_RAW: u32 = 4;
    const CLOCK_MONOTONIC: u32 = 6;

    unsafe extern "C" {
        safe fn clock_gettime_nsec_np(clock: u32) -> u64;
    }

    pub fn read(domain: Domain) -> u64 {
        clock_gettime_nsec_np(match domain {
            Domain::CLOCK_MONOTONIC_RAW => CLOCK_MONOTONIC_RAW,
            _ => CLOCK_MONOTONIC,
        })
    }

    pub fn ticks_per_s() -> u64 {
        1_000_000_000
    }
}

/// Windows, where `Instant` is QueryPerformanceCounter, too.
#[cfg(windows)]
mod system {
    use ash::vk::TimeDomainKHR as Domain;

    pub const DOMAINS: &[Domain] = &[Domain::QUERY_PERFORMANCE_COUNTER];

    #[link(name = "kernel32")]
    unsafe extern "system" {
        fn QueryPerformanceCounter(ticks: *mut i64) -> i32;
        fn QueryPerformanceFrequency(ticks_per_s: *mut i64) -> i32;
    }

    pub fn read(_: Domain) -> u64 {
        let mut ticks = 0;
        // SAFETY: the function writes one i64. It does not fail since Windows XP.
        unsafe { QueryPerformanceCounter(&mut ticks) };
        ticks as u64
    }

    pub fn ticks_per_s() -> u64 {
        let mut ticks_per_s = 0;
        // SAFETY: as above.
        unsafe { QueryPerformanceFrequency(&mut ticks_per_s) };
        // Not 0, which would be a division by zero.
        ticks_per_s.max(1) as u64
    }
}

/// Other systems have no clock that Vulkan names.
#[cfg(not(any(unix, windows)))]
mod system {
    use ash::vk::TimeDomainKHR as Domain;

    pub const DOMAINS: &[Domain] = &[];

    pub fn read(_: Domain) -> u64 {
        0
    }

    pub fn ticks_per_s() -> u64 {
        1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ash::vk::TimeDomainKHR as Domain;

    #[test]
    fn a_device_needs_its_own_clock_and_one_of_this_system() {
        let all = [
            Domain::QUERY_PERFORMANCE_COUNTER,
            Domain::CLOCK_MONOTONIC_RAW,
            Domain::CLOCK_MONOTONIC,
            Domain::DEVICE,
        ];
        assert_eq!(domain_among(&all), system::DOMAINS.first().copied());
        assert_eq!(domain_among(&all[..3]), None);
        assert_eq!(domain_among(&[Domain::DEVICE]), None);
        assert_eq!(domain_among(&[]), None);
        for domain in system::DOMAINS {
            assert_eq!(domain_among(&[*domain, Domain::DEVICE]), Some(*domain));
        }
        #[cfg(target_os = "linux")]
        assert_eq!(domain_among(&[Domain::DEVICE, Domain::QUERY_PERFORMANCE_COUNTER]), None);
    }

    #[test]
    fn ticks_of_any_length_become_nanoseconds() {
        // Windows counts 10 MHz; other systems nanoseconds.
        assert_eq!(to_ns(25, 10_000_000), 2_500);
        assert_eq!(to_ns(7, 1_000_000_000), 7);
        // A tick of a third of a microsecond is rounded down.
        assert_eq!(to_ns(1, 3_000_000), 333);
        assert_eq!(to_ns(u64::MAX, 1), i128::from(u64::MAX) * 1_000_000_000);
    }

    #[test]
    fn instant_of_inverts_each_clock_of_this_system() {
        for domain in system::DOMAINS {
            let before = Instant::now();
            let between = system::read(*domain);
            let after = Instant::now();
            let (at, off_ns) = instant_of(*domain, between);
            let slack = Duration::from_nanos(off_ns as u64 + 1);
            assert!(at + slack >= before && at <= after + slack, "{domain:?}: {off_ns}");
            // It converts future times, too.
            assert!(instant_of(*domain, between + system::ticks_per_s()).0 > after);
        }
    }
}
