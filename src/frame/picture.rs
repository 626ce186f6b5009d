//! The targets and pipelines that draw a frame's picture.

use super::blob_target::{BlobTarget, TargetSpec, n_chunks};
use super::constants::FrameConstants;
use super::features::{has_impostors, target_format};
use super::impostors::Impostors;
use super::low_res::LowResTarget;
use super::solids::Solids;
use super::staging::IN_FLIGHT;
use crate::error::Result;
use crate::gpu::{Buffer, BufferSpec, Compiler, Device, Recorder};
use crate::layout::frame::CameraRecord;
use crate::model::resolution::Resolution;
use crate::model::scene::Scene;

/// The targets of a scene's picture.
pub(super) struct Picture {
    /// The full picture. A frame that changes it draws into the one that the frame before has not.
    pub full: BlobTarget,
    /// Surfaces and terrain of the full picture.
    pub solids: Option<Solids>,
    /// The smaller picture of the blobs, unless they are drawn into the full one.
    pub low_res: Option<LowResTarget>,
    /// The picture of distant blobs.
    pub impostors: Option<Impostors>,
    /// Which of the full pictures the last submitted frame draws.
    pub i: usize,
}

fn target_spec(scene: &Scene) -> TargetSpec {
    TargetSpec {
        size: [scene.film.width, scene.film.height],
        format: target_format(scene.film.format),
        n_pictures: IN_FLIGHT,
        has_depth: scene.has_solids(),
        has_layer: has_impostors(scene),
        has_blobs: scene.draw.resolution == Resolution::Full,
        n_chunks: n_chunks(scene),
    }
}

impl Picture {
    /// Creates the targets of `scene`, in which no knob is "auto".
    pub fn new(device: &Device, compiler: &Compiler, scene: &Scene) -> Result<Picture> {
        let spec = target_spec(scene);
        let solids = || Solids::new(device, compiler, scene, spec.format, false);
        let low_res = || LowResTarget::new(device, compiler, scene);
        let impostors = || Impostors::new(device, compiler, scene);
        Ok(Picture {
            full: BlobTarget::new(device, compiler, scene, &spec)?,
            solids: scene.has_solids().then(solids).transpose()?,
            low_res: (!spec.has_blobs).then(low_res).transpose()?,
            impostors: has_impostors(scene).then(impostors).transpose()?,
            i: 0,
        })
    }

    /// Lists the sizes of the images and buffers.
    pub fn specs(scene: &Scene) -> Vec<BufferSpec> {
        let impostors = if has_impostors(scene) { Impostors::specs(scene) } else { vec![] };
        [target_spec(scene).specs(scene), LowResTarget::specs(scene), impostors].concat()
    }

    /// Moves on to the picture that the last frame has not drawn.
    pub fn flip(&mut self) {
        self.i = (self.i + 1) % IN_FLIGHT;
    }

    /// Returns the camera and size, in pixels, of the target that the blobs are drawn into.
    pub fn blob_camera(
        &self,
        camera: &CameraRecord,
        c: &FrameConstants,
    ) -> (CameraRecord, [u32; 2]) {
        match &self.low_res {
            Some(low_res) => (low_res.camera(camera), low_res.small.size),
            None => (*camera, c.size),
        }
    }

    /// Copies finished picture `i` to a buffer.
    pub fn record_copy(&mut self, rec: &mut Recorder<'_>, i: usize, to: &Buffer) {
        match self.buffer(i) {
            Some(picture) => rec.copy(picture, to),
            None => self.full.record_copy(rec, i, to),
        }
    }

    /// Returns the buffer that holds finished picture `i`; `None` if it is an image.
    pub fn buffer(&self, i: usize) -> Option<&Buffer> {
        match &self.low_res {
            Some(low_res) => Some(&low_res.buffers.pictures.0[i]),
            None => self.full.buffer(i),
        }
    }
}
