//! Work that takes longer than a submission is to take, and cannot be divided.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// The pipelines whose smallest part takes longer than the limit.
#[derive(Default)]
pub(super) struct OverLimit(Mutex<BTreeMap<String, Over>>);

#[derive(Default)]
struct Over {
    /// Greatest predicted time, in ns.
    ns: f64,
    is_told: bool,
}

impl OverLimit {
    /// Adds a pipeline whose smallest part is predicted to take `ns`.
    pub fn add(&self, pipeline: &str, ns: f64) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let over = all.entry(pipeline.to_owned()).or_default();
        over.ns = over.ns.max(ns);
    }

    /// Returns a note on each pipeline that was added since the last call, for a limit in ns. Each
    /// is told once.
    pub fn take(&self, limit_ns: f64) -> Vec<String> {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let note = |(name, over): (&String, &mut Over)| {
            over.is_told = true;
            let [takes, limit] = [over.ns, limit_ns].map(|ns| 1e-6 * ns);
            format!(
                "a submission takes about {takes:.3} ms, more than the {limit} ms of \
                 --max-submit-ms: {name} cannot be divided further"
            )
        };
        all.iter_mut().filter(|(_, over)| !over.is_told).map(note).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pipeline_is_told_once_with_its_greatest_time() {
        let over = OverLimit::default();
        assert_eq!(over.take(20e6), [""; 0]);
        over.add("sort.count", 31e6);
        over.add("sort.count", 32e6);
        over.add("generate", 25e6);
        let notes = over.take(20e6);
        assert_eq!(notes.len(), 2);
        assert!(notes[0].contains("25.000 ms") && notes[0].contains("generate"), "{notes:?}");
        assert!(notes[1].contains("about 32.000 ms, more than the 20 ms"), "{notes:?}");
        over.add("sort.count", 40e6);
        assert_eq!(over.take(20e6), [""; 0]);
    }
}
