//! Clocks, zones and statistics, independent of clouds and Vulkan.
//!
//! [`clock`] measures the host's clock, [`zones`] collects the spans of threads, [`stats`],
//! [`bootstrap`], [`blocked`] and [`lows`] summarize lists of times, [`changes`] finds where a
//! series changes, and [`picture`] compares pictures.

pub mod blocked;
pub mod bootstrap;
pub mod changes;
pub mod clock;
pub mod figure;
pub mod lows;
pub mod picture;
pub(crate) mod random;
pub mod stats;
pub mod student;
pub mod zones;
