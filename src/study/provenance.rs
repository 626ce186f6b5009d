//! What every record of a study says of how it came to be.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::machine::{Clocks, Cpu, Device};

/// With what, where and of what a study was made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of the form of the file.
    pub schema: u32,
    pub nimbus: String,
    pub revision: String,
    /// UTC, ISO 8601.
    pub date: String,
    pub command: Vec<String>,
    /// As typed.
    pub scene_file: String,
    /// SHA-256 of the resolved scene and its files.
    pub scene_hash: String,
    pub scene: serde_json::Value,
    pub device: Device,
    pub cpu: Cpu,
    pub environment: BTreeMap<String, String>,
    pub clocks: Clocks,
}

/// A figure with its 95 % interval; none where there were too few values for one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    pub value: f64,
    pub low: Option<f64>,
    pub high: Option<f64>,
}

/// What a picture or a study is measured by.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReferenceRecord {
    /// "thin", "volume", "model" or "reflections=K".
    pub against: String,
    /// SHA-256 of all that it is computed from.
    pub hash: String,
    /// Root mean square of its own error over the pixels: an estimate, see `accuracy`.
    pub own_error: f64,
    /// What that estimate is, in words.
    pub accuracy: String,
    /// Root mean square of its premultiplied red, green, blue and alpha: what errors are relative to.
    pub magnitude: f64,
    /// It was computed before and kept.
    pub from_cache: bool,
    /// What computing it took.
    pub seconds: f64,
    pub width: u32,
    pub height: u32,
    /// Pixels at which it is known: all of them, or a stratified sample.
    pub n_pixels: usize,
    pub frame: u32,
    pub time_s: f64,
}
