//! first: irradiance and first reflection of every facet.
//!
//! In: facets, lights, transmittance, regions (materials). Out: I_d and L1, linear RGB. Law:
//! L1 = K_d/π Σ E V max(0, n·ω), and the sky. Source: C (15), docs/model.md §7, §8, §11. Error: a few ulp a light.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::record;

record! {
    pub struct Push { eye: [f32; 3], n_facets: u32, n_lights: u32 }
}

pub struct First {
    kernel: Kernel,
}

impl First {
    pub fn new(device: &Device, compiler: &Compiler) -> Result<First> {
        Ok(First { kernel: Kernel::new(device, compiler, "first", Push::FIELDS, &[])? })
    }

    /// `facets`: FacetRecord; `lights`: LightRecord; `transmittance`: f32 [facet][light]; `regions`: RegionRecord; `table`:
    /// f32, a lobe a row; `lit`: LitRecord.
    pub fn record(&self, rec: &mut Recorder<'_>, buffers: [&Buffer; 6], push: &Push) -> Result<()> {
        rec.dispatch(&self.kernel, &buffers, push, push.n_facets)
    }
}
