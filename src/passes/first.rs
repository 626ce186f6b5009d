//! first: irradiance and first reflection of every facet.
//!
//! In: facets, lights, transmittance, regions (materials). Out: I_d and L1, linear RGB. Law: L1 =
//! K_d/π Σ E V max(0, n·ω), and the sky. Source: C (15), docs/model.md §7, §8, §11. Error: a few
//! ulp a light.

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

    /// `facets`: FacetRecord; `lights`: LightRecord; `transmittance`: f32 [facet][light];
    /// `regions`: RegionRecord; `table`: f32, a lobe a row; `lit`: LitRecord.
    pub fn record(&self, rec: &mut Recorder<'_>, buffers: [&Buffer; 6], push: &Push) -> Result<()> {
        rec.dispatch(&self.kernel, &buffers, push, push.n_facets)
    }
}

record! {
    pub struct TensorPush { eye: [f32; 3], n_facets: u32, n_lights: u32, n_bases: u32, n_rows: u32, i_vectors: u32 }
}

/// T1: the first reflection by light and basis, for `contract` to sum (docs/model.md §11
/// "contract").
pub struct FirstTensor {
    kernel: Kernel,
}

impl FirstTensor {
    pub fn new(device: &Device, compiler: &Compiler) -> Result<FirstTensor> {
        Ok(FirstTensor {
            kernel: Kernel::new(device, compiler, "first.tensor", TensorPush::FIELDS, &[])?,
        })
    }

    /// `facets`: FacetRecord; `lights`: LightRecord; `transmittance`: f32 [facet][light];
    /// `regions`: RegionRecord; `table`: f32, the vectors of the basis from row `i_vectors` on;
    /// `t1`: f32 [light][row]; `lit`: LitRecord, cleared.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 7],
        push: &TensorPush,
    ) -> Result<()> {
        rec.dispatch(&self.kernel, &buffers, push, push.n_facets)
    }
}
