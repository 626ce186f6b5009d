//! `study.json`: what `nimbus error` found. Its form is docs/study.schema.json; a change of
//! meaning, or of a key, raises [`SCHEMA_VERSION`].

use serde::{Deserialize, Serialize};

use crate::studies::provenance::{Figure, Provenance, ReferenceRecord};
use crate::timing::json::ResultFile;
use crate::timing::names::Setting;

pub const STUDY_FILE: &str = Study::FILE;
/// Every time that was taken, raw.
pub const TIMES_FILE: &str = "times.csv";

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Study {
    #[serde(flatten)]
    pub made: Provenance,
    pub reference: ReferenceRecord,
    /// The error that decides who is on the front: "rmse", "max" or "relmse".
    pub metric: String,
    /// The time that does: "gpu" or "frame".
    pub time: String,
    /// Times the configurations were all timed in turn.
    pub rounds: usize,
    /// Timed frames of a configuration in a round.
    pub frames: u32,
    /// Frames leave out what did not change, as when the scene is played; else everything moves.
    pub as_played: bool,
    /// The shaders are those of a folder and not the build's.
    pub own_shaders: bool,
    /// The first is the scene as it stands, which the others' times are measured by.
    pub configurations: Vec<Configuration>,
    pub best: Vec<Best>,
    pub interrupted: bool,
}

impl ResultFile for Study {
    const FILE: &'static str = "study.json";
    const SCHEMA: u32 = 1;
}

/// One setting of the knobs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Configuration {
    /// "key=value, key=value"; of the scene as it stands "as it stands".
    pub name: String,
    /// The keys that differ from the scene as it stands.
    pub settings: Vec<Setting>,
    /// SHA-256 of its resolved scene and files.
    pub hash: String,
    /// ms of a frame: that of the scene as it stands times `by_base`; none where the device has no
    /// timestamps.
    pub gpu_ms: Option<Figure>,
    /// ms of a frame, game step to finished picture, in the same way.
    pub frame_ms: Option<Figure>,
    /// Its time (of `Study::time`) by that of the scene as it stands, taken in turn with it.
    pub by_base: Option<Figure>,
    /// Turns that it was timed in.
    pub n_turns: usize,
    pub error: Option<PictureError>,
    pub front: Front,
    /// Why it could not be run.
    pub failure: Option<String>,
    /// Its picture as a PNG file beside study.json.
    pub picture: Option<String>,
    /// Where its picture differs from the reference and by how much: a PNG file.
    pub error_map: Option<String>,
}

/// How far a picture is from the reference, over premultiplied linear red, green, blue and alpha.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PictureError {
    /// Root mean square; its interval is over the picture's parts, and no narrower than the
    /// reference's own error.
    pub rmse: Figure,
    pub max: f64,
    /// Mean of squares relative to the reference's (`measure::picture`).
    pub relmse: f64,
    /// Whether the reference's own error is at most a tenth of `rmse`.
    pub is_resolved: bool,
}

/// Where a configuration lies among all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Front {
    /// None is better, as the figures stand: at most as long and as far off, and one of the two
    /// less.
    On,
    /// Some are, but none is faster by more than the intervals.
    Near,
    /// One is, and faster by more than the intervals.
    Off,
    /// It has no time or no error.
    Unknown,
}

/// What a budget buys.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Best {
    /// "ms" or "error".
    pub budget: String,
    pub value: f64,
    /// Which of `configurations`; none where no one is within.
    pub configuration: Option<usize>,
}
