//! transmit: how much of each light arrives at each facet.
//!
//! In: facets, lights, regions (rectangles), density grid. Out: transmittance [facet][light], and
//! where it is asked for what clouds alone let through. Law: [nothing hides the way] e^{−(1−g)τ}, τ
//! by the midpoint rule along the grid. Source: docs/model.md §8, §11. Error: against the same
//! march in f64, (1−g)τ times the samples' relative rounding plus the sum's ("sums") and 3 + 2|x|
//! ulp of exp; against the closed form, the grid's. What passes an edge by less than a few ulp may
//! be hidden or not.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::frame::GridRecord;
use crate::layout::record;
use crate::layout::sums::SumMacros;

record! {
    pub struct Push {
        grid: GridRecord,
        n_facets: u32,
        n_lights: u32,
        n_surfaces: u32,
        step_length: f32,
        backward: f32,
        max_steps: u32,
    }
}

/// Most steps of one march. The model refuses a scene whose marches need more; here the bound keeps
/// a wrong input from becoming an endless loop.
pub const MAX_STEPS: u32 = 4096;

pub struct Transmit {
    kernel: Kernel,
}

impl Transmit {
    /// `apart`: what the clouds let through is written by itself, too. `sums`: how τ is summed.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        apart: bool,
        sums: &SumMacros,
    ) -> Result<Transmit> {
        let constants = [(0, u32::from(apart))];
        let fields = Push::FIELDS;
        Ok(Transmit {
            kernel: Kernel::with_macros(
                device,
                compiler,
                "transmit",
                fields,
                &constants,
                sums.list(),
            )?,
        })
    }

    /// `facets`: FacetRecord; `lights`: LightRecord; `regions`: RegionRecord, the surfaces' first;
    /// `density`: f32; `transmittance`: f32; `through`: f32, e^{−(1−g)τ} whether or not a surface
    /// is in the way, empty where it was not asked for. `step_cells` is the step in cells,
    /// `forward` is g: where it is 1, nothing is marched.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 6],
        grid: &GridRecord,
        [n_facets, n_lights, n_surfaces]: [u32; 3],
        step_cells: f64,
        forward: f64,
    ) -> Result<()> {
        let step_length = (step_cells * f64::from(grid.cell)) as f32;
        let backward = (1.0 - forward) as f32;
        let push = Push {
            grid: *grid,
            n_facets,
            n_lights,
            n_surfaces,
            step_length,
            backward,
            max_steps: MAX_STEPS,
        };
        rec.dispatch(&self.kernel, &buffers, &push, n_facets * n_lights)
    }
}
