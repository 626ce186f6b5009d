//! The smaller picture that blobs are drawn into, and its upsampling over the full one
//! (passes.md "upsample").

use super::blob_target::{BlobTarget, TargetSpec, n_chunks};
use super::buffers::SceneBuffers;
use super::features::target_format;
use super::plan::Pass;
use super::solids::Solids;
use super::staging::DeviceBuffers;
use crate::error::Result;
use crate::gpu::{Buffer, BufferSpec, Compiler, Device, Recorder, buffers};
use crate::layout::frame::CameraRecord;
use crate::model::resolution::{LowResLayout, Resolution};
use crate::model::scene::Scene;
use crate::passes::upsample::{Extents, SolidBuffers, Upsample};

buffers! {
    /// The pictures before and after upsampling, as whole texels.
    pub(super) struct LowResBuffers(sizes: Sizes) {
        /// The blobs alone.
        blobs: Buffer => [u32; 4], sizes.texels(sizes.n_small, sizes.pixel_bytes),
            "upsample.blobs", Texels;
        /// The finished pictures.
        pictures: DeviceBuffers => [u32; 4], sizes.texels(sizes.n_full, sizes.pixel_bytes),
            "upsample.picture";
        /// Surfaces and terrain of the full picture.
        under: Buffer => [u32; 4], sizes.solids(sizes.n_full, sizes.pixel_bytes),
            "upsample.under", Texels;
        /// near/z that the small pixels see.
        small_depths: Buffer => [u32; 4], sizes.solids(sizes.n_small, 4), "upsample.small_depths";
        /// near/z that the full pixels see.
        depths: Buffer => [u32; 4], sizes.solids(sizes.n_full, 4), "upsample.depths";
    }
}

/// The sizes of the two pictures.
#[derive(Clone, Copy)]
pub(super) struct Sizes {
    n_full: u64,
    n_small: u64,
    pixel_bytes: u64,
    has_solids: bool,
}

impl Sizes {
    fn new(scene: &Scene, small: &LowResLayout) -> Sizes {
        Sizes {
            n_full: u64::from(small.full[0]) * u64::from(small.full[1]),
            n_small: small.n_pixels(),
            pixel_bytes: target_format(scene.film.format).bytes_per_pixel(),
            has_solids: scene.has_solids(),
        }
    }

    /// Returns the texels that `n` records of some bytes take.
    fn texels(self, n: u64, bytes: u64) -> u64 {
        (n * bytes).div_ceil(16)
    }

    fn solids(self, n: u64, bytes: u64) -> u64 {
        if self.has_solids { self.texels(n, bytes) } else { 0 }
    }
}

/// The smaller target of the blobs.
pub(super) struct LowResTarget {
    /// Columns and rows of the two pictures.
    pub small: LowResLayout,
    /// The smaller picture.
    pub target: BlobTarget,
    /// Surfaces and terrain as the small pixels see them: depth alone.
    solids: Option<Solids>,
    upsample: Upsample,
    pub buffers: LowResBuffers,
}

fn small_picture(scene: &Scene) -> LowResLayout {
    LowResLayout::of([scene.film.width, scene.film.height], scene.draw.resolution.divisor())
}

fn target_spec(scene: &Scene, small: &LowResLayout) -> TargetSpec {
    TargetSpec {
        size: small.size,
        format: target_format(scene.film.format),
        n_pictures: 1,
        has_depth: scene.has_solids(),
        has_layer: false,
        has_blobs: true,
        n_chunks: n_chunks(scene),
    }
}

impl LowResTarget {
    /// Creates the target of a scene's `draw.resolution`.
    pub fn new(device: &Device, compiler: &Compiler, scene: &Scene) -> Result<LowResTarget> {
        let (small, has_solids) = (small_picture(scene), scene.has_solids());
        let spec = target_spec(scene, &small);
        let extents =
            Extents { full: small.full, small: small.size, offsets: small.offsets(), n: small.n };
        let solids = || Solids::new(device, compiler, scene, spec.format, true);
        Ok(LowResTarget {
            small,
            target: BlobTarget::new(device, compiler, scene, &spec)?,
            solids: has_solids.then(solids).transpose()?,
            upsample: Upsample::new(device, compiler, &extents, spec.format, has_solids)?,
            buffers: LowResBuffers::new(device, Sizes::new(scene, &small))?,
        })
    }

    /// Lists the sizes of the images and buffers; none at the full resolution.
    pub fn specs(scene: &Scene) -> Vec<BufferSpec> {
        if scene.draw.resolution == Resolution::Full {
            return vec![];
        }
        let small = small_picture(scene);
        let buffers = LowResBuffers::specs(Sizes::new(scene, &small));
        [target_spec(scene, &small).specs(scene), buffers].concat()
    }

    /// Returns `camera` with the wider view of the smaller picture.
    pub fn camera(&self, camera: &CameraRecord) -> CameraRecord {
        let by = self.small.widening();
        let wider = |tan: f32, by: f64| (f64::from(tan) * by) as f32;
        CameraRecord {
            tan_x: wider(camera.tan_x, by.x),
            tan_y: wider(camera.tan_y, by.y),
            ..*camera
        }
    }

    /// Draws the depth of surfaces or terrain for the small pixels.
    pub fn record_solids(
        &mut self,
        rec: &mut Recorder<'_>,
        pass: Pass,
        b: &SceneBuffers,
        camera: &CameraRecord,
    ) -> Result<()> {
        let camera = self.camera(camera);
        if let (Some(solids), Some(target)) = (&self.solids, self.target.target(0)) {
            solids.record(rec, pass, (b, &b.lit), target, &camera)?;
        }
        // Copied before blobs are drawn, which may overwrite it.
        self.target.record_copy_solids(rec, 0, None, &self.buffers.small_depths);
        Ok(())
    }

    /// Upsamples the blobs over the surfaces and terrain of `full` into finished picture `i`.
    pub fn record_upsample(
        &mut self,
        rec: &mut Recorder<'_>,
        i: usize,
        full: &mut BlobTarget,
    ) -> Result<()> {
        let LowResBuffers { blobs, pictures, under, small_depths, depths } = &self.buffers;
        self.target.record_copy(rec, 0, blobs);
        full.record_copy_solids(rec, i, Some(under), depths);
        let solids = SolidBuffers { under, small_depths, depths };
        let solids = self.solids.is_some().then_some(solids);
        self.upsample.record(rec, [blobs, &pictures.0[i]], solids)
    }
}
