//! The constant inputs of the second reflection's gather: which regions light which, made once a
//! scene.

use super::features::{gathers_from_tree, has_glossy, is_glossy, region_sizes};
use crate::gpu::Device;
use crate::layout::facet::lobe_width;
use crate::layout::second::{BlockRecord, PairingRecord};
use crate::model::pairings::{Pairing, pairings};
use crate::model::scene::Scene;
use crate::model::tree::Tree;
use crate::passes::second::{GatherVariant, IterationBudget};

/// The lists of a gather.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct GatherLists {
    /// Blocks of receivers without a lobe.
    pub diffuse: Vec<BlockRecord>,
    /// Blocks of receivers with a lobe.
    pub glossy: Vec<BlockRecord>,
    pub pairings: Vec<PairingRecord>,
    /// Surfaces that may lie between the regions of a pairing.
    pub occluders: Vec<u32>,
    /// The sources; without clusters if every pair is gathered.
    pub tree: Tree,
}

impl GatherLists {
    /// Returns the lists of `scene` with at most `block_len` receivers a block.
    pub fn new(scene: &Scene, block_len: u32, has_tree: bool) -> GatherLists {
        let sizes = region_sizes(scene);
        let firsts: Vec<u32> =
            sizes.iter().scan(0, |first, n| Some(std::mem::replace(first, *first + n))).collect();
        let tree_of = if has_tree { Tree::push } else { Tree::push_flat };
        let mut lists = GatherLists::default();
        let roots: Vec<u32> = sizes.iter().map(|n| tree_of(&mut lists.tree, *n)).collect();
        let ends = roots.iter().skip(1).copied().chain([lists.tree.n_nodes.len() as u32]);
        let sources: Vec<(u32, u32)> =
            roots.iter().zip(ends).map(|(root, end)| (*root, end - root)).collect();
        for (i, from) in region_pairings(scene).iter().enumerate() {
            let i_pairing = lists.pairings.len() as u32;
            for pairing in from.iter().filter(|p| sizes[p.i_emitter] > 0) {
                lists.push_pairing(pairing, sources[pairing.i_emitter]);
            }
            let n_pairings = lists.pairings.len() as u32 - i_pairing;
            let blocks = if is_glossy(scene, i) { &mut lists.glossy } else { &mut lists.diffuse };
            for first in (0..sizes[i]).step_by(block_len as usize) {
                let (i_first, n_facets) = (firsts[i] + first, block_len.min(sizes[i] - first));
                blocks.push(BlockRecord { i_first, n_facets, i_pairing, n_pairings });
            }
        }
        lists.diffuse = scattered(&lists.diffuse);
        lists.glossy = scattered(&lists.glossy);
        lists
    }

    fn push_pairing(&mut self, pairing: &Pairing, (i_source, n_sources): (u32, u32)) {
        let i_occluder = self.occluders.len() as u32;
        self.occluders.extend(pairing.occluders.iter().map(|i| *i as u32));
        self.pairings.push(PairingRecord {
            i_region: pairing.i_emitter as u32,
            i_occluder,
            n_occluders: pairing.occluders.len() as u32,
            i_source,
            n_sources,
        });
    }
}

/// Returns, for each region, the regions that light it.
pub(super) fn region_pairings(scene: &Scene) -> Vec<Vec<Pairing>> {
    pairings(&scene.surfaces, scene.terrains.len() + scene.clouds.len())
}

/// Returns the number of sources: facets, and where there is a tree its clusters.
pub(super) fn n_sources(scene: &Scene) -> u64 {
    match gathers_from_tree(scene) {
        true => region_sizes(scene).iter().map(|n| Tree::n_nodes_over((*n).into())).sum(),
        false => scene.n_facets(),
    }
}

/// Reorders blocks by their index with its bits reversed, so that every contiguous range is a fair
/// sample of all. A device that deals out ranges (llvmpipe deals one a thread) would otherwise wait
/// for the thread with the crowded surfaces.
fn scattered(blocks: &[BlockRecord]) -> Vec<BlockRecord> {
    let mut order: Vec<u32> = (0..blocks.len() as u32).collect();
    order.sort_by_key(|i| i.reverse_bits());
    order.into_iter().map(|i| blocks[i as usize]).collect()
}

/// Iterations that the loops of an invocation may take together in one dispatch on any device; a
/// watchdog may end a dispatch that takes longer. Some tens of milliseconds at 10⁸ iterations a
/// second.
const MAX_ITERATIONS: u32 = 1 << 22;
/// Iterations below the device's limit that stay unused: room for the loops of a kernel that are
/// not counted, of at most some hundred iterations.
const SPARE_ITERATIONS: u32 = 535;
/// The most lights that a gather keeps in registers.
const MAX_KEPT_LIGHTS: usize = 4;
/// Facets that a receiver collects before it visits their cells, unless a facet may have thousands.
const COLLECTED: u32 = 8;
/// The same on wide devices, where they take shared memory: 1 KiB a workgroup of 64.
const COLLECTED_WIDE: u32 = 4;
/// The width below which a lobe may make thousands of cells of a facet.
const NARROW: f64 = 0.03;

/// Returns the variant of the scene's gather.
pub(super) fn gather_variant(scene: &Scene, device: &Device, has_tree: bool) -> GatherVariant {
    GatherVariant {
        has_clouds: scene.n_particles() > 0,
        has_tree,
        is_diffuse: (0..scene.n_regions()).any(|i| !is_glossy(scene, i)),
        is_glossy: has_glossy(scene),
        is_wide: is_wide(device),
        budget: iteration_budget(scene, device),
    }
}

/// Returns how a gather divides the iterations of its loops.
fn iteration_budget(scene: &Scene, device: &Device) -> IterationBudget {
    let limits = device.limits();
    let most = limits.max_loop_iterations.saturating_sub(SPARE_ITERATIONS).min(MAX_ITERATIONS);
    let from = region_pairings(scene);
    let n_occluders = from.iter().flatten().map(|p| p.occluders.len()).max().unwrap_or(0);
    let n_lights = scene.lights.len();
    let march = if scene.n_particles() > 0 { scene.lighting.pairs.steps } else { 0 };
    // The longest cell: the loops counted in iterations.glsl, all occluders, and all surfaces
    // before every light.
    let of_cell =
        16 + 5 * n_lights + n_occluders + n_lights * scene.surfaces.len() + march as usize;
    let aside = match is_narrow(scene) {
        true => 1,
        false if is_wide(device) => COLLECTED_WIDE,
        false => COLLECTED,
    };
    // When no cell is subdivided any more, three cells of each level and the other collected facets
    // remain.
    let left = (aside + 3 * scene.lighting.pairs.levels + 1) * of_cell.min(most as usize) as u32;
    let quarter = most.saturating_sub(left).max(most / 2);
    IterationBudget {
        quarter,
        batch: quarter / 2,
        aside,
        kept: match n_lights {
            1..=MAX_KEPT_LIGHTS if !is_wide(device) => n_lights as u32,
            _ => 0,
        },
    }
}

/// Returns whether registers cost a device more than loads: it runs fewer subgroups at once, the
/// more registers an invocation has.
fn is_wide(device: &Device) -> bool {
    device.info().kind != "cpu"
}

/// Returns whether some lobe is so narrow that a facet may have thousands of cells.
fn is_narrow(scene: &Scene) -> bool {
    let narrowest = |i: usize| f64::from(lobe_width(scene.region_material(i).exponents()[1]));
    (0..scene.n_regions()).any(|i| is_glossy(scene, i) && narrowest(i) < NARROW)
}

/// Returns the most dispatches of a gather of `n_sources`. Dispatches without unfinished receivers
/// have no workgroups. A source takes about ten iterations as a whole and some hundred by its
/// cells, and a dispatch where lobes are narrow.
pub(super) fn n_rounds(scene: &Scene, device: &Device, n_sources: u64) -> u32 {
    let batch = u64::from(iteration_budget(scene, device).batch);
    let of_sources = n_sources.saturating_mul(128).div_ceil(batch);
    let of_lobes = if is_narrow(scene) { n_sources.min(64) } else { 0 };
    (of_sources + of_lobes).min(1 << 16) as u32 + 1
}
