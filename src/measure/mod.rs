//! Clocks and statistics; knows nothing of clouds or Vulkan.
