//! Rates: the time that a pipeline takes for a unit of its work, and its corrections.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::timer::ScopeTime;

/// The most by which one frame corrects a rate: one odd time, of a busy machine, does not spoil it.
const MAX_CORRECTION: f64 = 4.0;

/// The work of one dispatch or draw.
#[derive(Clone, Copy)]
pub(super) enum Units {
    /// Workgroups, or rows of workgroups or of the picture, that can be run apart.
    Apart(u32),
    /// Workgroups that are run together.
    Together(u32),
    /// An indirect dispatch, of which only the device knows the number of workgroups.
    Indirect,
}

/// Nanoseconds that a pipeline takes for a unit of its work. 0: unknown.
#[derive(Clone, Default)]
pub(super) struct Rate(Arc<AtomicU64>);

impl Rate {
    pub fn get(&self) -> Option<f64> {
        let ns = f64::from_bits(self.0.load(Ordering::Relaxed));
        (ns > 0.0).then_some(ns)
    }

    pub fn set(&self, ns: f64) {
        // A unit takes some time, however short.
        self.0.store(ns.max(f64::MIN_POSITIVE).to_bits(), Ordering::Relaxed);
    }
}

/// The work that a recording gives to a pipeline in a scope.
pub(super) struct Work {
    /// The scope, by its place among the times; none outside of all scopes.
    pub i_scope: Option<u32>,
    /// The pipeline's rate.
    pub rate: Rate,
    /// Units of work, as the rate counts them.
    pub n_units: f64,
}

/// The pacing of one recording.
#[derive(Default)]
pub(super) struct Pace {
    /// Predicted time of what is recorded and not yet submitted, in ns.
    pub pending_ns: f64,
    /// Work whose time was predicted.
    pub work: Vec<Work>,
    /// Scopes in which parts were timed alone, so that their own times say nothing.
    pub timed: Vec<u32>,
}

impl Pace {
    /// Corrects the rates of pipelines by the measured times of the scopes that they ran in. Of
    /// several pipelines in a scope all are corrected by the same factor.
    pub fn correct(&mut self, times: &[ScopeTime]) {
        for (i_scope, time) in (0..).zip(times).filter(|(i, _)| !self.timed.contains(i)) {
            let in_scope = || self.work.iter().filter(|work| work.i_scope == Some(i_scope));
            let ns = |work: &Work| work.rate.get().unwrap_or(0.0) * work.n_units;
            let predicted: f64 = in_scope().map(ns).sum();
            let factor = 1e6 * time.ms() / predicted;
            if factor > 0.0 && factor.is_finite() {
                let factor = factor.clamp(1.0 / MAX_CORRECTION, MAX_CORRECTION);
                let mut corrected: Vec<*const AtomicU64> = vec![];
                for Work { rate, .. } in in_scope() {
                    let is_new = !corrected.contains(&Arc::as_ptr(&rate.0));
                    if let Some(ns) = rate.get().filter(|_| is_new) {
                        corrected.push(Arc::as_ptr(&rate.0));
                        rate.set(ns * factor);
                    }
                }
            }
        }
        *self = Pace::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(ms: &[f64]) -> Vec<ScopeTime> {
        let time = |ms: &f64| ScopeTime { name: "pass", begin_ns: 5.0, end_ns: 5.0 + 1e6 * ms };
        ms.iter().map(time).collect()
    }

    #[test]
    fn measured_times_correct_the_rates_of_a_scope_once() {
        let [a, b, c] = [100.0, 50.0, 7.0].map(|ns| {
            let rate = Rate::default();
            assert_eq!(rate.get(), None);
            rate.set(ns);
            rate
        });
        let work = |i, rate: &Rate, n_units| Work { i_scope: Some(i), rate: rate.clone(), n_units };
        let work = vec![work(0, &a, 6e3), work(0, &a, 4e3), work(0, &b, 2e4), work(2, &c, 1.0)];
        let mut pace = Pace { work, ..Pace::default() };
        // Predicted 2 ms in the first scope, nothing in the second one, 7 ns in the third.
        pace.correct(&times(&[3.0, 1.0, 1.0]));
        assert_eq!((a.get(), b.get()), (Some(150.0), Some(75.0)));
        // One frame corrects by a factor of 4 at most.
        assert_eq!(c.get(), Some(28.0));
        assert!(pace.work.is_empty());
        // No time at all is no measurement.
        pace.work = vec![Work { i_scope: Some(0), rate: a.clone(), n_units: 1.0 }];
        pace.correct(&times(&[0.0]));
        assert_eq!(a.get(), Some(150.0));
        // The time of a scope says nothing either if parts of it were timed alone.
        pace.work = vec![Work { i_scope: Some(0), rate: a.clone(), n_units: 1.0 }];
        pace.timed = vec![0];
        pace.correct(&times(&[5.0]));
        assert_eq!(a.get(), Some(150.0));
    }
}
