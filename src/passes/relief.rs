//! relief: tells which lights ground hides from its own points.
//!
//! In: points, lights, regions, boxes over the cells. Out: 1 by point and light where ground lies
//! between. Law: the way meets a triangle, or dives below one whose corner the point is. Source:
//! model.md §16. Error: a way that passes a triangle's side within 2e-6 of the ground's extent, or
//! of its own distance where that is greater, may count as meeting it.

use crate::error::Result;
use crate::gpu::{Compiler, Device, Kernel, Recorder};
use crate::layout::record;

record! {
    /// Push constants of `relief.comp`.
    pub struct Push {
        /// Number of points.
        n_points: u32,
        /// Number of lights.
        n_lights: u32,
        /// Number of grounds.
        n_grounds: u32,
        /// Region of the first ground.
        i_first_region: u32,
        /// Facet of its first point.
        i_first_ground: u32,
    }
}

bindings! {
    /// The buffers of the pass.
    pub struct ReliefBuffers {
        /// `FacetRecord` by point of all grounds, relative to their origins.
        ground,
        /// `LightRecord` by light.
        lights,
        /// `RegionRecord` by region.
        regions,
        /// `ReliefNodeRecord` by box over all grounds.
        nodes,
        /// Output, `u32` by point and light.
        hidden,
    }
}

/// The pipeline of the pass.
pub struct Relief {
    kernel: Kernel,
}

impl Relief {
    /// Creates the pipeline.
    ///
    /// # Errors
    /// Fails if the shader does not compile or the pipeline cannot be created.
    pub fn new(device: &Device, compiler: &Compiler) -> Result<Relief> {
        Ok(Relief { kernel: Kernel::new(device, compiler, "relief", Push::FIELDS)? })
    }

    /// Writes what ground hides from its points.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &ReliefBuffers<'_>,
        push: &Push,
    ) -> Result<()> {
        rec.dispatch(&self.kernel, &buffers.by_binding(), push, push.n_points * push.n_lights)
    }
}
