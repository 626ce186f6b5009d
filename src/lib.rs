//! nimbus: a Vulkan testbed for cloud particles.
//!
//! Data flows one way, and the modules stand in that order (see ARCHITECTURE.md):
//!
//! `io` turns text into a `model` (plain f64 data and mathematics); `layout` turns the model into
//! the f32 records that the GPU reads; `passes` are the GPU's stages, one a room, on `gpu`, which
//! knows Vulkan and no cloud; `frame` runs them (game step → packet → render step). `timing`,
//! `studies` and `stress` measure frames; `roof` measures what the device can do at most; `report`
//! draws charts and pages from their records; `viewer` shows scenes in windows; `farm` spreads work
//! over machines; `cli` parses the command line. `reference` holds the f64 twin of every pass,
//! written from the mathematics.

#![warn(missing_docs)]
#![warn(clippy::missing_errors_doc)]
// These macros panic when the stream is broken; io::console and cli::output do not.
#![warn(clippy::print_stderr)]
#![warn(clippy::print_stdout)]

pub mod cli;
pub mod error;
pub mod farm;
pub mod frame;
pub mod gpu;
pub mod inspect;
pub mod io;
pub mod layout;
pub mod measure;
pub mod model;
pub mod passes;
pub mod reference;
pub mod report;
pub mod roof;
pub mod stress;
pub mod studies;
pub mod timing;
pub mod viewer;
