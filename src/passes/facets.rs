//! facets: places the points that light falls on.
//!
//! Facets are the grid cells of surfaces, the points of terrain, and one facet a particle or a run
//! of particles in Morton order. In: regions, placed particles, extinction, groups, density grid,
//! order and runs. Out: position, unit normal, area, region and color of every facet; the facet of
//! each particle of a run. Law: surfaces row by row. A particle's normal points against the
//! gradient of the density smoothed to 2σ. Where that is ill conditioned, the normal is blended
//! toward "away from the cloud's center". The position is p + 1.5 σ n. Source: C §2.4,
//! model.md §5, passes.md. Error: the normal's error grows as 1/(t·conditioning).

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::frame::GridRecord;
use crate::layout::particle::Shapes;
use crate::layout::record;

record! {
    /// Push constants of `facets.comp` and `facets_groups.comp`.
    pub struct Push {
        /// The density grid.
        grid: GridRecord,
        /// Number of particles, or of runs.
        n_facets: u32,
        /// First facet that the pass writes.
        i_first_facet: u32,
    }
}

record! {
    /// Push constants of `facets_surfaces.comp`.
    pub struct SurfacesPush {
        /// Number of facets of surfaces.
        n_facets: u32,
    }
}

record! {
    /// Push constants of `facets_terrain.comp`.
    pub struct TerrainPush {
        /// Number of facets of terrains.
        n_facets: u32,
        /// First facet that the pass writes.
        i_first_facet: u32,
    }
}

bindings! {
    /// The buffers of the facets of particles.
    pub struct ParticleBuffers {
        /// `PlacedRecord` by particle.
        placed,
        /// `ParticleRecord` by particle.
        particles,
        /// `u32` group by particle.
        i_group,
        /// `GroupRecord` by group.
        groups,
        /// `f32` by cell: extinction per length.
        density,
        /// Output, `FacetRecord` by facet.
        facets,
    }
}

/// The pipelines of the pass.
pub struct Facets {
    particles: Kernel,
    runs: Kernel,
    surfaces: Kernel,
    terrain: Kernel,
}

impl Facets {
    /// Creates the pipelines; `shapes` are those of the blobs. Facets lie on the
    /// blobs' shells, or at their centres where clouds are a medium, `is_medium`.
    ///
    /// # Errors
    /// Fails if a shader does not compile or a pipeline cannot be created.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        shapes: Shapes,
        is_medium: bool,
    ) -> Result<Facets> {
        let macros = [("ELLIPSOIDS", shapes as u32), ("SHELL", u32::from(!is_medium))];
        let kernel = |name| Kernel::with_macros(device, compiler, name, Push::FIELDS, &[], &macros);
        Ok(Facets {
            particles: kernel("facets")?,
            runs: kernel("facets.groups")?,
            surfaces: Kernel::new(device, compiler, "facets.surfaces", SurfacesPush::FIELDS)?,
            terrain: Kernel::new(device, compiler, "facets.terrain", TerrainPush::FIELDS)?,
        })
    }

    /// Writes the first `n_facets` of `facets` (`FacetRecord`) from `regions` (`RegionRecord`);
    /// `i_region` holds the `u32` region of each facet.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record_surfaces(
        &self,
        rec: &mut Recorder<'_>,
        [regions, i_region, facets]: [&Buffer; 3],
        n_facets: u32,
    ) -> Result<()> {
        let push = SurfacesPush { n_facets };
        rec.dispatch(&self.surfaces, &[regions, i_region, facets], &push, n_facets)
    }

    /// Writes `n_facets` of `facets` from `i_first_facet` on: the points of `ground`
    /// (`FacetRecord`), moved to the origins in `regions` (`RegionRecord`).
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record_terrain(
        &self,
        rec: &mut Recorder<'_>,
        [regions, ground, facets]: [&Buffer; 3],
        n_facets: u32,
        i_first_facet: u32,
    ) -> Result<()> {
        let push = TerrainPush { n_facets, i_first_facet };
        rec.dispatch(&self.terrain, &[regions, ground, facets], &push, n_facets)
    }

    /// Writes a facet for each of `n_facets` particles, from `i_first_facet` on.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &ParticleBuffers<'_>,
        grid: &GridRecord,
        n_facets: u32,
        i_first_facet: u32,
    ) -> Result<()> {
        let push = Push { grid: *grid, n_facets, i_first_facet };
        rec.dispatch(&self.particles, &buffers.by_binding(), &push, n_facets)
    }

    /// Writes a facet for each of `n_facets` runs, from `i_first_facet` on. `order`: `u32` particle
    /// by place in Morton order; `runs`: `RunRecord` by facet; `i_facet`: output, `u32` facet by
    /// particle.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record_runs(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &ParticleBuffers<'_>,
        [order, runs, i_facet]: [&Buffer; 3],
        grid: &GridRecord,
        n_facets: u32,
        i_first_facet: u32,
    ) -> Result<()> {
        let push = Push { grid: *grid, n_facets, i_first_facet };
        let buffers = [&buffers.by_binding()[..], &[order, runs, i_facet]].concat();
        rec.dispatch(&self.runs, &buffers, &push, n_facets)
    }
}
