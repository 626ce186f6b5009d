//! One monotonic clock for every host time, with what it costs and how fine it is, measured on this machine: a time
//! shorter than a few resolutions or overheads says nothing, and the results carry both.

use std::hint::black_box;
use std::time::Instant;

/// Readings taken to find the resolution. 20 000 readings of 20–50 ns take about a millisecond.
const N_RESOLUTION_READINGS: usize = 20_000;
/// The overhead is the median over batches, so that a batch that was interrupted by the scheduler does not count,
/// of the mean within a batch, so that the resolution does not show.
const N_OVERHEAD_BATCHES: usize = 101;
const N_OVERHEAD_CALLS: u32 = 64;

/// Nanoseconds since the clock was started, never going back. Copies share the epoch, so times taken on different
/// threads may be subtracted.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    epoch: Instant,
    resolution_ns: u64,
    overhead_ns: f64,
}

impl Clock {
    /// Starts at zero, then measures itself (a few milliseconds).
    pub fn start() -> Self {
        let epoch = Instant::now();
        Clock { epoch, resolution_ns: measure_resolution_ns(epoch), overhead_ns: measure_overhead_ns(epoch) }
    }

    /// u64 holds 584 years of nanoseconds.
    pub fn now_ns(&self) -> u64 {
        elapsed_ns(self.epoch)
    }

    /// The smallest step ever seen between two readings: an upper bound of the tick, since a clock that is read more
    /// slowly than it ticks cannot show its tick.
    pub fn resolution_ns(&self) -> u64 {
        self.resolution_ns
    }

    /// What one `now_ns` costs. An interval between two readings holds about one of them.
    pub fn overhead_ns(&self) -> f64 {
        self.overhead_ns
    }
}

/// Milliseconds between two readings; negative if `end_ns` is the earlier one, so that a mix-up is seen.
pub fn ms_between(start_ns: u64, end_ns: u64) -> f64 {
    if end_ns >= start_ns { (end_ns - start_ns) as f64 * 1e-6 } else { (start_ns - end_ns) as f64 * -1e-6 }
}

fn elapsed_ns(epoch: Instant) -> u64 {
    u64::try_from(epoch.elapsed().as_nanos()).unwrap_or(u64::MAX)
}

fn measure_resolution_ns(epoch: Instant) -> u64 {
    let mut smallest = u64::MAX;
    let mut last = elapsed_ns(epoch);
    for _ in 0..N_RESOLUTION_READINGS {
        let now = elapsed_ns(epoch);
        if now > last {
            smallest = smallest.min(now - last);
            last = now;
        }
    }
    // A clock so coarse that it never ticked during the readings: one more tick is waited for.
    while smallest == u64::MAX {
        let now = elapsed_ns(epoch);
        if now > last {
            smallest = now - last;
        }
    }
    smallest
}

fn measure_overhead_ns(epoch: Instant) -> f64 {
    let mut batches = [0.0_f64; N_OVERHEAD_BATCHES];
    for batch in &mut batches {
        let start = elapsed_ns(epoch);
        for _ in 0..N_OVERHEAD_CALLS {
            black_box(elapsed_ns(black_box(epoch)));
        }
        // The closing reading is one more call.
        *batch = (elapsed_ns(epoch) - start) as f64 / f64::from(N_OVERHEAD_CALLS + 1);
    }
    batches.sort_by(f64::total_cmp);
    batches[N_OVERHEAD_BATCHES / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn never_goes_back_and_knows_itself() {
        let clock = Clock::start();
        let readings: Vec<u64> = (0..10_000).map(|_| clock.now_ns()).collect();
        assert!(readings.windows(2).all(|pair| pair[0] <= pair[1]));
        assert!(clock.resolution_ns() > 0);
        // Any machine that can run Vulkan reads its clock within 100 µs; 0 would mean that nothing was measured.
        assert!(clock.overhead_ns() > 0.0 && clock.overhead_ns() < 1e5, "{} ns", clock.overhead_ns());
    }

    #[test]
    fn a_sleep_is_never_shorter_than_asked() {
        let clock = Clock::start();
        let start = clock.now_ns();
        std::thread::sleep(std::time::Duration::from_millis(5));
        assert!(ms_between(start, clock.now_ns()) >= 5.0);
    }

    #[test]
    fn copies_share_the_epoch() {
        let clock = Clock::start();
        let before = clock.now_ns();
        let elsewhere = std::thread::spawn(move || clock.now_ns()).join().unwrap();
        assert!(before <= elsewhere && elsewhere <= clock.now_ns());
    }

    #[test]
    fn ms_between_keeps_the_sign() {
        assert_eq!(ms_between(1_000_000, 3_500_000), 2.5);
        assert_eq!(ms_between(3_500_000, 1_000_000), -2.5);
    }
}
