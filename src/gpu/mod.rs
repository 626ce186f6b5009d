//! Vulkan for the passes: instance, device, memory, shaders, pipelines, command recording, timers,
//! windows. This room knows no cloud.
//!
//! It uses Vulkan 1.3 core (synchronization2, dynamic rendering, timeline semaphores). Each
//! pipeline's reads and writes are reflected from its SPIR-V, and the recorder derives the barriers
//! from them.

mod advice;
mod barriers;
mod buffer;
mod buffers;
mod call;
mod capture;
mod captured_frames;
mod clocks;
mod cold;
mod commands;
mod counters;
mod descriptors;
mod device;
mod device_info;
mod device_options;
mod draw_pipeline;
mod draws;
mod executed;
mod extensions;
mod fault;
mod features;
mod guard;
mod host_clock;
mod image;
mod instance;
mod interface;
mod kept_pipelines;
mod kernel;
mod labels;
mod limits;
mod lowered;
mod memory;
mod memory_count;
mod memory_use;
mod over_limit;
#[cfg(feature = "window")]
mod overlay;
mod pacing;
mod pass_times;
#[cfg(feature = "window")]
mod presenter;
mod rate;
mod recorder;
mod reflect;
mod shader;
#[cfg(feature = "window")]
mod shown;
mod stamp;
mod statistics;
#[cfg(feature = "window")]
mod surface;
#[cfg(feature = "window")]
mod swapchain;
mod sync_objects;
mod tick_clock;
mod timer;
mod validation;

pub use advice::no_permission;
pub use barriers::Barriers;
pub use buffer::{Buffer, MemoryUsage, storage_bytes, texel_bytes};
pub use buffers::{BufferSpec, DeclaredBuffer, buffers};
pub use capture::Captured;
pub use clocks::{ClockFit, ClockSample};
pub use cold::ColdCaches;
pub use commands::{Commands, Submission};
pub use counters::Invocations;
pub use device::Device;
pub use device_info::DeviceInfo;
pub use device_options::DeviceOptions;
pub use draw_pipeline::{BlendMode, DrawPipeline, Primitives};
pub use draws::{InstanceCount, LoadOp, Target};
pub use host_clock::ClockCalibration;
pub use image::{DEPTH_BYTES_PER_PIXEL, Image, TargetFormat, has_depth24};
pub use instance::Instance;
pub use interface::Field;
pub use kernel::Kernel;
pub use limits::Limits;
pub use lowered::LoweredLimits;
pub use memory_use::{DeviceMemory, MemoryProbe};
#[cfg(feature = "window")]
pub use overlay::{Backdrop, Overlay, Widgets};
pub use pass_times::PassTimes;
pub use recorder::{DeviceCount, RecordCount, Recorder};
pub use reflect::{Binding, BindingKind, Member, Reflection, Struct, reflect};
pub use shader::{Compiler, Optimize, Sources, cache_folder, hex};
#[cfg(feature = "window")]
pub use shown::Shown;
pub use statistics::{PipelineReport, Program};
#[cfg(feature = "window")]
pub use surface::{PresentMode, Surface};
#[cfg(feature = "window")]
pub use swapchain::{PresentOutcome, Swapchain};
pub use timer::ScopeTime;
pub use validation::Messages;
