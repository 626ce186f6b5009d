//! What the host writes anew for a frame, on its way to the device: written into one of several
//! staging buffers, so that frames in flight keep theirs, and copied by the frame's own commands.

use bytemuck::Pod;

use crate::error::Result;
use crate::gpu::{Buffer, Device, MemoryUsage, Recorder};

/// Frames that may be on the device at once: one being drawn, one recorded and ready.
pub const IN_FLIGHT: usize = 2;

pub struct Feed {
    /// What shaders read.
    pub buffer: Buffer,
    staging: [Buffer; IN_FLIGHT],
    /// What the last frame wrote.
    last: Vec<u8>,
    is_new: bool,
}

impl Feed {
    /// Room for `n` records of type `T`.
    pub fn new<T: Pod>(device: &Device, name: &str, n: u64) -> Result<Feed> {
        let staging = |k: usize| {
            Buffer::new::<T>(device, &format!("{name}.upload{k}"), n, MemoryUsage::Upload)
        };
        Ok(Feed {
            buffer: Buffer::new::<T>(device, name, n, MemoryUsage::Device)?,
            staging: [staging(0)?, staging(1)?],
            last: vec![],
            is_new: false,
        })
    }

    /// Writes what the frame of `slot` is to see. The frame that last used the slot must have
    /// ended.
    pub fn write<T: Pod>(&mut self, slot: usize, data: &[T]) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        self.is_new = bytes != self.last;
        if self.is_new {
            self.staging[slot].write(data)?;
            self.last.clear();
            self.last.extend_from_slice(bytes);
        }
        Ok(())
    }

    /// Copies it, where it is not what the device has.
    pub fn record(&self, rec: &mut Recorder<'_>, slot: usize) {
        if self.is_new {
            rec.copy(&self.staging[slot], &self.buffer);
        }
    }
}
