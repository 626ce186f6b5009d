//! facets: what light falls on: the grids of the surfaces, the points of the ground, and one facet
//! a particle, or a run of particles in Morton order.
//!
//! In: regions (rectangles), placed particles, κ, groups, density grid, order and runs. Out:
//! position, unit normal, area, region, colour; of runs each particle's facet. Law: rectangles'
//! grids row by row; a particle's normal against the gradient of the density smoothed to 2σ,
//! blended to "away from the cloud's centre" where that is ill conditioned; position on the shell
//! `p + 1.5 σ n`. Source: C §2.4, docs/model.md §5, §11. The error of the normal grows as
//! 1/(t·conditioning).

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::frame::GridRecord;
use crate::layout::record;

record! {
    pub struct Push { grid: GridRecord, n_particles: u32, i_first_facet: u32 }
}

record! {
    pub struct GroupsPush { grid: GridRecord, n_facets: u32, i_first_facet: u32 }
}

record! {
    pub struct SurfacesPush { n_facets: u32 }
}

record! {
    pub struct TerrainPush { n_facets: u32, i_first_facet: u32 }
}

pub struct Facets {
    kernel: Kernel,
    groups: Kernel,
    surfaces: Kernel,
    terrain: Kernel,
}

impl Facets {
    /// `ellipsoids`: not all blobs are balls.
    pub fn new(device: &Device, compiler: &Compiler, ellipsoids: bool) -> Result<Facets> {
        let macros = [("ELLIPSOIDS", u32::from(ellipsoids))];
        let kernel =
            |name, fields| Kernel::with_macros(device, compiler, name, fields, &[], &macros);
        Ok(Facets {
            kernel: kernel("facets", Push::FIELDS)?,
            groups: kernel("facets.groups", GroupsPush::FIELDS)?,
            surfaces: Kernel::new(device, compiler, "facets.surfaces", SurfacesPush::FIELDS, &[])?,
            terrain: Kernel::new(device, compiler, "facets.terrain", TerrainPush::FIELDS, &[])?,
        })
    }

    /// The first `n_facets` of `facets` (FacetRecord) from `regions` (RegionRecord); `i_region`:
    /// u32 by facet.
    pub fn record_surfaces(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 3],
        n_facets: u32,
    ) -> Result<()> {
        rec.dispatch(&self.surfaces, &buffers, &SurfacesPush { n_facets }, n_facets)
    }

    /// `n_facets` of `ground` (FacetRecord, relative to their grounds' origins) to `facets` from
    /// `i_first_facet` on, where `regions` (RegionRecord) have their origins.
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

    /// `placed`: PlacedRecord; `particles`: ParticleRecord; `i_group`: u32; `groups`: GroupRecord;
    /// `density`: f32; `facets`: FacetRecord.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        [placed, particles, i_group, groups, density, facets]: [&Buffer; 6],
        grid: &GridRecord,
        n_particles: u32,
        i_first_facet: u32,
    ) -> Result<()> {
        let push = Push { grid: *grid, n_particles, i_first_facet };
        rec.dispatch(
            &self.kernel,
            &[placed, particles, i_group, groups, density, facets],
            &push,
            n_particles,
        )
    }

    /// `placed`, `particles`, `i_group`, `groups`, `density` as above; `order`: u32, the particle
    /// of each place; `runs`: RunRecord by facet; `facets`: FacetRecord; `i_facet`: u32 by
    /// particle.
    pub fn record_groups(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 9],
        grid: &GridRecord,
        n_facets: u32,
        i_first_facet: u32,
    ) -> Result<()> {
        rec.dispatch(
            &self.groups,
            &buffers,
            &GroupsPush { grid: *grid, n_facets, i_first_facet },
            n_facets,
        )
    }
}
