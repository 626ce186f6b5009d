//! The window of `nimbus edit`: panels and picture around the [`editor`](super::editor).

mod app;
mod dialogs;
mod fields;
mod keys;
mod panel_state;
mod panels;
mod render_thread;
mod rescue;
mod shapes;

pub(crate) use app::{Options, run};
pub use panels::picture_size;
