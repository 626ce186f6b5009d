//! Facets, the regions they make up, and what they receive and send.

use glam::DVec3;

use crate::layout::record;
use crate::model::material::Brdf;
use crate::model::surface::Surface;
use crate::model::terrain::{Terrain, TerrainFacet};

record! {
    /// A lighting facet (model.md §5), position relative to the lighting origin.
    pub struct FacetRecord {
        position: [f32; 3],
        area: f32,
        normal: [f32; 3],
        i_region: u32,
        /// A factor on its material's K_d.
        color: [f32; 3],
        unused: u32,
    }
}

impl FacetRecord {
    /// Of ground, relative to the ground's origin.
    pub fn terrain(facet: &TerrainFacet, i_region: u32) -> Self {
        FacetRecord {
            position: facet.position.as_vec3().to_array(),
            area: facet.area as f32,
            normal: facet.normal.as_vec3().to_array(),
            i_region,
            color: [1.0; 3],
            unused: 0,
        }
    }
}

record! {
    /// Places in the particles' Morton order that one facet stands for.
    pub struct RunRecord { i_first: u32, n_particles: u32 }
}

record! {
    /// What a facet receives and sends toward the camera, linear RGB.
    pub struct LitRecord {
        /// I_d.
        direct: [f32; 3],
        /// Pairs of this receiver that stayed wider than asked for at the last level.
        n_unresolved: f32,
        /// I_i.
        indirect: [f32; 3],
        /// Bound on what those pairs may change of L2's greatest channel; infinite where there is
        /// none: light lost, tensors.
        unresolved: f32,
        first: [f32; 3],
        /// Sources that the driver's loops ended before; 0 in a result that can be trusted.
        n_lost: f32,
        second: [f32; 3],
        unused: f32,
    }
}

/// Kinds of [`RegionRecord`]; the shaders' `REGION_*`.
pub const REGION_SURFACE: u32 = 0;
pub const REGION_CLOUD: u32 = 1;
/// A cloud whose facets have colours of their own.
pub const REGION_COLORED: u32 = 2;
/// Ground, whose facets are to the light what a cloud's are: discs.
pub const REGION_TERRAIN: u32 = 3;

/// `i_lobe` of a region without a lobe.
pub const NO_LOBE: u32 = u32::MAX;

record! {
    /// Facets of one material (C's R_i): a surface, with its rectangle, ground, or a cloud.
    pub struct RegionRecord {
        kd: [f32; 3],
        kind: u32,
        ks: [f32; 3],
        /// Row of its lobe in the table of lobes.
        i_lobe: u32,
        /// Of a surface, or the ground's origin, relative to the lighting origin.
        center: [f32; 3],
        i_first_facet: u32,
        /// Half axes; of ground how far it reaches from its origin along each axis.
        u: [f32; 3],
        n_facets: u32,
        v: [f32; 3],
        /// Facets along u, or of a row of ground.
        n_u: u32,
        normal: [f32; 3],
        /// Facets along v, or rows of ground.
        n_v: u32,
        /// 1/√n_s: half the width of its lobe in radians of γ, where it is narrowest over time.
        lobe_width: f32,
        /// Where it is widest.
        lobe_width_most: f32,
        /// Its first column of the tensors, and first row (docs/model.md §11 "contract").
        i_column: u32,
        i_row: u32,
    }
}

impl RegionRecord {
    /// A cloud of `n_facets` facets.
    pub fn cloud(brdf: &Brdf, i_lobe: u32, i_first_facet: u32, n_facets: u32) -> Self {
        RegionRecord {
            kd: brdf.kd.as_vec3().to_array(),
            kind: REGION_CLOUD,
            ks: brdf.ks.as_vec3().to_array(),
            i_lobe,
            i_first_facet,
            n_facets,
            lobe_width: lobe_width(brdf.ns),
            lobe_width_most: lobe_width(brdf.ns),
            ..RegionRecord::default()
        }
    }

    /// The record without what a material's edit changes.
    pub fn geometry(&self) -> Self {
        RegionRecord { kd: [0.0; 3], ks: [0.0; 3], ..*self }
    }

    /// Ground; `origin` is the lighting origin.
    pub fn terrain(
        terrain: &Terrain,
        origin: DVec3,
        brdf: &Brdf,
        i_lobe: u32,
        i_first_facet: u32,
    ) -> Self {
        let (low, high) = terrain.extent();
        RegionRecord {
            kind: REGION_TERRAIN,
            center: (terrain.origin - origin).as_vec3().to_array(),
            u: low.abs().max(high.abs()).as_vec3().to_array(),
            n_u: terrain.n[0],
            n_v: terrain.n[1],
            ..RegionRecord::cloud(brdf, i_lobe, i_first_facet, terrain.n_facets() as u32)
        }
    }

    /// A surface; `origin` is the lighting origin.
    pub fn surface(
        surface: &Surface,
        origin: DVec3,
        brdf: &Brdf,
        i_lobe: u32,
        i_first_facet: u32,
    ) -> Self {
        RegionRecord {
            kind: REGION_SURFACE,
            center: (surface.center - origin).as_vec3().to_array(),
            u: surface.u.as_vec3().to_array(),
            v: surface.v.as_vec3().to_array(),
            n_u: surface.subdivide[0],
            n_v: surface.subdivide[1],
            normal: surface.normal().as_vec3().to_array(),
            ..RegionRecord::cloud(brdf, i_lobe, i_first_facet, surface.n_facets() as u32)
        }
    }
}

record! {
    /// Where a region's points lie, for their Morton order.
    pub struct RegionBoundsRecord {
        /// Low corner, relative to the lighting origin.
        low: [f32; 3],
        unused: u32,
        /// Cells per unit along each axis; 0 where the region has no extent.
        scale: [f32; 3],
        unused_too: u32,
    }
}

/// An extent below this share of the greatest coordinate is four roundings of an f32 there: no
/// extent.
const LEAST_EXTENT: f64 = 1.0 / 4_194_304.0;

impl RegionBoundsRecord {
    /// `low` and `high` in the scene; `origin` is the lighting origin.
    pub fn new((low, high): (DVec3, DVec3), origin: DVec3, bits: KeyBits) -> Self {
        let (low, high) = (low - origin, high - origin);
        let least = LEAST_EXTENT * low.abs().max(high.abs()).max_element();
        let n_cells = f64::from(1u32 << bits.axis);
        let scale =
            (high - low).to_array().map(|e| if e > least { (n_cells / e) as f32 } else { 0.0 });
        // So small a region that its cells are beyond f32 is a point.
        let scale = scale.map(|s| if s.is_finite() { s } else { 0.0 });
        RegionBoundsRecord { low: low.as_vec3().to_array(), unused: 0, scale, unused_too: 0 }
    }
}

/// How a Morton key's 32 bits are shared out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KeyBits {
    /// Above: the region's number.
    pub region: u32,
    /// Below: this many of each axis, of 10 at most.
    pub axis: u32,
}

impl KeyBits {
    /// As many as number the regions; the rest by thirds.
    pub fn of(n_regions: u32) -> Self {
        let region = u32::BITS - n_regions.saturating_sub(1).leading_zeros();
        KeyBits { region, axis: ((u32::BITS - region) / 3).min(10) }
    }
}

/// 1/√n_s: half the width of a lobe in radians of γ.
pub fn lobe_width(ns: f64) -> f32 {
    ns.max(1.0).powf(-0.5) as f32
}
