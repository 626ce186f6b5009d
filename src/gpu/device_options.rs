//! The way in which a device is opened.

use super::lowered::LoweredLimits;
use super::pass_times::PassTimes;

/// The way in which a device is opened.
#[derive(Debug, Clone, Default)]
pub struct DeviceOptions {
    /// Limits of another device that the device is lowered to.
    pub limits: Option<LoweredLimits>,
    /// The device keeps a report on every pipeline that it makes.
    pub reports_pipelines: bool,
    /// Buffers are filled with NaN and have guard bands, which are checked after each pass.
    pub guard: bool,
    /// Most milliseconds that a submission is predicted to take; without, 500 on a device that is
    /// no CPU, and any time on a CPU.
    pub max_submit_ms: Option<f64>,
    /// The way in which the times of passes are taken.
    pub pass_times: PassTimes,
    /// The device can count the invocations and primitives of passes, if it has such counters.
    pub counts_invocations: bool,
    /// The frame that RenderDoc captures, counted from 0 as frames begin on the device.
    pub captured_frame: Option<u32>,
}
