//! Facets and what they receive and send.

use crate::layout::record;

record! {
    /// A lighting facet (model.md §5), position relative to the lighting origin.
    pub struct FacetRecord {
        position: [f32; 3],
        area: f32,
        normal: [f32; 3],
        i_region: u32,
    }
}

record! {
    /// I_d (irradiance) and L1 (radiance), linear RGB. The fourth components are unused and zero.
    pub struct LitRecord {
        irradiance: [f32; 4],
        radiance: [f32; 4],
    }
}
