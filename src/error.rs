//! One error type, by cause. Each message says what was wrong, where (file:line:column, key, or
//! pass and Vulkan call) and what was expected, so that a command prints the message alone.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Result of an operation of nimbus.
pub type Result<T> = std::result::Result<T, Error>;

/// A failure, by cause.
#[derive(Debug, Clone, PartialEq)]
pub enum Error {
    /// Bad input: a scene file, a box file, a particle list, a value given with `--set`.
    Scene {
        /// Place of the fault.
        at: Place,
        /// Message.
        what: String,
    },
    /// A shader that does not compile or does not match the host's declaration of it.
    Shader {
        /// Name of the shader.
        name: String,
        /// Message.
        what: String,
    },
    /// A Vulkan call that failed, or no device to make it on.
    Vulkan {
        /// Name of the Vulkan call.
        call: String,
        /// Message.
        what: String,
    },
    /// A request beyond a limit of the device or of nimbus, found before anything is allocated.
    Limit {
        /// Message.
        what: String,
    },
    /// A file that cannot be read or written.
    Io {
        /// Path of the file.
        path: PathBuf,
        /// Message.
        what: String,
    },
    /// Arguments that do not fit together.
    Usage {
        /// Message.
        what: String,
    },
    /// A check that was asked for and failed (validation messages, a comparison).
    Check {
        /// Message.
        what: String,
    },
    /// A fault of nimbus itself: a thread that panicked.
    Fault {
        /// Message.
        what: String,
    },
    /// A failure that may pass later or on another node, so that another try is worth it.
    Transient {
        /// Message.
        what: String,
    },
    /// Two results of the same work that differ.
    Conflict {
        /// Message.
        what: String,
    },
    /// Ctrl-C. Finished results are kept.
    Interrupted,
}

/// Place of a fault in an input.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Place {
    /// File name as given, or `--set key=value`.
    pub source: String,
    /// Line, from 1; 0 for the whole file.
    pub line: usize,
    /// Column in characters, from 1; 0 for the whole line.
    pub column: usize,
}

impl Place {
    /// Returns a place that is a whole file.
    pub fn file(path: &Path) -> Self {
        Place { source: path.display().to_string(), line: 0, column: 0 }
    }

    /// Returns a line and a column, both from 1, of a file.
    pub fn line(path: &Path, line: usize, column: usize) -> Self {
        Place { source: path.display().to_string(), line, column }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.line, self.column) {
            (0, _) => write!(f, "{}", self.source),
            (line, 0) => write!(f, "{}:{line}", self.source),
            (line, column) => write!(f, "{}:{line}:{column}", self.source),
        }
    }
}

impl Error {
    /// Returns an [`Error::Scene`].
    pub fn scene(at: Place, what: impl Into<String>) -> Self {
        Error::Scene { at, what: what.into() }
    }

    /// Returns an [`Error::Io`].
    pub fn io(path: &Path, cause: impl fmt::Display) -> Self {
        Error::Io { path: path.to_owned(), what: cause_text(&cause.to_string()) }
    }

    /// Returns [`Error::Transient`] for a failure that may pass later or on another node (a full
    /// disk, a file server that is away, too many processes), and [`Error::Io`] for any other.
    pub fn of_io(path: &Path, cause: &io::Error) -> Self {
        use io::ErrorKind::{
            HostUnreachable, Interrupted, NetworkDown, NetworkUnreachable, OutOfMemory,
            QuotaExceeded, ResourceBusy, StaleNetworkFileHandle, StorageFull, TimedOut, WouldBlock,
        };
        match cause.kind() {
            StorageFull
            | QuotaExceeded
            | StaleNetworkFileHandle
            | TimedOut
            | Interrupted
            | ResourceBusy
            | HostUnreachable
            | NetworkDown
            | NetworkUnreachable
            // The system has no room for another thread or process.
            | OutOfMemory
            | WouldBlock => Error::transient(path, cause),
            // A disk or a server that answers with an error: Rust has no kind for it.
            _ if is_io_error(cause) => Error::transient(path, cause),
            _ => Error::io(path, cause),
        }
    }

    fn transient(path: &Path, cause: &io::Error) -> Self {
        Error::Transient { what: format!("{}: {}", path.display(), cause_text(&cause.to_string())) }
    }

    /// Returns an [`Error::Vulkan`].
    pub fn vulkan(call: impl Into<String>, cause: impl fmt::Display) -> Self {
        Error::Vulkan { call: call.into(), what: cause_text(&cause.to_string()) }
    }

    /// Returns an [`Error::Limit`].
    pub fn limit(what: impl Into<String>) -> Self {
        Error::Limit { what: what.into() }
    }

    /// Returns an [`Error::Usage`].
    pub fn usage(what: impl Into<String>) -> Self {
        Error::Usage { what: what.into() }
    }

    /// Adds to the message where the error happened, such as a part of a run.
    pub fn within(self, place: &str) -> Self {
        self.with_end(&format!(" (in {place})"))
    }

    /// Adds a remark to the message, such as where results were kept.
    pub fn with_note(self, note: &str) -> Self {
        self.with_end(&format!("; {note}"))
    }

    fn with_end(mut self, end: &str) -> Self {
        match &mut self {
            Error::Scene { what, .. }
            | Error::Shader { what, .. }
            | Error::Vulkan { what, .. }
            | Error::Limit { what }
            | Error::Io { what, .. }
            | Error::Usage { what }
            | Error::Check { what }
            | Error::Fault { what }
            | Error::Transient { what }
            | Error::Conflict { what } => what.push_str(end),
            Error::Interrupted => {}
        }
        self
    }

    /// Returns the exit code of the program: 1 a check failed, 2 bad input or usage, 3 device or
    /// driver, 70 results that contradict each other, 75 worth another try, 101 a fault of nimbus
    /// itself, 130 interrupted. 70 and 75 are those of sysexits.h.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Check { .. } => 1,
            Error::Scene { .. }
            | Error::Shader { .. }
            | Error::Limit { .. }
            | Error::Io { .. }
            | Error::Usage { .. } => 2,
            Error::Vulkan { .. } => 3,
            Error::Conflict { .. } => 70,
            Error::Transient { .. } => 75,
            Error::Fault { .. } => 101,
            Error::Interrupted => 130,
        }
    }
}

/// Causes that the system names by a number, and what to do.
const REMEDIES: [(&str, &str); 4] = [
    (
        "Permission denied (os error 13)",
        "permission denied: this user may not read or write here; \
      choose another place, or change the permissions",
    ),
    ("Operation not permitted (os error 1)", "not permitted for this user; choose another place"),
    ("Read-only file system (os error 30)", "the file system is read-only; choose another place"),
    (
        "No space left on device (os error 28)",
        "no space left on the device; make room, or choose \
      another place",
    ),
];

/// Returns the cause of an error for a user: with what to do, without the names of temporary files,
/// the places in a library's source, and the system's numbers.
fn cause_text(cause: &str) -> String {
    let mut text = cause.to_owned();
    for (named, remedy) in REMEDIES {
        text = text.replace(named, remedy);
    }
    // Crate `tempfile` adds the path of the temporary file.
    if let Some((before, path)) = text.split_once(" at path \"") {
        let after = path.split_once('"').map_or("", |(_, after)| after);
        text = format!("{before}{after}");
    }
    if let Some((before, number)) = text.split_once(" (os error ")
        && let Some((digits, after)) = number.split_once(')')
        && digits.chars().all(|c| c.is_ascii_digit())
    {
        text = format!("{before}{after}");
    }
    text
}

/// The system's numbers for an I/O error: EIO, the same on every Unix.
#[cfg(not(windows))]
const IO_ERRORS: &[i32] = &[5];
/// The system's numbers for an I/O error: ERROR_CRC, ERROR_IO_DEVICE.
#[cfg(windows)]
const IO_ERRORS: &[i32] = &[23, 1117];

/// Returns whether the system names a failure of the disk itself.
fn is_io_error(cause: &io::Error) -> bool {
    cause.raw_os_error().is_some_and(|number| IO_ERRORS.contains(&number))
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Scene { at, what } => write!(f, "{at}: {what}"),
            Error::Shader { name, what } => write!(f, "shader {name}: {what}"),
            Error::Vulkan { call, what } => write!(f, "Vulkan: {call}: {what}"),
            Error::Limit { what } => write!(f, "limit: {what}"),
            Error::Io { path, what } => write!(f, "{}: {what}", path.display()),
            Error::Usage { what }
            | Error::Check { what }
            | Error::Fault { what }
            | Error::Transient { what }
            | Error::Conflict { what } => write!(f, "{what}"),
            Error::Interrupted => write!(f, "interrupted"),
        }
    }
}

impl std::error::Error for Error {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn causes_say_what_to_do_and_name_nothing_internal() {
        for (number, says) in [
            (13, "choose another place"),
            (30, "read-only"),
            (28, "make room"),
            (2, "No such file or directory"),
            (20, "Not a directory"),
        ] {
            let cause = io::Error::from_raw_os_error(number);
            let long = format!("cannot be written: {cause} at path \"/tmp/.a.png.x1.tmp\"");
            for text in [cause.to_string(), long] {
                let message = Error::io(Path::new("a.png"), text).to_string();
                assert!(message.starts_with("a.png: ") && message.contains(says), "{message}");
                assert!(!message.contains("os error") && !message.contains(".tmp"), "{message}");
            }
        }
        assert_eq!(cause_text("a (os error x) b"), "a (os error x) b");
    }
}
