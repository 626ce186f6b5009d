//! contract: irradiance and both reflections of every facet from the tensors.
//!
//! In: T1, T2, the lights' energies, the regions' materials as coefficients of the basis. Out: I_d, I_i, L1, L2 in `lit`.
//! Law: L1 = Σ_l E_l Σ_b' c_b' T1, L2 = Σ_l E_l Σ_b' c_b' Σ_columns C T2. Source: C (13)–(16), docs/model.md §7, §11.
//! Error: (columns + lights + bases) roundings of the sums of magnitudes.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::record;

record! {
    pub struct Push { n_facets: u32, n_lights: u32, n_bases: u32, n_rows: u32, n_columns: u32 }
}

pub struct Contract {
    kernel: Kernel,
}

impl Contract {
    pub fn new(device: &Device, compiler: &Compiler) -> Result<Contract> {
        Ok(Contract { kernel: Kernel::new(device, compiler, "contract", Push::FIELDS, &[])? })
    }

    /// `facets`: FacetRecord; `lights`: LightRecord; `regions`: RegionRecord; `coefficients`: [f32; 4] by column; `t1`: f32
    /// [light][row]; `t2`: f32 [light][column][row]; `lit`: LitRecord. Without T2 `n_columns` is 0.
    pub fn record(&self, rec: &mut Recorder<'_>, buffers: [&Buffer; 7], push: &Push) -> Result<()> {
        rec.dispatch(&self.kernel, &buffers, push, push.n_facets)
    }
}
