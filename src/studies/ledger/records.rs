//! `ledger.json`: what `nimbus ledger` found. Its form is docs/ledger.schema.json; a change of
//! meaning, or of a key, raises [`SCHEMA_VERSION`].

use serde::{Deserialize, Serialize};

use crate::studies::provenance::{Figure, Provenance};
use crate::timing::json::ResultFile;

pub const LEDGER_FILE: &str = Ledger::FILE;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    #[serde(flatten)]
    pub made: Provenance,
    pub frame: u32,
    pub time_s: f64,
    pub width: u32,
    pub height: u32,
    /// Pixels that pictures are compared at.
    pub n_pixels: usize,
    /// Root mean square of the last row's truth: what relative errors are relative to.
    pub magnitude: f64,
    /// From the picture as it is drawn down to the whole model.
    pub rows: Vec<Row>,
    /// RMSE of the picture as it is drawn by the last truth.
    pub total: Figure,
    /// Of all rows' errors.
    pub sum: f64,
    /// Root of the sum of their squares: what the total is where they know nothing of each other.
    pub quadrature: f64,
    /// total ≤ sum, but for rounding: anything else is a fault of nimbus.
    pub holds: bool,
    pub interrupted: bool,
}

impl ResultFile for Ledger {
    const FILE: &'static str = "ledger.json";
    const SCHEMA: u32 = 1;
}

/// One approximation: two pictures that differ in nothing else.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Short, such as "cutoff".
    pub name: String,
    /// What it is, and what it stands for: "3 σ", "6 σ".
    pub from: String,
    pub to: String,
    /// RMSE over premultiplied linear red, green, blue and alpha.
    pub error: Figure,
    /// By `Ledger::magnitude`.
    pub relative: f64,
    /// Of the sum of all rows.
    pub share: f64,
    /// What the two pictures' own errors may make of `error`: its root mean square.
    pub own_error: f64,
    /// Whether `own_error` is at most a tenth of `error`.
    pub is_resolved: bool,
    /// GPU time of a frame with it by that without, where both are drawn by the device.
    pub time_ratio: Option<Figure>,
}
