//! Clocks and statistics; knows nothing of clouds or Vulkan.

pub mod clock;
pub mod stats;
