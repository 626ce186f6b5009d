//! `nimbus farm` on this machine.

mod bench;
#[path = "../harness/farm.rs"]
mod farm;
mod frames;
mod interrupted;
mod model;
#[path = "../harness/program.rs"]
mod program;
mod reference;
mod study;
