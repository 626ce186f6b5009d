//! Looking at scenes: a window to fly in, with what can be toggled while it runs. Pure reducers, and under them a window.
//! And changing clouds by hand: the [`editor`], (state, action) → state, which knows no window.

pub mod editor;
pub mod flight;
pub mod knobs;
pub mod playback;
#[cfg(feature = "window")]
pub mod screen;
pub mod wanted;
#[cfg(feature = "window")]
pub mod window;
