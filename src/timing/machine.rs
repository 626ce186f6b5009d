//! Where and with what a run was made: device, processor, environment, clocks, build.

use std::collections::BTreeMap;
use std::fs;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::frame::render::Renderer;
use crate::gpu::DeviceInfo;
use crate::measure::clock::ClockQuality;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Device {
    pub name: String,
    pub driver: String,
    /// Vulkan version, "1.3.230".
    pub api: String,
    /// "discrete", "integrated", "virtual", "cpu" or "other".
    #[serde(rename = "type")]
    pub kind: String,
    /// 32 hex digits.
    pub uuid: String,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cpu {
    pub model: String,
    /// Logical cores that this process may use.
    pub logical_cores: usize,
}

impl Device {
    /// Its kind: two cards of one kind, whose UUIDs differ, draw the same and take the same time.
    pub fn class(&self) -> String {
        format!("{} ({}, Vulkan {})", self.name, self.driver, self.api)
    }
}

impl Cpu {
    pub fn class(&self) -> String {
        format!("{}, {} cores", self.model, self.logical_cores)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Clocks {
    pub resolution_ns: f64,
    pub overhead_ns: f64,
    /// Of the device; null where it has no timestamps.
    pub timestamp_period_ns: Option<f64>,
    /// What a pass that does nothing measures; a pass near it says nothing.
    pub timestamp_overhead_ns: Option<f64>,
}

/// The device as results name it.
pub fn device_record(info: &DeviceInfo) -> Device {
    let (major, minor, patch) = info.api_version;
    Device {
        name: info.name.clone(),
        driver: info.driver.clone(),
        api: format!("{major}.{minor}.{patch}"),
        kind: info.kind.into(),
        uuid: info.uuid.clone(),
    }
}

/// The host's clock and the device's, measured.
pub fn clocks_record(info: &DeviceInfo, renderer: &mut Renderer) -> Result<Clocks> {
    let host = ClockQuality::measure();
    let limits = &info.limits;
    let timestamp_period_ns =
        (limits.timestamp_valid_bits > 0).then_some(limits.timestamp_period_ns);
    let timestamp_overhead_ns = renderer.empty_scope_ns()?;
    let (resolution_ns, overhead_ns) = (host.resolution_ns as f64, host.overhead_ns);
    Ok(Clocks { resolution_ns, overhead_ns, timestamp_period_ns, timestamp_overhead_ns })
}

/// The revision that was built (see build.rs).
pub fn revision() -> &'static str {
    env!("NIMBUS_GIT_REVISION")
}

pub fn cpu() -> Cpu {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split_once(':').map(|(_, name)| name));
    Cpu {
        model: model.map_or_else(|| "unknown".to_owned(), |name| name.trim().to_owned()),
        logical_cores: std::thread::available_parallelism().map_or(1, usize::from),
    }
}

/// Of the process: Mesa, its software rasteriser, and the Vulkan loader.
pub fn environment() -> BTreeMap<String, String> {
    relevant(
        std::env::vars_os()
            .filter_map(|(key, value)| Some((key.into_string().ok()?, value.into_string().ok()?))),
    )
}

fn relevant(variables: impl Iterator<Item = (String, String)>) -> BTreeMap<String, String> {
    const PREFIXES: [&str; 4] = ["LP_", "MESA_", "VK_", "GALLIUM_"];
    variables.filter(|(key, _)| PREFIXES.iter().any(|prefix| key.starts_with(prefix))).collect()
}

/// Now, as "2024-02-29T12:34:56Z". A clock before 1970 gives 1970.
pub fn utc_now() -> String {
    iso_8601_utc(SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs()))
}

/// Seconds since 1970-01-01T00:00:00Z, without leap seconds. The date is Howard Hinnant's
/// `civil_from_days`: years begin in March, so that the leap day is a year's last, and repeat every
/// 400 years of 146 097 days.
pub fn iso_8601_utc(unix_s: u64) -> String {
    let (days, second) = (unix_s / 86_400, unix_s % 86_400);
    // Days from 0000-03-01 to 1970-01-01.
    let days = days + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    // Months from March have 31, 30, 31, 30, 31 days and again: 153 days in five.
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = 400 * era + year_of_era + u64::from(month <= 2);
    let (hour, minute, second) = (second / 3_600, second / 60 % 60, second % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_dates() {
        // From `date -u -d @N`.
        for (unix_s, text) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (951_868_799, "2000-02-29T23:59:59Z"),
            (1_709_210_096, "2024-02-29T12:34:56Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ] {
            assert_eq!(iso_8601_utc(unix_s), text);
        }
    }

    #[test]
    fn only_variables_that_matter_are_kept() {
        let given =
            ["LP_NUM_THREADS", "HOME", "VK_DRIVER_FILES", "MESA_VK_DEVICE_SELECT", "SECRET_VK_KEY"];
        let kept = relevant(given.iter().map(|key| ((*key).to_owned(), "1".to_owned())));
        assert_eq!(
            kept.keys().collect::<Vec<_>>(),
            ["LP_NUM_THREADS", "MESA_VK_DEVICE_SELECT", "VK_DRIVER_FILES"]
        );
    }
}
