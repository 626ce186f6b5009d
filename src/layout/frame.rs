//! Records that many passes of a frame read: lights, camera, grid.

use glam::DVec3;

use crate::layout::record;
use crate::model::camera::{Camera, Pose};
use crate::model::film::Film;
pub use crate::model::grid::{FIRST_BLUR, LAST_BLUR};
use crate::model::grid::{GridSpec, cells_before};
use crate::model::light::{Light, MIN_PENUMBRA, UP};

/// The kind of a directional [`LightRecord`]. The shaders' `LIGHT_*` have the same values.
pub const LIGHT_DIRECTIONAL: u32 = 0;
/// The kind of the sky.
pub const LIGHT_SKY: u32 = 1;
/// The kind of a point or spot light.
pub const LIGHT_POINT: u32 = 2;

record! {
    /// A light. A spot is a point light with a cone.
    pub struct LightRecord {
        /// Unit vector toward a directional light; up for the sky; against a spot's axis.
        toward: [f32; 3],
        /// `LIGHT_DIRECTIONAL`, `LIGHT_SKY` or `LIGHT_POINT`.
        kind: u32,
        /// Irradiance, or intensity of a point light, linear RGB.
        energy: [f32; 3],
        /// Share of the sky's energy that arrives from everywhere.
        constant: f32,
        /// Place of a point light relative to the lighting origin.
        position: [f32; 3],
        /// Distance below which a point light does not grow brighter.
        radius: f32,
        /// Scale of a spot's share, (cone_scale · cos + cone_offset) cut to [0, 1] and squared; the
        /// share of other lights is 1.
        cone_scale: f32,
        /// Offset of a spot's share.
        cone_offset: f32,
        /// Padding.
        unused: [f32; 2],
        /// Change of a sky's radiance along x, by channel ([`Tilt`](crate::model::tilt::Tilt)).
        tilt_x: [f32; 3],
        /// Padding.
        unused_a: f32,
        /// Along y.
        tilt_y: [f32; 3],
        /// Padding.
        unused_b: f32,
        /// Along z.
        tilt_z: [f32; 3],
        /// Padding.
        unused_c: f32,
    }
}

impl LightRecord {
    /// Returns the record of `light`; `origin` is the lighting origin.
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
            Light::Sky { constant, tilt, .. } => LightRecord {
                toward: f32s(UP),
                kind: LIGHT_SKY,
                constant: constant as f32,
                tilt_x: f32s(tilt.along[0]),
                tilt_y: f32s(tilt.along[1]),
                tilt_z: f32s(tilt.along[2]),
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
    /// The density grid (model.md §8).
    pub struct GridRecord {
        /// Low corner relative to the lighting origin.
        low: [f32; 3],
        /// Edge of a cell along x and z.
        cell: f32,
        /// Cells along each axis.
        n_cells: [u32; 3],
        /// 1/`cell`.
        inv_cell: f32,
        /// Edge of a cell along y over that along x and z.
        aspect: f32,
        /// 1/`aspect`.
        inv_aspect: f32,
        /// Padding.
        unused: [f32; 2],
    }
}

impl GridRecord {
    /// Returns the grid of cells that are `edge` times as wide, as [`GridSpec::merged`] does.
    pub fn merged(&self, edge: u32) -> GridRecord {
        let before = self.cells_before(edge);
        let of = |k: usize| (self.n_cells[k] + before[k]).div_ceil(edge);
        let edges = [self.cell, self.cell * self.aspect, self.cell];
        let low = |k: usize| self.low[k] - edges[k] * before[k] as f32;
        let (cell, inv_cell) = (self.cell * edge as f32, self.inv_cell / edge as f32);
        GridRecord { n_cells: [0, 1, 2].map(of), low: [0, 1, 2].map(low), cell, inv_cell, ..*self }
    }

    /// Returns how many cells the first of those of [`GridRecord::merged`] reaches beyond the box.
    pub fn cells_before(&self, edge: u32) -> [u32; 3] {
        self.n_cells.map(|n| cells_before(n, edge))
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
    /// The camera. The ray of pixel (i, j) is x right + y up + forward. There
    /// x = (2(i + ½)/W − 1) tan_x and y = (1 − 2(j + ½)/H) tan_y.
    pub struct CameraRecord {
        /// Eye minus lighting origin.
        eye: [f32; 3],
        /// Tangent of half the horizontal field of view.
        tan_x: f32,
        /// Unit vector to the right.
        right: [f32; 3],
        /// Tangent of half the vertical field of view.
        tan_y: f32,
        /// Unit vector upward in the picture.
        up: [f32; 3],
        /// View depth of the near plane.
        near: f32,
        /// Unit vector of view.
        forward: [f32; 3],
        /// Padding.
        unused: f32,
    }
}

impl CameraRecord {
    /// Returns the sides of a pixel of a `width` × `height` picture, as slopes.
    pub fn pixel_slopes(&self, width: u32, height: u32) -> [f32; 2] {
        [2.0 * self.tan_x / width as f32, 2.0 * self.tan_y / height as f32]
    }

    /// Returns the record of a camera at `pose`. `light_origin` is subtracted from the eye in f64.
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
