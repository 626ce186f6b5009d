//! second: the second reflection on every facet, gathered from all others.
//!
//! In: facets, regions, lights, the facets' shares of them, the table of lobes, the density grid.
//! Out: I_i and L2 in `lit`. Law: L2_j = Σ L1_i f_j V cos cos A/(d² + A/π). Source: C (16),
//! docs/model.md §7, §11; of the sum's error "sums" there.

use bytemuck::Pod;

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::frame::GridRecord;
use crate::layout::record;
use crate::layout::sums::SumMacros;

record! {
    pub struct SourcesPush { n_facets: u32, n_lights: u32, n_surfaces: u32 }
}

record! {
    pub struct MergePush { i_first: u32, n_merges: u32, n_lights: u32 }
}

record! {
    pub struct GatherPush {
        grid: GridRecord,
        eye: [f32; 3],
        n_lights: u32,
        pair_size: f32,
        pair_levels: u32,
        step_length: f32,
        backward: f32,
        pair_steps: u32,
        i_first_block: u32,
        theta: f32,
        n_surfaces: u32,
        i_round: u32,
        n_rounds: u32,
    }
}

pub struct Second {
    sources: Kernel,
    merge: Kernel,
    /// For receivers without a lobe, and with.
    gather: [Kernel; 2],
    /// Receivers of one block.
    block: u32,
}

/// How a gather shares out the turns that its loops may take in one dispatch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Turns {
    /// After these no cell is quartered any more.
    pub quarter: u32,
    /// After these no further source is looked at.
    pub batch: u32,
    /// Facets that are set aside together for a closer look.
    pub aside: u32,
    /// Lights that are kept at hand: all, or none.
    pub kept: u32,
}

impl Turns {
    fn macros(&self, device: &Device) -> [(&'static str, u32); 5] {
        [
            ("SPLIT_ITERATIONS", self.quarter),
            ("BATCH_ITERATIONS", self.batch),
            ("MAX_DEFERRED", self.aside),
            ("N_KEPT", self.kept),
            ("TOGETHER", u32::from(device.limits().has_subgroup_arithmetic)),
        ]
    }
}

/// Blocks of receivers, by whether they have a lobe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Receivers {
    Diffuse,
    Glossy,
}

impl Second {
    /// `has_clouds`: light between facets is attenuated by the density grid; `tree`: sources are
    /// the nodes of a tree; `shiny`: some region has a lobe. `turns`: of a dispatch. `sums`: how a
    /// receiver's sums over its senders are formed.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        [has_clouds, tree, shiny]: [bool; 3],
        turns: Turns,
        sums: &SumMacros,
    ) -> Result<Second> {
        let width = block_len(device);
        let gather = |glossy: u32| {
            let macros = [
                ("WORKGROUP", width),
                ("MARCH", u32::from(has_clouds)),
                ("GLOSSY", glossy),
                ("TREE", u32::from(tree)),
                ("SHINY", u32::from(shiny)),
            ];
            let macros = [&macros[..], &turns.macros(device), sums.list()].concat();
            Kernel::with_macros(device, compiler, "second.gather", GatherPush::FIELDS, &[], &macros)
        };
        Ok(Second {
            sources: Kernel::new(device, compiler, "second.sources", SourcesPush::FIELDS, &[])?,
            merge: Kernel::new(device, compiler, "second.merge", MergePush::FIELDS, &[])?,
            gather: [gather(0)?, gather(1)?],
            block: width,
        })
    }

    /// Most receivers of a block.
    pub fn block_len(&self) -> u32 {
        self.block
    }

    /// `facets`: FacetRecord; `lights`: LightRecord; `transmittance` and `through`: f32
    /// [facet][light]; `regions`: RegionRecord; `order`: u32, the facet of each place; `leaves`:
    /// u32, the source of each place; `sources`: SourceRecord; `fluxes`: [f32; 4] [source][light].
    pub fn record_sources(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 10],
        push: &SourcesPush,
    ) -> Result<()> {
        rec.dispatch(&self.sources, &buffers, push, push.n_facets)
    }

    /// The clusters of one height. `merges`: u32, nodes by height; `nodes`: NodeRecord; `sources`
    /// and `fluxes` as above.
    pub fn record_merge(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 4],
        push: &MergePush,
    ) -> Result<()> {
        rec.dispatch(&self.merge, &buffers, push, push.n_merges)
    }

    /// `blocks`: BlockRecord; `pairings`: PairingRecord; `occluders`: u32, surfaces; `order`: u32;
    /// `facets`, `regions`, `lights`, `sources`, `fluxes` as above; `table`: f32, a lobe a row;
    /// `density`: f32; `nodes`: NodeRecord; `lit`: LitRecord; `reached`: u32 by facet; `stencils`:
    /// PackedRecord [source][light]; `rounds`: [u32; 3], the workgroups of each round. A gather
    /// takes several dispatches, its rounds.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 16],
        push: &GatherPush,
        receivers: Receivers,
        n_blocks: u32,
    ) -> Result<()> {
        of_round(rec, &self.gather[receivers as usize], &buffers, push, push.i_round, n_blocks)
    }
}

record! {
    pub struct TensorPush {
        grid: GridRecord,
        eye: [f32; 3],
        n_lights: u32,
        pair_size: f32,
        pair_levels: u32,
        step_length: f32,
        backward: f32,
        pair_steps: u32,
        i_first_block: u32,
        i_light: u32,
        i_vectors: u32,
        n_rows: u32,
        n_columns: u32,
        n_surfaces: u32,
        i_round: u32,
        n_rounds: u32,
        is_first_light: u32,
    }
}

/// T2: the second reflection by light, basis of the receiver and column of the emitters, for
/// `contract` to sum (docs/model.md §11 "contract").
pub struct SecondTensor {
    /// For receivers without a lobe, and with.
    gather: [Kernel; 2],
}

impl SecondTensor {
    /// `has_clouds`: light between facets is attenuated by the density grid. `n_bases`: N_b.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        has_clouds: bool,
        n_bases: u32,
        turns: Turns,
    ) -> Result<SecondTensor> {
        let width = block_len(device);
        let gather = |glossy: u32| {
            let march = u32::from(has_clouds);
            let macros =
                [("WORKGROUP", width), ("MARCH", march), ("GLOSSY", glossy), ("N_BASES", n_bases)];
            let macros = [&macros[..], &turns.macros(device)].concat();
            Kernel::with_macros(device, compiler, "second.tensor", TensorPush::FIELDS, &[], &macros)
        };
        Ok(SecondTensor { gather: [gather(0)?, gather(1)?] })
    }

    /// Buffers as [`Second::record`] has them; `table` with the vectors of the basis from row
    /// `i_vectors` on; `t2`: f32 [light][row / 64][column][row % 64] (contract's TILE).
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 16],
        push: &TensorPush,
        receivers: Receivers,
        n_blocks: u32,
    ) -> Result<()> {
        of_round(rec, &self.gather[receivers as usize], &buffers, push, push.i_round, n_blocks)
    }
}

/// A block has at least as many receivers, but for a region's last.
pub const LEAST_BLOCK: u32 = 8;

/// Most receivers of a block: a subgroup's width.
fn block_len(device: &Device) -> u32 {
    device.limits().subgroup_size.clamp(LEAST_BLOCK, 64)
}

/// The first round has a workgroup a block, and every other as many as the one before has counted.
fn of_round<P: Pod>(
    rec: &mut Recorder<'_>,
    kernel: &Kernel,
    buffers: &[&Buffer; 16],
    push: &P,
    i_round: u32,
    n_blocks: u32,
) -> Result<()> {
    match i_round {
        0 => rec.dispatch_groups(kernel, buffers, push, n_blocks),
        _ => rec.dispatch_indirect(kernel, buffers, push, (buffers[15], 3 * i_round)),
    }
}
