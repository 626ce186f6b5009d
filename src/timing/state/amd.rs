//! The state of a GPU of AMD, from the files of the driver amdgpu.
//!
//! *Source*: the kernel's documentation of GPU power and thermal controls (amdgpu), and
//! kgd_pp_interface.h for `gpu_metrics`.

use std::fs;
use std::path::{Path, PathBuf};

use super::device_source::DeviceSource;
use super::row::StateRow;
use super::sysfs;

/// A card of the driver amdgpu.
pub struct AmdCard {
    device: PathBuf,
    sensors: Option<PathBuf>,
}

impl AmdCard {
    /// Returns the reader of a card; `card` is its folder in /sys/class/drm.
    ///
    /// # Errors
    /// The card has no such files. The error is a phrase.
    pub fn open(card: &Path) -> Result<AmdCard, String> {
        let device = card.join("device");
        let sensors = sysfs::sensors(&device, "amdgpu");
        if sensors.is_none() && !device.join("pp_dpm_sclk").exists() {
            return Err(format!("{} has no sensors of amdgpu", device.display()));
        }
        Ok(AmdCard { device, sensors })
    }

    fn sensor(&self, names: &[&str], per_unit: f64) -> Option<f64> {
        let folder = self.sensors.as_ref()?;
        names.iter().find_map(|name| sysfs::number(&folder.join(name))).map(|n| n / per_unit)
    }

    /// Returns the clock that a list of levels marks as the present one.
    fn level_mhz(&self, name: &str) -> Option<f64> {
        let text = sysfs::text(&self.device.join(name))?;
        let level = text.lines().find(|line| line.trim_end().ends_with('*'))?;
        let (_, clock) = level.split_once(':')?;
        let clock = clock.trim().to_lowercase();
        clock.split("mhz").next()?.trim().parse().ok()
    }
}

impl DeviceSource for AmdCard {
    fn name(&self) -> &'static str {
        "amdgpu"
    }

    fn read(&mut self, _: f64, row: &mut StateRow) {
        // Hertz, millidegrees and microwatts.
        let or_level = |sensor, name| self.sensor(&[sensor], 1e6).or_else(|| self.level_mhz(name));
        row.gpu_mhz = or_level("freq1_input", "pp_dpm_sclk").filter(|mhz| *mhz > 0.0);
        row.gpu_memory_mhz = or_level("freq2_input", "pp_dpm_mclk").filter(|mhz| *mhz > 0.0);
        row.gpu_c = self.sensor(&["temp1_input"], 1e3);
        row.gpu_w = self.sensor(&["power1_average", "power1_input"], 1e6);
        row.gpu_busy_percent = sysfs::number(&self.device.join("gpu_busy_percent"));
        let metrics = fs::read(self.device.join("gpu_metrics")).ok();
        if let Some(reasons) = metrics.and_then(|bytes| reasons(&bytes)) {
            row.set_reasons(&reasons);
        }
    }
}

/// Returns the reasons that hold the clock down, from a `gpu_metrics` of version 1.3, which
/// discrete GPUs have. Other versions have no word for them that means the same on all GPUs, or
/// have it elsewhere.
fn reasons(metrics: &[u8]) -> Option<Vec<&'static str>> {
    /// Bytes of the structure, whose last eight are indep_throttle_status.
    const SIZE: usize = 120;
    /// Groups of bits of that number: SMU_THROTTLER_PPT0_BIT and so on are limits of power, from
    /// TDC_GFX_BIT on of current, from TEMP_GPU_BIT on of heat.
    const GROUPS: [(&str, u64); 4] = [
        ("power", 0xffff),
        ("current", 0xffff << 16),
        ("temperature", 0xff_ffff << 32),
        ("other", 0xff << 56),
    ];
    let (size, revisions) = (metrics.first_chunk()?, metrics.get(2..4)?);
    if usize::from(u16::from_le_bytes(*size)) != SIZE || revisions != [1, 3] {
        return None;
    }
    let status: [u8; 8] = *metrics.get(..SIZE)?.last_chunk()?;
    let status = u64::from_le_bytes(status);
    // All ones: this GPU does not tell.
    let groups = GROUPS.iter().filter(|(_, bits)| status & bits != 0).map(|(name, _)| *name);
    (status != u64::MAX).then(|| groups.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metrics_name_the_groups_of_reasons() {
        let metrics = |revision: u8, status: u64| {
            let mut bytes = vec![0; 120];
            bytes[..4].copy_from_slice(&[120, 0, 1, revision]);
            bytes[112..].copy_from_slice(&status.to_le_bytes());
            bytes
        };
        assert_eq!(reasons(&metrics(3, 0)), Some(vec![]));
        assert_eq!(reasons(&metrics(3, 1)), Some(vec!["power"]));
        assert_eq!(reasons(&metrics(3, 1 << 36 | 1 << 16)), Some(vec!["current", "temperature"]));
        assert_eq!(reasons(&metrics(3, 1 << 56)), Some(vec!["other"]));
        assert_eq!(reasons(&metrics(3, u64::MAX)), None);
        assert_eq!(reasons(&metrics(2, 1)), None);
        for cut in 0..120 {
            assert_eq!(reasons(&metrics(3, 1)[..cut]), None, "{cut} bytes");
        }
    }
}
