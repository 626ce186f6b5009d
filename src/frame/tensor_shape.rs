//! The layout of the light tensors T1 and T2 of a scene whose materials are edited
//! (passes.md "contract").

use super::features::{
    Tensors, has_glossy, has_second, is_glossy, is_lit, is_medium, region_sizes,
};
use super::gather_lists::region_pairings;
use crate::gpu::Limits;
use crate::layout::facet::{REGION_CLOUD, REGION_COLORED, REGION_SURFACE, REGION_TERRAIN};
use crate::model::basis::Basis;
use crate::model::cloud::CloudSource;
use crate::model::material::Brdf;
use crate::model::scene::Scene;
use crate::passes::contract::TILE;

/// Returns the basis of a scene; `None` if no lobe is computed.
pub fn basis_of(scene: &Scene) -> Option<Basis> {
    let l = &scene.lighting;
    (has_glossy(scene) && is_lit(scene)).then(|| Basis::new(l.exponents, l.bases, l.sampling))
}

/// Returns whether materials of facets that reflect are edited, so that tensors are of use. Tensors
/// have no colours of ground.
pub fn is_edited(scene: &Scene) -> bool {
    let reflects = is_lit(scene) && !is_medium(scene);
    let is_plain = scene.terrains.iter().all(|t| t.colors.is_empty());
    reflects && is_plain && (0..scene.n_regions()).any(|i| scene.region_material(i).is_edited())
}

/// Returns the region's kind in its record.
pub(super) fn kind_of(scene: &Scene, i_region: usize) -> u32 {
    let Some(i_other) = i_region.checked_sub(scene.surfaces.len()) else { return REGION_SURFACE };
    let Some(i_cloud) = i_other.checked_sub(scene.terrains.len()) else { return REGION_TERRAIN };
    match scene.clouds[i_cloud].source {
        CloudSource::Boxes { .. } | CloudSource::Disc(_) | CloudSource::Animated(_) => REGION_CLOUD,
        CloudSource::Particles(_) => REGION_COLORED,
    }
}

/// The place of a region in the tensors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Block {
    /// First row: for every basis function of a receiver, the facets of the region in order.
    pub i_row: u32,
    /// First column.
    pub i_column: u32,
    /// Columns of the diffuse basis function: 3 if facets have colors of their own.
    pub n_plain: u32,
    /// Columns of the lobe, and basis functions of a receiver besides the diffuse one.
    pub n_vectors: u32,
}

/// The sizes of the tensors: T1 is `[light][row]`, T2 is `[light][row / TILE][column][row % TILE]`,
/// both of numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shape {
    /// The place of each region.
    pub blocks: Vec<Block>,
    /// Number of basis functions.
    pub n_bases: u32,
    /// Number of lights.
    pub n_lights: u32,
    /// Number of rows, a multiple of TILE: the last ones may belong to no facet.
    pub n_rows: u64,
    /// Number of columns.
    pub n_columns: u32,
    /// Without a second reflection T2 is empty.
    pub has_second: bool,
}

impl Shape {
    /// Returns the shape of `scene`; `n_bases` is the size of its basis, 1 without one.
    pub fn new(scene: &Scene, n_bases: u32) -> Shape {
        let (mut n_rows, mut n_columns) = (0u64, 0u32);
        let mut blocks = Vec::new();
        for (i, n_facets) in region_sizes(scene).into_iter().enumerate() {
            let n_plain = if kind_of(scene, i) == REGION_COLORED { 3 } else { 1 };
            let n_vectors = if is_glossy(scene, i) { n_bases - 1 } else { 0 };
            blocks.push(Block { i_row: n_rows as u32, i_column: n_columns, n_plain, n_vectors });
            n_rows += u64::from(n_facets) * u64::from(1 + n_vectors);
            n_columns += n_plain + n_vectors;
        }
        Shape {
            blocks,
            n_bases,
            n_lights: scene.lights.len() as u32,
            n_rows: n_rows.next_multiple_of(u64::from(TILE)),
            n_columns,
            has_second: has_second(scene),
        }
    }

    /// Returns the numbers of T1.
    pub fn n_first(&self) -> u64 {
        u64::from(self.n_lights).saturating_mul(self.n_rows)
    }

    /// Returns the numbers of T2; `None` beyond 64 bits.
    pub fn n_second(&self) -> Option<u64> {
        let n_columns = if self.has_second { u64::from(self.n_columns) } else { 0 };
        self.n_first().checked_mul(n_columns)
    }

    /// Returns whether T1 and T2 fit into `free` bytes, and each into one binding.
    pub fn fits(&self, limits: &Limits, free: u64) -> Tensors {
        let bytes_of = |n: u64| n.max(1).saturating_mul(4);
        let (first, second) =
            (bytes_of(self.n_first()), self.n_second().map_or(u64::MAX, bytes_of));
        // Both are written as buffers and read float by float.
        let binding = limits.max_storage_buffer_bytes.min(limits.max_texel_buffer_bytes(4));
        let most = free.saturating_sub(first).min(binding);
        match second <= most && first <= binding {
            true => Tensors::Kept,
            false => Tensors::TooLarge { bytes: second, most },
        }
    }

    /// Returns C by column: K_d of the region (channel by channel if there are three), then K_s
    /// c_b(n_s). `brdfs` are by region; `coefficients` returns c_b of each.
    pub fn coefficients(
        &self,
        brdfs: &[Brdf],
        coefficients: impl Fn(usize) -> Vec<f64>,
    ) -> Vec<[f32; 4]> {
        let mut columns = Vec::with_capacity(self.n_columns as usize);
        for (i, (block, brdf)) in self.blocks.iter().zip(brdfs).enumerate() {
            let kd = brdf.kd.as_vec3();
            match block.n_plain {
                1 => columns.push(kd),
                _ => columns.extend([0, 1, 2].map(|c| kd * glam::Vec3::AXES[c])),
            }
            if block.n_vectors > 0 {
                columns.extend(coefficients(i).into_iter().map(|c| (brdf.ks * c).as_vec3()));
            }
        }
        columns.into_iter().map(|c| c.extend(0.0).to_array()).collect()
    }

    /// Returns by region (first, number) of its spans, then the spans: (first, number) of the
    /// columns of regions whose light can reach it. Other columns of T2 are not written.
    pub fn spans(&self, scene: &Scene) -> Vec<[u32; 2]> {
        let sizes = region_sizes(scene);
        let mut spans = vec![[0, 0]; sizes.len()];
        if !self.has_second {
            return spans;
        }
        for (i, from) in region_pairings(scene).iter().enumerate() {
            let first = spans.len();
            // Nothing is written for an emitter without facets.
            let emitters = from.iter().map(|p| p.i_emitter).filter(|i| sizes[*i] > 0);
            for block in emitters.map(|i| self.blocks[i]) {
                let n = block.n_plain + block.n_vectors;
                match spans[first..].last_mut() {
                    // Adjacent columns make one span.
                    Some(last) if last[0] + last[1] == block.i_column => last[1] += n,
                    _ => spans.push([block.i_column, n]),
                }
            }
            spans[i] = [first as u32, (spans.len() - first) as u32];
        }
        spans
    }
}
