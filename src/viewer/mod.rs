//! What is looked at and changed by hand. The [`editor`] is a pure core, (state, action) → state, that knows no window.

pub mod editor;
