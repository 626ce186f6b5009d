//! The folder of a device in /sys/class/drm.

use std::fs;
use std::path::{Path, PathBuf};

use super::sysfs;

/// Vendors by their PCI numbers.
pub const NVIDIA: u32 = 0x10de;
/// Advanced Micro Devices.
pub const AMD: u32 = 0x1002;
/// Intel.
pub const INTEL: u32 = 0x8086;

/// Returns the folder of a device: the card with its PCI address, or else with its node in
/// /dev/dri. Two equal cards differ in both. `sys` is the folder /sys.
///
/// # Errors
/// The driver tells neither, or no card has it. The error is a phrase.
pub fn card(
    sys: &Path,
    address: Option<&str>,
    drm_node: Option<[i64; 2]>,
) -> Result<PathBuf, String> {
    let folder = sys.join("class/drm");
    let entries = fs::read_dir(&folder);
    let whole = |address: &str| format!("its address {address}");
    let named = |[major, minor]: [i64; 2]| format!("its node {major}:{minor}");
    let told = address.map(whole).or_else(|| drm_node.map(named));
    let told = told.ok_or("the driver does not tell its PCI address")?;
    entries.map_err(|e| format!("{}: {e}", folder.display()))?;
    let is_card = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let digits = name.strip_prefix("card");
        digits.is_some_and(|d| !d.is_empty() && d.chars().all(|c| c.is_ascii_digit()))
    };
    let is_the_one = |path: &PathBuf| match (address, drm_node) {
        (Some(address), _) => fs::canonicalize(path.join("device"))
            .is_ok_and(|device| device.file_name().is_some_and(|name| name == address)),
        (None, Some([major, minor])) => {
            sysfs::text(&path.join("dev")) == Some(format!("{major}:{minor}"))
        }
        (None, None) => false,
    };
    let mut all = sysfs::entries(&folder, "card").into_iter().filter(is_card);
    all.find(is_the_one).ok_or_else(|| format!("no card of {} has {told}", folder.display()))
}
