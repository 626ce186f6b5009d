//! What a reader of a device's state does.

use super::row::StateRow;

/// A reader of the clocks, heat and power of a device.
pub trait DeviceSource {
    /// Returns the name of the driver or library that is asked.
    fn name(&self) -> &'static str;

    /// Sets what the source tells at `time_s`, seconds since the start of the run.
    fn read(&mut self, time_s: f64, row: &mut StateRow);
}
