//! No message or table of nimbus misleads: scenes that stand still or show nothing, settings of the
//! wrong form, and characters that a terminal would obey.

#[path = "../harness/generated.rs"]
mod generated;
#[path = "../harness/program.rs"]
mod program;

mod forms;
mod still;
mod terminal;
mod unseen;
