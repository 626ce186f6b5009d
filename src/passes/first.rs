//! first: computes the direct irradiance and the first reflection of every facet.
//!
//! In: facets, lights, transmittance, regions (materials). Out: I_d and L1, linear RGB. Law: L1 =
//! K_d/π Σ E V max(0, n·ω), and the sky. Source: C (15), model.md §7, §8, passes.md.
//! Error: a few ulp a light.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::record;

record! {
    /// Push constants of `first.comp`.
    pub struct Push {
        /// Eye, relative to the lighting origin.
        eye: [f32; 3],
        /// Number of facets.
        n_facets: u32,
        /// Number of lights.
        n_lights: u32,
    }
}

bindings! {
    /// The buffers of the pass.
    pub struct FirstBuffers {
        /// `FacetRecord` by facet.
        facets,
        /// `LightRecord` by light.
        lights,
        /// `f32` by facet and light.
        transmittance,
        /// `RegionRecord` by region.
        regions,
        /// `f32`: a row a lobe; for [`FirstTensor`] the vectors of the basis, from row `i_vectors`
        /// on.
        table,
        /// Output, `LitRecord` by facet; [`FirstTensor`] clears it.
        lit,
    }
}

/// The pipeline of the pass where light is gathered at once.
pub struct First {
    kernel: Kernel,
}

impl First {
    /// Creates the pipeline.
    ///
    /// # Errors
    /// Fails if the shader does not compile or the pipeline cannot be created.
    pub fn new(device: &Device, compiler: &Compiler) -> Result<First> {
        Ok(First { kernel: Kernel::new(device, compiler, "first", Push::FIELDS)? })
    }

    /// Writes the light of every facet.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &FirstBuffers<'_>,
        push: &Push,
    ) -> Result<()> {
        rec.dispatch(&self.kernel, &buffers.by_binding(), push, push.n_facets)
    }
}

record! {
    /// Push constants of `first_tensor.comp`.
    pub struct TensorPush {
        /// Eye, relative to the lighting origin.
        eye: [f32; 3],
        /// Number of facets.
        n_facets: u32,
        /// Number of lights.
        n_lights: u32,
        /// Number of basis functions.
        n_bases: u32,
        /// Rows of T1 and T2.
        n_rows: u32,
        /// First row of the basis' vectors in the table.
        i_vectors: u32,
    }
}

/// The pipeline that fills T1: the first reflection by light and basis function, for `contract` to
/// sum (passes.md "contract").
pub struct FirstTensor {
    kernel: Kernel,
}

impl FirstTensor {
    /// Creates the pipeline.
    ///
    /// # Errors
    /// Fails if the shader does not compile or the pipeline cannot be created.
    pub fn new(device: &Device, compiler: &Compiler) -> Result<FirstTensor> {
        let kernel = Kernel::new(device, compiler, "first.tensor", TensorPush::FIELDS)?;
        Ok(FirstTensor { kernel })
    }

    /// Writes `t1`, `f32` by light and row.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &FirstBuffers<'_>,
        t1: &Buffer,
        push: &TensorPush,
    ) -> Result<()> {
        let buffers = [&buffers.by_binding()[..], &[t1]].concat();
        rec.dispatch(&self.kernel, &buffers, push, push.n_facets)
    }
}
