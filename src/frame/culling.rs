//! The pass that keeps particles that can show, and how many it kept.

use super::constants::FrameConstants;
use super::features::{blob_variant, culls};
use super::packet::Packet;
use super::staging::ReadbackBuffers;
use crate::error::Result;
use crate::gpu::{BufferSpec, Compiler, Device, buffers};
use crate::layout::cull::KeptRecord;
use crate::layout::frame::CameraRecord;
use crate::model::scene::Scene;
use crate::passes::blobs::{DepthFrom, Depths};
use crate::passes::cull::{self, Cull, CullView};

buffers! {
    /// The numbers of kept particles that the host reads.
    pub(super) struct KeptCounts() {
        counts: ReadbackBuffers => KeptRecord, 1, "cull.count";
    }
}

/// The pass `cull` of a scene.
pub(super) struct Culling {
    pub cull: Cull,
    pub counts: KeptCounts,
}

impl Culling {
    /// Creates the pass; `None` if the scene leaves out no particles.
    pub fn new(device: &Device, compiler: &Compiler, scene: &Scene) -> Result<Option<Culling>> {
        let n = scene.n_particles() as u32;
        let culling = || -> Result<Culling> {
            let cull = Cull::new(device, compiler, n, blob_variant(scene))?;
            Ok(Culling { cull, counts: KeptCounts::new(device)? })
        };
        culls(scene).then(culling).transpose()
    }

    /// Lists the sizes of the buffers.
    pub fn specs(scene: &Scene) -> Vec<BufferSpec> {
        match culls(scene) {
            true => [cull::Scratch::specs(scene.n_particles()), KeptCounts::specs()].concat(),
            false => vec![],
        }
    }

    /// Returns how many particles were kept in the frame that last ended in `slot`.
    pub fn n_kept(&self, slot: usize) -> Result<u32> {
        let words: Vec<u32> = self.counts.counts.0[slot].read(size_of::<KeptRecord>() / 4)?;
        Ok(words[KeptRecord::I_COUNT as usize])
    }
}

/// Returns the view that particles are tested against: `camera` and `size` are those of the blobs'
/// target, and `packet` has the camera of the full picture.
pub(super) fn cull_view<'a>(
    camera: &'a CameraRecord,
    size: [u32; 2],
    packet: &'a Packet,
    c: &FrameConstants,
) -> CullView<'a> {
    // The bound is in pixels of the film, of which a slope has another number.
    let pixels = f64::from(size[1]) * f64::from(packet.camera.tan_y)
        / (f64::from(c.size[1]) * f64::from(camera.tan_y));
    CullView { blobs: c.view(camera, packet), size, smallest: c.smallest * pixels }
}

/// Returns the depths that sort keys are made of.
pub(super) fn key_depths(packet: &Packet, c: &FrameConstants) -> Depths {
    let Packet { radius, sort_bits: n_bits, .. } = *packet;
    // Slices are shells about the eye.
    let from = match c.slices {
        true => DepthFrom::Eye(packet.camera.eye),
        false => DepthFrom::Plane(packet.camera.forward),
    };
    Depths { from, radius, n_bits }
}
