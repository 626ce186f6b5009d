//! Work spread over the processor's threads.

use rayon::prelude::*;

/// Returns `f` of 0…n−1 in order, computed on all threads.
pub fn parallel_map<T: Send>(n: usize, f: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    (0..n).into_par_iter().map(f).collect()
}
