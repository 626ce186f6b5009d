//! Failures that another try, or another node, may not meet.

use std::io;
use std::path::Path;

use crate::error::Error;

/// Turns errors that may not happen again into [`Error::Transient`]: a lost or missing device,
/// Ctrl-C, or the signal with which Slurm takes a node back. Other errors stay as they are.
pub fn as_transient(error: Error) -> Error {
    match error {
        Error::Vulkan { .. } | Error::Interrupted => Error::Transient { what: error.to_string() },
        other => other,
    }
}

/// Returns a conversion of failed file operations on `path` by [`Error::of_io`].
pub fn io_error(path: &Path) -> impl Fn(io::Error) -> Error + '_ {
    move |cause| Error::of_io(path, &cause)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transient_failures_have_exit_code_75_and_permanent_ones_have_2() {
        let code = |cause: io::Error| io_error(Path::new("a"))(cause).exit_code();
        // ENOSPC, EDQUOT, ESTALE, EIO, EAGAIN, ENOMEM; ENOENT, EACCES, EROFS.
        for (number, expected) in
            [(28, 75), (122, 75), (116, 75), (5, 75), (11, 75), (12, 75), (2, 2), (13, 2), (30, 2)]
        {
            assert_eq!(code(io::Error::from_raw_os_error(number)), expected, "{number}");
        }
        assert_eq!(as_transient(Error::vulkan("vkQueueSubmit2", "device lost")).exit_code(), 75);
        assert_eq!(as_transient(Error::Interrupted).exit_code(), 75);
        assert_eq!(as_transient(Error::usage("no")).exit_code(), 2);
    }
}
