//! first: irradiance and first reflection of every facet.
//!
//! In: facets, lights, transmittance, regions (materials). Out: I_d and L1, linear RGB. Law:
//! L1 = K_d/π Σ E V max(0, n·ω), and the sky. Source: C (15), docs/model.md §7, §8, §11. Error: a few ulp a light.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::record;

record! {
    pub struct Push { n_facets: u32, n_lights: u32 }
}

pub struct First {
    kernel: Kernel,
}

impl First {
    pub fn new(device: &Device, compiler: &Compiler) -> Result<First> {
        Ok(First { kernel: Kernel::new(device, compiler, "first", Push::FIELDS, &[])? })
    }

    /// `facets`: FacetRecord; `lights`: LightRecord; `transmittance`: f32; `regions`: RegionRecord; `lit`: LitRecord.
    pub fn record(&self, rec: &mut Recorder<'_>, buffers: [&Buffer; 5], n_facets: u32, n_lights: u32) -> Result<()> {
        rec.dispatch(&self.kernel, &buffers, &Push { n_facets, n_lights }, n_facets)
    }
}
