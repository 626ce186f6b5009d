//! `nimbus devices --lock`: the commands that hold the clocks of devices at one speed.
//!
//! A clock that follows heat and load changes times more than most changes of a program do. nimbus
//! only prints the commands: they need root, and hold for all programs until they are undone.

use std::fs;
use std::path::{Path, PathBuf};

use crate::gpu::DeviceInfo;
use crate::timing::state::{AMD, INTEL, NVIDIA, card};

/// Returns the commands for each device; `sys` is the folder /sys.
pub fn text(devices: &[DeviceInfo], sys: &Path) -> String {
    let of = |d: &DeviceInfo| format!("{}: {} ({})\n{}", d.index, d.name, d.kind, lock(d, sys));
    devices.iter().map(of).collect::<Vec<_>>().join("\n")
}

/// Commands that lock and unlock, as root, with a remark.
struct Lock {
    lock: Vec<String>,
    unlock: Vec<String>,
    remark: String,
}

fn lock(device: &DeviceInfo, sys: &Path) -> String {
    let address = device.pci_address.as_deref();
    let found = match (device.kind, device.vendor) {
        ("cpu", _) => of_processor(sys),
        (_, NVIDIA) => Ok(of_nvidia(&device.uuid)),
        (_, AMD) => card(sys, address, None).and_then(|card| of_amd(&card)),
        (_, INTEL) => card(sys, address, None).and_then(|card| of_intel(&card)),
        _ => Err("nimbus knows no commands for this maker's devices".to_owned()),
    };
    let indented = |lines: &[String]| -> String {
        lines.iter().map(|line| format!("     {line}\n")).collect()
    };
    match found {
        Ok(Lock { lock, unlock, remark }) => format!(
            "   lock, as root:\n{}   unlock:\n{}   {remark}\n",
            indented(&lock),
            indented(&unlock)
        ),
        Err(why) => format!("   no commands: {why}\n"),
    }
}

/// NVIDIA's tool names a GPU by the UUID that Vulkan has, too.
fn of_nvidia(uuid: &str) -> Lock {
    let parts = [(0, 8), (8, 12), (12, 16), (16, 20), (20, 32)].map(|(i, j)| uuid.get(i..j));
    let parts: Vec<&str> = parts.into_iter().flatten().collect();
    let gpu = format!("nvidia-smi -i GPU-{}", parts.join("-"));
    let of = |options: &[&str]| options.iter().map(|option| format!("{gpu} {option}")).collect();
    Lock {
        lock: of(&["-pm 1", "--lock-gpu-clocks=MHZ,MHZ", "--lock-memory-clocks=MHZ,MHZ"]),
        unlock: of(&["--reset-gpu-clocks", "--reset-memory-clocks"]),
        remark: format!(
            "MHZ: one of the clocks of `{gpu} -q -d SUPPORTED_CLOCKS`, low enough to be held \
             under load"
        ),
    }
}

/// amdgpu has levels of performance; one of them is for profiling.
fn of_amd(card: &Path) -> Result<Lock, String> {
    let path = existing(card.join("device/power_dpm_force_performance_level"))?;
    let set = |level: &str| vec![format!("echo {level} > {path}")];
    Ok(Lock {
        lock: set("profile_standard"),
        unlock: set("auto"),
        remark: "the driver chooses the clocks of core and memory: the same in all runs".to_owned(),
    })
}

/// The drivers i915 and Xe have a least and a greatest clock, and tell the most efficient one.
fn of_intel(card: &Path) -> Result<Lock, String> {
    let i915 = (
        "",
        ["gt_RP1_freq_mhz", "gt_RPn_freq_mhz", "gt_RP0_freq_mhz"],
        ["gt_boost_freq_mhz", "gt_max_freq_mhz", "gt_min_freq_mhz"],
    );
    let xe = (
        "device/tile0/gt0/freq0",
        ["rpe_freq", "rpn_freq", "rp0_freq"],
        ["max_freq", "max_freq", "min_freq"],
    );
    let is_there = |(folder, _, [_, greatest, _]): &(&str, [&str; 3], [&str; 3])| {
        card.join(folder).join(greatest).exists()
    };
    let (folder, [held, least, most], [boost, greatest, smallest]) = [i915, xe]
        .into_iter()
        .find(is_there)
        .ok_or_else(|| format!("{} has no clocks that can be set", card.display()))?;
    let at = |name: &str| card.join(folder).join(name).display().to_string();
    let copy = |from: &str, to: &str| format!("cat {} > {}", at(from), at(to));
    // A greatest clock is never below the least one.
    let mut lock = vec![copy(held, boost), copy(held, greatest), copy(held, smallest)];
    let mut unlock = vec![copy(least, smallest), copy(most, greatest), copy(most, boost)];
    lock.dedup();
    unlock.dedup();
    let remark = "the clock is the one that the device calls efficient".to_owned();
    Ok(Lock { lock, unlock, remark })
}

/// Software drivers run on the processor.
fn of_processor(sys: &Path) -> Result<Lock, String> {
    let folder = sys.join("devices/system/cpu");
    existing(folder.join("cpu0/cpufreq/scaling_governor"))?;
    let governors = format!("{}/cpu*/cpufreq/scaling_governor", folder.display());
    let before = fs::read_to_string(folder.join("cpu0/cpufreq/scaling_governor"));
    let before = before.unwrap_or_default();
    // The shell does not expand a pattern behind ">".
    let set = |governor: &str| format!("echo {governor} | tee {governors} > /dev/null");
    let mut lock = vec![set("performance")];
    let mut unlock = vec![set(before.trim())];
    for (name, off, on) in [("intel_pstate/no_turbo", 1, 0), ("cpufreq/boost", 0, 1)] {
        if let Ok(path) = existing(folder.join(name)) {
            lock.push(format!("echo {off} > {path}"));
            unlock.push(format!("echo {on} > {path}"));
        }
    }
    let remark = "without turbo, and with no other load, the processor keeps its clock".to_owned();
    Ok(Lock { lock, unlock, remark })
}

/// Returns a path that exists.
fn existing(path: PathBuf) -> Result<String, String> {
    let text = path.display().to_string();
    if path.exists() { Ok(text) } else { Err(format!("this machine has no {text}")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::Limits;

    /// A folder like /sys with one card at a PCI address, which has these files.
    fn sys(address: &str, files: &[&str]) -> tempfile::TempDir {
        let sys = tempfile::tempdir().expect("a folder");
        let device = sys.path().join("devices").join(address);
        let card = sys.path().join("class/drm/card1");
        for folder in [&device, &card, &sys.path().join("class/drm/card1-DP-1")] {
            fs::create_dir_all(folder).expect("room");
        }
        std::os::unix::fs::symlink(&device, card.join("device")).expect("a link");
        for file in files {
            let path = card.join(file);
            fs::create_dir_all(path.parent().expect("a folder")).expect("room");
            fs::write(path, "600\n").expect("room");
        }
        sys
    }

    fn device(kind: &'static str, vendor: u32, address: Option<&str>) -> DeviceInfo {
        let uuid = "00112233445566778899aabbccddeeff".to_owned();
        let mut device = DeviceInfo::of_limits("a device", kind, Limits::default());
        (device.vendor, device.uuid) = (vendor, uuid);
        device.pci_address = address.map(str::to_owned);
        device
    }

    #[test]
    fn each_maker_has_its_commands() {
        let empty = tempfile::tempdir().expect("a folder");
        let nvidia = lock(&device("discrete", NVIDIA, None), empty.path());
        let gpu = "nvidia-smi -i GPU-00112233-4455-6677-8899-aabbccddeeff";
        for option in ["--lock-gpu-clocks=MHZ,MHZ\n", "--reset-gpu-clocks\n", "-pm 1\n"] {
            assert!(nvidia.contains(&format!("     {gpu} {option}")), "{nvidia}");
        }

        let address = "0000:03:00.0";
        let folder = sys(address, &["device/power_dpm_force_performance_level"]);
        let amd = lock(&device("discrete", AMD, Some(address)), folder.path());
        let at = folder.path().join("class/drm/card1/device/power_dpm_force_performance_level");
        assert!(amd.contains(&format!("echo profile_standard > {}\n", at.display())), "{amd}");
        assert!(amd.contains(&format!("echo auto > {}\n", at.display())), "{amd}");

        let folder = sys(address, &["gt_max_freq_mhz"]);
        let intel = lock(&device("integrated", INTEL, Some(address)), folder.path());
        let at = folder.path().join("class/drm/card1").display().to_string();
        let limits = format!("cat {at}/gt_RP1_freq_mhz > {at}/gt_min_freq_mhz\n   unlock:");
        assert!(intel.contains(&limits), "{intel}");

        let folder = sys(address, &["device/tile0/gt0/freq0/max_freq"]);
        let intel = lock(&device("discrete", INTEL, Some(address)), folder.path());
        assert_eq!(intel.matches("rpe_freq > ").count(), 2, "{intel}");
        assert_eq!(intel.matches("rp0_freq > ").count(), 1, "{intel}");
    }

    #[test]
    fn a_device_without_commands_is_told_why() {
        let address = "0000:03:00.0";
        let folder = sys(address, &[]);
        for (of, why) in [
            (device("discrete", AMD, None), "does not tell its PCI address"),
            (device("discrete", AMD, Some("0000:04:00.0")), "has its address 0000:04:00.0"),
            (device("discrete", AMD, Some(address)), "this machine has no "),
            (device("discrete", INTEL, Some(address)), "has no clocks that can be set"),
            (device("integrated", 0x106b, Some(address)), "knows no commands"),
            (device("cpu", 0x10005, None), "scaling_governor"),
        ] {
            let text = lock(&of, folder.path());
            assert!(text.contains("   no commands: ") && text.contains(why), "{text}");
        }
    }

    #[test]
    fn a_processor_gets_its_own_governor_back() {
        let sys = tempfile::tempdir().expect("a folder");
        let cpu = sys.path().join("devices/system/cpu");
        for (name, text) in
            [("cpu0/cpufreq/scaling_governor", "schedutil\n"), ("cpufreq/boost", "1\n")]
        {
            fs::create_dir_all(cpu.join(name).parent().expect("a folder")).expect("room");
            fs::write(cpu.join(name), text).expect("room");
        }
        let text = lock(&device("cpu", 0x10005, None), sys.path());
        let (locks, unlocks) = text.split_once("   unlock:\n").expect("two parts");
        assert!(locks.contains("echo performance | tee ") && locks.contains("echo 0 > "), "{text}");
        assert!(unlocks.contains("echo schedutil | tee ") && unlocks.contains("echo 1 > "));
    }
}
