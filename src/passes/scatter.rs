//! scatter: computes the radiance that clouds scatter toward the eye as a medium.
//!
//! In: facets, lights, optical depths, regions (materials of surfaces and ground), media, and with
//! diffusion the diffuse light by cell. Out: fluence of suns and lamps and radiance of clouds, I_d
//! and L1 of surfaces and ground, linear RGB. Law: model.md §18, passes.md "scatter". Error: a few
//! ulp a light, and the depth's relative error times the depth.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::frame::GridRecord;
use crate::layout::record;

record! {
    /// Push constants of `scatter.comp`.
    pub struct Push {
        /// The density grid.
        grid: GridRecord,
        /// Eye, relative to the lighting origin.
        eye: [f32; 3],
        /// Number of facets.
        n_facets: u32,
        /// Number of lights.
        n_lights: u32,
        /// Number of surfaces and grounds: the regions before the clouds.
        n_solids: u32,
        /// Share of the depth that weakens light on its way to surfaces and ground.
        backward: f32,
        /// Number of terms.
        n_terms: u32,
        /// Light of a term over that of the one before.
        term_light: f32,
        /// Optical depth, alike.
        term_depth: f32,
        /// Mean cosines, alike.
        term_phase: f32,
        /// Padding.
        unused: u32,
        /// 1 over ϖ(1 − f) of the mean medium.
        inverse_scattered: [f32; 3],
    }
}

bindings! {
    /// The buffers of the pass.
    pub struct ScatterBuffers {
        /// `FacetRecord` by facet.
        facets,
        /// `LightRecord` by light.
        lights,
        /// `f32` optical depth by facet and light.
        depths,
        /// `RegionRecord` by region.
        regions,
        /// `f32`: a row a lobe.
        table,
        /// Output, `LitRecord` by facet.
        lit,
        /// `MediumRecord` by cloud.
        media,
        /// Four `[f32; 4]` by cell: φ and F along each axis, and beside φ the mean U of suns and
        /// lamps; without diffusion not read.
        field,
        /// Output, `SlopeRecord` by facet of a cloud; without slopes not written.
        slopes,
        /// Four `[f32; 4]` by patch of the grid's box: φ and F; read with diffusion and surfaces or
        /// ground.
        patches,
        /// `[f32; 4]` by cell: radiance toward the eye, and extinction; read with bounces.
        seen,
    }
}

/// The light that the pass computes, besides the buffers.
#[derive(Debug, Clone, Copy)]
pub struct ScatterParams {
    /// Eye, relative to the lighting origin.
    pub eye: [f32; 3],
    /// Number of facets.
    pub n_facets: u32,
    /// Number of lights.
    pub n_lights: u32,
    /// Number of surfaces and grounds.
    pub n_solids: u32,
    /// Share of the depth that weakens light on its way to surfaces and ground.
    pub backward: f64,
    /// Number of terms of the light that is scattered once.
    pub n_terms: u32,
    /// Light, optical depth and mean cosines of a term over those of the one before.
    pub term: [f64; 3],
    /// ϖ(1 − f) of the mean medium.
    pub scattered: [f32; 3],
}

/// Further light of a scene besides that of suns and lamps that is scattered once.
#[derive(Debug, Clone, Copy)]
pub struct ScatterVariant {
    /// Light is scattered further by diffusion.
    pub is_diffuse: bool,
    /// The slopes of diffuse light are wanted.
    pub has_slopes: bool,
    /// Diffuse light reaches surfaces or ground.
    pub has_solids: bool,
    /// Clouds have the light that the cells scatter toward the eye.
    pub has_seen: bool,
}

/// The pipeline of the pass.
pub struct Scatter {
    kernel: Kernel,
    variant: ScatterVariant,
}

impl Scatter {
    /// Creates the pipeline.
    ///
    /// # Errors
    /// Fails if the shader does not compile or the pipeline cannot be created.
    pub fn new(device: &Device, compiler: &Compiler, variant: ScatterVariant) -> Result<Scatter> {
        let macros = [
            ("DIFFUSE", u32::from(variant.is_diffuse)),
            ("SLOPES", u32::from(variant.has_slopes)),
            ("SOLIDS", u32::from(variant.has_solids)),
            ("SEEN", u32::from(variant.has_seen)),
        ];
        let kernel = Kernel::with_macros(device, compiler, "scatter", Push::FIELDS, &[], &macros)?;
        Ok(Scatter { kernel, variant })
    }

    /// Writes the light of every facet.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &ScatterBuffers<'_>,
        grid: &GridRecord,
        of: &ScatterParams,
    ) -> Result<()> {
        let [term_light, term_depth, term_phase] = of.term.map(|v| v as f32);
        let push = Push {
            grid: *grid,
            eye: of.eye,
            n_facets: of.n_facets,
            n_lights: of.n_lights,
            n_solids: of.n_solids,
            backward: of.backward as f32,
            n_terms: of.n_terms,
            term_light,
            term_depth,
            term_phase,
            unused: 0,
            inverse_scattered: of.scattered.map(|a| 1.0 / a.max(f32::MIN_POSITIVE)),
        };
        // The last ones are bound where they are wanted.
        let ScatterVariant { is_diffuse, has_slopes, has_solids, has_seen } = self.variant;
        let is_bound = [is_diffuse, has_slopes, has_solids, has_seen];
        let buffers: [&Buffer; 11] = buffers.by_binding();
        let (always, wanted) = buffers.split_at(7);
        let wanted = wanted.iter().zip(is_bound).filter(|(_, is)| *is).map(|(buffer, _)| *buffer);
        let bound: Vec<&Buffer> = always.iter().copied().chain(wanted).collect();
        rec.dispatch(&self.kernel, &bound, &push, of.n_facets)
    }
}
