//! The command line of this process and the name of its machine.

use std::fs;

/// Returns the arguments of this process. Bytes that are not UTF-8 become U+FFFD.
pub fn command_line() -> Vec<String> {
    std::env::args_os().map(|argument| argument.to_string_lossy().into_owned()).collect()
}

/// Returns this machine's name, as the kernel or else the shell has it.
pub fn host_name() -> Option<String> {
    let kernel = fs::read_to_string("/proc/sys/kernel/hostname").ok();
    // The kernel comes first: a shell on another machine may have exported HOSTNAME.
    kernel.or_else(|| std::env::var("HOSTNAME").ok()).map(|name| name.trim().to_owned())
}
