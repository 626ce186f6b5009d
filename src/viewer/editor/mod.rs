//! The cloud macrostructure editor (P, Figs. 2, 3 and 5) without its window: what a cloud is shaped
//! by is a list of boxes, and every change of it is a function from one state to the next.
//!
//! [`session`] has the file: what is open, what is saved, what would be lost. [`state`] has what is
//! edited: the [`document`], what is selected of it, the drag that is under way and the steps that
//! can be undone. It takes an [`action`]; [`edits`], [`mirror`] and [`drag`] say what becomes of
//! the boxes. A window draws what the state holds, asks [`viewport`] and [`handles`] what lies
//! under the pointer, [`shortcuts`] what a key means and [`numbers`] what was typed, and computes
//! anew what [`document::Touched`] names. [`desk`] does the asking: what pointer and keys do there
//! becomes the session's events. [`scenery`] is the scene whose cloud is edited, [`sketch`] what is
//! drawn over it.

pub mod acceptance;
pub mod action;
pub mod desk;
pub mod document;
pub mod drag;
pub mod edits;
pub mod handles;
pub mod history;
pub mod mirror;
pub mod numbers;
pub mod ray;
pub mod recent;
pub mod scenery;
pub mod selection;
pub mod session;
pub mod shortcuts;
pub mod sketch;
pub mod snap;
pub mod state;
pub mod viewport;

#[cfg(test)]
mod samples;

pub use action::{Action, DragAction, Edit, Refusal, Select, Setting};
pub use document::{Document, Touched};
pub use state::Editor;

/// One of the scene's axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axis {
    X,
    Y,
    Z,
}

impl Axis {
    pub const ALL: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

    /// Of a vector's component.
    pub fn index(self) -> usize {
        self as usize
    }

    pub fn unit(self) -> glam::DVec3 {
        glam::DVec3::AXES[self.index()]
    }
}
