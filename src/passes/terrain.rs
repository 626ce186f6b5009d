//! terrain: draws the ground, opaque, with depth, before the blobs.
//!
//! In: regions, the points of the terrains, lit facets. Out: linear RGBA in the target's format,
//! and depth near/z. Law: L1 + L2 where the pixel's ray meets the nearest triangle, interpolated
//! linearly between its points; black from below. Source: model.md §16. Error: the
//! position to 1e-6 of the distance over the cosine, and the target's rounding. An edge pixel may
//! show another triangle within 1/16 of a pixel, Vulkan's guarantee for the position of vertices.

use crate::error::Result;
use crate::gpu::{
    BlendMode, Buffer, Compiler, Device, DrawPipeline, InstanceCount, LoadOp, Recorder, Target,
    TargetFormat,
};
use crate::layout::frame::CameraRecord;
use crate::layout::record;

record! {
    /// Push constants of `terrain.vert` and `terrain.frag`.
    pub struct Push {
        /// The camera.
        camera: CameraRecord,
        /// Sides of a pixel, as slopes.
        pixel: [f32; 2],
        /// Region of the terrain.
        i_region: u32,
        /// Facet of the first point of all terrains.
        i_first_ground: u32,
    }
}

/// The pipeline of the pass.
pub struct Terrain {
    pipeline: DrawPipeline,
}

/// One terrain of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Piece {
    /// Region of the terrain.
    pub i_region: u32,
    /// Facet of the first point of all terrains.
    pub i_first_ground: u32,
    /// Number of grid cells.
    pub n_cells: u32,
}

impl Terrain {
    /// Creates the pipeline; with `depth_only`, color and alpha are 0.
    ///
    /// # Errors
    /// Fails if a shader does not compile or the pipeline cannot be created.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        format: TargetFormat,
        depth_only: bool,
    ) -> Result<Terrain> {
        let (constants, blend) = ([(0, u32::from(depth_only))], (format, BlendMode::Opaque));
        let pipeline =
            DrawPipeline::new(device, compiler, "terrain", Push::FIELDS, &constants, blend)?;
        Ok(Terrain { pipeline })
    }

    /// Draws `piece` over what `start` leaves of `target`, which has depth.
    ///
    /// `regions`: `RegionRecord`; `ground`: `FacetRecord`, the points of all terrains relative to
    /// their origins; `lit`: `LitRecord` by facet.
    ///
    /// # Errors
    /// Fails if `target` has no depth or another format than the pipeline.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        [regions, ground, lit]: [&Buffer; 3],
        (target, start): (Target<'_>, LoadOp),
        camera: &CameraRecord,
        piece: Piece,
    ) -> Result<()> {
        let (width, height) = target.color.size();
        let pixel = camera.pixel_slopes(width, height);
        let Piece { i_region, i_first_ground, n_cells } = piece;
        let push = Push { camera: *camera, pixel, i_region, i_first_ground };
        let buffers = [regions, ground, lit];
        rec.draw(&self.pipeline, target, start, &buffers, &push, InstanceCount::Known(n_cells))
    }
}
