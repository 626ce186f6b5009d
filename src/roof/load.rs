//! What is measured: work of any amount, whose results are known.

use crate::error::{Error, Result};
use crate::gpu::{Buffer, Commands, Device, MemoryUsage, Recorder};

/// A kind of work of a device.
pub(super) trait Load {
    /// Returns the name of the roof and the way of access.
    fn name(&self) -> (&'static str, Option<&'static str>);

    /// Returns the bytes that are accessed again and again; none for arithmetic.
    fn set_bytes(&self) -> Option<u64>;

    /// Returns the bytes or operations of `n` units of work.
    fn amount(&self, n: u32) -> f64;

    /// Returns the most units of work at once.
    fn most(&self) -> u32;

    /// Records what comes before the work and is not timed.
    ///
    /// # Errors
    /// Fails if the device is lost.
    fn prepare(&self, rec: &mut Recorder<'_>) -> Result<()>;

    /// Records `n` units of work.
    ///
    /// # Errors
    /// Fails if the device is lost.
    fn record(&self, rec: &mut Recorder<'_>, n: u32) -> Result<()>;

    /// Checks the results of `n` units, the last that were recorded.
    ///
    /// # Errors
    /// Fails if they are wrong, or the device is lost.
    fn check(&self, device: &Device, commands: &mut Commands, n: u32) -> Result<()>;
}

/// Returns the first `n` words of a buffer.
pub(super) fn words(
    device: &Device,
    commands: &mut Commands,
    from: &Buffer,
    n: usize,
) -> Result<Vec<u32>> {
    let to = Buffer::new::<u32>(device, "roof.readback", n as u64, MemoryUsage::Readback)?;
    commands.run(|rec| {
        rec.copy(from, &to);
        Ok(())
    })?;
    to.read(n)
}

/// Fails unless two results are the same.
pub(super) fn expect_same<T: PartialEq + std::fmt::Debug>(
    what: &str,
    found: T,
    expected: T,
) -> Result<()> {
    if found == expected {
        return Ok(());
    }
    let what = format!(
        "devices --roof: {what}: the device computes {found:?}, expected {expected:?}; its times \
         mean nothing. `nimbus stress` says what else is wrong"
    );
    Err(Error::Check { what })
}
