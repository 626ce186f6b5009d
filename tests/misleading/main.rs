//! No message or table of nimbus misleads: scenes that stand still or show nothing, settings of the
//! wrong form, messages without a remedy, and characters that a terminal would obey.

#[path = "../harness/generated.rs"]
mod generated;
#[path = "../harness/program.rs"]
mod program;
#[path = "../harness/signals.rs"]
mod signals;

mod forms;
mod remedies;
mod still;
mod terminal;
mod unseen;
