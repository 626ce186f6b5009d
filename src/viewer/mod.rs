//! Looking at scenes: a window to fly in, with what can be toggled while it runs. Pure reducers,
//! and under them a window. And changing clouds by hand: the [`editor`], (state, action) → state,
//! which knows no window.

#[cfg(feature = "window")]
pub mod easel;
#[cfg(feature = "window")]
pub mod edit_panels;
#[cfg(feature = "window")]
pub mod edit_window;
pub mod editor;
pub mod flight;
pub mod judge;
#[cfg(feature = "window")]
pub mod judging;
pub mod knobs;
#[cfg(feature = "window")]
pub mod opening;
pub mod origin;
#[cfg(feature = "window")]
pub mod pane;
#[cfg(feature = "window")]
pub mod panels;
pub mod playback;
#[cfg(feature = "window")]
pub mod screen;
#[cfg(feature = "window")]
pub mod second;
#[cfg(feature = "window")]
pub mod seen;
pub mod timeline;
pub mod wanted;
pub mod watch;
#[cfg(feature = "window")]
pub mod widgets;
#[cfg(feature = "window")]
pub mod window;
