//! Nothing that nimbus prints misleads: scenes that stand still or show nothing, settings of the
//! wrong form, and characters that a terminal would obey.

#[path = "../harness/program.rs"]
mod program;

mod forms;
mod still;
mod terminal;
mod unseen;
