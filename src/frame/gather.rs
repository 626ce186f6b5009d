//! The gather of the second reflection: its pipelines, buffers and push constants.

use super::features::gathers_from_tree;
use super::gather_lists::{GatherLists, gather_variant, n_rounds, n_sources};
use super::morton_sort::MortonSort;
use super::packet::Packet;
use super::staging::upload;
use crate::error::Result;
use crate::gpu::{Buffer, BufferSpec, Commands, Compiler, Device, MemoryUsage, buffers};
use crate::layout::second::{PackedRecord, SourceRecord};
use crate::model::scene::Scene;
use crate::passes::second::{
    GatherBuffers, GatherPush, Receivers, Second, SourceBuffers, block_len,
};

use super::buffers::SceneBuffers;

buffers! {
    /// The buffers that grow with the number of sources.
    pub(super) struct GatherScratch(scene: &Scene) {
        sources: Buffer => SourceRecord, n_sources(scene), "second.sources", Texels;
        /// By source and light.
        fluxes: Buffer => [f32; 4], n_fluxes(scene), "second.fluxes", Texels;
        /// By source and light.
        stencils: Buffer => PackedRecord, n_fluxes(scene), "second.stencils", Texels;
        /// Source that the gather has reached, by facet.
        reached: Buffer => u32, scene.n_facets(), "second.reached";
    }
}

fn n_fluxes(scene: &Scene) -> u64 {
    n_sources(scene) * scene.lights.len() as u64
}

/// A contiguous range of blocks of receivers.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockRange {
    pub receivers: Receivers,
    pub i_first: u32,
    pub n: u32,
}

/// The gather of the second reflection.
pub(super) struct IndirectGather {
    pub second: Second,
    /// Order of the facets, if the sources are a tree.
    pub order: Option<MortonSort>,
    pub sources: GatherScratch,
    blocks: Buffer,
    pairings: Buffer,
    occluders: Buffer,
    /// Facet by place: in Morton order if the sources are a tree.
    pub places: Buffer,
    /// Source by place.
    leaves: Buffer,
    pub nodes: Buffer,
    /// Clusters by height.
    pub merges: Buffer,
    /// First and number of the clusters of each height.
    pub heights: Vec<(u32, u32)>,
    /// Workgroups of each round of a gather.
    pub rounds: Buffer,
    /// `rounds` before a gather: no workgroups after the first round until a receiver is not done.
    pub rounds_at_rest: Buffer,
    n_diffuse: u32,
    n_glossy: u32,
    /// Push constants with what is constant over a run.
    push: GatherPush,
    step_cells: f64,
}

impl IndirectGather {
    /// Creates the gather of `scene`. `has_tensors`: tensors keep every pair, so there is no tree.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        commands: &mut Commands,
        scene: &Scene,
        has_tensors: bool,
    ) -> Result<IndirectGather> {
        let has_tree = !has_tensors && gathers_from_tree(scene);
        let lists = GatherLists::new(scene, block_len(device), has_tree);
        let counts = lists.tree.merges.iter().map(|m| m.len() as u32);
        let heights =
            counts.scan(0, |first, n| Some((std::mem::replace(first, *first + n), n))).collect();
        let places: Vec<u32> = (0..scene.n_facets() as u32).collect();
        let blocks = [&lists.diffuse[..], &lists.glossy[..]].concat();
        let n_rounds = n_rounds(scene, device, lists.tree.n_nodes.len() as u64);
        // One more than there are: the last round counts into it.
        let at_rest = [0, 1, 1].repeat(n_rounds as usize + 1);
        let mut made = |name: &str, data: &[u32], min_words: usize| -> Result<Buffer> {
            let n = data.len().max(min_words) as u64;
            let buffer = Buffer::new::<u32>(device, name, n, MemoryUsage::Device)?;
            upload(device, commands, data, &buffer)?;
            Ok(buffer)
        };
        let lighting = &scene.lighting;
        let order = || MortonSort::new(device, compiler, scene, scene.n_facets());
        Ok(IndirectGather {
            second: Second::new(
                device,
                compiler,
                &gather_variant(scene, device, has_tree),
                &lighting.sums.into(),
            )?,
            order: has_tree.then(order).transpose()?,
            sources: GatherScratch::new(device, scene)?,
            blocks: made("second.blocks", bytemuck::cast_slice(&blocks), 4)?,
            pairings: made("second.pairings", bytemuck::cast_slice(&lists.pairings), 5)?,
            occluders: made("second.occluders", &lists.occluders, 1)?,
            places: made("second.order", &places, 1)?,
            leaves: made("second.leaves", &lists.tree.leaves, 1)?,
            nodes: made("second.nodes", &lists.tree.n_nodes, 1)?,
            merges: made("second.merges", &lists.tree.merges.concat(), 1)?,
            rounds: made("second.rounds", &at_rest, 3)?,
            rounds_at_rest: made("second.rounds_at_rest", &at_rest, 3)?,
            heights,
            n_diffuse: lists.diffuse.len() as u32,
            n_glossy: lists.glossy.len() as u32,
            push: GatherPush {
                n_lights: scene.lights.len() as u32,
                pair_size: lighting.pairs.size as f32,
                pair_levels: lighting.pairs.levels,
                backward: (1.0 - lighting.forward) as f32,
                pair_steps: lighting.pairs.steps,
                theta: lighting.theta as f32,
                n_surfaces: scene.surfaces.len() as u32,
                n_rounds,
                ..GatherPush::default()
            },
            step_cells: lighting.step,
        })
    }

    /// Lists the sizes of the buffers that grow with the scene.
    pub fn specs(scene: &Scene) -> Vec<BufferSpec> {
        let order = match gathers_from_tree(scene) {
            true => MortonSort::specs(scene, scene.n_facets()),
            false => vec![],
        };
        [GatherScratch::specs(scene), order].concat()
    }

    /// Returns the blocks to gather on; with `view_only`, those of receivers with a lobe.
    pub fn blocks(&self, view_only: bool) -> impl Iterator<Item = BlockRange> + use<> {
        let (receivers, n) = (Receivers::Diffuse, if view_only { 0 } else { self.n_diffuse });
        let diffuse = BlockRange { receivers, i_first: 0, n };
        let (receivers, i_first, n) = (Receivers::Glossy, self.n_diffuse, self.n_glossy);
        [diffuse, BlockRange { receivers, i_first, n }].into_iter().filter(|range| range.n > 0)
    }

    /// Returns the push constants of every round of a gather on `range`.
    pub fn pushes(&self, packet: &Packet, range: BlockRange) -> impl Iterator<Item = GatherPush> {
        let push = GatherPush {
            grid: packet.grid,
            eye: packet.camera.eye,
            step_length: self.step_cells as f32 * packet.grid.cell,
            i_first_block: range.i_first,
            ..self.push
        };
        (0..push.n_rounds).map(move |i_round| GatherPush { i_round, ..push })
    }

    /// Returns the buffers that sources are made from.
    pub fn source_buffers<'a>(&'a self, b: &'a SceneBuffers) -> SourceBuffers<'a> {
        let SceneBuffers { facets, lights, transmittance, through, regions, .. } = b;
        let GatherScratch { sources, fluxes, stencils, .. } = &self.sources;
        let (order, leaves) = (&self.places, &self.leaves);
        SourceBuffers {
            facets,
            lights,
            transmittance,
            through,
            regions,
            order,
            leaves,
            sources,
            fluxes,
            stencils,
        }
    }

    /// Returns the buffers of a gather, of which two depend on its output.
    pub fn gather_buffers<'a>(
        &'a self,
        b: &'a SceneBuffers,
        nodes: &'a Buffer,
        out: &'a Buffer,
    ) -> GatherBuffers<'a> {
        let SceneBuffers { facets, regions, lights, table, density, .. } = b;
        let GatherScratch { sources, fluxes, stencils, reached } = &self.sources;
        let IndirectGather { blocks, pairings, occluders, places: order, rounds, .. } = self;
        GatherBuffers {
            blocks,
            pairings,
            occluders,
            order,
            facets,
            regions,
            lights,
            sources,
            fluxes,
            table,
            density,
            nodes,
            out,
            reached,
            stencils,
            rounds,
        }
    }
}
