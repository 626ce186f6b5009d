//! Clocks, zones and statistics, independent of clouds and Vulkan.
//!
//! [`clock`] measures the host's clock, [`zones`] collects the spans of threads, [`stats`],
//! [`bootstrap`] and [`lows`] summarize lists of times, and [`picture`] compares pictures.

pub mod bootstrap;
pub mod clock;
pub mod figure;
pub mod lows;
pub mod picture;
pub(crate) mod random;
pub mod stats;
pub mod zones;
