//! The command line of this process and the name of its machine.

use std::ffi::{OsStr, OsString};
use std::path::Path;

/// Returns the arguments of this process, after the program's name without its folder: results do
/// not tell where somebody keeps programs. Bytes that are not UTF-8 become U+FFFD.
pub fn command_line() -> Vec<String> {
    let mut all = std::env::args_os();
    let program = all.next().unwrap_or_default();
    let name = Path::new(&program).file_name().unwrap_or(OsStr::new("nimbus")).to_owned();
    let as_text = |argument: OsString| argument.to_string_lossy().into_owned();
    std::iter::once(name).chain(all).map(as_text).collect()
}

/// Returns this machine's name, as the system or else the shell has it.
pub fn host_name() -> Option<String> {
    // The system comes first: a shell on another machine may have exported HOSTNAME.
    let name = system_name().or_else(|| std::env::var("HOSTNAME").ok());
    name.map(|name| name.trim().to_owned())
}

#[cfg(unix)]
fn system_name() -> Option<String> {
    Some(rustix::system::uname().nodename().to_string_lossy().into_owned())
}

#[cfg(not(unix))]
fn system_name() -> Option<String> {
    // Windows sets it for every process.
    std::env::var("COMPUTERNAME").ok()
}
