//! The conditions of a study, and the reference that it measures by.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::picture_error::magnitude;
use super::reference_cache::CachedReference;
use crate::gpu::DeviceInfo;
use crate::io::process_info::command_line;
use crate::io::scene_file::LoadedScene;
use crate::reference::picture::{Pixels, ReferenceKind};
use crate::timing::machine::{self, Clocks, Cpu, Device};

/// The conditions that a study was made under.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Schema version of the file.
    pub schema: u32,
    /// Version of nimbus.
    pub nimbus: String,
    /// Git revision that was built.
    pub revision: String,
    /// Digest of the sources that were built, which tells modified builds of one revision apart.
    pub code: String,
    /// Start of the study, UTC, ISO 8601.
    pub date: String,
    /// The command line.
    pub command: Vec<String>,
    /// Path of the scene file, as typed.
    pub scene_file: String,
    /// SHA-256 of the resolved scene and its files.
    pub scene_hash: String,
    /// The scene with every default filled in.
    pub scene: serde_json::Value,
    /// Vulkan device.
    pub device: Device,
    /// Processor.
    pub cpu: Cpu,
    /// Environment variables that change what drivers do.
    pub environment: BTreeMap<String, String>,
    /// Clocks of host and device.
    pub clocks: Clocks,
}

impl Provenance {
    /// Returns the conditions of a study of `scene` that begins now.
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
            command: command_line(),
            scene_file: scene_file.display().to_string(),
            scene_hash: scene.hash().to_owned(),
            scene: scene.resolved.clone(),
            device: machine::device_record(info),
            cpu: machine::cpu(),
            environment: machine::environment(),
            clocks,
        }
    }
}

/// The reference that pictures are compared with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReferenceRecord {
    /// "thin", "slices", "volume", "model", "reflections=K" or "transport".
    pub against: String,
    /// SHA-256 of everything that it depends on.
    pub hash: String,
    /// Estimated root mean square of its own error over the pixels; none if there is no bound.
    pub own_error: Option<f64>,
    /// Meaning of that estimate in words.
    pub accuracy: String,
    /// Root mean square of its premultiplied red, green, blue and alpha, which relative errors are
    /// relative to.
    pub magnitude: f64,
    /// Whether it was read from the cache.
    pub from_cache: bool,
    /// Seconds that computing it took.
    pub seconds: f64,
    /// Width of the picture in pixels.
    pub width: u32,
    /// Height of the picture in pixels.
    pub height: u32,
    /// Pixels at which it is known: all of them, or a stratified sample.
    pub n_pixels: usize,
    /// Frame number.
    pub frame: u32,
    /// Scene time in seconds.
    pub time_s: f64,
}

impl ReferenceRecord {
    /// Returns the number of pixels of the picture.
    pub fn n_all_pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// Returns whether the reference is known at every pixel.
    pub fn is_everywhere(&self) -> bool {
        self.n_pixels as u64 == self.n_all_pixels()
    }

    /// Describes a reference at `pixels` of a frame.
    pub fn of(
        cached: &CachedReference,
        against: ReferenceKind,
        pixels: &Pixels,
        frame: u32,
        time_s: f64,
    ) -> ReferenceRecord {
        let CachedReference { reference, hash, from_cache } = cached;
        ReferenceRecord {
            against: against.to_string(),
            hash: hash.clone(),
            own_error: Some(reference.own_error).filter(|e| e.is_finite()),
            accuracy: reference.accuracy.clone(),
            magnitude: magnitude(&reference.rgba),
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
