//! Timestamps of few valid bits, extended to a count that does not wrap.
//!
//! A queue counts in the low bits of a timestamp, as few as 36: at 1 ns a tick they begin again
//! every 69 s. The host's clock tells how many ticks have passed since the timestamp before, which
//! decides how often the counter has wrapped.

use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use super::limits::Limits;

/// The timestamps of one device in the order in which they are seen.
#[derive(Debug)]
pub(super) struct TickClock {
    mask: u64,
    period_ns: f64,
    /// The last timestamp, extended, and the host's time when it was seen.
    last: Mutex<Option<(u64, Instant)>>,
}

impl TickClock {
    pub fn new(limits: &Limits) -> TickClock {
        let (mask, period_ns) = (limits.tick_mask(), limits.timestamp_period_ns);
        TickClock { mask, period_ns, last: Mutex::new(None) }
    }

    /// Returns the nanoseconds from the device's own zero to each of `ticks`, which are timestamps
    /// of one submission, or of one calibration, that was seen at `at`.
    ///
    /// Two calls may lie any time apart. The timestamps of one call, and the time from the first of
    /// them to `at`, must span less than half of the counter's period.
    pub fn ns(&self, ticks: &[u64], at: Instant) -> Vec<f64> {
        let Some(&first) = ticks.first() else { return vec![] };
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let expected = last.map(|(ticks, then)| {
            let after = at.saturating_duration_since(then).as_secs_f64();
            let before = then.saturating_duration_since(at).as_secs_f64();
            i128::from(ticks).saturating_add((1e9 * (after - before) / self.period_ns) as i128)
        });
        let base = expected.map_or(first & self.mask, |near| nearest(first, self.mask, near));
        *last = Some((base, at));
        drop(last);
        let of = |t: &u64| nearest(*t, self.mask, base.into()) as f64 * self.period_ns;
        ticks.iter().map(of).collect()
    }
}

/// Returns the number nearest to `near` whose bits of `mask` are those of `ticks`; `mask` has the
/// lowest bits up to some bit.
fn nearest(ticks: u64, mask: u64, near: i128) -> u64 {
    let period = i128::from(mask) + 1;
    let ahead = (i128::from(ticks & mask) - near).rem_euclid(period);
    let from_near = if 2 * ahead > period { ahead - period } else { ahead };
    let found = near + from_near;
    // Before the device's zero there is no timestamp, and a counter of 64 bits never ends.
    let found = if found < 0 { found + period } else { found };
    u64::try_from(found).unwrap_or(ticks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn clock(bits: u32, period_ns: f64) -> TickClock {
        let limits = Limits {
            timestamp_valid_bits: bits,
            timestamp_period_ns: period_ns,
            ..Limits::default()
        };
        TickClock::new(&limits)
    }

    /// Seconds of a run, and what a counter of 36 bits that began at `zero` shows then, with
    /// rubbish in the bits that do not count.
    fn shown(zero: u64, s: f64) -> u64 {
        ((zero + (1e9 * s) as u64) & ((1 << 36) - 1)) | 0xabc << 40
    }

    #[test]
    fn a_counter_of_36_bits_goes_on_when_it_wraps() {
        let (clock, begin) = (clock(36, 1.0), Instant::now());
        // 1 s before the first wrap at 68.7 s. The host sees a frame some ms after its end.
        let zero = (1 << 36) - 1_000_000_000;
        let times = [0.0, 0.5, 0.999, 1.001, 30.0, 69.0, 70.0, 400.0, 4000.0, 90_000.0];
        let ns = |s: f64| {
            let at = begin + Duration::from_secs_f64(s + 0.1 + 0.02 * (7.0 * s).sin());
            clock.ns(&[shown(zero, s), shown(zero, s + 0.002)], at)
        };
        let first = ns(times[0])[0];
        assert_eq!(first, zero as f64);
        for s in &times[1..] {
            let [a, b] = ns(*s)[..] else { panic!("two times") };
            let expected = 1e9 * s;
            assert!((a - first - expected).abs() < 2.0, "{s}: {}", a - first - expected);
            assert!((b - a - 2e6).abs() < 2.0, "{s}: {}", b - a);
        }
    }

    #[test]
    fn a_pass_that_the_wrap_cuts_keeps_its_length_and_order() {
        let (clock, at) = (clock(36, 83.333), Instant::now());
        let end = 1 << 36;
        // The second pass begins before the wrap and ends after it; passes may overlap, so that a
        // later timestamp in the list is an earlier time.
        let ns = clock.ns(&[end - 100, end - 50, end - 10, 30, end - 5, 40], at);
        let lengths: Vec<f64> = ns.chunks(2).map(|p| ((p[1] - p[0]) / 83.333).round()).collect();
        assert_eq!(lengths, [50.0, 40.0, 45.0]);
        assert!(ns[3] > ns[0] && ns[4] > ns[2], "{ns:?}");
    }

    #[test]
    fn whole_and_missing_counters_are_left_as_they_are() {
        let at = Instant::now();
        let whole = clock(64, 1.0);
        let late = 1_u64 << 62;
        assert_eq!(whole.ns(&[late, late + 1024], at), [late as f64, (late + 1024) as f64]);
        assert_eq!(whole.ns(&[5], at)[0], 5.0);
        assert_eq!(clock(0, 1.0).ns(&[], at), [0.0; 0]);
        // A device without timestamps has no tick and no period: nothing panics.
        assert!(clock(0, 0.0).ns(&[7, 9], at).iter().all(|ns| *ns == 0.0));
    }

    #[test]
    fn readings_of_two_threads_out_of_order_agree() {
        let (clock, begin) = (clock(36, 1.0), Instant::now());
        let zero = (1 << 36) - 1_000;
        let at = |s: f64| begin + Duration::from_secs_f64(s);
        clock.ns(&[shown(zero, 0.0)], at(0.0));
        let later = clock.ns(&[shown(zero, 1.0)], at(1.0))[0];
        let earlier = clock.ns(&[shown(zero, 0.5)], at(0.5))[0];
        assert!((later - earlier - 5e8).abs() < 2.0, "{}", later - earlier);
    }
}
