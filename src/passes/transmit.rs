//! transmit: computes how much of each light arrives at each facet.
//!
//! In: facets, lights, regions (rectangles), density grid, what ground hides. Out: transmittance by
//! facet and light, and on request that of the clouds alone. Law: [nothing hides the light]
//! e^{−(1−g)τ}, τ by the midpoint rule along the grid. Source: model.md §8, passes.md. Error:
//! against the same march in f64, (1−g)τ times the samples' relative rounding, plus the sum's
//! ("sums") and 3 + 2|x| ulp of exp; against the closed form, the grid's. A ray within a few ulp of
//! an edge may count as hidden or not.

use crate::error::Result;
use crate::gpu::{Compiler, Device, Kernel, Recorder};
use crate::layout::frame::GridRecord;
use crate::layout::record;
use crate::layout::sums::SumMacros;

record! {
    /// Push constants of `transmit.comp`.
    pub struct Push {
        /// The density grid.
        grid: GridRecord,
        /// Number of facets.
        n_facets: u32,
        /// Number of lights.
        n_lights: u32,
        /// Number of surfaces.
        n_surfaces: u32,
        /// Length of a step of the march.
        step_length: f32,
        /// Share 1 − g of extinction that counts.
        backward: f32,
        /// The most steps of a march.
        max_steps: u32,
        /// The first so many facets receive the sky through the clouds.
        n_under_sky: u32,
        /// Facet of the ground's first point.
        i_first_ground: u32,
        /// Number of the ground's points.
        n_ground: u32,
    }
}

/// The most steps of a march. The model refuses a scene whose marches need more; here the bound
/// keeps a wrong input from becoming an endless loop.
pub const MAX_STEPS: u32 = 4096;

bindings! {
    /// The buffers of the pass.
    pub struct TransmitBuffers {
        /// `FacetRecord` by facet.
        facets,
        /// `LightRecord` by light.
        lights,
        /// `RegionRecord` by region, surfaces first.
        regions,
        /// `f32` by cell: extinction per length.
        density,
        /// Output, `f32` by facet and light.
        transmittance,
        /// Output, `f32` by facet and light: e^{−(1−g)τ} whether or not a surface hides the light;
        /// empty unless requested.
        through,
        /// `u32` by point of the ground and light: 1 where ground hides the light; empty where it
        /// hides none.
        hidden,
    }
}

/// The march toward the lights.
#[derive(Debug, Clone, Copy)]
pub struct MarchParams {
    /// Number of facets.
    pub n_facets: u32,
    /// Number of lights.
    pub n_lights: u32,
    /// Number of surfaces that may hide a light.
    pub n_surfaces: u32,
    /// Step in cells.
    pub step_cells: f64,
    /// Forward-scattering share g; 1 marches nothing.
    pub forward: f64,
    /// The first so many facets receive the sky through the clouds.
    pub n_under_sky: u32,
    /// Facet of the ground's first point.
    pub i_first_ground: u32,
    /// Number of the ground's points.
    pub n_ground: u32,
}

/// Optical depth of a way that a surface bars, and to a light without energy.
pub const BARRED: f32 = 1e30;

/// Result of the pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arriving {
    /// V.
    Share,
    /// V, and beside it what the clouds alone let through.
    ShareAndClouds,
    /// τ, where clouds are a medium; [`BARRED`] where V is 0.
    Depth,
}

/// The pipeline of the pass.
pub struct Transmit {
    kernel: Kernel,
}

impl Transmit {
    /// Creates the pipeline; `sums` says how τ is summed, `has_relief` whether ground may hide
    /// lights.
    ///
    /// # Errors
    /// Fails if the shader does not compile or the pipeline cannot be created.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        arriving: Arriving,
        sums: &SumMacros,
        has_relief: bool,
    ) -> Result<Transmit> {
        let is_apart = arriving == Arriving::ShareAndClouds;
        let constants = [(0, u32::from(is_apart)), (1, u32::from(has_relief))];
        let depths = [("DEPTHS", u32::from(arriving == Arriving::Depth))];
        let macros = [sums.list(), &depths].concat();
        let fields = Push::FIELDS;
        let kernel =
            Kernel::with_macros(device, compiler, "transmit", fields, &constants, &macros)?;
        Ok(Transmit { kernel })
    }

    /// Writes the transmittance of every facet and light.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &TransmitBuffers<'_>,
        grid: &GridRecord,
        march: &MarchParams,
    ) -> Result<()> {
        let MarchParams { n_facets, n_lights, n_surfaces, step_cells, forward, .. } = *march;
        let MarchParams { n_under_sky, i_first_ground, n_ground, .. } = *march;
        let push = Push {
            grid: *grid,
            n_facets,
            n_lights,
            n_surfaces,
            step_length: (step_cells * f64::from(grid.cell)) as f32,
            backward: (1.0 - forward) as f32,
            max_steps: MAX_STEPS,
            n_under_sky,
            i_first_ground,
            n_ground,
        };
        rec.dispatch(&self.kernel, &buffers.by_binding(), &push, n_facets * n_lights)
    }
}
