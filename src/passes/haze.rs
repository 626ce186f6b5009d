//! haze: the air between the eye and the facets, and what a sea mirrors.
//!
//! In: facets, their light and its changes, the sky, what arrives of the sun. Out: the light as the
//! eye sees it. Law: T (L + S) + A, with S of a sea, in closed form. Source: model.md §19. Error:
//! 1e-5 of the magnitudes that are added up; of a sea's glitter more where sun and eye are low.

use crate::error::Result;
use crate::gpu::{Compiler, Device, Kernel, Recorder};
use crate::layout::record;

record! {
    /// Push constants of `haze.comp`.
    pub struct Push {
        /// Number of facets.
        n_facets: u32,
        /// Number of lights.
        n_lights: u32,
        /// Number of the sun among them.
        i_sun: u32,
        /// Number of regions of surfaces and ground.
        n_solids: u32,
        /// Share of the depth that weakens light on its way to them, where depths arrive.
        backward: f32,
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
        /// `f32` by facet and light, as "transmit" writes it; not read without a sea.
        arriving,
        /// `f32` by region: mean square of a sea's slopes, 0 of what is none; empty without a sea.
        seas,
    }
}

/// Variant of the pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HazeVariant {
    /// The light changes inside of blobs.
    pub has_slopes: bool,
    /// Some ground is a sea.
    pub has_sea: bool,
    /// Optical depths arrive, in place of shares.
    pub has_depths: bool,
}

/// The pipeline of the pass.
pub struct HazePass {
    kernel: Kernel,
}

impl HazePass {
    /// Creates the pipeline.
    ///
    /// # Errors
    /// Fails if the shader does not compile or the pipeline cannot be created.
    pub fn new(device: &Device, compiler: &Compiler, variant: HazeVariant) -> Result<HazePass> {
        let HazeVariant { has_slopes, has_sea, has_depths } = variant;
        let constants = [has_slopes, has_sea, has_depths];
        let constants = [0, 1, 2].map(|k| (k, u32::from(constants[k as usize])));
        let kernel = Kernel::with_macros(device, compiler, "haze", Push::FIELDS, &constants, &[])?;
        Ok(HazePass { kernel })
    }

    /// Writes the light of the facets as the eye sees it.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &HazeBuffers<'_>,
        push: &Push,
    ) -> Result<()> {
        rec.dispatch(&self.kernel, &buffers.by_binding(), push, push.n_facets)
    }
}
