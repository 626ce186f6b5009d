//! Which failures are worth another try.

use std::io;
use std::path::Path;

use crate::error::Error;

/// What may be otherwise later or on another node: a full disk, a file server that is away, a
/// device that was lost or is not there, Ctrl-C or an engine's signal. Everything else is as it is.
pub fn may_pass(error: Error) -> Error {
    match error {
        Error::Vulkan { .. } | Error::Interrupted => Error::Transient { what: error.to_string() },
        other => other,
    }
}

/// The error of a file that a shard reads or writes.
pub fn of_io(path: &Path, cause: &io::Error) -> Error {
    Error::of_io(path, cause)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_may_pass_is_75_and_what_stays_is_not() {
        let code = |cause: io::Error| of_io(Path::new("a"), &cause).exit_code();
        // ENOSPC, EDQUOT, ESTALE, EIO; ENOENT, EACCES, EROFS.
        for (number, expected) in
            [(28, 75), (122, 75), (116, 75), (5, 75), (2, 2), (13, 2), (30, 2)]
        {
            assert_eq!(code(io::Error::from_raw_os_error(number)), expected, "{number}");
        }
        assert_eq!(may_pass(Error::vulkan("vkQueueSubmit2", "device lost")).exit_code(), 75);
        assert_eq!(
            (may_pass(Error::Interrupted).exit_code(), may_pass(Error::usage("no")).exit_code()),
            (75, 2)
        );
    }
}
