//! Limits and optional features of a device.

/// Limits and optional features of a device.
#[derive(Debug, Clone, Copy, Default)]
pub struct Limits {
    /// Bytes of one storage buffer that a shader can address.
    pub max_storage_buffer_bytes: u64,
    /// Bytes of one buffer.
    pub max_buffer_bytes: u64,
    /// Storage buffers that one stage of a pipeline can bind.
    pub max_storage_buffers: u32,
    /// Texels of one texel buffer.
    pub max_texels: u64,
    /// Workgroups along x of one dispatch.
    pub max_workgroups_x: u32,
    /// Invocations of one workgroup along x.
    pub max_workgroup_invocations: u32,
    /// Bytes of memory that a workgroup shares.
    pub max_shared_memory_bytes: u32,
    /// Bytes of push constants.
    pub max_push_constant_bytes: u32,
    /// Pixels along a side of an image that is drawn into.
    pub max_image_extent: u32,
    /// Pixels along a side of the largest point; 0 where the sides of points are rounded by more
    /// than an eighth of a pixel.
    pub max_point_size: f32,
    /// Bytes of the largest device-local heap.
    pub device_memory_bytes: u64,
    /// Invocations of a subgroup, unless a kernel asks for another size.
    pub subgroup_size: u32,
    /// Whether compute shaders can sum and compare over a subgroup.
    pub has_subgroup_arithmetic: bool,
    /// Whether compute shaders can vote, ballot and shuffle over a subgroup.
    pub has_subgroup_shuffle: bool,
    /// Whether all subgroups have the same size.
    pub is_subgroup_size_fixed: bool,
    /// Whether a compute kernel can ask for a subgroup size.
    pub can_choose_subgroup_size: bool,
    /// Whether shaders can use 64-bit integers.
    pub has_int64: bool,
    /// Whether shaders can use 64-bit floats.
    pub has_float64: bool,
    /// Whether shaders can compute with 16-bit floats.
    pub has_float16: bool,
    /// Iterations after which the driver ends every loop of an invocation without a message; nested
    /// loops count together. [`u32::MAX`] where it does not.
    pub max_loop_iterations: u32,
    /// Bits of a timestamp that count; 0 where the queue has no timestamps.
    pub timestamp_valid_bits: u32,
    /// Nanoseconds per timestamp tick.
    pub timestamp_period_ns: f64,
}

/// llvmpipe's LP_MAX_TGSI_LOOP_ITERATIONS.
pub(super) const LLVMPIPE_ITERATIONS: u32 = 65_535;

/// Least texels of a texel buffer with which shaders read buffers as texels: what desktop GPUs and
/// llvmpipe have. Devices with fewer have 65 536 often, which a grid of 64³ cells exceeds.
const LEAST_TEXELS: u64 = 1 << 27;

impl Limits {
    /// Whether shaders read buffers as texels; otherwise they read the same bytes as elements of
    /// storage buffers, and [`Limits::max_texels`] limits nothing.
    pub fn has_texel_buffers(&self) -> bool {
        self.max_texels >= LEAST_TEXELS
    }

    /// Returns the most bytes that a shader can read by texels of `texel_bytes`.
    pub fn max_texel_buffer_bytes(&self, texel_bytes: u64) -> u64 {
        match self.has_texel_buffers() {
            true => self.max_texels.saturating_mul(texel_bytes),
            false => self.max_storage_buffer_bytes,
        }
    }

    /// Whether a workgroup of `n_invocations` is certainly one subgroup that can vote and shuffle.
    pub fn is_one_subgroup(&self, n_invocations: u32) -> bool {
        self.has_subgroup_shuffle
            && self.subgroup_size == n_invocations
            && (self.is_subgroup_size_fixed || self.can_choose_subgroup_size)
    }

    /// Returns a mask of the timestamp bits that count.
    pub(super) fn tick_mask(&self) -> u64 {
        u64::MAX.checked_shr(64 - self.timestamp_valid_bits).unwrap_or(0)
    }
}
