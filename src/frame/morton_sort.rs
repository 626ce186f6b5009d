//! The sort of particles or facets along a Morton curve.

use super::staging::{StagedBuffer, upload};
use crate::error::Result;
use crate::gpu::{Buffer, BufferSpec, Commands, Compiler, Device, buffers};
use crate::layout::facet::{RegionBoundsRecord, RunRecord};
use crate::model::scene::Scene;
use crate::passes::morton::Morton;
use crate::passes::sort::{self, Sort};

/// Bits of a Morton key.
pub(super) const KEY_BITS: u32 = 32;

buffers! {
    /// The entries of a Morton sort and the bounds of its cells.
    pub(super) struct MortonBuffers(n: u64, n_regions: u64) {
        /// Morton key and index.
        entries: Buffer => [u32; 2], n, "morton.entries";
        bounds: StagedBuffer => RegionBoundsRecord, n_regions, "morton.bounds";
    }
}

/// The pipelines and buffers of a Morton sort.
pub(super) struct MortonSort {
    pub morton: Morton,
    pub sort: Sort,
    pub buffers: MortonBuffers,
}

impl MortonSort {
    /// Creates a sort of `n` particles or facets of `scene`.
    pub fn new(device: &Device, compiler: &Compiler, scene: &Scene, n: u64) -> Result<MortonSort> {
        Ok(MortonSort {
            morton: Morton::new(device, compiler)?,
            sort: Sort::new(device, compiler, n as u32)?,
            buffers: MortonBuffers::new(device, n, scene.n_regions() as u64)?,
        })
    }

    /// Lists the sizes of the buffers.
    pub fn specs(scene: &Scene, n: u64) -> Vec<BufferSpec> {
        let buffers = MortonBuffers::specs(n, scene.n_regions() as u64);
        [buffers, sort::Scratch::specs_of_bytes(n)].concat()
    }
}

buffers! {
    /// The runs of particles that facets stand for.
    pub(super) struct RunBuffers(scene: &Scene) {
        /// Particle by place in Morton order.
        order: Buffer => u32, scene.n_particles(), "morton.order";
        /// Places of each facet.
        runs: Buffer => RunRecord, scene.facet_runs().len() as u64, "facets.runs";
    }
}

/// Facets that stand for runs of particles in Morton order.
pub(super) struct FacetRuns {
    pub sort: MortonSort,
    pub buffers: RunBuffers,
    pub n_runs: u32,
}

impl FacetRuns {
    /// Creates the runs of `scene`.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        commands: &mut Commands,
        scene: &Scene,
    ) -> Result<FacetRuns> {
        let record = |(first, end): (u64, u64)| RunRecord {
            i_first: first as u32,
            n_particles: (end - first) as u32,
        };
        let runs: Vec<RunRecord> = scene.facet_runs().into_iter().map(record).collect();
        let buffers = RunBuffers::new(device, scene)?;
        upload(device, commands, &runs, &buffers.runs)?;
        Ok(FacetRuns {
            sort: MortonSort::new(device, compiler, scene, scene.n_particles())?,
            buffers,
            n_runs: runs.len() as u32,
        })
    }

    /// Lists the sizes of the buffers.
    pub fn specs(scene: &Scene) -> Vec<BufferSpec> {
        [MortonSort::specs(scene, scene.n_particles()), RunBuffers::specs(scene)].concat()
    }
}
