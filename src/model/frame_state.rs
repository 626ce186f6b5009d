//! The state of a scene at one time: where the camera is, and where the density grid lies.

use glam::DVec3;

use crate::error::{Error, Place, Result};
use crate::model::camera::Pose;
use crate::model::cloud::Group;
use crate::model::grid::{DEPOSIT_CUT_SIGMA, GridSpec};
use crate::model::scene::Scene;

/// Camera, origin and density grid of a scene at one time, in f64. The game step turns it into
/// records; the references use it as it is.
#[derive(Debug, Clone)]
pub struct FrameState {
    pub time_s: f64,
    pub pose: Pose,
    /// The lighting origin O: centre of the scene's bounds (docs/model.md §11).
    pub light_origin: DVec3,
    /// The density grid, relative to O.
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
