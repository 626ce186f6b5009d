//! Durations on the host's clock.

use std::time::Instant;

/// Returns the time from `begin` to `end` in ms; 0 if `end` is earlier.
pub(super) fn ms(begin: Instant, end: Instant) -> f64 {
    end.saturating_duration_since(begin).as_secs_f64() * 1e3
}
