//! Vulkan, and nothing of nimbus: instance, device, memory, shaders, kernels, command recording,
//! timers.
//!
//! Vulkan 1.3 core (synchronization2, dynamic rendering, timeline semaphores). What a shader reads
//! and writes is reflected from its SPIR-V, and the recorder derives the barriers from that.

pub mod calibration;
pub mod device;
pub mod draw;
pub mod instance;
pub mod kernel;
pub mod memory;
#[cfg(feature = "window")]
pub mod overlay;
#[cfg(feature = "window")]
mod presenter;
mod probe;
pub mod recorder;
pub mod recorder_draw;
pub mod reflect;
pub mod shader;
#[cfg(feature = "window")]
pub mod surface;
#[cfg(feature = "window")]
pub mod swapchain;
pub mod timer;

pub use calibration::{ClockFit, ClockPair};
pub use device::{Device, DeviceInfo};
pub use draw::{DrawPipeline, Meet};
pub use instance::Instance;
pub use kernel::{Field, Kernel};
pub use memory::{Buffer, Image, Place};
#[cfg(feature = "window")]
pub use overlay::{Backdrop, Overlay, Widgets};
pub use recorder::{Amount, Barriers, Commands, Pending, Recorder};
pub use recorder_draw::{Instances, Start, Target};
pub use shader::{Compiler, Sources};
#[cfg(feature = "window")]
pub use surface::{PresentMode, Surface};
#[cfg(feature = "window")]
pub use swapchain::{Shown, Swapchain};
pub use timer::ScopeTime;
