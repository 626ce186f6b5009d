//! The state of the machine as `run.json` has it.

use serde::{Deserialize, Serialize};

use crate::measure::stats::{extremes, median};

/// Median, least and greatest value of readings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Median.
    pub median: f64,
    /// Least value.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
}

impl Spread {
    /// Returns the spread of values; none for no value.
    pub fn of(values: &[f64]) -> Option<Spread> {
        let (min, max) = extremes(values.iter().copied())?;
        Some(Spread { median: median(values)?, min, max })
    }
}

/// A reason that held the clock down.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ThrottleCount {
    /// Name of the reason, as its source has it.
    pub reason: String,
    /// Readings during timed frames that had it.
    pub n: usize,
}

/// The change of the clock over a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Drift {
    /// Mean clock of the last third of the readings divided by that of the first third.
    pub last_by_first: f64,
    /// Lower end of its 95 % interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
    /// Whether the clock drifts: the interval excludes 1, and the ratio differs from 1 by more
    /// than 2 %.
    pub drifts: bool,
}

/// The state of the machine while the timed frames of a case ran.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct CaseState {
    /// Readings.
    pub n_readings: usize,
    /// Graphics clock of the GPU in MHz; null if no source tells it.
    pub gpu_mhz: Option<Spread>,
    /// Memory clock of the GPU in MHz.
    pub gpu_memory_mhz: Option<Spread>,
    /// Temperature of the GPU in °C.
    pub gpu_c: Option<Spread>,
    /// Power of the GPU in W.
    pub gpu_w: Option<Spread>,
    /// Greatest clock of a processor core in MHz.
    pub cpu_mhz: Option<Spread>,
    /// The reasons that held the GPU's clock down, the most frequent first; null if no source tells
    /// them.
    pub throttle: Option<Vec<ThrottleCount>>,
    /// Most device memory of the process at a reading, as the driver tells it, in bytes.
    pub peak_process_bytes: Option<u64>,
    /// Most device memory that nimbus had allocated at a time, in bytes.
    pub peak_own_bytes: Option<u64>,
    /// Share of the processors' time that other processes took.
    pub others_share: Option<f64>,
    /// Timed frames below 75 % of the run's median clock.
    pub n_slow_clock: usize,
    /// Timed frames in which heat or a fault of the power supply held the clock down.
    pub n_slowdown: usize,
    /// Timed frames in which a limit of power or current held the clock down.
    pub n_limited: usize,
    /// Timed frames that are in no statistic (`--discard-throttled`).
    pub n_discarded: usize,
}

/// The state of the machine during a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RunState {
    /// The sources of the readings.
    pub sources: Vec<String>,
    /// The clock that frames are judged by: "gpu" or, for a device of type "cpu", "cpu".
    pub clock: String,
    /// The whole run, as the cases have it.
    pub all: CaseState,
    /// The change of the clock over the run; null with too few readings.
    pub drift: Option<Drift>,
    /// Governor of the processors' clocks at the start; several joined by "+".
    pub governor: Option<String>,
    /// Whether the processors may exceed their base clock.
    pub turbo: Option<bool>,
    /// Load at the start: runnable processes, mean of the minute before.
    pub load_at_start: Option<f64>,
    /// Events during the run in which heat held a processor's clock down.
    pub cpu_throttles: Option<u64>,
    /// Sentences about what may have disturbed the times.
    pub remarks: Vec<String>,
}
