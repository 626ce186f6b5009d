//! What every record of a study says of how it came to be.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::gpu::DeviceInfo;
use crate::io::scene_file::LoadedScene;
use crate::reference::picture::{Pixels, ReferenceKind};
use crate::studies::reference_cache::Kept;
use crate::timing::machine::{self, Clocks, Cpu, Device};

/// With what, where and of what a study was made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of the form of the file.
    pub schema: u32,
    pub nimbus: String,
    pub revision: String,
    /// Digest of the sources that were built: two builds that differ from one revision differ in
    /// it.
    pub code: String,
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

impl Provenance {
    /// Of a study of `scene` that is being made now.
    pub fn now(
        schema: u32,
        scene_file: &Path,
        scene: &LoadedScene,
        info: &DeviceInfo,
        clocks: Clocks,
    ) -> Provenance {
        Provenance {
            schema,
            nimbus: env!("CARGO_PKG_VERSION").into(),
            revision: machine::revision().into(),
            code: env!("NIMBUS_CODE").into(),
            date: machine::utc_now(),
            command: std::env::args().collect(),
            scene_file: scene_file.display().to_string(),
            scene_hash: scene.hash.clone(),
            scene: scene.resolved.clone(),
            device: machine::device_record(info),
            cpu: machine::cpu(),
            environment: machine::environment(),
            clocks,
        }
    }
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
    /// Root mean square of its own error over the pixels: an estimate, see `accuracy`; none where
    /// there is no bound.
    pub own_error: Option<f64>,
    /// What that estimate is, in words.
    pub accuracy: String,
    /// Root mean square of its premultiplied red, green, blue and alpha: what errors are relative
    /// to.
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

impl ReferenceRecord {
    /// Of `kept`, which is `against`'s picture of a frame at `pixels`.
    pub fn of(
        kept: &Kept,
        against: ReferenceKind,
        pixels: &Pixels,
        frame: u32,
        time_s: f64,
    ) -> ReferenceRecord {
        let Kept { reference, hash, from_cache } = kept;
        let squares: f64 = reference.rgba.iter().flatten().map(|v| v * v).sum();
        ReferenceRecord {
            against: against.to_string(),
            hash: hash.clone(),
            own_error: Some(reference.own_error).filter(|e| e.is_finite()),
            accuracy: reference.accuracy.clone(),
            magnitude: (squares / (4 * reference.rgba.len()).max(1) as f64).sqrt(),
            from_cache: *from_cache,
            seconds: reference.seconds,
            width: pixels.width,
            height: pixels.height,
            n_pixels: pixels.at.len(),
            frame,
            time_s,
        }
    }
}
