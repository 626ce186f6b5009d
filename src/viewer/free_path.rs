//! Names for files that the windows save on their own.

use std::path::PathBuf;

/// Returns the first of `name(1)`, `name(2)`, … that does not exist.
pub fn free_path(name: impl Fn(u32) -> PathBuf) -> PathBuf {
    let mut n = 1;
    while name(n).symlink_metadata().is_ok() {
        n += 1;
    }
    name(n)
}
