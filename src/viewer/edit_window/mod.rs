//! The window of `nimbus edit`.

mod app;
mod dialogs;
mod fields;
mod panels;
mod render_thread;

pub use app::{Options, run, session_of};
pub use panels::picture_of;
