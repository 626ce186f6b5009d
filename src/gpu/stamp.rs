//! A number that every submission writes at its end: a driver that says that commands are done, and
//! has not executed them, is noticed.

use std::sync::Arc;

use ash::vk;

use super::buffer::{Buffer, MemoryUsage};
use super::device::{Device, SharedDevice};
use crate::error::Result;

/// Odd and without a pattern, so that no number is 0 or what memory holds by chance.
const STEP: u32 = 0x9e37_79b9;

/// The number of the last submission of a command buffer.
pub(super) struct Stamp {
    word: Buffer,
    number: u32,
    shared: Arc<SharedDevice>,
}

impl Stamp {
    pub fn new(device: &Device, name: &str) -> Result<Stamp> {
        let name = format!("{name}.stamp");
        let word = Buffer::new::<u32>(device, &name, 1, MemoryUsage::Readback)?;
        Ok(Stamp { word, number: 0, shared: device.shared().clone() })
    }

    /// Records that the device writes the next number; the last command but for a barrier.
    pub fn write(&mut self, commands: vk::CommandBuffer) {
        self.number = self.number.wrapping_add(STEP);
        let (word, number) = (self.word.raw(), self.number);
        unsafe { self.shared.raw.cmd_fill_buffer(commands, word, 0, 4, number) };
    }

    /// Counts a submission that has ended.
    pub fn count(&self) -> Result<()> {
        let word: Vec<u32> = self.word.read(1)?;
        self.shared.executed.add(word == [self.number]);
        Ok(())
    }
}
