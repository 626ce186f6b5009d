//! Looking at scenes: a window to fly in, with what can be toggled while it runs. Pure reducers, and under them a window.

pub mod flight;
pub mod knobs;
pub mod playback;
#[cfg(feature = "window")]
pub mod screen;
pub mod wanted;
#[cfg(feature = "window")]
pub mod window;
