//! surfaces: draws the scene's rectangles, opaque, with depth, before the blobs.
//!
//! In: regions, lit facets. Out: linear RGBA in the target's format, and depth near/z. Law: L1 + L2
//! where the pixel's ray meets the rectangle, interpolated between the facets' centers; the back is
//! black. Source: model.md §9, passes.md. Error: the position to 1e-6 of the rectangle's
//! distance over the cosine, the depth likewise, and the target's rounding.

use crate::error::Result;
use crate::gpu::{
    BlendMode, Buffer, Compiler, Device, DrawPipeline, InstanceCount, LoadOp, Recorder, Target,
    TargetFormat,
};
use crate::layout::frame::CameraRecord;
use crate::layout::record;

record! {
    /// Push constants of `surfaces.vert` and `surfaces.frag`.
    pub struct Push {
        /// The camera.
        camera: CameraRecord,
        /// Sides of a pixel, as slopes.
        pixel: [f32; 2],
        /// Padding.
        unused: [f32; 2],
    }
}

/// The pipeline of the pass.
pub struct Surfaces {
    pipeline: DrawPipeline,
}

impl Surfaces {
    /// Creates the pipeline; with `depth_only`, color and alpha are 0.
    ///
    /// # Errors
    /// Fails if a shader does not compile or the pipeline cannot be created.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        format: TargetFormat,
        depth_only: bool,
    ) -> Result<Surfaces> {
        let (constants, blend) = ([(0, u32::from(depth_only))], (format, BlendMode::Opaque));
        let pipeline =
            DrawPipeline::new(device, compiler, "surfaces", Push::FIELDS, &constants, blend)?;
        Ok(Surfaces { pipeline })
    }

    /// Clears `target`, which has depth, and draws the first `n_surfaces` of `regions`
    /// (`RegionRecord`) with the light `lit` (`LitRecord` by facet).
    ///
    /// # Errors
    /// Fails if `target` has no depth or another format than the pipeline.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        [regions, lit]: [&Buffer; 2],
        target: Target<'_>,
        camera: &CameraRecord,
        n_surfaces: u32,
    ) -> Result<()> {
        let (width, height) = target.color.size();
        let pixel = camera.pixel_slopes(width, height);
        let push = Push { camera: *camera, pixel, unused: [0.0; 2] };
        let instances = InstanceCount::Known(n_surfaces);
        rec.draw(&self.pipeline, target, LoadOp::Clear, &[regions, lit], &push, instances)
    }
}
