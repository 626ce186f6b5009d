//! The state of the host, from the files of Linux. Other systems have none of them.

use std::path::{Path, PathBuf};

use super::row::StateRow;
use super::sysfs;

/// Most processors whose clock is read: of more, some that lie evenly among them.
const MOST_CLOCKS: usize = 32;

/// The host.
pub struct Host {
    proc: PathBuf,
    /// /sys/devices/system/cpu.
    cpu: PathBuf,
    governors: Vec<PathBuf>,
    clocks: Vec<PathBuf>,
    throttles: Vec<PathBuf>,
}

impl Host {
    /// Returns the reader of the host; `sys` and `proc` are the folders /sys and /proc.
    pub fn open(sys: &Path, proc: &Path) -> Host {
        let cpu = sys.join("devices/system/cpu");
        let is_cpu = |path: &PathBuf| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name[3..].chars().all(|c| c.is_ascii_digit()) && name.len() > 3
        };
        let all = sysfs::entries(&cpu, "cpu").into_iter().filter(is_cpu).collect::<Vec<_>>();
        let of = |names: &[&str]| -> Vec<PathBuf> {
            let paths = all.iter().flat_map(|cpu| names.iter().map(|name| cpu.join(name)));
            paths.filter(|path| path.exists()).collect()
        };
        let clocks = of(&["cpufreq/scaling_cur_freq"]);
        let step = clocks.len().div_ceil(MOST_CLOCKS).max(1);
        Host {
            proc: proc.to_owned(),
            governors: of(&["cpufreq/scaling_governor"]),
            clocks: clocks.into_iter().step_by(step).collect(),
            // Each processor counts the events of its package.
            throttles: of(&["thermal_throttle/core_throttle_count"])
                .into_iter()
                .chain(all.first().map(|cpu| cpu.join("thermal_throttle/package_throttle_count")))
                .filter(|path| path.exists())
                .collect(),
            cpu,
        }
    }

    /// Returns the names of what there is to read.
    pub fn names(&self) -> Vec<&'static str> {
        let has = [
            (self.proc.join("stat").exists(), "/proc/stat"),
            (!self.governors.is_empty() || !self.clocks.is_empty(), "cpufreq"),
            (!self.throttles.is_empty(), "thermal_throttle"),
        ];
        has.into_iter().filter(|(is_there, _)| *is_there).map(|(_, name)| name).collect()
    }

    /// Reads what changes from frame to frame: clock, and times of the processors.
    pub fn read_fast(&self, row: &mut StateRow) {
        // Kilohertz. Idle cores are slow; the fastest one is at work.
        let clocks = self.clocks.iter().filter_map(|path| sysfs::number(path));
        row.cpu_mhz = clocks.reduce(f64::max).map(|khz| 1e-3 * khz);
        let stat = sysfs::text(&self.proc.join("stat"));
        if let Some([all, busy]) = stat.as_deref().and_then(times_of_all) {
            (row.cpu_ticks, row.cpu_busy_ticks) = (Some(all), Some(busy));
        }
        let own = sysfs::text(&self.proc.join("self/stat"));
        row.cpu_own_ticks = own.as_deref().and_then(time_of_process);
    }

    /// Reads what changes slowly, or takes a file for each processor.
    pub fn read_slow(&self, row: &mut StateRow) {
        let mut governors: Vec<String> =
            self.governors.iter().filter_map(|path| sysfs::text(path)).collect();
        governors.sort();
        governors.dedup();
        row.governor = (!governors.is_empty()).then(|| governors.join("+"));
        let is_off = sysfs::count(&self.cpu.join("intel_pstate/no_turbo")).map(|off| off == 0);
        let boost = || sysfs::count(&self.cpu.join("cpufreq/boost")).map(|on| on != 0);
        row.turbo = is_off.or_else(boost);
        let load = sysfs::text(&self.proc.join("loadavg"));
        row.load = load.and_then(|text| text.split_whitespace().next()?.parse().ok());
        row.cpu_throttles =
            self.throttles.iter().filter_map(|path| sysfs::count(path)).reduce(|a, b| a + b);
    }
}

/// Returns the ticks of all processors, and those in which they worked, from /proc/stat.
fn times_of_all(stat: &str) -> Option<[u64; 2]> {
    let line = stat.lines().find_map(|line| line.strip_prefix("cpu "))?;
    let ticks: Vec<u64> = line.split_whitespace().map_while(|field| field.parse().ok()).collect();
    // Time of guests is in the time of users, too. Time that a hypervisor stole is work for others.
    let [user, nice, system, idle, wait, irq, soft_irq, steal] = *ticks.first_chunk()?;
    let busy = [user, nice, system, irq, soft_irq, steal].into_iter().try_fold(0, u64::checked_add);
    let busy = busy?;
    Some([busy.checked_add(idle)?.checked_add(wait)?, busy])
}

/// Returns the ticks of a process and all its threads, from its file stat.
fn time_of_process(stat: &str) -> Option<u64> {
    // The name is in parentheses and may hold anything. The state follows it, as field 3; utime and
    // stime are fields 14 and 15.
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let mut next = || fields.next()?.parse::<u64>().ok();
    next()?.checked_add(next()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_processors_are_read_from_their_line() {
        let stat = "cpu  100 1 20 1000 30 4 5 6 50 0\ncpu0 1 1 1 1 1 1 1 1 1 1\nintr 7\n";
        assert_eq!(times_of_all(stat), Some([1166, 136]));
        for faulty in ["", "cpu", "cpu  1 2 3", "cpu  1 2 x 4 5 6 7 8", "cpu0 1 2 3 4 5 6 7 8"] {
            assert_eq!(times_of_all(faulty), None, "{faulty}");
        }
        let most = u64::MAX;
        assert_eq!(times_of_all(&format!("cpu  {most} 1 1 1 1 1 1 1")), None);
    }

    #[test]
    fn a_name_with_spaces_and_parentheses_does_not_shift_the_fields() {
        let stat = |name: &str| format!("7 ({name}) R 1 1 1 0 -1 4194304 99 0 0 0 321 12 5 5 20 0");
        for name in ["nimbus", "a b", "a) R 9 9 9 9 9 9 9 9 9 9 9 9 (b", ")"] {
            assert_eq!(time_of_process(&stat(name)), Some(333), "{name}");
        }
        assert_eq!(time_of_process("7 (nimbus) R 1 1"), None);
        assert_eq!(time_of_process(""), None);
    }
}
