//! What a frame says to many passes: lights, camera, grid.

use glam::DVec3;

use crate::layout::record;
use crate::model::camera::{Camera, Pose};
use crate::model::film::Film;
use crate::model::grid::GridSpec;
use crate::model::light::{Light, MIN_PENUMBRA, UP};

/// Kinds of [`LightRecord`]; the shaders' `LIGHT_*`.
pub const LIGHT_DIRECTIONAL: u32 = 0;
pub const LIGHT_SKY: u32 = 1;
pub const LIGHT_POINT: u32 = 2;

record! {
    /// A light. A spot is a point light with a cone.
    pub struct LightRecord {
        /// Unit vector toward a directional light, for the sky up, for a spot against its axis.
        toward: [f32; 3],
        kind: u32,
        /// Irradiance; of point lights intensity.
        energy: [f32; 3],
        /// The sky's share from everywhere.
        constant: f32,
        /// Relative to the lighting origin.
        position: [f32; 3],
        /// Nearer than this a point light does not grow brighter.
        radius: f32,
        /// A spot's share is (cone_scale · cos + cone_offset) cut to [0, 1], squared; of other
        /// lights 1.
        cone_scale: f32,
        cone_offset: f32,
        unused: [f32; 2],
    }
}

impl LightRecord {
    /// `origin`: the lighting origin.
    pub fn new(light: &Light, origin: DVec3) -> Self {
        let f32s = |v: DVec3| v.as_vec3().to_array();
        let record = LightRecord {
            energy: f32s(light.energy()),
            cone_offset: 1.0,
            radius: 1.0,
            ..LightRecord::default()
        };
        match *light {
            Light::Directional { direction, .. } => {
                LightRecord { toward: f32s(-direction), kind: LIGHT_DIRECTIONAL, ..record }
            }
            Light::Sky { constant, .. } => LightRecord {
                toward: f32s(UP),
                kind: LIGHT_SKY,
                constant: constant as f32,
                ..record
            },
            Light::Point { position, radius, .. } => LightRecord {
                position: f32s(position - origin),
                kind: LIGHT_POINT,
                radius: radius as f32,
                ..record
            },
            Light::Spot { position, direction, radius, cos_inner, cos_outer, .. } => {
                let scale = 1.0 / (cos_inner - cos_outer).max(MIN_PENUMBRA);
                LightRecord {
                    toward: f32s(-direction),
                    position: f32s(position - origin),
                    kind: LIGHT_POINT,
                    radius: radius as f32,
                    cone_scale: scale as f32,
                    cone_offset: (-cos_outer * scale) as f32,
                    ..record
                }
            }
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
        /// Of the cells: their edge along y over those along x and z, and its inverse.
        aspect: f32,
        inv_aspect: f32,
        unused: [f32; 2],
    }
}

impl From<&GridSpec> for GridRecord {
    fn from(grid: &GridSpec) -> Self {
        GridRecord {
            low: grid.low.as_vec3().to_array(),
            cell: grid.cell as f32,
            n_cells: grid.n_cells.to_array(),
            inv_cell: (1.0 / grid.cell) as f32,
            aspect: grid.aspect as f32,
            inv_aspect: (1.0 / grid.aspect) as f32,
            unused: [0.0; 2],
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
