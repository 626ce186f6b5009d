//! Records of facets, of the regions that they make up, and of their light.

use glam::DVec3;

use crate::layout::record;
use crate::model::material::Brdf;
use crate::model::shade::FacetSlope;
use crate::model::surface::Surface;
use crate::model::terrain::{Terrain, TerrainFacet};

record! {
    /// A lighting facet (model.md §5), position relative to the lighting origin.
    pub struct FacetRecord {
        /// Centre, scene units.
        position: [f32; 3],
        /// Area, scene units squared.
        area: f32,
        /// Unit normal.
        normal: [f32; 3],
        /// Its region.
        i_region: u32,
        /// Factor on its material's K_d.
        color: [f32; 3],
        /// σ of the blobs that it stands for, scene units; 0 on surfaces and ground.
        sigma: f32,
    }
}

impl FacetRecord {
    /// Returns a facet of ground, relative to the ground's origin.
    pub fn terrain(facet: &TerrainFacet, i_region: u32) -> Self {
        FacetRecord {
            position: facet.position.as_vec3().to_array(),
            area: facet.area as f32,
            normal: facet.normal.as_vec3().to_array(),
            i_region,
            color: facet.color.as_vec3().to_array(),
            sigma: 0.0,
        }
    }
}

record! {
    /// The places in the particles' Morton order that one facet stands for.
    pub struct RunRecord {
        /// First place.
        i_first: u32,
        /// Number of places.
        n_particles: u32,
    }
}

record! {
    /// Irradiance of a facet and its radiance toward the camera, linear RGB.
    pub struct LitRecord {
        /// Direct irradiance I_d.
        direct: [f32; 3],
        /// Pairs of this receiver that stayed too wide at the last level.
        n_unresolved: f32,
        /// Indirect irradiance I_i. Of clouds with bounces of diffuse light their colour: what the
        /// cells show by its mean over the channels.
        indirect: [f32; 3],
        /// Bound on the change by those pairs of L2's greatest channel; infinite where no bound is
        /// known: with lost sources or tensors.
        unresolved: f32,
        /// Radiance L1 of the first reflection.
        first: [f32; 3],
        /// Sources not looked at before the loops ended; 0 in a complete result.
        n_lost: f32,
        /// Radiance L2 of the second reflection.
        second: [f32; 3],
        /// Padding.
        unused: f32,
    }
}

record! {
    /// Change of the light inside the blobs of a facet (model.md §18).
    pub struct SlopeRecord {
        /// Relative change of the radiance, 1/length.
        relative: [f32; 3],
        /// Padding.
        unused: u32,
        /// Place of the facet, relative to the lighting origin.
        position: [f32; 3],
        /// Padding.
        unused_too: u32,
    }
}

impl SlopeRecord {
    /// Returns what a device has written.
    pub fn read(&self) -> FacetSlope {
        let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        FacetSlope { relative: vector(self.relative), position: vector(self.position) }
    }
}

/// The kind of a surface's [`RegionRecord`]. The shaders' `REGION_*` have the same values.
pub const REGION_SURFACE: u32 = 0;
/// The kind of a cloud.
pub const REGION_CLOUD: u32 = 1;
/// The kind of a cloud whose facets have colours of their own.
pub const REGION_COLORED: u32 = 2;
/// The kind of ground, whose facets count as discs, as a cloud's do.
pub const REGION_TERRAIN: u32 = 3;

/// `i_lobe` of a region without a lobe.
pub const NO_LOBE: u32 = u32::MAX;

record! {
    /// Facets of one material (C's R_i): a surface, ground, or a cloud.
    pub struct RegionRecord {
        /// K_d, linear RGB.
        kd: [f32; 3],
        /// `REGION_SURFACE`, `REGION_CLOUD`, `REGION_COLORED` or `REGION_TERRAIN`.
        kind: u32,
        /// K_s, linear RGB.
        ks: [f32; 3],
        /// Row of its lobe in the table of lobes, or [`NO_LOBE`].
        i_lobe: u32,
        /// Centre of a surface, or the ground's origin, relative to the lighting origin.
        center: [f32; 3],
        /// Its first facet.
        i_first_facet: u32,
        /// First half axis; of ground its greatest distance from its origin along each axis.
        u: [f32; 3],
        /// Number of its facets.
        n_facets: u32,
        /// Second half axis.
        v: [f32; 3],
        /// Facets along u, or of a row of ground.
        n_u: u32,
        /// Unit normal of a surface.
        normal: [f32; 3],
        /// Facets along v, or rows of ground.
        n_v: u32,
        /// Least half width of its lobe over time, 1/√n_s in radians of γ.
        lobe_width: f32,
        /// Greatest half width of its lobe over time.
        lobe_width_most: f32,
        /// Its first column of the tensors (passes.md "contract").
        i_column: u32,
        /// Its first row of the tensors.
        i_row: u32,
    }
}

impl RegionRecord {
    /// Returns a cloud of `n_facets` facets.
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

    /// Returns the record without K_d and K_s, which an edit of the material changes.
    pub fn geometry(&self) -> Self {
        RegionRecord { kd: [0.0; 3], ks: [0.0; 3], ..*self }
    }

    /// Returns ground; `origin` is the lighting origin.
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

    /// Returns a surface; `origin` is the lighting origin.
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
    /// The bounds of a region's points, for their Morton order.
    pub struct RegionBoundsRecord {
        /// Low corner, relative to the lighting origin.
        low: [f32; 3],
        /// Padding.
        unused: u32,
        /// Cells per unit along each axis; 0 where the region has no extent.
        scale: [f32; 3],
        /// Padding.
        unused_too: u32,
    }
}

/// An extent below this share of the greatest coordinate counts as none: it is four roundings of
/// an f32 there.
const LEAST_EXTENT: f64 = 1.0 / 4_194_304.0;

impl RegionBoundsRecord {
    /// Returns the record of bounds `low` and `high` in the scene; `origin` is the lighting origin.
    pub fn new((low, high): (DVec3, DVec3), origin: DVec3, bits: KeyBits) -> Self {
        let (low, high) = (low - origin, high - origin);
        let least = LEAST_EXTENT * low.abs().max(high.abs()).max_element();
        let n_cells = f64::from(1u32 << bits.axis);
        let scale =
            (high - low).to_array().map(|e| if e > least { (n_cells / e) as f32 } else { 0.0 });
        // A region whose cells per unit are beyond f32 counts as a point.
        let scale = scale.map(|s| if s.is_finite() { s } else { 0.0 });
        RegionBoundsRecord { low: low.as_vec3().to_array(), unused: 0, scale, unused_too: 0 }
    }
}

/// The parts of a Morton key's 32 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KeyBits {
    /// The highest bits: the region's number.
    pub region: u32,
    /// The bits of each axis below, at most 10.
    pub axis: u32,
}

impl KeyBits {
    /// Gives the regions' numbers the bits they need, and each axis a third of the rest.
    pub fn of(n_regions: u32) -> Self {
        let region = u32::BITS - n_regions.saturating_sub(1).leading_zeros();
        KeyBits { region, axis: ((u32::BITS - region) / 3).min(10) }
    }
}

/// Returns half the width of a lobe of exponent n_s, 1/√n_s in radians of γ.
pub fn lobe_width(ns: f64) -> f32 {
    ns.max(1.0).powf(-0.5) as f32
}
