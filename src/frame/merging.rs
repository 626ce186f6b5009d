//! The pass that lets one blob stand for many, with its sort and its buffers.

use super::buffers::SceneBuffers;
use super::features::has_lod;
use crate::error::Result;
use crate::gpu::{Buffer, BufferSpec, Compiler, Device, Recorder, buffers};
use crate::layout::particle::{ParticleRecord, PlacedRecord};
use crate::model::lod::class_of;
use crate::model::scene::Scene;
use crate::passes::lod::{Lod, LodInput};
use crate::passes::sort::{self, Count, Sort};

/// Bits of a key.
const KEY_BITS: u32 = 32;

buffers! {
    /// The buffers that the pass writes.
    pub(super) struct MergedBuffers(n: u64) {
        /// Key and particle.
        entries: Buffer => [u32; 2], n, "lod.entries";
        placed: Buffer => PlacedRecord, n, "lod.placed", TexelStores;
        particles: Buffer => ParticleRecord, n, "lod.particles", TexelStores;
    }
}

/// The pipelines and buffers of merged blobs.
pub(super) struct Merging {
    lod: Lod,
    sort: Sort,
    buffers: MergedBuffers,
    /// Edge of a cell over the least σ of its class.
    cells: f64,
}

impl Merging {
    /// Creates them; `None` if every blob of `scene` stands for itself.
    pub fn new(device: &Device, compiler: &Compiler, scene: &Scene) -> Result<Option<Merging>> {
        if !has_lod(scene) {
            return Ok(None);
        }
        let n = scene.n_particles();
        Ok(Some(Merging {
            lod: Lod::new(device, compiler, scene.clouds.len() > 1, scene.is_textured())?,
            sort: Sort::new(device, compiler, n as u32)?,
            buffers: MergedBuffers::new(device, n)?,
            cells: scene.draw.lod,
        }))
    }

    /// Lists the sizes of the buffers.
    pub fn specs(scene: &Scene) -> Vec<BufferSpec> {
        let n = scene.n_particles();
        [MergedBuffers::specs(n), sort::Scratch::specs_of_bytes(n)].concat()
    }

    /// Merges the blobs of `n` particles whose σ is `sigma_max` at most.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        b: &SceneBuffers,
        n: u32,
        sigma_max: f64,
    ) -> Result<()> {
        let SceneBuffers { placed, particles, i_group, groups, textured, .. } = b;
        let MergedBuffers { entries, placed: to_placed, particles: to_particles } = &self.buffers;
        let input = LodInput { placed, particles, i_group, groups, textured };
        let law = (class_of(sigma_max), self.cells);
        self.lod.record_keys(rec, &input, entries, n, law)?;
        let sorted = self.sort.record(rec, entries, KEY_BITS, Count::Known(n))?;
        self.lod.record_merge(rec, &input, [sorted, to_placed, to_particles], n)
    }
}

/// Returns the places and the particles that are drawn.
pub(super) fn drawn<'a>(merging: &'a Option<Merging>, b: &'a SceneBuffers) -> [&'a Buffer; 2] {
    match merging {
        Some(Merging { buffers, .. }) => [&buffers.placed, &buffers.particles],
        None => [&b.placed, &b.particles],
    }
}
