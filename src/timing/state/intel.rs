//! The state of a GPU of Intel, from the files of the drivers i915 and Xe.
//!
//! *Source*: the kernel's intel_gt_sysfs_pm.c, xe_gt_throttle.c, and the descriptions of the
//! drivers' sensors (sysfs-driver-intel-i915-hwmon, sysfs-driver-intel-xe-hwmon).

use std::path::{Path, PathBuf};

use super::device_source::DeviceSource;
use super::row::StateRow;
use super::sysfs;

/// A card of the driver i915 or Xe.
pub struct IntelCard {
    name: &'static str,
    /// The clock that the GPU runs at, 0 while it sleeps; and the clock that the driver asks for.
    clocks: [PathBuf; 2],
    /// Whether some reason holds the clock down.
    is_throttled: PathBuf,
    /// Each reason, with its name.
    reasons: Vec<(String, PathBuf)>,
    energy: Option<PathBuf>,
    temperature: Option<PathBuf>,
    /// Energy in J and time in s of the reading before.
    last: Option<[f64; 2]>,
}

impl IntelCard {
    /// Returns the reader of a card; `card` is its folder in /sys/class/drm.
    ///
    /// # Errors
    /// The card has no such files. The error is a phrase.
    pub fn open(card: &Path) -> Result<IntelCard, String> {
        let xe = card.join("device/tile0/gt0/freq0");
        let (name, clocks, [folder, status, prefix]) = if xe.join("act_freq").exists() {
            let clocks = ["act_freq", "cur_freq"].map(|name| xe.join(name));
            ("xe", clocks, [&xe.join("throttle"), Path::new("status"), Path::new("reason_")])
        } else if card.join("gt_cur_freq_mhz").exists() {
            let clocks = ["gt_act_freq_mhz", "gt_cur_freq_mhz"].map(|name| card.join(name));
            let status = Path::new("throttle_reason_status");
            ("i915", clocks, [&card.join("gt/gt0"), status, Path::new("throttle_reason_")])
        } else {
            return Err(format!("{} has no clock of i915 or Xe", card.display()));
        };
        let is_throttled = folder.join(status);
        let named = |path: PathBuf| {
            let name = path.file_name()?.to_str()?.strip_prefix(prefix.to_str()?)?.to_owned();
            (path != is_throttled).then_some((name, path))
        };
        let prefix_text = prefix.to_str().unwrap_or_default();
        let reasons = sysfs::entries(folder, prefix_text).into_iter().filter_map(named).collect();
        let sensors = sysfs::sensors(&card.join("device"), name);
        // Xe counts card and package apart; a card without one has the other.
        let first = |names: [&str; 2]| {
            let folder = sensors.as_ref()?;
            names.into_iter().map(|name| folder.join(name)).find(|path| path.exists())
        };
        Ok(IntelCard {
            name,
            clocks,
            reasons,
            energy: first(["energy1_input", "energy2_input"]),
            temperature: first(["temp1_input", "temp2_input"]),
            last: None,
            is_throttled,
        })
    }

    /// Returns the mean power since the reading before, in W.
    fn power_w(&mut self, time_s: f64) -> Option<f64> {
        // Microjoules.
        let energy = 1e-6 * sysfs::number(self.energy.as_ref()?)?;
        let [energy_before, before_s] = self.last.replace([energy, time_s])?;
        let (spent, passed) = (energy - energy_before, time_s - before_s);
        // The counter can begin again, and readings of one moment have no power.
        (spent >= 0.0 && passed > 1e-3).then(|| spent / passed)
    }
}

impl DeviceSource for IntelCard {
    fn name(&self) -> &'static str {
        self.name
    }

    fn read(&mut self, time_s: f64, row: &mut StateRow) {
        let clock = |path: &PathBuf| sysfs::number(path).filter(|mhz| *mhz > 0.0);
        let has_actual = self.clocks[0].exists();
        row.gpu_mhz = clock(if has_actual { &self.clocks[0] } else { &self.clocks[1] });
        row.gpu_c = self.temperature.as_deref().and_then(sysfs::number).map(|c| 1e-3 * c);
        row.gpu_w = self.power_w(time_s);
        let is_active = |path: &Path| sysfs::number(path).map(|n| n != 0.0);
        if let Some(is_throttled) = is_active(&self.is_throttled) {
            let active = self.reasons.iter().filter(|(_, path)| is_active(path) == Some(true));
            let names = active.map(|(name, _)| name.as_str());
            row.set_reasons(&if is_throttled { names.collect::<Vec<_>>() } else { vec![] });
        }
    }
}
