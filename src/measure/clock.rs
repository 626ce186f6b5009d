//! The precision of the host's monotonic clock (`std::time::Instant`), measured on this machine. A
//! time of a few resolutions or overheads is meaningless; the results therefore record both.

use std::hint::black_box;
use std::time::Instant;

/// Readings that determine the resolution. 20 000 readings of 20–50 ns take about a millisecond.
const N_RESOLUTION_READINGS: usize = 20_000;
/// Batches of readings. The overhead is the median over batches, which leaves out those that the
/// scheduler interrupted, of the mean within a batch, which averages the resolution out.
const N_OVERHEAD_BATCHES: usize = 101;
const N_OVERHEAD_CALLS: u32 = 64;

/// The precision of a clock.
#[derive(Debug, Clone, Copy)]
pub struct ClockQuality {
    /// Smallest step between two readings, in ns: an upper bound of the tick, which stays hidden if
    /// a reading takes longer.
    pub resolution_ns: u64,
    /// Time of one reading, in ns. An interval between two readings contains about one of them.
    pub overhead_ns: f64,
}

impl ClockQuality {
    /// Measures both, which takes a few milliseconds.
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
    // A coarse clock may not tick during the readings; wait for one more tick.
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
        // The last reading is one more call.
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
