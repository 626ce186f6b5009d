//! Charts of results, drawn as SVG for pages and as characters for terminals.
//!
//! Every chart implements [`Chart`]: one drawing routine, by plotters, serves both media.

mod axis;
mod bars;
mod bins;
mod chart;
pub mod error;
pub mod frames;
pub mod ledger;
mod medium;
mod number;
mod overlap;
pub mod passes;
mod plot_area;
pub mod sweep;
mod text_canvas;

pub use chart::{Chart, LegendEntry, Tooltip, escape_markup};
pub use medium::{Medium, NEUTRAL_COLORS, SERIES_COLORS, ThemeColor};
pub use number::{number, with_interval};
pub use plot_area::{Canvas, MarkerFill};
