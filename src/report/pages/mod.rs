//! Results as one self-contained HTML page, without network access, fonts or other files.
//!
//! Tables and charts are complete without the script, which adds tooltips, sliders and sorting.

mod bench;
mod comparison;
mod error;
mod figure;
mod history;
mod ledger;
mod page;
mod pictures;
mod provenance;
mod roofs;
pub mod source;
mod table;

pub use history::{HistoryRun, history_page};
pub use page::page;
