//! The conditions of a run: device, processor, environment, clocks, build.

use std::collections::BTreeMap;
use std::fs;
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::frame::Renderer;
use crate::gpu::{DeviceInfo, PassTimes};
use crate::measure::clock::ClockQuality;

/// A Vulkan device, as results name it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Device {
    /// Name that the driver reports.
    pub name: String,
    /// Name and version of the driver.
    pub driver: String,
    /// Vulkan version, "1.3.230".
    pub api: String,
    /// "discrete", "integrated", "virtual", "cpu" or "other".
    #[serde(rename = "type")]
    pub kind: String,
    /// UUID of the device, 32 hex digits.
    pub uuid: String,
}

/// The processor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cpu {
    /// Name of the model.
    pub model: String,
    /// Logical cores that this process may use.
    pub logical_cores: usize,
}

impl Device {
    /// Returns name, driver and Vulkan version. Two cards of one class differ in their UUIDs only;
    /// they draw the same pictures in the same time.
    pub fn class(&self) -> String {
        format!("{} ({}, Vulkan {})", self.name, self.driver, self.api)
    }
}

impl Cpu {
    /// Returns model and number of cores.
    pub fn class(&self) -> String {
        format!("{}, {} cores", self.model, self.logical_cores)
    }
}

/// The precision of the clocks, in ns.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Clocks {
    /// Smallest step of the host's clock.
    pub resolution_ns: f64,
    /// Time that one reading of the host's clock takes.
    pub overhead_ns: f64,
    /// Tick of the device's timestamps; null if it has none.
    pub timestamp_period_ns: Option<f64>,
    /// The way in which passes are timed; older results have passes "drained".
    #[serde(default)]
    pub pass_times: PassTimes,
    /// Measured time of a pass that does nothing. The time of a real pass means little if it is
    /// about as short.
    pub timestamp_overhead_ns: Option<f64>,
}

/// Returns the device as results name it.
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

/// Measures the clocks of host and device.
///
/// # Errors
/// Fails if a Vulkan call fails.
pub fn clocks_record(
    info: &DeviceInfo,
    pass_times: PassTimes,
    renderer: &mut Renderer,
) -> Result<Clocks> {
    let host = ClockQuality::measure();
    let limits = &info.limits;
    let timestamp_period_ns =
        (limits.timestamp_valid_bits > 0).then_some(limits.timestamp_period_ns);
    let timestamp_overhead_ns = renderer.empty_scope_ns()?;
    let (resolution_ns, overhead_ns) = (host.resolution_ns as f64, host.overhead_ns);
    Ok(Clocks {
        resolution_ns,
        overhead_ns,
        timestamp_period_ns,
        pass_times,
        timestamp_overhead_ns,
    })
}

/// Returns the Git revision that was built (see build.rs).
pub fn revision() -> &'static str {
    env!("NIMBUS_GIT_REVISION")
}

/// Returns the processor of this machine.
pub fn cpu() -> Cpu {
    let model = processor_name().map(|name| name.trim().to_owned());
    Cpu {
        model: model.filter(|name| !name.is_empty()).unwrap_or_else(|| "unknown".to_owned()),
        logical_cores: std::thread::available_parallelism().map_or(1, usize::from),
    }
}

/// Returns the name of the processor, where the system tells it.
fn processor_name() -> Option<String> {
    if cfg!(windows) {
        return std::env::var("PROCESSOR_IDENTIFIER").ok();
    }
    if cfg!(target_os = "macos") {
        let output = Command::new("sysctl").args(["-n", "machdep.cpu.brand_string"]).output();
        return String::from_utf8(output.ok()?.stdout).ok();
    }
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let name_of = |line: &str| Some(line.strip_prefix("model name")?.split_once(':')?.1.to_owned());
    text.lines().find_map(name_of)
}

/// Returns the environment variables that Vulkan drivers and the loader read: Mesa's for every
/// vendor, AMD's, NVIDIA's, Intel's and MoltenVK's.
pub fn environment() -> BTreeMap<String, String> {
    relevant(
        std::env::vars_os()
            .filter_map(|(key, value)| Some((key.into_string().ok()?, value.into_string().ok()?))),
    )
}

fn relevant(variables: impl Iterator<Item = (String, String)>) -> BTreeMap<String, String> {
    const PREFIXES: [&str; 17] = [
        "LP_", "MESA_", "VK_", "GALLIUM_", "RADV_", "ACO_", "AMD_", "AMDVLK_", "NVK_", "NAK_",
        "__GL_", "__NV_", "NVIDIA_", "ANV_", "INTEL_", "MVK_", "DRI_",
    ];
    variables.filter(|(key, _)| PREFIXES.iter().any(|prefix| key.starts_with(prefix))).collect()
}

/// Returns the present time as "2024-02-29T12:34:56Z"; 1970 if the clock is set before it.
pub fn utc_now() -> String {
    iso_8601_utc(SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs()))
}

/// Formats seconds since 1970-01-01T00:00:00Z, without leap seconds.
///
/// The date is Howard Hinnant's `civil_from_days`: years begin in March, so that the leap day is a
/// year's last, and repeat every 400 years of 146 097 days.
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
    fn dates_are_those_of_the_date_command() {
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
    fn only_variables_of_drivers_are_kept() {
        let given = [
            "LP_NUM_THREADS",
            "HOME",
            "VK_DRIVER_FILES",
            "MESA_VK_DEVICE_SELECT",
            "SECRET_VK_KEY",
            "RADV_DEBUG",
            "__GL_THREADED_OPTIMIZATIONS",
        ];
        let kept = relevant(given.iter().map(|key| ((*key).to_owned(), "1".to_owned())));
        assert_eq!(
            kept.keys().collect::<Vec<_>>(),
            [
                "LP_NUM_THREADS",
                "MESA_VK_DEVICE_SELECT",
                "RADV_DEBUG",
                "VK_DRIVER_FILES",
                "__GL_THREADED_OPTIMIZATIONS",
            ]
        );
    }
}
