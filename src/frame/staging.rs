//! Buffers that the host writes for every frame: each frame in flight has its own staging buffer,
//! and the frame's commands copy it to where shaders read it.

use std::ops::Deref;

use bytemuck::Pod;

use crate::error::Result;
use crate::gpu::{BindingKind, Buffer, Commands, DeclaredBuffer, Device, MemoryUsage, Recorder};

/// The most frames on the device at once: one executing, one recorded and ready.
pub const IN_FLIGHT: usize = 2;

fn pair<T: Pod>(
    device: &Device,
    name: &str,
    n: u64,
    texels: Option<BindingKind>,
    place: MemoryUsage,
) -> Result<[Buffer; IN_FLIGHT]> {
    let buffer = |i: usize| {
        let name = format!("{name}.{i}");
        match texels {
            Some(BindingKind::TexelStores) => Buffer::of_texels::<T>(device, &name, n, place),
            _ => Buffer::new::<T>(device, &name, n, place),
        }
    };
    Ok([buffer(0)?, buffer(1)?])
}

/// A device buffer for each frame in flight.
pub struct DeviceBuffers(pub [Buffer; IN_FLIGHT]);

/// A buffer for each frame in flight that the host writes.
pub struct UploadBuffers(pub [Buffer; IN_FLIGHT]);

/// A buffer for each frame in flight that the host reads.
pub struct ReadbackBuffers(pub [Buffer; IN_FLIGHT]);

/// Implements [`DeclaredBuffer`] for a buffer a frame in flight.
macro_rules! declared_pair {
    ($($Name:ident in $place:ident),*) => {$(
        impl DeclaredBuffer for $Name {
            const N_COPIES: u64 = IN_FLIGHT as u64;

            fn allocate<T: Pod>(
                device: &Device,
                name: &str,
                n: u64,
                texels: Option<BindingKind>,
            ) -> Result<$Name> {
                Ok($Name(pair::<T>(device, name, n, texels, MemoryUsage::$place)?))
            }
        }
    )*};
}

declared_pair!(DeviceBuffers in Device, UploadBuffers in Upload, ReadbackBuffers in Readback);

/// Staging buffers that remember their content, so that unchanged data is not copied again.
pub struct Staging {
    buffers: UploadBuffers,
    /// The data that the device has.
    last: Vec<u8>,
    is_new: bool,
}

impl DeclaredBuffer for Staging {
    const N_COPIES: u64 = UploadBuffers::N_COPIES;

    fn allocate<T: Pod>(
        device: &Device,
        name: &str,
        n: u64,
        texels: Option<BindingKind>,
    ) -> Result<Staging> {
        let buffers = UploadBuffers::allocate::<T>(device, &format!("{name}.upload"), n, texels)?;
        Ok(Staging { buffers, last: vec![], is_new: false })
    }
}

impl Staging {
    /// Writes the data of the frame in `slot`. The frame that used the slot before must have ended.
    ///
    /// # Errors
    /// Fails if the data is larger than the buffer.
    pub fn write<T: Pod>(&mut self, slot: usize, data: &[T]) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        self.is_new = bytes != self.last;
        if self.is_new {
            self.buffers.0[slot].write(data)?;
            self.last.clear();
            self.last.extend_from_slice(bytes);
        }
        Ok(())
    }

    /// Copies the data to `buffer` if it has changed.
    pub fn record_copy(&self, rec: &mut Recorder<'_>, slot: usize, buffer: &Buffer) {
        if self.is_new {
            rec.copy(&self.buffers.0[slot], buffer);
        }
    }
}

/// A device buffer with its staging buffers. Dereferences to the device buffer.
pub struct StagedBuffer {
    buffer: Buffer,
    staging: Staging,
}

impl DeclaredBuffer for StagedBuffer {
    const N_COPIES: u64 = 1 + Staging::N_COPIES;

    fn allocate<T: Pod>(
        device: &Device,
        name: &str,
        n: u64,
        texels: Option<BindingKind>,
    ) -> Result<StagedBuffer> {
        Ok(StagedBuffer {
            buffer: Buffer::allocate::<T>(device, name, n, texels)?,
            staging: Staging::allocate::<T>(device, name, n, texels)?,
        })
    }
}

impl StagedBuffer {
    /// Writes the data of the frame in `slot`. The frame that used the slot before must have ended.
    ///
    /// # Errors
    /// Fails if the data is larger than the buffer.
    pub fn write<T: Pod>(&mut self, slot: usize, data: &[T]) -> Result<()> {
        self.staging.write(slot, data)
    }

    /// Copies the data to the device buffer if it has changed.
    pub fn record_copy(&self, rec: &mut Recorder<'_>, slot: usize) {
        self.staging.record_copy(rec, slot, &self.buffer);
    }
}

impl Deref for StagedBuffer {
    type Target = Buffer;

    fn deref(&self) -> &Buffer {
        &self.buffer
    }
}

/// The most bytes that are uploaded at once: 10 million particles have 480 MiB, which the host need
/// not hold twice.
const UPLOAD_BYTES: usize = 32 << 20;

/// Fills a device buffer with `data` and waits.
pub(super) fn upload<T: Pod>(
    device: &Device,
    commands: &mut Commands,
    data: &[T],
    to: &Buffer,
) -> Result<()> {
    let parts = data.chunks(per_upload::<T>()).map(|part| part.to_vec());
    upload_parts(device, commands, parts, to, 0)
}

/// Returns the most records of one upload.
pub(super) const fn per_upload<T>() -> usize {
    UPLOAD_BYTES / size_of::<T>()
}

/// Writes parts of at most [`per_upload`] records, one after the other, to a device buffer from
/// record `i_first` on, and waits.
pub(super) fn upload_parts<T: Pod>(
    device: &Device,
    commands: &mut Commands,
    parts: impl Iterator<Item = Vec<T>>,
    to: &Buffer,
    i_first: u64,
) -> Result<()> {
    let mut staging: Option<Buffer> = None;
    let mut at = i_first * size_of::<T>() as u64;
    for part in parts.filter(|part| !part.is_empty()) {
        let n = part.len() as u64;
        let bytes = n * size_of::<T>() as u64;
        let kept = staging.take().filter(|kept| kept.bytes() >= bytes);
        let mut from = match kept {
            Some(kept) => kept,
            None => Buffer::new::<T>(device, "frame.staging", n, MemoryUsage::Upload)?,
        };
        from.write(&part)?;
        commands.run(|rec| {
            rec.copy_runs(&from, to, &[[0, at, bytes]]);
            Ok(())
        })?;
        at += bytes;
        staging = Some(from);
    }
    Ok(())
}

/// Returns the first `n` records of a device buffer.
pub(super) fn download<T: Pod>(
    device: &Device,
    commands: &mut Commands,
    from: &Buffer,
    n: u32,
) -> Result<Vec<T>> {
    let readback =
        Buffer::of_texels::<T>(device, "frame.readback", n.into(), MemoryUsage::Readback)?;
    commands.run(|rec| {
        rec.copy(from, &readback);
        Ok(())
    })?;
    readback.read(n as usize)
}
