//! terrain: the ground, opaque, with depth, under the blobs.
//!
//! In: regions, the ground's points, lit facets. Out: linear RGBA in the film's format, and depth
//! near/z. Law: where the pixel's ray meets the nearest triangle between three points, L1 + L2
//! interpolated linearly between them; from below it is black. Source: docs/model.md §16. Error:
//! the place to 1e-6 of the distance over the cosine; which triangle is seen at an edge to 1/16 of
//! a pixel, as exactly as Vulkan promises vertices to be placed; and the target's rounding.

use crate::error::Result;
use crate::gpu::TargetFormat;
use crate::gpu::{
    BlendMode, Buffer, Compiler, Device, DrawPipeline, InstanceCount, LoadOp, Recorder, Target,
};
use crate::layout::frame::CameraRecord;
use crate::layout::record;

record! {
    pub struct Push { camera: CameraRecord, pixel: [f32; 2], i_region: u32, i_first_ground: u32 }
}

pub struct Terrain {
    pipeline: DrawPipeline,
}

/// One of the scene's grounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Piece {
    pub i_region: u32,
    /// Facet of the first point of all grounds.
    pub i_first_ground: u32,
    pub n_cells: u32,
}

impl Terrain {
    /// `depth_only`: of no colour and no alpha.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        format: TargetFormat,
        depth_only: bool,
    ) -> Result<Terrain> {
        let constants = [(0, u32::from(depth_only))];
        let pipeline = DrawPipeline::new(
            device,
            compiler,
            "terrain",
            Push::FIELDS,
            &constants,
            (format, BlendMode::Opaque),
        )?;
        Ok(Terrain { pipeline })
    }

    /// Draws `piece` into `target`, which has depth, from `start`. Buffers: regions (RegionRecord),
    /// points of all grounds relative to their origins (FacetRecord), light by facet (LitRecord).
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 3],
        (target, start): (Target<'_>, LoadOp),
        camera: &CameraRecord,
        piece: Piece,
    ) -> Result<()> {
        let (width, height) = target.color.size();
        let pixel = [2.0 * camera.tan_x / width as f32, 2.0 * camera.tan_y / height as f32];
        let Piece { i_region, i_first_ground, n_cells } = piece;
        let push = Push { camera: *camera, pixel, i_region, i_first_ground };
        rec.draw(&self.pipeline, target, start, &buffers, &push, InstanceCount::Known(n_cells))
    }
}
