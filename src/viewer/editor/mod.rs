//! The editor of the cloud macrostructure (P, Figs. 2, 3 and 5) without its window.
//!
//! A cloud is shaped by a list of boxes. Every change is a function from one state to the next:
//!
//! - [`EditorController`] takes the window's [`Input`] and returns the [`Request`]s to the window.
//! - [`Session`] holds the file: what is open, saved, or about to be lost.
//! - [`Editor`] holds the [`Document`], the selection, the drag in progress, and the history. It
//!   changes by an [`Action`].
//! - [`EditedScene`] is the scene around the edited cloud, and `overlay` makes the shapes over it.

#[cfg(feature = "window")]
mod acceptance;
mod action;
mod axis;
mod controller;
pub mod document;
mod drag;
mod edited_scene;
mod edits;
#[cfg(test)]
mod fixtures;
mod grid_snap;
mod handles;
mod history;
mod input;
#[cfg(feature = "window")]
mod key_groups;
pub mod numbers;
#[cfg(feature = "window")]
mod overlay;
mod pointer;
mod ray;
#[cfg(feature = "window")]
mod recent_files;
mod selection;
mod session;
mod settings;
mod shortcuts;
mod snapshot;
mod state;
mod viewport;

pub use action::{
    Action, DragAction, DragModifiers, Edit, MirrorPlane, MirrorResult, Select, Setting,
};
pub use axis::Axis;
pub use controller::EditorController;
pub use document::Document;
pub use edited_scene::EditedScene;
pub use grid_snap::GridSnap;
pub use handles::{Handle, Side};
pub use input::{Button, Field, Input, ModifierKeys};
pub use pointer::PictureArea;
pub use ray::Ray;
pub use selection::SelectionMode;
pub use session::{Answer, Intent, Request, Session, SessionEvent, perform};
pub use settings::{DisplayMode, ScalingAnchor};
pub use shortcuts::{Chord, Key};
pub use state::Editor;
pub use viewport::Viewport;

#[cfg(feature = "window")]
pub(crate) use self::{
    acceptance::{BoxAcceptance, box_acceptances, mean_rate},
    key_groups::key_groups,
    overlay::{Color, Shape, Stroke, overlay_shapes},
    recent_files::{RecentFiles, default_path},
    shortcuts::{Command, SHORTCUTS},
};
