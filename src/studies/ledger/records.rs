//! The types of `ledger.json`, which docs/reference/schemas/ledger.schema.json describes.

use serde::{Deserialize, Serialize};

use crate::measure::figure::Figure;
use crate::studies::provenance::Provenance;
use crate::timing::json::ResultFile;

/// The whole of `ledger.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// Conditions of the study.
    #[serde(flatten)]
    pub made: Provenance,
    /// Frame number.
    pub frame: u32,
    /// Scene time in seconds.
    pub time_s: f64,
    /// Width of the picture in pixels.
    pub width: u32,
    /// Height of the picture in pixels.
    pub height: u32,
    /// Pixels that pictures are compared at.
    pub n_pixels: usize,
    /// Root mean square of the last picture, which relative errors are relative to.
    pub magnitude: f64,
    /// The approximations, from the picture as it is drawn to the whole model.
    pub rows: Vec<Row>,
    /// RMSE of the picture as it is drawn against the last picture.
    pub total: Figure,
    /// Sum of the errors of all rows.
    pub sum: f64,
    /// Root of the sum of their squares, which is the total of independent errors.
    pub quadrature: f64,
    /// Whether total ≤ sum but for rounding; false means a fault of nimbus.
    pub holds: bool,
    /// Whether the study ended early.
    pub interrupted: bool,
}

impl ResultFile for Ledger {
    const FILE: &'static str = "ledger.json";
    const SCHEMA: u32 = 1;
}

/// One approximation: two pictures that differ in nothing else.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Short name, such as "cutoff".
    pub name: String,
    /// The approximation, such as "3 σ".
    pub from: String,
    /// The value that it stands for, such as "6 σ".
    pub to: String,
    /// RMSE over premultiplied linear red, green, blue and alpha.
    pub error: Figure,
    /// `error` divided by [`Ledger::magnitude`].
    pub relative: f64,
    /// Share of the sum of all rows.
    pub share: f64,
    /// Sum of the root mean square errors that the two pictures have themselves.
    pub own_error: f64,
    /// Whether `own_error` is at most a tenth of `error`.
    pub is_resolved: bool,
    /// Device time of a frame with the approximation divided by that without, if the device draws
    /// both.
    pub time_ratio: Option<Figure>,
}
