//! Push constants of the pass's shaders.

use glam::DVec3;

use super::division::Division;
use crate::layout::frame::{CameraRecord, GridRecord};
use crate::layout::record;
use crate::passes::blobs::BlobView;

record! {
    /// Push constants of `tiles_splat.comp`.
    pub struct SplatPush {
        /// The camera.
        camera: CameraRecord,
        /// Sides of a pixel, as slopes.
        pixel: [f32; 2],
        /// Radius of a blob's footprint, in σ.
        cutoff: f32,
        /// Facet of the first particle.
        i_first_facet: u32,
        /// Columns of the picture.
        width: u32,
        /// Rows of the picture.
        height: u32,
        /// Columns of a tile.
        tile_width: u32,
        /// Rows of a tile.
        tile_height: u32,
        /// One over the optical depth at which a blob ends.
        inv_threshold: f32,
        /// Least b²/(2 σ²) at which a blob ends.
        least_cut: f32,
    }
}

record! {
    /// Push constants of `tiles_rounds.comp`.
    pub struct RoundsPush {
        /// Number of rounds.
        n_rounds: u32,
        /// The most pairs of a round.
        capacity: u32,
        /// The most blocks of a round.
        most_blocks: u32,
        /// Entries that a workgroup of the sort takes.
        sort_tile: u32,
        /// Workgroups that find the bins' ranges.
        bin_groups: u32,
    }
}

record! {
    /// Push constants of `tiles_clear.comp`.
    pub struct ClearPush {
        /// Fours of the state.
        n_fours: u32,
        /// Padding.
        unused: u32,
    }
}

record! {
    /// Push constants of `tiles_pairs.comp`.
    pub struct PairsPush {
        /// Greatest slopes of the view.
        tangents: [f32; 2],
        /// Sides of a tile, as slopes.
        tile: [f32; 2],
        /// Columns of bins.
        n_bins_x: u32,
        /// The round.
        i_round: u32,
        /// b²/(2 σ²) at the cutoff, in powers of two.
        cut: f32,
        /// One over the optical depth at which a blob ends.
        inv_threshold: f32,
        /// Least b²/(2 σ²) at which a blob ends.
        least_cut: f32,
    }
}

record! {
    /// Push constants of `tiles_ranges.comp`.
    pub struct RangesPush {
        /// Number of bins.
        n_bins: u32,
        /// The round.
        i_round: u32,
        /// The most workgroups along x of a dispatch.
        max_groups: u32,
        /// The most tiles that a workgroup draws.
        most_tiles: u32,
    }
}

record! {
    /// Push constants of `tiles.comp`.
    pub struct Push {
        /// Greatest slopes of the view.
        tangents: [f32; 2],
        /// Sides of a pixel, as slopes.
        pixel: [f32; 2],
        /// Columns of the picture.
        width: u32,
        /// Rows of the picture.
        height: u32,
        /// Columns of bins.
        n_bins_x: u32,
        /// The round.
        i_round: u32,
        /// b²/(2 σ²) at the cutoff, in powers of two.
        cut: f32,
        /// Transmittance below which a pixel is opaque.
        saturated: f32,
        /// One over the optical depth at which a blob ends.
        inv_threshold: f32,
        /// Least b²/(2 σ²) at which a blob ends.
        least_cut: f32,
        /// The scene's y along the camera's right.
        y_right: f32,
        /// The scene's y along the camera's up.
        y_up: f32,
        /// The scene's y along the camera's forward.
        y_forward: f32,
        /// The near plane's distance over the thickness of a slice; 0 without slices.
        near_in_slices: f32,
        /// Place of the eye among the centres of the cells that light slices, in cells.
        eye_in_cells: [f32; 3],
        /// Number of these cells along x.
        n_x: u32,
        /// As long as a slice is thick, to the right, in cells along each axis.
        right_in_cells: [f32; 3],
        /// Number of cells along y.
        n_y: u32,
        /// Upward, alike.
        up_in_cells: [f32; 3],
        /// Number of cells along z.
        n_z: u32,
        /// Forward, alike.
        forward_in_cells: [f32; 3],
    }
}

impl Push {
    /// Returns that of round `i_round` of a view.
    pub(super) fn new(view: &BlobView<'_>, division: &Division, i_round: u32) -> Push {
        let (width, height) = (division.width, division.height);
        let push = Push {
            tangents: [view.camera.tan_x, view.camera.tan_y],
            pixel: view.camera.pixel_slopes(width, height),
            width,
            height,
            n_bins_x: division.n_bins_x,
            i_round,
            cut: in_powers_of_two(0.5 * view.cutoff * view.cutoff),
            saturated: view.saturated as f32,
            inv_threshold: view.inv_threshold(),
            least_cut: in_powers_of_two(view.least_cut()),
            y_right: view.camera.right[1],
            y_up: view.camera.up[1],
            y_forward: view.camera.forward[1],
            near_in_slices: view.near_in_slices(),
            ..Push::default()
        };
        match view.cells {
            Some(grid) => push.in_cells(view.camera, grid, view.slice),
            None => push,
        }
    }

    /// Adds where `grid` lies, by slices of this thickness from the eye.
    fn in_cells(self, camera: &CameraRecord, grid: &GridRecord, slice: f64) -> Push {
        let edges = DVec3::new(1.0, f64::from(grid.aspect), 1.0) * f64::from(grid.cell);
        let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        let from_low = vector(camera.eye) - vector(grid.low);
        let in_cells = |v: DVec3| (v / edges).as_vec3().to_array();
        let [n_x, n_y, n_z] = grid.n_cells;
        Push {
            eye_in_cells: in_cells(from_low - 0.5 * edges),
            n_x,
            right_in_cells: in_cells(slice * vector(camera.right)),
            n_y,
            up_in_cells: in_cells(slice * vector(camera.up)),
            n_z,
            forward_in_cells: in_cells(slice * vector(camera.forward)),
            ..self
        }
    }
}

/// Returns b²/(2 σ²) of a cut in powers of two: at most 46, at 8 σ; the shader's power of two holds
/// up to 125.
pub(super) fn in_powers_of_two(cut: f64) -> f32 {
    (cut * std::f64::consts::LOG2_E) as f32
}
