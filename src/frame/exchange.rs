//! Who receives light from whom: the constant part of the second reflection's gather, made once a
//! scene.

use crate::error::Result;
use crate::gpu::{Buffer, Commands, Device, MemoryUsage, Recorder};
use crate::layout::facet::lobe_width;
use crate::layout::second::{BlockRecord, PackedRecord, PairingRecord, SourceRecord};
use crate::model::pairings::{Pairing, pairings};
use crate::model::scene::{Gather, Scene};
use crate::model::tree::Tree;
use crate::passes::second::{Receivers, Turns};

use super::buffers::{Buffers, upload};

/// Buffers of the exchange, and how many blocks of receivers there are without and with a lobe.
pub struct Exchange {
    pub blocks: Buffer,
    pub pairings: Buffer,
    pub occluders: Buffer,
    /// Facet of each place: as they are, or in Morton order where there is a tree.
    pub order: Buffer,
    /// Source of each place.
    pub leaves: Buffer,
    pub nodes: Buffer,
    /// Clusters by height.
    pub merges: Buffer,
    /// First and number of those of each height.
    pub heights: Vec<(u32, u32)>,
    pub sources: Buffer,
    pub fluxes: Buffer,
    pub stencils: Buffer,
    /// By facet: the source that its gather has reached.
    pub reached: Buffer,
    /// Workgroups of each round of a gather: none but of the first until a receiver is not done.
    pub rounds: Buffer,
    rounds_at_rest: Buffer,
    n_rounds: u32,
    n_diffuse_blocks: u32,
    n_glossy_blocks: u32,
}

/// The records behind the buffers.
#[derive(Debug, Clone, Default, PartialEq)]
struct Lists {
    diffuse: Vec<BlockRecord>,
    glossy: Vec<BlockRecord>,
    pairings: Vec<PairingRecord>,
    occluders: Vec<u32>,
    /// Without clusters where every pair is gathered.
    tree: Tree,
}

impl Exchange {
    /// Blocks hold at most `block_len` receivers.
    pub fn new(
        device: &Device,
        commands: &mut Commands,
        scene: &Scene,
        block_len: u32,
        tree: bool,
    ) -> Result<Exchange> {
        let lists = Lists::of(scene, block_len, tree);
        let n_sources = lists.tree.n_nodes.len() as u64;
        let n_fluxes = n_sources * scene.lights.len() as u64;
        let counts = lists.tree.merges.iter().map(|m| m.len() as u32);
        let heights =
            counts.scan(0, |first, n| Some((std::mem::replace(first, *first + n), n))).collect();
        let places: Vec<u32> = (0..scene.n_facets() as u32).collect();
        let blocks = [&lists.diffuse[..], &lists.glossy[..]].concat();
        let n_rounds = n_rounds(scene, n_sources);
        // One more, that the last would count for.
        let at_rest = [0, 1, 1].repeat(n_rounds as usize + 1);
        let mut made = |name: &str, data: &[u32], words: usize| -> Result<Buffer> {
            let n = (data.len() as u64).max(words as u64);
            let buffer = Buffer::new::<u32>(device, name, n, MemoryUsage::Device)?;
            upload(device, commands, data, &buffer)?;
            Ok(buffer)
        };
        Ok(Exchange {
            blocks: made("second.blocks", bytemuck::cast_slice(&blocks), 4)?,
            pairings: made("second.pairings", bytemuck::cast_slice(&lists.pairings), 5)?,
            occluders: made("second.occluders", &lists.occluders, 1)?,
            order: made("second.order", &places, 1)?,
            leaves: made("second.leaves", &lists.tree.leaves, 1)?,
            nodes: made("second.nodes", &lists.tree.n_nodes, 1)?,
            merges: made("second.merges", &lists.tree.merges.concat(), 1)?,
            heights,
            sources: Buffer::new::<SourceRecord>(
                device,
                "second.sources",
                n_sources,
                MemoryUsage::Device,
            )?,
            fluxes: Buffer::new::<[f32; 4]>(
                device,
                "second.fluxes",
                n_fluxes,
                MemoryUsage::Device,
            )?,
            stencils: Buffer::new::<PackedRecord>(
                device,
                "second.stencils",
                n_fluxes,
                MemoryUsage::Device,
            )?,
            reached: Buffer::new::<u32>(
                device,
                "second.reached",
                scene.n_facets(),
                MemoryUsage::Device,
            )?,
            rounds: made("second.rounds", &at_rest, 3)?,
            rounds_at_rest: made("second.rounds_at_rest", &at_rest, 3)?,
            n_rounds,
            n_diffuse_blocks: lists.diffuse.len() as u32,
            n_glossy_blocks: lists.glossy.len() as u32,
        })
    }

    /// Blocks of receivers: their kind, the first and how many, where there are any.
    pub fn blocks<'a>(
        &'a self,
        gathered: &'a [Receivers],
    ) -> impl Iterator<Item = (Receivers, u32, u32)> + 'a {
        let of = |r: &Receivers| match r {
            Receivers::Diffuse => (*r, 0, self.n_diffuse_blocks),
            Receivers::Glossy => (*r, self.n_diffuse_blocks, self.n_glossy_blocks),
        };
        gathered.iter().map(of).filter(|(_, _, n)| *n > 0)
    }

    /// The rounds of a gather: the number of each, and how many there are.
    pub fn rounds(&self) -> impl Iterator<Item = [u32; 2]> {
        let n = self.n_rounds;
        (0..n).map(move |k| [k, n])
    }

    /// Before the first of them.
    pub fn start_rounds(&self, rec: &mut Recorder<'_>) {
        rec.copy(&self.rounds_at_rest, &self.rounds);
    }

    /// The gathering kernels' buffers, of which two differ.
    pub fn bindings<'a>(
        &'a self,
        b: &'a Buffers,
        last: &'a Buffer,
        out: &'a Buffer,
    ) -> [&'a Buffer; 16] {
        [
            &self.blocks,
            &self.pairings,
            &self.occluders,
            &self.order,
            &b.facets,
            &b.regions.buffer,
            &b.lights.buffer,
            &self.sources,
            &self.fluxes,
            &b.table.buffer,
            &b.density,
            last,
            out,
            &self.reached,
            &self.stencils,
            &self.rounds,
        ]
    }
}

/// Turns that an invocation's loops may take together, nested ones counted each: llvmpipe ends
/// every loop without a word when they are used up (LP_MAX_TGSI_LOOP_ITERATIONS), and a watchdog
/// may be as strict.
const LOOP_TURNS: u32 = 65_000;
/// Lights that a gather keeps at hand, at most.
const MOST_KEPT: usize = 4;
/// Facets that a receiver sets aside before it looks at their cells: all at once, but where each
/// may have thousands.
const ASIDE: u32 = 8;
/// A lobe narrower than this has as many.
const NARROW: f64 = 0.03;

/// How a gather of the scene shares out its loops' turns.
pub fn turns(scene: &Scene) -> Turns {
    let from = pairings(&scene.surfaces, scene.terrains.len() + scene.clouds.len());
    let n_occluders = from.iter().flatten().map(|p| p.occluders.len()).max().unwrap_or(0);
    let n_lights = scene.lights.len();
    let march = if scene.n_particles() > 0 { scene.lighting.pairs.steps } else { 0 };
    // A cell at its longest: iterations.glsl's count of its loops, all occluders, and before every light
    // all surfaces.
    let of_cell =
        16 + 5 * n_lights + n_occluders + n_lights * scene.surfaces.len() + march as usize;
    let aside = if is_narrow(scene) { 1 } else { ASIDE };
    // When no cell is quartered any more these are left: three of each level, and the other facets
    // that were set aside.
    let left =
        (aside + 3 * scene.lighting.pairs.levels + 1) * of_cell.min(LOOP_TURNS as usize) as u32;
    let quarter = LOOP_TURNS.saturating_sub(left).max(LOOP_TURNS / 2);
    Turns {
        quarter,
        batch: quarter / 2,
        aside,
        kept: if n_lights <= MOST_KEPT { n_lights as u32 } else { 0 },
    }
}

/// Whether some lobe is so narrow that a facet may have thousands of cells.
fn is_narrow(scene: &Scene) -> bool {
    let narrowest = |i: usize| f64::from(lobe_width(scene.region_material(i).exponents()[1]));
    (0..scene.n_regions()).any(|i| is_glossy(scene, i) && narrowest(i) < NARROW)
}

/// Most dispatches of a gather of `n_sources`: those in which no receiver has anything left to do
/// have no workgroups. A source takes some ten turns as a whole and some hundred by its cells, and
/// where lobes are narrow a dispatch each.
fn n_rounds(scene: &Scene, n_sources: u64) -> u32 {
    let of_sources = n_sources.saturating_mul(128).div_ceil(u64::from(turns(scene).batch));
    let of_lobes = if is_narrow(scene) { n_sources.min(64) } else { 0 };
    (of_sources + of_lobes).min(1 << 16) as u32 + 1
}

/// From this many facets on the tree is the faster (docs/measured.md).
const TREE_PAYS: u64 = 1024;

/// Whether the second reflection is gathered from a tree.
pub fn gathers_from_tree(scene: &Scene) -> bool {
    match scene.lighting.gather {
        Gather::Exact => false,
        Gather::Tree => true,
        Gather::Auto => scene.n_facets() >= TREE_PAYS,
    }
}

/// Facets of each region.
pub fn region_sizes(scene: &Scene) -> Vec<u32> {
    let of_surfaces = scene.surfaces.iter().map(|s| s.n_facets() as u32);
    let of_terrains = scene.terrains.iter().map(|t| t.n_facets() as u32);
    of_surfaces
        .chain(of_terrains)
        .chain(scene.clouds.iter().map(|c| scene.n_cloud_facets(c) as u32))
        .collect()
}

/// Whether a region's lobe is to be computed.
pub fn is_glossy(scene: &Scene, i_region: usize) -> bool {
    scene.lighting.bases > 1 && scene.region_material(i_region).is_glossy()
}

/// In the order of their numbers' bits reversed, so that every stretch of them is a fair sample of
/// all: a device that deals out stretches (llvmpipe one a thread) would else wait for the one with
/// the crowded surfaces.
fn scattered(blocks: &[BlockRecord]) -> Vec<BlockRecord> {
    let mut order: Vec<u32> = (0..blocks.len() as u32).collect();
    order.sort_by_key(|i| i.reverse_bits());
    order.into_iter().map(|i| blocks[i as usize]).collect()
}

impl Lists {
    fn of(scene: &Scene, block_len: u32, tree: bool) -> Lists {
        let sizes = region_sizes(scene);
        let firsts: Vec<u32> =
            sizes.iter().scan(0, |first, n| Some(std::mem::replace(first, *first + n))).collect();
        let tree_of = if tree { Tree::push } else { Tree::push_flat };
        let mut lists = Lists::default();
        let roots: Vec<u32> = sizes.iter().map(|n| tree_of(&mut lists.tree, *n)).collect();
        let ends = roots.iter().skip(1).copied().chain([lists.tree.n_nodes.len() as u32]);
        let sources: Vec<(u32, u32)> =
            roots.iter().zip(ends).map(|(root, end)| (*root, end - root)).collect();
        for (i, from) in
            pairings(&scene.surfaces, scene.terrains.len() + scene.clouds.len()).iter().enumerate()
        {
            let i_pairing = lists.pairings.len() as u32;
            for pairing in from.iter().filter(|p| sizes[p.i_emitter] > 0) {
                lists.push_pairing(pairing, sources[pairing.i_emitter]);
            }
            let n_pairings = lists.pairings.len() as u32 - i_pairing;
            let blocks = if is_glossy(scene, i) { &mut lists.glossy } else { &mut lists.diffuse };
            for first in (0..sizes[i]).step_by(block_len as usize) {
                let n_facets = block_len.min(sizes[i] - first);
                blocks.push(BlockRecord {
                    i_first: firsts[i] + first,
                    n_facets,
                    i_pairing,
                    n_pairings,
                });
            }
        }
        lists.diffuse = scattered(&lists.diffuse);
        lists.glossy = scattered(&lists.glossy);
        lists
    }

    fn push_pairing(&mut self, pairing: &Pairing, (i_source, n_sources): (u32, u32)) {
        let i_occluder = self.occluders.len() as u32;
        self.occluders.extend(pairing.occluders.iter().map(|i| *i as u32));
        let n_occluders = pairing.occluders.len() as u32;
        let i_region = pairing.i_emitter as u32;
        self.pairings.push(PairingRecord {
            i_region,
            i_occluder,
            n_occluders,
            i_source,
            n_sources,
        });
    }
}
