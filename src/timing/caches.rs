//! The size of a device's last cache level.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::gpu::DeviceInfo;

/// A bound of the last cache level of devices that do not tell it: 256 MiB, as in AMD's MI300. An
/// RTX 4090 has 72 MiB, an H100 50 MiB, an RX 7900 XTX 96 MiB.
pub const GPU_CACHE_BYTES: u64 = 256 << 20;

/// Returns the bytes of the last cache level of a device: of the processors if it is one, else
/// [`GPU_CACHE_BYTES`].
pub fn last_level_bytes(info: &DeviceInfo) -> u64 {
    let of_cpu = || processor_bytes(Path::new("/sys/devices/system/cpu"));
    (info.kind == "cpu").then(of_cpu).flatten().unwrap_or(GPU_CACHE_BYTES)
}

/// Returns the bytes of all caches of the processors' highest level, as Linux lists them under
/// `root`; none where it does not.
fn processor_bytes(root: &Path) -> Option<u64> {
    // By level, then by the processors that share a cache.
    let mut levels: BTreeMap<u32, BTreeMap<String, u64>> = BTreeMap::new();
    let folders = |at: &Path, prefix: &str| {
        let entries = fs::read_dir(at).into_iter().flatten().flatten().map(|e| e.path());
        let is_one = |path: &std::path::PathBuf| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let digits = name.strip_prefix(prefix).unwrap_or_default();
            !digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit())
        };
        entries.filter(is_one).collect::<Vec<_>>()
    };
    for cache in folders(root, "cpu").iter().flat_map(|cpu| folders(&cpu.join("cache"), "index")) {
        let read = |name: &str| fs::read_to_string(cache.join(name)).ok();
        let (level, size) = (read("level"), read("size").and_then(|text| bytes(text.trim())));
        let level = level.and_then(|text| text.trim().parse().ok());
        if let (Some(level), Some(size), Some(shared)) = (level, size, read("shared_cpu_list")) {
            levels.entry(level).or_default().insert(shared, size);
        }
    }
    Some(levels.last_key_value()?.1.values().sum()).filter(|bytes| *bytes > 0)
}

/// Parses "32768K" and the like.
fn bytes(text: &str) -> Option<u64> {
    let (digits, shift) = match text.as_bytes().last()? {
        b'K' => (&text[..text.len() - 1], 10),
        b'M' => (&text[..text.len() - 1], 20),
        _ => (text, 0),
    };
    digits.parse::<u64>().ok()?.checked_mul(1 << shift)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn caches_of_the_last_level_are_added_once_each() {
        let root = tempfile::tempdir().unwrap();
        let cache = |cpu: u32, index: u32, level: &str, size: &str, shared: &str| {
            let at = root.path().join(format!("cpu{cpu}/cache/index{index}"));
            fs::create_dir_all(&at).unwrap();
            for (name, text) in [("level", level), ("size", size), ("shared_cpu_list", shared)] {
                fs::write(at.join(name), format!("{text}\n")).unwrap();
            }
        };
        assert_eq!(processor_bytes(root.path()), None);
        for cpu in 0..4 {
            cache(cpu, 0, "1", "32K", &cpu.to_string());
            cache(cpu, 2, "2", "1M", &cpu.to_string());
            // Two processors share each cache of the last level.
            cache(cpu, 3, "3", "16384K", if cpu < 2 { "0-1" } else { "2-3" });
        }
        fs::create_dir_all(root.path().join("cpufreq")).unwrap();
        assert_eq!(processor_bytes(root.path()), Some(32 << 20));
        // A size that cannot be read is no size.
        cache(3, 3, "3", "unknown", "2-3");
        assert_eq!(processor_bytes(root.path()), Some(32 << 20));
        assert_eq!((bytes("512"), bytes(""), bytes("K")), (Some(512), None, None));
        assert_eq!(bytes("99999999999999999999M"), None);
        assert_eq!(bytes("18446744073709551615K"), None);
    }
}
