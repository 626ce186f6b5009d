//! contract: irradiance and both reflections of every facet from the tensors.
//!
//! In: T1, T2, the lights' energies, the regions' materials as coefficients of the basis. Out: I_d,
//! I_i, L1, L2 in `lit`. Law: L1 = Σ_l E_l Σ_b' c_b' T1, L2 = Σ_l E_l Σ_b' c_b' Σ_columns C T2.
//! Source: C (13)–(16), docs/model.md §7, §11. Error: (columns + lights + bases) roundings of the
//! sums of magnitudes; formed otherwise, six and those of "sums".

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::record;
use crate::layout::sums::SumMacros;

/// Rows of T2 that lie side by side; the number of rows is a multiple of it.
pub const TILE: u32 = 64;

record! {
    pub struct Push { n_facets: u32, n_lights: u32, n_rows: u32, n_columns: u32 }
}

pub struct Contract {
    kernel: Kernel,
}

impl Contract {
    /// `n_bases`: N_b. `sums`: how they are formed.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        n_bases: u32,
        sums: &SumMacros,
    ) -> Result<Contract> {
        let macros = [&[("N_BASES", n_bases)], sums.list()].concat();
        Ok(Contract {
            kernel: Kernel::with_macros(device, compiler, "contract", Push::FIELDS, &[], &macros)?,
        })
    }

    /// `facets`: FacetRecord; `lights`: LightRecord; `regions`: RegionRecord; `coefficients`: [f32;
    /// 4] by column; `t1`: f32 [light][row]; `t2`: f32 [light][row / TILE][column][row % TILE];
    /// `spans`: [u32; 2], by region (first, number) of its spans, then these, (first, number) of
    /// columns that it can receive light from: other columns are not read; `lit`: LitRecord.
    pub fn record(&self, rec: &mut Recorder<'_>, buffers: [&Buffer; 8], push: &Push) -> Result<()> {
        rec.dispatch(&self.kernel, &buffers, push, push.n_facets)
    }
}
