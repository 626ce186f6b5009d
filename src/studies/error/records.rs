//! The types of `study.json`, the record of `nimbus error`, which
//! docs/reference/schemas/study.schema.json describes.

use serde::{Deserialize, Serialize};

use super::blocks::TimeKind;
use super::front::{Front, Metric};
use crate::measure::figure::Figure;
use crate::studies::picture_error::PictureError;
use crate::studies::provenance::{Provenance, ReferenceRecord};
use crate::timing::json::ResultFile;
use crate::timing::names::{Setting, sweep_text};

/// The whole of `study.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Study {
    /// Conditions of the study.
    #[serde(flatten)]
    pub made: Provenance,
    /// The reference that pictures are compared with.
    pub reference: ReferenceRecord,
    /// The error that decides which configurations are on the front.
    pub metric: Metric,
    /// The time that decides it.
    pub time: TimeKind,
    /// Rounds in which all configurations were timed.
    pub rounds: usize,
    /// Timed frames of a configuration in a round.
    pub frames: u32,
    /// Whether frames skip the work that the scene lets them skip; else everything moves in each.
    pub as_played: bool,
    /// Whether the shaders are those of a folder instead of the build's.
    pub own_shaders: bool,
    /// All configurations. The first is the unchanged scene, which times are relative to.
    pub configurations: Vec<Configuration>,
    /// The best configuration for each budget.
    pub best: Vec<Best>,
    /// Whether the study ended early.
    pub interrupted: bool,
}

impl ResultFile for Study {
    const FILE: &'static str = "study.json";
    const SCHEMA: u32 = 1;
}

/// Name of the configuration without settings, the unchanged scene.
pub const BASE: &str = "as it stands";

/// One setting of the knobs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Configuration {
    /// "key=value, key=value", or [`BASE`].
    pub name: String,
    /// The keys that differ from the unchanged scene.
    pub settings: Vec<Setting>,
    /// SHA-256 of its resolved scene and files.
    pub hash: String,
    /// Device time of a frame in ms: that of the unchanged scene times `by_base`; none if the
    /// device has no timestamps.
    pub gpu_ms: Option<Figure>,
    /// Time of a frame in ms, from the game step to the finished picture, computed in the same way.
    pub frame_ms: Option<Figure>,
    /// Its time (see [`Study::time`]) divided by that of the unchanged scene.
    pub by_base: Option<Figure>,
    /// Timed blocks.
    pub n_turns: usize,
    /// Error of its picture; none before it was drawn.
    pub error: Option<PictureError>,
    /// Place relative to the other configurations.
    pub front: Front,
    /// Why it could not be run.
    pub failure: Option<String>,
    /// File name of its picture, a PNG beside `study.json`.
    pub picture: Option<String>,
    /// File name of the map of its error, a PNG.
    pub error_map: Option<String>,
}

impl Configuration {
    /// Returns a configuration that was neither drawn nor timed yet.
    pub fn new(settings: Vec<Setting>, hash: String) -> Configuration {
        Configuration {
            name: name_of(&settings),
            settings,
            hash,
            gpu_ms: None,
            frame_ms: None,
            by_base: None,
            n_turns: 0,
            error: None,
            front: Front::Unknown,
            failure: None,
            picture: None,
            error_map: None,
        }
    }

    /// Returns its time of the given kind in ms.
    pub fn ms(&self, time: TimeKind) -> Option<Figure> {
        if time == TimeKind::Gpu { self.gpu_ms } else { self.frame_ms }
    }
}

/// Returns the settings as "key=value, key=value"; [`BASE`] if there are none.
pub fn name_of(settings: &[Setting]) -> String {
    if settings.is_empty() { BASE.to_owned() } else { sweep_text(settings) }
}

/// A quantity that is limited while the other one is minimized.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Budget {
    /// Time, in ms.
    Ms,
    /// Error, by [`Study::metric`].
    Error,
}

/// The best configuration within a budget.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Best {
    /// The limited quantity.
    pub budget: Budget,
    /// The limit.
    pub value: f64,
    /// Its place in [`Study::configurations`]; none if no configuration is within the limit.
    pub configuration: Option<usize>,
}
