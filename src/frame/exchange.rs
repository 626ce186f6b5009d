//! Who receives light from whom: the constant part of the second reflection's gather, made once a scene.

use crate::error::Result;
use crate::gpu::{Buffer, Commands, Device, Place};
use crate::layout::second::{BlockRecord, PairingRecord, SourceRecord};
use crate::model::pairings::{Pairing, pairings};
use crate::model::scene::{Gather, Scene};
use crate::model::tree::Tree;
use crate::passes::second::Receivers;

use super::buffers::upload;

/// What the sources of one dispatch may cost on a processor: llvmpipe ends all loops of an invocation after 65 535 turns
/// in all (Mesa's LP_MAX_TGSI_LOOP_ITERATIONS). A cloud's facet costs 1, up to 16 turns of march and a look at some
/// surfaces; a surface's may be seen as some hundred cells, each of which asks surfaces and lights. Where that is not
/// enough the gather says so: `unresolved` is infinite.
const SLICE: u32 = 1024;
/// And on devices without such an end, whose watchdogs like dispatches short nevertheless.
const LONG_SLICE: u32 = 64 * SLICE;
/// Of a surface's facet where every pair is gathered, and of one in a tree, few of whose nodes a receiver meets.
const SURFACE_COST: u32 = 128;
const TREE_COST: u32 = 48;
/// Facets of one tree, at most, where a dispatch has short slices, and long ones: powers of FAN, whole clusters.
const TREE_RUN: u32 = 16;
const LONG_TREE_RUN: u32 = 4096;

/// Cells of one receiver and slice after which shadows' rims are not looked for any more: each up to some 30 turns, and what stays unresolved is gone through twice.
const RIM_CELLS: u32 = 1024;

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
    /// Cells after which rims are not looked for any more.
    pub rim_cells: u32,
    /// First block and number of blocks of each slice of the sources, of receivers without and with a lobe.
    slices: [Vec<(u32, u32)>; 2],
}

/// The records behind the buffers.
#[derive(Debug, Clone, Default, PartialEq)]
struct Lists {
    /// By slice of the sources, of receivers without and with a lobe.
    blocks: [Vec<Vec<BlockRecord>>; 2],
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
        let (slice, rim_cells) = if device.info().kind == "cpu" { (SLICE, RIM_CELLS) } else { (LONG_SLICE, u32::MAX) };
        let lists = Lists::of(scene, block_len, tree, slice);
        let n_sources = lists.tree.n_nodes.len() as u64;
        let n_fluxes = n_sources * scene.lights.len() as u64;
        let counts = lists.tree.merges.iter().map(|m| m.len() as u32);
        let heights = counts.scan(0, |first, n| Some((std::mem::replace(first, *first + n), n))).collect();
        let places: Vec<u32> = (0..scene.n_facets() as u32).collect();
        let blocks = lists.blocks.concat().concat();
        let mut made = |name: &str, data: &[u32], words: usize| -> Result<Buffer> {
            let n = (data.len() as u64).max(words as u64);
            let buffer = Buffer::new::<u32>(device, name, n, Place::Device)?;
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
            sources: Buffer::new::<SourceRecord>(device, "second.sources", n_sources, Place::Device)?,
            fluxes: Buffer::new::<[f32; 4]>(device, "second.fluxes", n_fluxes, Place::Device)?,
            rim_cells,
            slices: lists.slices(),
        })
    }

    /// First block and number of blocks of each slice of the sources; the first slice has every receiver.
    pub fn slices_of(&self, receivers: Receivers) -> &[(u32, u32)] {
        &self.slices[receivers as usize]
    }
}

/// From this many facets on the tree is the faster (docs/measured.md).
const TREE_PAYS: u64 = 2048;

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
    of_surfaces.chain(scene.clouds.iter().map(|c| scene.n_cloud_facets(c) as u32)).collect()
}

/// Whether a region's lobe is to be computed.
pub fn is_glossy(scene: &Scene, i_region: usize) -> bool {
    scene.lighting.bases > 1 && scene.region_material(i_region).is_glossy()
}

impl Lists {
    fn of(scene: &Scene, block_len: u32, tree: bool, slice: u32) -> Lists {
        let sizes = region_sizes(scene);
        let firsts: Vec<u32> = sizes.iter().scan(0, |first, n| Some(std::mem::replace(first, *first + n))).collect();
        let costs: Vec<u32> = (0..sizes.len()).map(|i| cost(scene, i, tree).min(slice)).collect();
        let mut lists = Lists::default();
        let runs: Vec<Vec<(u32, u32)>> =
            sizes.iter().zip(&costs).map(|(n, cost)| lists.push_sources(*n, slice / cost, tree)).collect();
        for (i, from) in pairings(&scene.surfaces, scene.clouds.len()).iter().enumerate() {
            let first_pairing = lists.pairings.len();
            for pairing in from {
                lists.push_pairings(pairing, &runs[pairing.i_emitter]);
            }
            let slices = slices(&lists.pairings[first_pairing..], first_pairing as u32, &costs, slice);
            for (i_slice, (i_pairing, n_pairings)) in slices.into_iter().enumerate() {
                let blocks = &mut lists.blocks[usize::from(is_glossy(scene, i))];
                blocks.resize(blocks.len().max(i_slice + 1), vec![]);
                for first in (0..sizes[i]).step_by(block_len as usize) {
                    let n_facets = block_len.min(sizes[i] - first);
                    let i_first = firsts[i] + first;
                    let block = BlockRecord { i_first, n_facets, i_pairing, n_pairings };
                    blocks[i_slice].push(block);
                }
            }
        }
        lists
    }

    /// Sources of a region's `n` facets, run by run: the first, and how many there are.
    fn push_sources(&mut self, n: u32, most: u32, tree: bool) -> Vec<(u32, u32)> {
        let (run, push): (u32, fn(&mut Tree, u32) -> u32) = match tree {
            true if most > SLICE => (LONG_TREE_RUN, Tree::push),
            true => (TREE_RUN, Tree::push),
            false => (most, Tree::push_flat),
        };
        let mut push_run = |first: u32| {
            let root = push(&mut self.tree, run.min(n - first));
            (root, self.tree.n_nodes.len() as u32 - root)
        };
        (0..n).step_by(run as usize).map(&mut push_run).collect()
    }

    fn push_pairings(&mut self, pairing: &Pairing, runs: &[(u32, u32)]) {
        let i_occluder = self.occluders.len() as u32;
        self.occluders.extend(pairing.occluders.iter().map(|i| *i as u32));
        let n_occluders = pairing.occluders.len() as u32;
        let i_region = pairing.i_emitter as u32;
        let of = |&(i_source, n_sources)| PairingRecord { i_region, i_occluder, n_occluders, i_source, n_sources };
        self.pairings.extend(runs.iter().map(of));
    }

    fn slices(&self) -> [Vec<(u32, u32)>; 2] {
        let mut first = 0;
        let mut next = |n: usize| {
            first += n as u32;
            (first - n as u32, n as u32)
        };
        let [diffuse, glossy] = &self.blocks;
        let [diffuse, glossy] = [diffuse, glossy].map(|slices| slices.iter().map(|b| next(b.len())).collect());
        [diffuse, glossy]
    }
}

/// Of one source of a region.
fn cost(scene: &Scene, i_region: usize, tree: bool) -> u32 {
    // Finer pairs have more cells.
    let finer = (0.5 / scene.lighting.pairs.size).max(1.0).powi(2);
    let of_facet = match i_region < scene.surfaces.len() {
        true if tree => TREE_COST,
        true => SURFACE_COST,
        false => return 1,
    };
    (f64::from(of_facet) * finer).min(f64::from(SLICE)) as u32
}

/// First and number of pairings of each slice of a cost of at most `most`, or of one pairing that costs more; at least one slice.
fn slices(pairings: &[PairingRecord], first: u32, costs: &[u32], most: u32) -> Vec<(u32, u32)> {
    let mut slices = Vec::new();
    let [mut i_first, mut n, mut spent] = [first, 0, 0];
    for pairing in pairings {
        let cost = pairing.n_sources * costs[pairing.i_region as usize];
        if n > 0 && spent + cost > most {
            slices.push((i_first, n));
            [i_first, n, spent] = [i_first + n, 0, 0];
        }
        [n, spent] = [n + 1, spent + cost];
    }
    slices.push((i_first, n));
    slices
}
