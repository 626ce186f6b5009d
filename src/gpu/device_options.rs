//! The way in which a device is opened.

use ash::vk;

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

/// Most milliseconds of a submission to a GPU. Windows resets a GPU that does not answer for two
/// seconds, other systems wait longer; a prediction may be off by a factor of four.
const MAX_SUBMIT_MS: f64 = 500.0;

impl DeviceOptions {
    /// Returns the most nanoseconds that a submission to a device of this kind is predicted to
    /// take, if there is a limit.
    pub(super) fn max_submit_ns(&self, kind: &str) -> Option<f64> {
        let of_kind = (kind != "cpu").then_some(MAX_SUBMIT_MS);
        self.max_submit_ms.or(of_kind).map(|ms| 1e6 * ms)
    }

    /// Returns whether commands count invocations: it is asked for, and the device has counters.
    pub(super) fn counts_on(&self, instance: &ash::Instance, physical: vk::PhysicalDevice) -> bool {
        let features = || unsafe { instance.get_physical_device_features(physical) };
        self.counts_invocations && features().pipeline_statistics_query == vk::TRUE
    }
}
