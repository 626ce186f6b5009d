//! The window of `nimbus view`: fly through a scene, change settings, compare, and measure.
//!
//! [`ViewState`] holds what is drawn, and changes by commands. The render thread runs the same
//! loops as `bench` and presents each frame. It reports times and errors as a status that the
//! panels show.

#[cfg(feature = "window")]
mod app;
#[cfg(feature = "window")]
mod captures;
mod commands;
#[cfg(feature = "window")]
mod comparison;
#[cfg(feature = "window")]
mod error_meter;
#[cfg(feature = "window")]
mod file_watch;
#[cfg(feature = "window")]
mod frame_loop;
mod knobs;
#[cfg(feature = "window")]
mod panels;
mod playback;
#[cfg(feature = "window")]
mod render_links;
#[cfg(feature = "window")]
mod render_thread;
#[cfg(feature = "window")]
mod scene_source;
#[cfg(feature = "window")]
mod shown_times;
#[cfg(feature = "window")]
mod status;
#[cfg(feature = "window")]
mod timeline;
mod view_state;

#[cfg(feature = "window")]
pub(crate) use self::{
    app::{Options, run},
    frame_loop::{LoopTimes, RenderTimes, WindowTimes},
    scene_source::SceneSource,
    shown_times::ShownTimes,
};
pub use view_state::ViewState;
