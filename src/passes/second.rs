//! second: computes the second reflection on every facet, gathered from all other facets.
//!
//! In: facets, regions, lights, the facets' light of each, the table of lobes, the density grid.
//! Out: I_i and L2 in `lit`. Law: L2_j = Σ L1_i f_j V cos cos A/(d² + A/π). Source: C (16),
//! model.md §7, passes.md. Error: that of the sum, see "sums" there.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::frame::GridRecord;
use crate::layout::record;
use crate::layout::sums::SumMacros;

record! {
    /// Push constants of `second_sources.comp`.
    pub struct SourcesPush {
        /// Number of facets.
        n_facets: u32,
        /// Number of lights.
        n_lights: u32,
        /// Number of surfaces.
        n_surfaces: u32,
    }
}

record! {
    /// Push constants of `second_merge.comp`.
    pub struct MergePush {
        /// First entry of `merges`.
        i_first: u32,
        /// Number of clusters.
        n_merges: u32,
        /// Number of lights.
        n_lights: u32,
    }
}

record! {
    /// Push constants of `second_gather.comp` and `second_tensor.comp`.
    pub struct GatherPush {
        /// The density grid.
        grid: GridRecord,
        /// Eye, relative to the lighting origin.
        eye: [f32; 3],
        /// Number of lights.
        n_lights: u32,
        /// Greatest width of a source over its distance.
        pair_size: f32,
        /// The most subdivisions of a facet.
        pair_levels: u32,
        /// Length of a step of the march.
        step_length: f32,
        /// Share 1 − g of extinction that counts.
        backward: f32,
        /// The most steps of a march between two facets.
        pair_steps: u32,
        /// First block of receivers.
        i_first_block: u32,
        /// Opening angle of clusters.
        theta: f32,
        /// Number of surfaces.
        n_surfaces: u32,
        /// The round.
        i_round: u32,
        /// Number of rounds.
        n_rounds: u32,
        /// The light of a tensor, as all that follows.
        i_light: u32,
        /// First row of the basis' vectors in the table.
        i_vectors: u32,
        /// Rows of T1 and T2.
        n_rows: u32,
        /// Columns of T2.
        n_columns: u32,
        /// 1 for the first light that has energy.
        is_first_light: u32,
    }
}

bindings! {
    /// The buffers that sources are made from.
    pub struct SourceBuffers {
        /// `FacetRecord` by facet.
        facets,
        /// `LightRecord` by light.
        lights,
        /// `f32` by facet and light.
        transmittance,
        /// `f32` by facet and light: transmittance of the clouds alone.
        through,
        /// `RegionRecord` by region.
        regions,
        /// `u32` facet by place.
        order,
        /// `u32` source by place.
        leaves,
        /// Output, `SourceRecord` by source.
        sources,
        /// Output, `[f32; 4]` by source and light.
        fluxes,
        /// Output, `PackedRecord` by source and light.
        stencils,
    }
}

bindings! {
    /// The buffers of a gather.
    pub struct GatherBuffers {
        /// `BlockRecord`: blocks of receivers.
        blocks,
        /// `PairingRecord`: the regions that a block receives light from.
        pairings,
        /// `u32`: surfaces that may hide a region from another.
        occluders,
        /// `u32` facet by place.
        order,
        /// `FacetRecord` by facet.
        facets,
        /// `RegionRecord` by region.
        regions,
        /// `LightRecord` by light.
        lights,
        /// `SourceRecord` by source.
        sources,
        /// `[f32; 4]` by source and light.
        fluxes,
        /// `f32`: a row a lobe.
        table,
        /// `f32` by cell: extinction per length.
        density,
        /// `u32` by source: nodes of its subtree, or `LitRecord` where a tensor is gathered.
        nodes,
        /// Output: `LitRecord` by facet, or T2.
        out,
        /// `u32` by facet: the source that its gather has reached.
        reached,
        /// `PackedRecord` by source and light.
        stencils,
        /// `[u32; 3]` by round: its workgroups.
        rounds,
    }
}

/// The most iterations that the loops of a gather may take in one dispatch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IterationBudget {
    /// Iterations after which no cell is subdivided.
    pub quarter: u32,
    /// Iterations after which no further source is visited.
    pub batch: u32,
    /// Facets that are collected before their cells are visited.
    pub aside: u32,
    /// Lights that are kept in registers: all, or none.
    pub kept: u32,
}

/// A kind of receivers, by whether they have a lobe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Receivers {
    /// Receivers that reflect diffusely.
    Diffuse,
    /// Receivers with a specular lobe.
    Glossy,
}

/// The properties of a scene that the gather is compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GatherVariant {
    /// The density grid attenuates light between facets.
    pub has_clouds: bool,
    /// Sources are the nodes of a tree.
    pub has_tree: bool,
    /// Some region has no specular lobe.
    pub is_diffuse: bool,
    /// Some region has a specular lobe.
    pub is_glossy: bool,
    /// Few registers are used, at the cost of more loads: for devices that are no CPU.
    pub is_wide: bool,
    /// Bound of a dispatch.
    pub budget: IterationBudget,
}

/// The gather kernels, for receivers without and with a lobe; `None` where there are no such
/// receivers.
struct Gather([Option<Kernel>; 2]);

impl Gather {
    fn new(
        device: &Device,
        compiler: &Compiler,
        name: &str,
        variant: &GatherVariant,
        macros: &[(&'static str, u32)],
    ) -> Result<Gather> {
        let budget = &variant.budget;
        let kernel = |glossy: u32| {
            let shared = [
                ("WORKGROUP", block_len(device)),
                ("MARCH", u32::from(variant.has_clouds)),
                ("WIDE", u32::from(variant.is_wide)),
                ("GLOSSY", glossy),
                ("SPLIT_ITERATIONS", budget.quarter),
                ("BATCH_ITERATIONS", budget.batch),
                ("MAX_DEFERRED", budget.aside),
                ("N_KEPT", budget.kept),
                ("TOGETHER", u32::from(device.limits().has_subgroup_arithmetic)),
            ];
            let macros = [&shared[..], macros].concat();
            Kernel::with_macros(device, compiler, name, GatherPush::FIELDS, &[], &macros)
        };
        let diffuse = variant.is_diffuse.then(|| kernel(0)).transpose()?;
        let glossy = variant.is_glossy.then(|| kernel(1)).transpose()?;
        Ok(Gather([diffuse, glossy]))
    }

    /// Records a round. The first one has a workgroup a block, every other one as many as the round
    /// before it has counted.
    fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &GatherBuffers<'_>,
        push: &GatherPush,
        (receivers, n_blocks): (Receivers, u32),
    ) -> Result<()> {
        let Some(kernel) = &self.0[receivers as usize] else { return Ok(()) };
        let all = buffers.by_binding();
        match push.i_round {
            0 => rec.dispatch_blocks(kernel, &all, push, n_blocks),
            i => rec.dispatch_indirect(kernel, &all, push, (buffers.rounds, 3 * i)),
        }
    }
}

/// The pipelines of the pass where light is gathered at once.
pub struct Second {
    sources: Kernel,
    merge: Kernel,
    gather: Gather,
}

impl Second {
    /// Creates the pipelines; `sums` says how a receiver's sum over its sources is formed.
    ///
    /// # Errors
    /// Fails if a shader does not compile or a pipeline cannot be created.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        variant: &GatherVariant,
        sums: &SumMacros,
    ) -> Result<Second> {
        let macros =
            [("TREE", u32::from(variant.has_tree)), ("SHINY", u32::from(variant.is_glossy))];
        let macros = [&macros[..], sums.list()].concat();
        Ok(Second {
            sources: Kernel::new(device, compiler, "second.sources", SourcesPush::FIELDS)?,
            merge: Kernel::new(device, compiler, "second.merge", MergePush::FIELDS)?,
            gather: Gather::new(device, compiler, "second.gather", variant, &macros)?,
        })
    }

    /// Writes the facets as sources.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record_sources(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &SourceBuffers<'_>,
        push: &SourcesPush,
    ) -> Result<()> {
        rec.dispatch(&self.sources, &buffers.by_binding(), push, push.n_facets)
    }

    /// Writes the clusters of one height. `merges`: `u32`, nodes by height; `nodes`: `u32` by
    /// source; `sources` and `fluxes` as in [`SourceBuffers`].
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record_merge(
        &self,
        rec: &mut Recorder<'_>,
        [merges, nodes, sources, fluxes]: [&Buffer; 4],
        push: &MergePush,
    ) -> Result<()> {
        rec.dispatch(&self.merge, &[merges, nodes, sources, fluxes], push, push.n_merges)
    }

    /// Gathers light on `blocks`: their kind and number. A gather takes several dispatches, its
    /// rounds.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &GatherBuffers<'_>,
        push: &GatherPush,
        blocks: (Receivers, u32),
    ) -> Result<()> {
        self.gather.record(rec, buffers, push, blocks)
    }
}

/// The pipelines that fill T2: the second reflection by light, basis function of the receiver and
/// column of the emitters, for `contract` to sum (passes.md "contract").
pub struct SecondTensor {
    gather: Gather,
}

impl SecondTensor {
    /// Creates the pipelines for `n_bases` basis functions.
    ///
    /// # Errors
    /// Fails if a shader does not compile or a pipeline cannot be created.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        variant: &GatherVariant,
        n_bases: u32,
    ) -> Result<SecondTensor> {
        let macros = [("N_BASES", n_bases)];
        let gather = Gather::new(device, compiler, "second.tensor", variant, &macros)?;
        Ok(SecondTensor { gather })
    }

    /// Gathers the tensor on `blocks`: their kind and number.
    ///
    /// Of `buffers`, `table` has the vectors of the basis from row `i_vectors` on, and `out` is T2:
    /// `f32` by light, row / 64, column and row % 64 (the TILE of `contract`).
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &GatherBuffers<'_>,
        push: &GatherPush,
        blocks: (Receivers, u32),
    ) -> Result<()> {
        self.gather.record(rec, buffers, push, blocks)
    }
}

/// The least capacity of a block of receivers.
pub const MIN_BLOCK: u32 = 8;

/// Returns the capacity of a block of receivers: the width of a subgroup.
pub fn block_len(device: &Device) -> u32 {
    device.limits().subgroup_size.clamp(MIN_BLOCK, 64)
}
