//! Clocks, zones and statistics; knows nothing of clouds or Vulkan.

pub mod bootstrap;
pub mod clock;
pub mod lows;
pub mod picture;
pub(crate) mod random;
pub mod stats;
pub mod zones;
