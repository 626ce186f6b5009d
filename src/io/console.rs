//! Lines for people, on stderr. A stderr that is closed, broken or full loses them and nothing
//! else: no run ends, and no result is lost, because a remark cannot be shown.

use std::fmt::Arguments;
use std::io::Write;

use super::plain_text::plain;

/// Writes a line to stderr without harmful characters, and ignores a failure. `say!` calls this
/// function.
pub fn write_line(line: Arguments<'_>) {
    write_painted(&plain(&line.to_string()));
}

/// Writes a line that may hold colours to stderr, and ignores a failure.
pub fn write_painted(line: &str) {
    // One write for the whole line, so that lines of several threads do not mix.
    let _ = std::io::stderr().lock().write_all(format!("{line}\n").as_bytes());
}

/// Writes a line to stdout, and ignores a failure. Only windows call this function, for lines that
/// they print while they run. Results go through `cli::output`, which reports failures.
pub fn write_line_to_stdout(line: &str) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(format!("{}\n", plain(line)).as_bytes()).and_then(|()| out.flush());
}

/// Writes a line to stderr, as `eprintln!` does, but never panics.
macro_rules! say {
    ($($text:tt)*) => {
        $crate::io::console::write_line(format_args!($($text)*))
    };
}
pub(crate) use say;
