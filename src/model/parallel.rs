//! Work spread over the processor's threads.

use std::sync::OnceLock;

use rayon::prelude::*;

/// Returns `f` of 0…n−1 in order, computed on all threads; on the caller's where no threads can be
/// started.
pub fn parallel_map<T: Send>(n: usize, f: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    if has_pool() { (0..n).into_par_iter().map(f).collect() } else { (0..n).map(f).collect() }
}

/// Returns whether there is a pool of threads. rayon would panic where its own cannot be started.
fn has_pool() -> bool {
    static IS_STARTED: OnceLock<bool> = OnceLock::new();
    rayon::current_thread_index().is_some()
        || *IS_STARTED.get_or_init(|| match rayon::ThreadPoolBuilder::new().build_global() {
            Ok(()) => true,
            // A failure to start threads has a cause; the other error says that the pool exists.
            Err(error) => std::error::Error::source(&error).is_none(),
        })
}
