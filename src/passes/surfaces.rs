//! surfaces: the scene's rectangles, opaque, with depth, under the sprites.
//!
//! In: regions, lit facets. Out: linear RGBA in the film's format, and depth near/z. Law: where the
//! pixel's ray meets the rectangle, L1 + L2 interpolated between the facets' centres; the back is
//! black. Source: docs/model.md §9, §11. Error: the place to 1e-6 of the rectangle's distance over
//! the cosine, depth likewise, and the target's rounding.

use crate::error::Result;
use crate::gpu::TargetFormat;
use crate::gpu::{
    BlendMode, Buffer, Compiler, Device, DrawPipeline, InstanceCount, LoadOp, Recorder, Target,
};
use crate::layout::frame::CameraRecord;
use crate::layout::record;

record! {
    pub struct Push { camera: CameraRecord, pixel: [f32; 2], unused: [f32; 2] }
}

pub struct Surfaces {
    pipeline: DrawPipeline,
}

impl Surfaces {
    /// `depth_only`: of no colour and no alpha.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        format: TargetFormat,
        depth_only: bool,
    ) -> Result<Surfaces> {
        let constants = [(0, u32::from(depth_only))];
        let pipeline = DrawPipeline::new(
            device,
            compiler,
            "surfaces",
            Push::FIELDS,
            &constants,
            (format, BlendMode::Opaque),
        )?;
        Ok(Surfaces { pipeline })
    }

    /// Clears `target`, which has depth, and draws the first `n_surfaces` regions. `regions`:
    /// RegionRecord; `lit`: LitRecord by facet.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 2],
        target: Target<'_>,
        camera: &CameraRecord,
        n_surfaces: u32,
    ) -> Result<()> {
        let (width, height) = target.color.size();
        let pixel = [2.0 * camera.tan_x / width as f32, 2.0 * camera.tan_y / height as f32];
        let push = Push { camera: *camera, pixel, unused: [0.0; 2] };
        rec.draw(
            &self.pipeline,
            target,
            LoadOp::Clear,
            &buffers,
            &push,
            InstanceCount::Known(n_surfaces),
        )
    }
}
