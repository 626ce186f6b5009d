//! `state.csv`: every reading of the machine's state, raw.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// File name of the table.
pub const STATE_FILE: &str = "state.csv";

/// The reason for a reading.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Event {
    /// The bench is about to begin.
    #[default]
    Start,
    /// The timed frames of a block begin.
    Begin,
    /// A tenth of a second has passed.
    Tick,
    /// The frames of a block have ended.
    End,
}

/// A row of `state.csv`; None, an empty field, if no source tells a value.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StateRow {
    /// Seconds since the start of the run.
    pub time_s: f64,
    /// The reason for the reading.
    pub event: Event,
    /// Number of the block over the whole run.
    pub block: Option<u32>,
    /// Graphics clock of the GPU in MHz.
    pub gpu_mhz: Option<f64>,
    /// Memory clock of the GPU in MHz.
    pub gpu_memory_mhz: Option<f64>,
    /// Temperature of the GPU in °C.
    pub gpu_c: Option<f64>,
    /// Power of the GPU in W.
    pub gpu_w: Option<f64>,
    /// Share of the time in which the GPU had work, in %.
    pub gpu_busy_percent: Option<f64>,
    /// Reasons that hold the clock down, joined by "+"; "none" if there is none.
    pub throttle: Option<String>,
    /// Device memory of the process as the driver tells it, in bytes.
    pub process_bytes: Option<u64>,
    /// Device memory that nimbus has allocated, in bytes.
    pub own_bytes: Option<u64>,
    /// The most of it since the row before.
    pub own_peak_bytes: Option<u64>,
    /// Greatest clock of a processor core in MHz.
    pub cpu_mhz: Option<f64>,
    /// Time of all processors since the system started, in ticks of the system (mostly 10 ms).
    pub cpu_ticks: Option<u64>,
    /// Ticks in which they worked, or were taken away by a hypervisor.
    pub cpu_busy_ticks: Option<u64>,
    /// Ticks in which they worked for this process.
    pub cpu_own_ticks: Option<u64>,
    /// Runnable processes, mean of the last minute.
    pub load: Option<f64>,
    /// Governor of the processors' clocks; several joined by "+".
    pub governor: Option<String>,
    /// Whether the processors may exceed their base clock.
    pub turbo: Option<bool>,
    /// Events since the system started in which heat held a processor's clock down.
    pub cpu_throttles: Option<u64>,
}

/// The value of [`StateRow::throttle`] if nothing holds the clock down.
pub const NO_REASON: &str = "none";

impl StateRow {
    /// Returns the reasons that hold the clock down.
    pub fn reasons(&self) -> impl Iterator<Item = &str> {
        let text = self.throttle.as_deref().filter(|text| *text != NO_REASON);
        text.into_iter().flat_map(|text| text.split('+'))
    }

    /// Sets the reasons that hold the clock down.
    pub fn set_reasons(&mut self, reasons: &[impl AsRef<str>]) {
        let names: Vec<&str> = reasons.iter().map(AsRef::as_ref).collect();
        let text = if names.is_empty() { NO_REASON.to_owned() } else { names.join("+") };
        self.throttle = Some(text);
    }
}

/// Returns rows as the text of a `state.csv`.
///
/// # Errors
/// Fails only if the rows cannot be written as CSV, which is a fault of nimbus.
pub fn rows_text(rows: &[StateRow]) -> Result<String> {
    let failed = |cause: String| Error::io(Path::new(STATE_FILE), cause);
    let mut writer = csv::Writer::from_writer(Vec::new());
    rows.iter().try_for_each(|row| writer.serialize(row)).map_err(|e| failed(e.to_string()))?;
    let bytes = writer.into_inner().map_err(|e| failed(e.to_string()))?;
    String::from_utf8(bytes).map_err(|e| failed(e.to_string()))
}

/// Parses the text of a `state.csv`; errors name `path` and the line.
///
/// # Errors
/// Fails if a column is missing, a row is cut off, or a field has another type.
pub fn parse_rows(text: &str, path: &Path) -> Result<Vec<StateRow>> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let rows = reader.deserialize().map(|row| row.map_err(|cause| Error::io(path, cause)));
    rows.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_were_read_are_written_with_the_same_bytes() {
        let mut full = StateRow {
            time_s: 0.125,
            event: Event::Tick,
            block: Some(3),
            gpu_mhz: Some(1905.0),
            gpu_memory_mhz: Some(9501.0),
            gpu_c: Some(61.5),
            gpu_w: Some(212.25),
            gpu_busy_percent: Some(97.0),
            throttle: None,
            process_bytes: Some(1 << 33),
            own_bytes: Some(7),
            own_peak_bytes: Some(9),
            cpu_mhz: Some(4199.5),
            cpu_ticks: Some(u64::MAX),
            cpu_busy_ticks: Some(5),
            cpu_own_ticks: Some(4),
            load: Some(0.25),
            governor: Some("performance+powersave".to_owned()),
            turbo: Some(false),
            cpu_throttles: Some(0),
        };
        full.set_reasons(&["sw_power_cap", "sw_thermal_slowdown"]);
        let rows = [StateRow::default(), full];
        let text = rows_text(&rows).unwrap();
        let read = parse_rows(&text, Path::new(STATE_FILE)).unwrap();
        assert_eq!(read, rows);
        assert_eq!(rows_text(&read).unwrap(), text);
        assert_eq!(read[1].reasons().collect::<Vec<_>>(), ["sw_power_cap", "sw_thermal_slowdown"]);
        assert_eq!(rows_text(&[]).unwrap(), "");
        assert_eq!(parse_rows("", Path::new(STATE_FILE)).unwrap(), []);
    }

    #[test]
    fn a_faulty_row_is_reported_with_its_line() {
        let mut text = rows_text(&[StateRow::default()]).unwrap();
        text = text.replace("start", "begun");
        let message = parse_rows(&text, Path::new("a/state.csv")).unwrap_err().to_string();
        assert!(message.contains("state.csv") && message.contains("line: 2"), "{message}");
    }
}
