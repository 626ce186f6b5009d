//! What a frame says to many passes: lights, camera, grid.

use glam::DVec3;

use crate::layout::record;
use crate::model::camera::{Camera, Pose};
use crate::model::film::Film;
use crate::model::grid::GridSpec;
use crate::model::light::Light;

/// Kinds of [`LightRecord`]; the shaders' `LIGHT_*`.
pub const LIGHT_DIRECTIONAL: u32 = 0;
pub const LIGHT_SKY: u32 = 1;

record! {
    pub struct LightRecord {
        /// Unit vector toward the light.
        toward: [f32; 3],
        kind: u32,
        irradiance: [f32; 3],
        constant: f32,
    }
}

impl From<&Light> for LightRecord {
    fn from(light: &Light) -> Self {
        let (kind, constant) = match light {
            Light::Directional { .. } => (LIGHT_DIRECTIONAL, 0.0),
            Light::Sky { constant, .. } => (LIGHT_SKY, *constant as f32),
        };
        LightRecord {
            toward: light.toward().as_vec3().to_array(),
            kind,
            irradiance: light.irradiance().as_vec3().to_array(),
            constant,
        }
    }
}

record! {
    /// The density grid (model.md §8), corner relative to the lighting origin.
    pub struct GridRecord {
        low: [f32; 3],
        cell: f32,
        n_cells: [u32; 3],
        inv_cell: f32,
    }
}

impl From<&GridSpec> for GridRecord {
    fn from(grid: &GridSpec) -> Self {
        GridRecord {
            low: grid.low.as_vec3().to_array(),
            cell: grid.cell as f32,
            n_cells: grid.n_cells.to_array(),
            inv_cell: (1.0 / grid.cell) as f32,
        }
    }
}

record! {
    /// The camera as the sprites need it. The pixel (i, j)'s ray is x right + y up + forward with
    /// x = (2(i + ½)/W − 1) tan_x, y = (1 − 2(j + ½)/H) tan_y.
    pub struct CameraRecord {
        /// Eye minus lighting origin.
        eye: [f32; 3],
        tan_x: f32,
        right: [f32; 3],
        tan_y: f32,
        up: [f32; 3],
        near: f32,
        forward: [f32; 3],
        unused: f32,
    }
}

impl CameraRecord {
    /// `light_origin` is subtracted from the eye in f64.
    pub fn new(camera: &Camera, pose: &Pose, film: &Film, light_origin: DVec3) -> Self {
        let tan_y = (0.5 * camera.fov_y_rad).tan();
        CameraRecord {
            eye: (pose.position - light_origin).as_vec3().to_array(),
            tan_x: (tan_y * f64::from(film.width) / f64::from(film.height)) as f32,
            right: pose.right.as_vec3().to_array(),
            tan_y: tan_y as f32,
            up: pose.up.as_vec3().to_array(),
            near: camera.near as f32,
            forward: pose.forward.as_vec3().to_array(),
            unused: 0.0,
        }
    }
}
