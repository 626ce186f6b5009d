//! haze: the air between the eye and the facets.
//!
//! In: facets, their light and its changes, the sky. Out: the light as the eye sees it. Law: T L +
//! A, T and A in closed form. Source: model.md §19. Error: 1e-5 of the magnitudes that are added
//! up.

use crate::error::Result;
use crate::gpu::{Compiler, Device, Kernel, Recorder};
use crate::layout::record;

record! {
    /// Push constants of `haze.comp`.
    pub struct Push {
        /// Number of facets.
        n_facets: u32,
    }
}

bindings! {
    /// The buffers of the pass.
    pub struct HazeBuffers {
        /// `FacetRecord` by facet.
        facets,
        /// `LitRecord` by facet.
        lit,
        /// `SlopeRecord` by facet, where the light changes inside of blobs.
        slopes,
        /// `SkyRecord`, one.
        sky,
        /// Output, `LitRecord` by facet: all radiance in `first`.
        hazed,
        /// Output, `SlopeRecord` by facet.
        hazed_slopes,
    }
}

/// The pipeline of the pass.
pub struct HazePass {
    kernel: Kernel,
}

impl HazePass {
    /// Creates the pipeline; with `has_slopes` the light changes inside of blobs.
    ///
    /// # Errors
    /// Fails if the shader does not compile or the pipeline cannot be created.
    pub fn new(device: &Device, compiler: &Compiler, has_slopes: bool) -> Result<HazePass> {
        let constants = [(0, u32::from(has_slopes))];
        let kernel = Kernel::with_macros(device, compiler, "haze", Push::FIELDS, &constants, &[])?;
        Ok(HazePass { kernel })
    }

    /// Writes the light of `n_facets` facets as the eye sees it.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &HazeBuffers<'_>,
        n_facets: u32,
    ) -> Result<()> {
        rec.dispatch(&self.kernel, &buffers.by_binding(), &Push { n_facets }, n_facets)
    }
}
