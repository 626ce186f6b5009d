//! Storage buffers, checked against the device's limits before they are allocated.

use ash::vk;
use bytemuck::Pod;
use gpu_allocator::MemoryLocation;

use super::call::Call;
use super::device::{Device, Owned};
use super::guard::BAND_BYTES;
use super::limits::Limits;
use super::memory::Memory;
use super::reflect::BindingKind;
use crate::error::{Error, Result};

/// The memory a buffer lives in, by who accesses it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MemoryUsage {
    /// The device alone.
    Device,
    /// The host writes, the device reads.
    Upload,
    /// The device writes, the host reads.
    Readback,
}

/// Returns the format of texels: words of any bits, which every device reads and stores, or floats,
/// which every device reads.
fn format_of(kind: BindingKind) -> vk::Format {
    match kind {
        BindingKind::Floats => vk::Format::R32_SFLOAT,
        _ => vk::Format::R32G32B32A32_UINT,
    }
}

/// Bytes of the larger of the two texels.
const MAX_TEXEL_BYTES: u64 = 16;

/// A buffer that shaders read and write as records or as texels, and that can be copied and
/// dispatched from.
// Fields drop in order: views before their buffer, the buffer before its memory.
pub struct Buffer {
    /// A view of the whole buffer by words, and one by floats; none where it has more texels than
    /// the device reads.
    words: Option<Owned<vk::BufferView>>,
    floats: Option<Owned<vk::BufferView>>,
    handle: Owned<vk::Buffer>,
    memory: Memory,
    bytes: u64,
    /// The bytes that shaders see: whole texels, and the guard band on a device that has them.
    shader_bytes: u64,
    limits: Limits,
    name: String,
}

impl Buffer {
    /// Allocates a buffer of `n` records of type `T`; at least one record, since Vulkan has no
    /// empty buffers. On a device with guard bands the buffer is full of NaN, and a band follows.
    ///
    /// # Errors
    /// The size breaks a limit of the device, or its memory is used up.
    pub fn new<T: Pod>(device: &Device, name: &str, n: u64, usage: MemoryUsage) -> Result<Buffer> {
        let bytes = storage_bytes(device.limits(), name, n, size_of::<T>() as u64)?;
        Buffer::of_bytes(device, name, bytes, usage)
    }

    /// Allocates a buffer that shaders read and write by texels alone, or that is only copied. It
    /// may be larger than one of records ([`texel_bytes`]).
    ///
    /// # Errors
    /// As for [`Buffer::new`].
    pub fn of_texels<T: Pod>(
        device: &Device,
        name: &str,
        n: u64,
        usage: MemoryUsage,
    ) -> Result<Buffer> {
        let bytes = texel_bytes(device.limits(), name, n, size_of::<T>() as u64)?;
        Buffer::of_bytes(device, name, bytes, usage)
    }

    fn of_bytes(device: &Device, name: &str, bytes: u64, usage: MemoryUsage) -> Result<Buffer> {
        let (shared, limits) = (device.shared(), device.limits());
        // Whole texels, so that texel reads reach the last words too.
        let mut shader_bytes = bytes.next_multiple_of(MAX_TEXEL_BYTES);
        if shared.guards.is_some() {
            // A band must not make a buffer too large to be bound.
            let records = limits.max_storage_buffer_bytes;
            let bound = if shader_bytes <= records { records } else { u64::MAX };
            let most = bound.min(limits.max_buffer_bytes).min(shader_bytes + BAND_BYTES);
            shader_bytes = shader_bytes.max(most - most % MAX_TEXEL_BYTES);
        }
        let info = vk::BufferCreateInfo::default().size(shader_bytes).usage(
            vk::BufferUsageFlags::STORAGE_BUFFER
                | vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER
                | vk::BufferUsageFlags::STORAGE_TEXEL_BUFFER
                | vk::BufferUsageFlags::TRANSFER_SRC
                | vk::BufferUsageFlags::TRANSFER_DST
                | vk::BufferUsageFlags::INDIRECT_BUFFER,
        );
        let raw =
            unsafe { shared.raw.create_buffer(&info, None) }.of_call("vkCreateBuffer", name)?;
        let handle = shared.own(raw, name, ash::Device::destroy_buffer);
        let requirements = unsafe { shared.raw.get_buffer_memory_requirements(raw) };
        let location = match usage {
            // The host fills all buffers with bands, and reads the bands.
            _ if shared.guards.is_some() => MemoryLocation::GpuToCpu,
            MemoryUsage::Device => MemoryLocation::GpuOnly,
            MemoryUsage::Upload => MemoryLocation::CpuToGpu,
            MemoryUsage::Readback => MemoryLocation::GpuToCpu,
        };
        let mut memory = Memory::new(shared, name, requirements, location, true)?;
        let (block, offset) = memory.place();
        unsafe { shared.raw.bind_buffer_memory(raw, block, offset) }
            .of_call("vkBindBufferMemory", name)?;
        let max_texels = if limits.has_texel_buffers() { limits.max_texels } else { 0 };
        let view = |kind: BindingKind| {
            let (format, texel_bytes) = (format_of(kind), u64::from(kind.texel_bytes()));
            if bytes.div_ceil(texel_bytes) > max_texels {
                return Ok(None);
            }
            let range = (shader_bytes / texel_bytes).min(max_texels) * texel_bytes;
            let info = vk::BufferViewCreateInfo::default().buffer(raw).format(format);
            let view = unsafe { shared.raw.create_buffer_view(&info.range(range), None) }
                .of_call("vkCreateBufferView", name)?;
            Ok(Some(shared.own(view, name, ash::Device::destroy_buffer_view)))
        };
        let (words, floats) = (view(BindingKind::Texels)?, view(BindingKind::Floats)?);
        if let Some(guards) = &shared.guards
            && let Some(mapped) =
                memory.mapped_mut().and_then(|m| m.get_mut(..shader_bytes as usize))
        {
            guards.watch(raw, name, mapped, bytes as usize);
        }
        let name = name.to_owned();
        let limits = *limits;
        Ok(Buffer { words, floats, handle, memory, bytes, shader_bytes, limits, name })
    }

    pub(super) fn raw(&self) -> vk::Buffer {
        self.handle.raw
    }

    /// Returns the view by which shaders read or store the buffer as texels; null for records.
    pub(super) fn texels(&self, kind: BindingKind) -> Result<vk::BufferView> {
        let view = match kind {
            BindingKind::Storage => return Ok(vk::BufferView::null()),
            BindingKind::Texels | BindingKind::TexelStores => &self.words,
            BindingKind::Floats => &self.floats,
        };
        view.as_ref().map(|view| view.raw).ok_or_else(|| {
            Error::limit(format!(
                "{}: {} bytes are to be read by {}, this device takes {} such texels at most \
                 (maxTexelBufferElements)",
                self.name,
                self.bytes,
                kind.texel_bytes(),
                self.limits.max_texels
            ))
        })
    }

    /// Returns what shaders read and write as records: whole texels, and the guard band if there is
    /// one.
    pub(super) fn records(&self) -> Result<vk::DescriptorBufferInfo> {
        if self.shader_bytes > self.limits.max_storage_buffer_bytes {
            return Err(Error::limit(format!(
                "{}: {} bytes are to be bound as records, this device takes {} at most \
                 (maxStorageBufferRange)",
                self.name, self.shader_bytes, self.limits.max_storage_buffer_bytes
            )));
        }
        let (buffer, range) = (self.raw(), self.shader_bytes);
        Ok(vk::DescriptorBufferInfo { buffer, offset: 0, range })
    }

    /// Returns the size in bytes, as it was asked for.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Copies `data` to the start of an upload buffer. The GPU must not be reading it.
    ///
    /// # Errors
    /// The data does not fit, or the host cannot see the buffer.
    pub fn write<T: Pod>(&mut self, data: &[T]) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        // The allocation may be larger than the buffer.
        let size = self.bytes as usize;
        let target =
            self.memory.mapped_mut().and_then(|m| m.get_mut(..size)?.get_mut(..bytes.len()));
        let Some(target) = target else {
            return Err(Error::limit(format!(
                "{}: {} bytes do not fit a host-visible buffer of {size}",
                self.name,
                bytes.len(),
            )));
        };
        target.copy_from_slice(bytes);
        Ok(())
    }

    /// Returns the first `n` records of a readback buffer. The GPU must have finished writing it.
    ///
    /// # Errors
    /// The buffer holds fewer records, or the host cannot see it.
    pub fn read<T: Pod>(&self, n: usize) -> Result<Vec<T>> {
        let size = self.bytes as usize;
        let bytes =
            self.memory.mapped().and_then(|m| m.get(..size)?.get(..n.checked_mul(size_of::<T>())?));
        // Collected, since the mapping has the allocator's alignment and not that of T.
        bytes.map(bytemuck::pod_collect_to_vec).ok_or_else(|| {
            Error::limit(format!(
                "{}: {n} records do not lie in a host-visible buffer of {size} bytes",
                self.name
            ))
        })
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        if let Some(guards) = &self.memory.shared().guards {
            guards.forget(self.handle.raw);
        }
    }
}

/// Returns the bytes of a storage buffer of `n` records.
///
/// # Errors
/// The device takes fewer; the message names the limit.
pub fn storage_bytes(limits: &Limits, name: &str, n: u64, record_bytes: u64) -> Result<u64> {
    let most = limits.max_storage_buffer_bytes;
    bytes_within(limits, name, [n, record_bytes], most, "maxStorageBufferRange")
}

/// Returns the bytes of a buffer of `n` records that shaders read and store by texels alone. Where
/// the device has too few texels, shaders read records in their place.
///
/// # Errors
/// As for [`storage_bytes`].
pub fn texel_bytes(limits: &Limits, name: &str, n: u64, record_bytes: u64) -> Result<u64> {
    if !limits.has_texel_buffers() {
        return storage_bytes(limits, name, n, record_bytes);
    }
    let most = limits.max_texel_buffer_bytes(MAX_TEXEL_BYTES);
    let limit = format!("maxTexelBufferElements {}, in bytes", limits.max_texels);
    bytes_within(limits, name, [n, record_bytes], most, &limit)
}

fn bytes_within(
    limits: &Limits,
    name: &str,
    [n, record_bytes]: [u64; 2],
    most: u64,
    limit: &str,
) -> Result<u64> {
    let Limits { max_buffer_bytes, device_memory_bytes, .. } = *limits;
    let fitting = most.min(max_buffer_bytes).min(device_memory_bytes);
    // Shaders see whole texels, which must fit, too.
    let fitting = fitting - fitting % MAX_TEXEL_BYTES;
    match n.max(1).checked_mul(record_bytes) {
        Some(bytes) if bytes <= fitting => Ok(bytes.next_multiple_of(4)),
        _ => Err(Error::limit(format!(
            "{name}: {n} records of {record_bytes} bytes are wanted, this device takes {} at most \
             ({limit} {most}, maxBufferSize {max_buffer_bytes}, memory {device_memory_bytes} \
             bytes)",
            fitting / record_bytes
        ))),
    }
}
