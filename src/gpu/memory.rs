//! Buffers and images. Every one is named `room.thing`, and checked against the device's limits
//! before it is allocated.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use ash::vk;
use bytemuck::Pod;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

use super::device::{Device, Limits, Shared};
use super::recorder::{Commands, Recorder};
use super::reflect::BindingKind;
use crate::error::{Error, Result};

/// Where a buffer lives, by who touches it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Device only.
    Device,
    /// Written by the host, read by the device.
    Upload,
    /// Written by the device, read by the host.
    Readback,
}

/// What texels are: as words, so that every bit passes; and as floats. Every device reads both.
const TEXELS: [(BindingKind, vk::Format); 2] = [
    (BindingKind::Texels, vk::Format::R32G32B32A32_UINT),
    (BindingKind::Floats, vk::Format::R32_SFLOAT),
];

/// Of the largest texel.
const TEXEL_BYTES: u64 = 16;

pub struct Buffer {
    pub(super) raw: vk::Buffer,
    /// All of it, by kind of texel; null where it has more than the device reads.
    views: [vk::BufferView; 2],
    allocation: Option<Allocation>,
    bytes: u64,
    name: String,
    shared: Arc<Shared>,
}

impl Buffer {
    /// A storage buffer of `n` records of type `T`; at least one record, since Vulkan has no empty
    /// buffers.
    pub fn new<T: Pod>(device: &Device, name: &str, n: u64, place: Place) -> Result<Buffer> {
        let bytes = storage_bytes(device.limits(), name, n, size_of::<T>() as u64)?;
        let shared = device.shared().clone();
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST
            | vk::BufferUsageFlags::INDIRECT_BUFFER;
        // Whole texels, so that the last words are read by them as well.
        let info =
            vk::BufferCreateInfo::default().size(bytes.next_multiple_of(TEXEL_BYTES)).usage(usage);
        let raw = unsafe { shared.raw.create_buffer(&info, None) }
            .map_err(|e| Error::vulkan(format!("vkCreateBuffer {name}"), e))?;
        shared.name(raw, name);
        let requirements = unsafe { shared.raw.get_buffer_memory_requirements(raw) };
        let location = match place {
            Place::Device => MemoryLocation::GpuOnly,
            Place::Upload => MemoryLocation::CpuToGpu,
            Place::Readback => MemoryLocation::GpuToCpu,
        };
        let views = [vk::BufferView::null(); 2];
        let mut buffer =
            Buffer { raw, views, allocation: None, bytes, name: name.to_owned(), shared };
        let allocation = allocate(&buffer.shared, name, requirements, location, true)?;
        let (memory, offset) = (unsafe { allocation.memory() }, allocation.offset());
        buffer.allocation = Some(allocation);
        unsafe { buffer.shared.raw.bind_buffer_memory(raw, memory, offset) }
            .map_err(|e| Error::vulkan(format!("vkBindBufferMemory {name}"), e))?;
        buffer.make_views(device.limits())?;
        if buffer.shared.poisons.load(Ordering::Relaxed) {
            buffer.poison(device, place)?;
        }
        Ok(buffer)
    }

    /// Fills it with words that are NaN as floats and too great as numbers.
    fn poison(&mut self, device: &Device, place: Place) -> Result<()> {
        if place == Place::Device {
            let mut commands = Commands::new(device, "poison")?;
            let fill = |rec: &mut Recorder<'_>| {
                rec.fill(self, u32::MAX);
                Ok(())
            };
            return commands.run(fill).map(|_| ());
        }
        let size = self.bytes as usize;
        let mapped = self.allocation.as_mut().and_then(Allocation::mapped_slice_mut);
        if let Some(bytes) = mapped.and_then(|m| m.get_mut(..size)) {
            bytes.fill(u8::MAX);
        }
        Ok(())
    }

    fn make_views(&mut self, limits: &Limits) -> Result<()> {
        for (view, (kind, format)) in self.views.iter_mut().zip(TEXELS) {
            let n = self.bytes.div_ceil(u64::from(kind.texel_bytes()));
            if n > limits.max_texels {
                continue;
            }
            let info = vk::BufferViewCreateInfo::default().buffer(self.raw).format(format);
            let info = info.range(n * u64::from(kind.texel_bytes()));
            *view = unsafe { self.shared.raw.create_buffer_view(&info, None) }
                .map_err(|e| Error::vulkan(format!("vkCreateBufferView {}", self.name), e))?;
        }
        Ok(())
    }

    /// As shaders read it by texels; null for records.
    pub(super) fn texels(&self, kind: BindingKind) -> Result<vk::BufferView> {
        let Some(i) = TEXELS.iter().position(|(k, _)| *k == kind) else {
            return Ok(vk::BufferView::null());
        };
        if self.views[i] == vk::BufferView::null() {
            let most = self.shared.limits.max_texels;
            return Err(Error::limit(format!(
                "{}: {} bytes are to be read by {}, this device takes {most} such texels at most \
                 (maxTexelBufferElements)",
                self.name,
                self.bytes,
                kind.texel_bytes()
            )));
        }
        Ok(self.views[i])
    }

    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    /// Copies `data` to the start of an upload buffer. The GPU must not be reading it.
    pub fn write<T: Pod>(&mut self, data: &[T]) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        // The allocation may be larger than the buffer.
        let size = self.bytes as usize;
        let mapped = self.allocation.as_mut().and_then(Allocation::mapped_slice_mut);
        match mapped.and_then(|m| m.get_mut(..size)?.get_mut(..bytes.len())) {
            Some(target) => {
                target.copy_from_slice(bytes);
                Ok(())
            }
            None => Err(Error::limit(format!(
                "{}: {} bytes do not fit a host-visible buffer of {}",
                self.name,
                bytes.len(),
                self.bytes
            ))),
        }
    }

    /// The first `n` records of a readback buffer. The GPU must have finished writing it.
    pub fn read<T: Pod>(&self, n: usize) -> Result<Vec<T>> {
        let mapped = self.allocation.as_ref().and_then(Allocation::mapped_slice);
        match mapped
            .and_then(|m| m.get(..self.bytes as usize)?.get(..n.checked_mul(size_of::<T>())?))
        {
            // collect: the mapping's alignment is the allocator's, not T's.
            Some(bytes) => Ok(bytemuck::pod_collect_to_vec(bytes)),
            None => Err(Error::limit(format!(
                "{}: {n} records do not lie in a host-visible buffer of {} bytes",
                self.name, self.bytes
            ))),
        }
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: whoever drops a buffer has waited for the commands that use it, or drops those
        // first, which wait.
        unsafe {
            for view in self.views {
                self.shared.raw.destroy_buffer_view(view, None);
            }
            self.shared.raw.destroy_buffer(self.raw, None);
        }
        free(&self.shared, self.allocation.take());
    }
}

/// Bytes of `n` records, or the error that names the limit they break.
pub fn storage_bytes(limits: &Limits, name: &str, n: u64, record_bytes: u64) -> Result<u64> {
    let most = limits.max_storage_buffer_bytes.min(limits.device_memory_bytes);
    match n.max(1).checked_mul(record_bytes) {
        Some(bytes) if bytes <= most => Ok(bytes.next_multiple_of(4)),
        _ => Err(Error::limit(format!(
            "{name}: {n} records of {record_bytes} bytes are wanted, this device takes {} at most \
             (maxStorageBufferRange {}, memory {} bytes)",
            most / record_bytes,
            limits.max_storage_buffer_bytes,
            limits.device_memory_bytes
        ))),
    }
}

/// A colour target, or depth beside one.
pub struct Image {
    pub(super) raw: vk::Image,
    pub(super) view: vk::ImageView,
    pub(super) layout: vk::ImageLayout,
    pub(super) extent: vk::Extent2D,
    pub(super) range: vk::ImageSubresourceRange,
    allocation: Option<Allocation>,
    /// A swapchain's, which owns it.
    is_borrowed: bool,
    shared: Arc<Shared>,
}

/// Formats a colour target can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TargetFormat {
    /// UNORM, not sRGB: blending is linear.
    Rgba8,
    Rgba16f,
    Rgba32f,
    /// What windows mostly have; UNORM, too.
    Bgra8,
}

impl TargetFormat {
    pub(super) fn raw(self) -> vk::Format {
        match self {
            TargetFormat::Rgba8 => vk::Format::R8G8B8A8_UNORM,
            TargetFormat::Rgba16f => vk::Format::R16G16B16A16_SFLOAT,
            TargetFormat::Rgba32f => vk::Format::R32G32B32A32_SFLOAT,
            TargetFormat::Bgra8 => vk::Format::B8G8R8A8_UNORM,
        }
    }

    pub fn bytes_per_pixel(self) -> u64 {
        match self {
            TargetFormat::Rgba8 | TargetFormat::Bgra8 => 4,
            TargetFormat::Rgba16f => 8,
            TargetFormat::Rgba32f => 16,
        }
    }
}

impl Image {
    pub fn color_target(
        device: &Device,
        name: &str,
        width: u32,
        height: u32,
        format: TargetFormat,
    ) -> Result<Image> {
        let extent = check_extent(device, name, width, height, format.bytes_per_pixel())?;
        check_blendable(device, format)?;
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
        Image::new(device, name, extent, format.raw(), usage, vk::ImageAspectFlags::COLOR)
    }

    /// Depth in the best format that the device has.
    pub fn depth(device: &Device, name: &str, width: u32, height: u32) -> Result<Image> {
        let extent = check_extent(device, name, width, height, DEPTH_BYTES_PER_PIXEL)?;
        let usage =
            vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
        Image::new(device, name, extent, depth_format(device), usage, vk::ImageAspectFlags::DEPTH)
    }

    fn new(
        device: &Device,
        name: &str,
        extent: vk::Extent2D,
        format: vk::Format,
        usage: vk::ImageUsageFlags,
        aspect: vk::ImageAspectFlags,
    ) -> Result<Image> {
        let shared = device.shared().clone();
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(extent.into())
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(usage);
        let raw = unsafe { shared.raw.create_image(&info, None) }
            .map_err(|e| Error::vulkan(format!("vkCreateImage {name}"), e))?;
        shared.name(raw, name);
        let requirements = unsafe { shared.raw.get_image_memory_requirements(raw) };
        let (layout, view) = (vk::ImageLayout::UNDEFINED, vk::ImageView::null());
        let range =
            vk::ImageSubresourceRange::default().aspect_mask(aspect).level_count(1).layer_count(1);
        let mut image = Image {
            raw,
            view,
            layout,
            extent,
            range,
            allocation: None,
            is_borrowed: false,
            shared,
        };
        let allocation =
            allocate(&image.shared, name, requirements, MemoryLocation::GpuOnly, false)?;
        let (memory, offset) = (unsafe { allocation.memory() }, allocation.offset());
        image.allocation = Some(allocation);
        unsafe { image.shared.raw.bind_image_memory(raw, memory, offset) }
            .map_err(|e| Error::vulkan(format!("vkBindImageMemory {name}"), e))?;
        image.make_view(name, format)?;
        Ok(image)
    }

    /// An image of a swapchain, which must outlive it.
    #[cfg(feature = "window")]
    pub(super) fn of_swapchain(
        shared: &Arc<Shared>,
        name: &str,
        raw: vk::Image,
        extent: vk::Extent2D,
        format: TargetFormat,
    ) -> Result<Image> {
        let range = vk::ImageSubresourceRange::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .level_count(1)
            .layer_count(1);
        let (layout, view, shared) =
            (vk::ImageLayout::UNDEFINED, vk::ImageView::null(), shared.clone());
        let mut image =
            Image { raw, view, layout, extent, range, allocation: None, is_borrowed: true, shared };
        image.make_view(name, format.raw())?;
        Ok(image)
    }

    fn make_view(&mut self, name: &str, format: vk::Format) -> Result<()> {
        let view = vk::ImageViewCreateInfo::default()
            .image(self.raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(self.range);
        self.view = unsafe { self.shared.raw.create_image_view(&view, None) }
            .map_err(|e| Error::vulkan(format!("vkCreateImageView {name}"), e))?;
        self.shared.name(self.view, name);
        Ok(())
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.extent.width, self.extent.height)
    }

    pub fn n_pixels(&self) -> u64 {
        u64::from(self.extent.width) * u64::from(self.extent.height)
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        // SAFETY: as for buffers; a null view may be destroyed.
        unsafe {
            self.shared.raw.destroy_image_view(self.view, None);
            if !self.is_borrowed {
                self.shared.raw.destroy_image(self.raw, None);
            }
        }
        free(&self.shared, self.allocation.take());
    }
}

/// The extent, if the device takes an image of it.
fn check_extent(
    device: &Device,
    name: &str,
    width: u32,
    height: u32,
    bytes_per_pixel: u64,
) -> Result<vk::Extent2D> {
    let limits = device.limits();
    let most = limits.max_image_extent;
    if width.max(height) > most {
        return Err(Error::limit(format!(
            "{name}: {width}×{height} pixels are wanted, this device takes {most} along a side"
        )));
    }
    let bytes = u64::from(width) * u64::from(height) * bytes_per_pixel;
    if bytes > limits.device_memory_bytes {
        let has = limits.device_memory_bytes;
        return Err(Error::limit(format!(
            "{name}: {bytes} bytes are wanted, this device has {has}"
        )));
    }
    Ok(vk::Extent2D { width, height })
}

/// Of both formats that [`depth_format`] chooses from.
pub const DEPTH_BYTES_PER_PIXEL: u64 = 4;

/// Reversed depth wants a float, whose steps shrink with the distance. Vulkan promises that one of
/// the two can be drawn to.
pub(super) fn depth_format(device: &Device) -> vk::Format {
    let features = device.format_features(vk::Format::D32_SFLOAT);
    match features.contains(vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT) {
        true => vk::Format::D32_SFLOAT,
        false => vk::Format::X8_D24_UNORM_PACK32,
    }
}

/// Whether depth is copied as 24 bits of a word, and not as a float.
pub fn has_depth24(device: &Device) -> bool {
    depth_format(device) == vk::Format::X8_D24_UNORM_PACK32
}

/// Blending is guaranteed for rgba8 and rgba16f; rgba32f is probed.
fn check_blendable(device: &Device, format: TargetFormat) -> Result<()> {
    let features = device.format_features(format.raw());
    if features.contains(vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND) {
        return Ok(());
    }
    Err(Error::limit(format!(
        "this device cannot blend into {format:?}; expected film.format = \"rgba16f\""
    )))
}

fn allocate(
    shared: &Shared,
    name: &str,
    requirements: vk::MemoryRequirements,
    location: MemoryLocation,
    linear: bool,
) -> Result<Allocation> {
    let desc = AllocationCreateDesc {
        name,
        requirements,
        location,
        linear,
        allocation_scheme: AllocationScheme::GpuAllocatorManaged,
    };
    shared.lock_allocator().allocate(&desc).map_err(|e| {
        Error::limit(format!("{name}: {} bytes of device memory: {e}", requirements.size))
    })
}

fn free(shared: &Shared, allocation: Option<Allocation>) {
    if let Some(allocation) = allocation {
        // Freeing fails only for an allocation of another allocator, which cannot be here.
        let _ = shared.lock_allocator().free(allocation);
    }
}
