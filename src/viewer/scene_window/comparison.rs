//! Comparison of A with B: B is drawn frame by frame with the camera of A's frame.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use super::commands::Comparison;
use crate::model::camera::Pose;
use crate::passes::present::Compare;
use crate::viewer::fly_camera::FlyCamera;
use crate::viewer::sync::lock;

/// Cameras of the frames in flight, oldest first.
#[derive(Clone, Default)]
pub struct CameraQueue(Arc<Mutex<VecDeque<FlyCamera>>>);

impl CameraQueue {
    /// Adds the camera of a new frame, and returns its pose.
    pub fn push(&self, camera: FlyCamera) -> Pose {
        lock(&self.0).push_back(camera);
        camera.pose()
    }

    /// Removes the camera of the frame that has ended.
    pub fn pop(&self) -> Option<FlyCamera> {
        lock(&self.0).pop_front()
    }

    /// Removes all cameras.
    pub fn clear(&self) {
        lock(&self.0).clear();
    }
}

/// Returns the comparison as the present pass takes it, for a picture `width` pixels wide.
pub fn compare_of(comparison: Comparison, width: u32) -> Compare {
    match comparison {
        Comparison::Split(share) => {
            Compare::Split { column: (share.clamp(0.0, 1.0) * f64::from(width)) as i32 }
        }
        Comparison::Difference(gain) => Compare::Difference { gain: gain as f32 },
        Comparison::OnlyB => Compare::Second,
    }
}
