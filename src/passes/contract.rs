//! contract: sums irradiance and both reflections of every facet from the light tensors.
//!
//! In: T1, T2, the lights' energies, and the regions' materials as coefficients of the basis. Out:
//! I_d, I_i, L1, L2 in `lit`. Law: L1 = Σ_l E_l Σ_b' c_b' T1, L2 = Σ_l E_l Σ_b' c_b' Σ_columns C
//! T2. Source: C (13)–(16), model.md §7, passes.md. Error: (columns + lights + bases)
//! roundings of the sums of magnitudes; with another kind of sum, six roundings and the bound of
//! that kind.

use crate::error::Result;
use crate::gpu::{Compiler, Device, Kernel, Recorder};
use crate::layout::record;
use crate::layout::sums::SumMacros;

/// Rows of T2 that lie side by side; the number of rows is a multiple of it.
pub const TILE: u32 = 64;

record! {
    /// Push constants of `contract.comp`.
    pub struct Push {
        /// Number of facets.
        n_facets: u32,
        /// Number of lights.
        n_lights: u32,
        /// Rows of T1 and T2.
        n_rows: u32,
        /// Columns of T2.
        n_columns: u32,
    }
}

bindings! {
    /// The buffers of the pass.
    pub struct ContractBuffers {
        /// `FacetRecord` by facet.
        facets,
        /// `LightRecord` by light.
        lights,
        /// `RegionRecord` by region.
        regions,
        /// `[f32; 4]` by column: coefficients of the materials.
        coefficients,
        /// `f32` by light and row.
        t1,
        /// `f32` by light, row / TILE, column and row % TILE.
        t2,
        /// `[u32; 2]`: by region the first span and their number, then the spans: first column and
        /// number of columns that can light the region. Other columns are not read.
        spans,
        /// Output, `LitRecord` by facet.
        lit,
    }
}

/// The pipeline of the pass.
pub struct Contract {
    kernel: Kernel,
}

impl Contract {
    /// Creates the pipeline for `n_bases` basis functions, whose sums are formed as `sums` says.
    ///
    /// # Errors
    /// Fails if the shader does not compile or the pipeline cannot be created.
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

    /// Writes the light of every facet.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &ContractBuffers<'_>,
        push: &Push,
    ) -> Result<()> {
        rec.dispatch(&self.kernel, &buffers.by_binding(), push, push.n_facets)
    }
}
