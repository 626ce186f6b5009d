//! State of a scene at one time: the camera and the density grid.

use glam::DVec3;

use crate::error::{Error, Place, Result};
use crate::model::camera::Pose;
use crate::model::cloud::Group;
use crate::model::grid::{DEPOSIT_CUT_SIGMA, GridSpec};
use crate::model::scene::Scene;

/// Camera, lighting origin and density grid of a scene at one time, in f64. The game step converts
/// it to records; the references use it as it is.
#[derive(Debug, Clone)]
pub struct FrameState {
    /// Time of the state.
    pub time_s: f64,
    /// Pose of the camera.
    pub pose: Pose,
    /// Lighting origin O: centre of the scene's bounds (passes.md).
    pub light_origin: DVec3,
    /// Density grid, relative to O.
    pub grid: GridSpec,
    /// Half the diagonal of the bounds.
    pub radius: f64,
}

impl FrameState {
    /// Returns the state of `scene` at `time_s`.
    ///
    /// # Errors
    /// The camera has no direction at that time.
    pub fn at(scene: &Scene, groups: &[Group], time_s: f64) -> Result<FrameState> {
        let pose = scene.camera.pose(time_s).ok_or_else(|| {
            let at = Place { source: "camera".into(), line: 0, column: 0 };
            Error::scene(
                at,
                format!(
                    "has no direction at time {time_s} s; expected a target apart from the \
                     position, off the up axis"
                ),
            )
        })?;
        let (low, high) = scene
            .lighting_bounds(groups, time_s, DEPOSIT_CUT_SIGMA)
            .unwrap_or((DVec3::ZERO, DVec3::ZERO));
        let light_origin = 0.5 * (low + high);
        let half = 0.5 * (high - low);
        let grid = scene.density_grid(groups, half);
        Ok(FrameState { time_s, pose, light_origin, grid, radius: half.length() })
    }
}
