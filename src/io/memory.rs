//! Memory of the machine: what does not fit is refused before it is allocated.

use sysinfo::{MemoryRefreshKind, RefreshKind, System};

use crate::error::{Error, Result};

/// Sizes below this are not checked, in bytes: every machine that runs nimbus has them.
const SMALL: u64 = 64 << 20;

/// Returns the bytes that can be allocated now: of the machine, and of its control group. Where the
/// system does not say, there is no limit.
pub fn available() -> u64 {
    let memory = RefreshKind::nothing().with_memory(MemoryRefreshKind::nothing().with_ram());
    let system = System::new_with_specifics(memory);
    let of_group = system.cgroup_limits().map_or(u64::MAX, |limits| limits.free_memory);
    let of_machine = system.available_memory();
    if of_machine == 0 { of_group } else { of_machine.min(of_group) }
}

/// Checks that `n_bytes` can be allocated; `what` they are for stands in the message.
///
/// # Errors
/// When there is less memory, with both sizes.
pub fn check(n_bytes: u64, what: impl FnOnce() -> String) -> Result<()> {
    if n_bytes < SMALL {
        return Ok(());
    }
    let available = available();
    if n_bytes <= available {
        return Ok(());
    }
    let [needed, available] = [n_bytes, available].map(|bytes| bytes >> 20);
    Err(Error::limit(format!(
        "{} need {needed} MiB of memory, {available} MiB are free; expected fewer, or more memory",
        what()
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_refused_with_both_sizes() {
        assert!(available() > 0);
        assert!(check(1 << 20, || unreachable!()).is_ok());
        let error = check(1 << 60, || "a.ply: 9 particles".to_owned()).expect_err("too much");
        let text = error.to_string();
        let start = "a.ply: 9 particles need 1099511627776 MiB of memory, ";
        assert!(text.contains(start) && text.contains(" MiB are free"), "{text}");
        assert_eq!(error.exit_code(), 2);
    }
}
