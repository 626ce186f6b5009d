//! The command line of this process and the name of its machine.

/// Returns the arguments of this process. Bytes that are not UTF-8 become U+FFFD.
pub fn command_line() -> Vec<String> {
    std::env::args_os().map(|argument| argument.to_string_lossy().into_owned()).collect()
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
