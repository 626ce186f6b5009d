//! Groups, processor times and requests to end of processes, for each system.

#[cfg(unix)]
pub use unix::{become_own_group, interrupt, processor_ticks};
#[cfg(windows)]
pub use windows::{become_own_group, interrupt, processor_ticks};

#[cfg(unix)]
mod unix {
    use std::os::unix::process::CommandExt;
    use std::process::{Child, Command, Stdio};

    /// Makes the process that `command` starts the first of a new group.
    pub fn become_own_group(command: &mut Command) {
        command.process_group(0);
    }

    /// Asks a process to end, as Ctrl-C does.
    pub fn interrupt(child: &mut Child) {
        let mut kill = Command::new("kill");
        // A failure means that the process has ended; the caller waits for it in any case.
        let _ = kill.args(["-INT", &child.id().to_string()]).stderr(Stdio::null()).status();
    }

    /// Returns the processor time of all threads of a process, in clock ticks (proc(5), fields
    /// utime and stime).
    #[cfg(target_os = "linux")]
    pub fn processor_ticks(child: &Child) -> Option<u64> {
        let text = std::fs::read_to_string(format!("/proc/{}/stat", child.id())).ok()?;
        // The name of the program, in parentheses, may have spaces. The state, field 3, follows it.
        let mut fields = text.rsplit_once(')')?.1.split_whitespace().skip(14 - 3);
        Some(fields.next()?.parse::<u64>().ok()? + fields.next()?.parse::<u64>().ok()?)
    }

    /// Returns the digits of the processor time that ps prints, such as "12:03.45": a number that
    /// changes when the process uses processor time.
    #[cfg(not(target_os = "linux"))]
    pub fn processor_ticks(child: &Child) -> Option<u64> {
        let mut ps = Command::new("ps");
        ps.args(["-o", "time=", "-p", &child.id().to_string()]).stderr(Stdio::null());
        let text = String::from_utf8(ps.output().ok()?.stdout).ok()?;
        text.chars().filter(char::is_ascii_digit).collect::<String>().parse().ok()
    }
}

#[cfg(windows)]
mod windows {
    use std::os::windows::io::{AsRawHandle, RawHandle};
    use std::os::windows::process::CommandExt;
    use std::process::{Child, Command};

    /// Constants of winbase.h and wincon.h.
    const CREATE_NEW_PROCESS_GROUP: u32 = 0x200;
    const CTRL_BREAK_EVENT: u32 = 1;

    #[link(name = "kernel32")]
    unsafe extern "system" {
        safe fn GenerateConsoleCtrlEvent(event: u32, group: u32) -> i32;
        fn GetProcessTimes(
            process: RawHandle,
            created: *mut [u32; 2],
            ended: *mut [u32; 2],
            kernel: *mut [u32; 2],
            user: *mut [u32; 2],
        ) -> i32;
    }

    /// Makes the process that `command` starts the first of a new group.
    pub fn become_own_group(command: &mut Command) {
        command.creation_flags(CREATE_NEW_PROCESS_GROUP);
    }

    /// Asks a process to end, as Ctrl-C does. A new group ignores Ctrl-C itself, and gets
    /// Ctrl-Break in its place. Without a console nothing can be asked, and the process is killed.
    pub fn interrupt(child: &mut Child) {
        if GenerateConsoleCtrlEvent(CTRL_BREAK_EVENT, child.id()) == 0 {
            // A failure means that the process has ended; the caller waits for it in any case.
            let _ = child.kill();
        }
    }

    /// Returns the processor time of all threads of a process, in units of 100 ns.
    pub fn processor_ticks(child: &Child) -> Option<u64> {
        let [mut created, mut ended, mut kernel, mut user] = [[0; 2]; 4];
        let process = child.as_raw_handle();
        // SAFETY: the handle is open as long as `child`, and a FILETIME is two u32, the low one
        // first.
        let has_times = unsafe {
            GetProcessTimes(process, &mut created, &mut ended, &mut kernel, &mut user) != 0
        };
        let ticks = |[low, high]: [u32; 2]| u64::from(high) << 32 | u64::from(low);
        has_times.then(|| ticks(kernel) + ticks(user))
    }
}
