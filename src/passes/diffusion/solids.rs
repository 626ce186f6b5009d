//! Light between the box of the density grid and surfaces or ground, through patches of its faces.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::diffusion::N_PATCHES;
use crate::layout::frame::GridRecord;
use crate::layout::record;

record! {
    /// Push constants of `diffusion_solids.comp`.
    pub struct SolidsPush {
        /// Number of facets of surfaces and ground.
        n_facets: u32,
        /// Number of lights.
        n_lights: u32,
        /// 1 − g.
        backward: f32,
    }
}

record! {
    /// Push constants of `diffusion_faces.comp`.
    pub struct FacesPush {
        /// The density grid.
        grid: GridRecord,
        /// Number of facets of surfaces and ground.
        n_facets: u32,
        /// Number of lights.
        n_lights: u32,
        /// Longest edge of a facet.
        lift: f32,
    }
}

record! {
    /// Push constants of `diffusion_patches.comp`.
    pub struct PatchesPush {
        /// The density grid.
        grid: GridRecord,
    }
}

/// Facets of surfaces and ground, and how their light is gathered.
#[derive(Debug, Clone, Copy)]
pub struct SolidsWork {
    /// Number of facets.
    pub n_facets: u32,
    /// Number of lights.
    pub n_lights: u32,
    /// Longest edge of a facet.
    pub lift: f64,
    /// g of the ways to them.
    pub forward: f64,
}

/// The kernels that scenes with surfaces or ground need.
pub(super) struct Solids {
    solids: Kernel,
    faces: Kernel,
    patches: Kernel,
}

impl Solids {
    /// Creates the kernels. `has_bounces`: light is wanted by sector.
    pub fn new(device: &Device, compiler: &Compiler, has_bounces: bool) -> Result<Solids> {
        let invocations = device.limits().subgroup_size.clamp(8, 64);
        let kernel = |name: &str, fields: &_| Kernel::new(device, compiler, name, fields);
        Ok(Solids {
            solids: kernel("diffusion.solids", SolidsPush::FIELDS)?,
            faces: Kernel::with_macros(
                device,
                compiler,
                "diffusion.faces",
                FacesPush::FIELDS,
                &[],
                &[("BOUNCES", u32::from(has_bounces)), ("WORKGROUP", invocations)],
            )?,
            patches: kernel("diffusion.patches", PatchesPush::FIELDS)?,
        })
    }

    /// Gathers the light of surfaces and ground on the patches.
    pub fn record_faces(
        &self,
        rec: &mut Recorder<'_>,
        [facets, lights, depths, regions]: [&Buffer; 4],
        [solids, faces]: [&Buffer; 2],
        grid: &GridRecord,
        &SolidsWork { n_facets, n_lights, lift, forward }: &SolidsWork,
    ) -> Result<()> {
        let push = SolidsPush { n_facets, n_lights, backward: (1.0 - forward) as f32 };
        rec.dispatch(&self.solids, &[facets, lights, depths, regions, solids], &push, n_facets)?;
        let push = FacesPush { grid: *grid, n_facets, n_lights, lift: lift as f32 };
        rec.dispatch_blocks(&self.faces, &[lights, solids, faces], &push, N_PATCHES)
    }

    /// Takes the light of the cells, `field`, at the patches.
    pub fn record_patches(
        &self,
        rec: &mut Recorder<'_>,
        [field, patches]: [&Buffer; 2],
        grid: &GridRecord,
    ) -> Result<()> {
        rec.dispatch(&self.patches, &[field, patches], &PatchesPush { grid: *grid }, N_PATCHES)
    }
}
