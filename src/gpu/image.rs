//! Images: colour targets, depth targets and a swapchain's images.

#[cfg(feature = "window")]
use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;

use super::call::Call;
use super::device::{Device, Owned, SharedDevice};
use super::memory::Memory;
use crate::error::{Error, Result};

/// A colour target, or a depth target beside one.
// Fields drop in order: the view before the image, the image before its memory.
pub struct Image {
    view: Owned<vk::ImageView>,
    pub(super) raw: vk::Image,
    pub(super) layout: vk::ImageLayout,
    pub(super) extent: vk::Extent2D,
    pub(super) range: vk::ImageSubresourceRange,
    /// The image and its memory; none where a swapchain owns them.
    _owned: Option<(Owned<vk::Image>, Memory)>,
}

/// A format that a colour target can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TargetFormat {
    /// Four bytes, UNORM and not sRGB: blending is linear.
    Rgba8,
    /// Four 16-bit floats.
    Rgba16f,
    /// Four 32-bit floats.
    Rgba32f,
    /// Four bytes in the order that most windows have, UNORM too.
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

    /// Returns the bytes of a pixel.
    pub fn bytes_per_pixel(self) -> u64 {
        match self {
            TargetFormat::Rgba8 | TargetFormat::Bgra8 => 4,
            TargetFormat::Rgba16f => 8,
            TargetFormat::Rgba32f => 16,
        }
    }
}

/// Bytes of a depth pixel, in either format that a device may have.
pub const DEPTH_BYTES_PER_PIXEL: u64 = 4;

impl Image {
    /// Creates a colour target that can be copied from.
    ///
    /// # Errors
    /// The size breaks a limit, or the device cannot blend into the format.
    pub fn color_target(
        device: &Device,
        name: &str,
        width: u32,
        height: u32,
        format: TargetFormat,
    ) -> Result<Image> {
        let extent = checked_extent(device, name, [width, height], format.bytes_per_pixel())?;
        // Blending is guaranteed for rgba8 and rgba16f; rgba32f may lack it.
        let features = device.format_features(format.raw());
        if !features.contains(vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND) {
            return Err(Error::limit(format!(
                "this device cannot blend into {format:?}; expected film.format = \"rgba16f\""
            )));
        }
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT;
        Image::new(device, name, extent, format.raw(), usage, vk::ImageAspectFlags::COLOR)
    }

    /// Creates a depth target in the device's best format, which can be copied from.
    ///
    /// # Errors
    /// The size breaks a limit of the device.
    pub fn depth(device: &Device, name: &str, width: u32, height: u32) -> Result<Image> {
        let extent = checked_extent(device, name, [width, height], DEPTH_BYTES_PER_PIXEL)?;
        let usage = vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT;
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
        let shared = device.shared();
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(extent.into())
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(usage | vk::ImageUsageFlags::TRANSFER_SRC);
        let raw = unsafe { shared.raw.create_image(&info, None) }.of_call("vkCreateImage", name)?;
        let handle = shared.own(raw, name, ash::Device::destroy_image);
        let requirements = unsafe { shared.raw.get_image_memory_requirements(raw) };
        let memory = Memory::new(shared, name, requirements, MemoryLocation::GpuOnly, false)?;
        let (block, offset) = memory.place();
        unsafe { shared.raw.bind_image_memory(raw, block, offset) }
            .of_call("vkBindImageMemory", name)?;
        Image::with_view(shared, name, raw, extent, format, aspect, Some((handle, memory)))
    }

    /// Wraps an image of a swapchain, which must outlive it.
    #[cfg(feature = "window")]
    pub(super) fn of_swapchain(
        shared: &Arc<SharedDevice>,
        name: &str,
        raw: vk::Image,
        extent: vk::Extent2D,
        format: TargetFormat,
    ) -> Result<Image> {
        let aspect = vk::ImageAspectFlags::COLOR;
        Image::with_view(shared, name, raw, extent, format.raw(), aspect, None)
    }

    fn with_view(
        shared: &std::sync::Arc<SharedDevice>,
        name: &str,
        raw: vk::Image,
        extent: vk::Extent2D,
        format: vk::Format,
        aspect: vk::ImageAspectFlags,
        owned: Option<(Owned<vk::Image>, Memory)>,
    ) -> Result<Image> {
        let range =
            vk::ImageSubresourceRange::default().aspect_mask(aspect).level_count(1).layer_count(1);
        let info = vk::ImageViewCreateInfo::default()
            .image(raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(range);
        let view = unsafe { shared.raw.create_image_view(&info, None) }
            .of_call("vkCreateImageView", name)?;
        let view = shared.own(view, name, ash::Device::destroy_image_view);
        Ok(Image { view, raw, layout: vk::ImageLayout::UNDEFINED, extent, range, _owned: owned })
    }

    pub(super) fn view(&self) -> vk::ImageView {
        self.view.raw
    }

    /// Returns the whole image as a source or target of copies.
    pub(super) fn layers(&self) -> vk::ImageSubresourceLayers {
        vk::ImageSubresourceLayers::default().aspect_mask(self.range.aspect_mask).layer_count(1)
    }

    /// Returns width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.extent.width, self.extent.height)
    }
}

/// Returns the extent, if the device takes an image of it.
fn checked_extent(
    device: &Device,
    name: &str,
    [width, height]: [u32; 2],
    bytes_per_pixel: u64,
) -> Result<vk::Extent2D> {
    let limits = device.limits();
    let (most, has) = (limits.max_image_extent, limits.device_memory_bytes);
    if width.max(height) > most {
        return Err(Error::limit(format!(
            "{name}: {width}×{height} pixels are wanted, this device takes {most} along a side"
        )));
    }
    let bytes = u64::from(width) * u64::from(height) * bytes_per_pixel;
    if bytes > has {
        return Err(Error::limit(format!(
            "{name}: {bytes} bytes are wanted, this device has {has}"
        )));
    }
    Ok(vk::Extent2D { width, height })
}

/// Returns the depth format of a device. Reversed depth wants a float, whose steps shrink with the
/// distance. Vulkan promises that one of the two can be drawn to.
pub(super) fn depth_format(device: &Device) -> vk::Format {
    let features = device.format_features(vk::Format::D32_SFLOAT);
    match features.contains(vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT) {
        true => vk::Format::D32_SFLOAT,
        false => vk::Format::X8_D24_UNORM_PACK32,
    }
}

/// Whether a depth pixel is copied as 24 bits of a word, and not as a float.
pub fn has_depth24(device: &Device) -> bool {
    depth_format(device) == vk::Format::X8_D24_UNORM_PACK32
}
