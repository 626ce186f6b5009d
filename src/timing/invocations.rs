//! What the passes of a case invoke, counted in a frame of its own: queries around passes would
//! change the times of the frames that are timed.

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::frame::Stage;
use crate::gpu::Invocations;

/// The warning where `--invocations` finds nothing to read.
pub const NO_COUNTERS: &str =
    "this device counts no invocations: it lacks the feature pipelineStatisticsQuery";

/// What a pass invoked on the device in one frame.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PassInvocations {
    /// Name of the pass.
    pub name: String,
    /// The counts.
    #[serde(flatten)]
    pub of: Invocations,
}

/// Draws a frame of the stage's scene at `time_s` in which every pass runs, and returns the counts
/// of each; none if the device has no counters.
///
/// # Errors
/// Fails if the frame cannot be drawn.
pub fn count(stage: &mut Stage, time_s: f64) -> Result<Option<Vec<PassInvocations>>> {
    let i_frame = stage.scene.time.frame_at(time_s);
    let packet = stage.game.step_at(i_frame, time_s)?;
    let counted = stage.renderer.count_invocations(packet)?;
    let record = |(name, of): (&str, Invocations)| PassInvocations { name: name.to_owned(), of };
    Ok(counted.map(|scopes| scopes.into_iter().map(record).collect()))
}
