//! The host's monotonic clock, which all host times are taken with (`std::time::Instant`): what it
//! costs and how fine it is, measured on this machine. A time shorter than a few resolutions or
//! overheads says nothing, and the results carry both.

use std::hint::black_box;
use std::time::Instant;

/// Readings taken to find the resolution. 20 000 readings of 20–50 ns take about a millisecond.
const N_RESOLUTION_READINGS: usize = 20_000;
/// The overhead is the median over batches, so that a batch that was interrupted by the scheduler
/// does not count, of the mean within a batch, so that the resolution does not show.
const N_OVERHEAD_BATCHES: usize = 101;
const N_OVERHEAD_CALLS: u32 = 64;

/// Both in nanoseconds.
#[derive(Debug, Clone, Copy)]
pub struct ClockQuality {
    /// The smallest step ever seen between two readings: an upper bound of the tick, since a clock
    /// that is read more slowly than it ticks cannot show its tick.
    pub resolution_ns: u64,
    /// What one reading costs. An interval between two readings holds about one of them.
    pub overhead_ns: f64,
}

impl ClockQuality {
    /// Takes a few milliseconds.
    pub fn measure() -> Self {
        let epoch = Instant::now();
        ClockQuality {
            resolution_ns: measure_resolution_ns(epoch),
            overhead_ns: measure_overhead_ns(epoch),
        }
    }
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
    fn the_clock_has_a_tick_and_a_cost() {
        let clock = ClockQuality::measure();
        assert!(clock.resolution_ns > 0);
        // Any machine that can run Vulkan reads its clock within 100 µs; 0 would mean that nothing
        // was measured.
        assert!(clock.overhead_ns > 0.0 && clock.overhead_ns < 1e5, "{} ns", clock.overhead_ns);
    }
}
