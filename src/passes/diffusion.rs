//! diffusion: computes the diffuse light in every cell of the density grid.
//!
//! In: the density grid, lights, regions (rectangles), facets of surfaces and ground. Out: fluence
//! φ and flux F by cell. Law: −∇·(D∇φ) + σ(1 − ϖ)φ = Q0 − ∇·q with Marshak's condition at the box,
//! where surfaces and ground send light in, by a fixed number of multigrid cycles. Source: model.md
//! §18, passes.md. Error: of a cycle about an eighth of what the cycle before left; of rounding
//! 2e-6 of φ.

mod bounces;
mod push;
mod solids;

use crate::error::{Error, Result};
use crate::gpu::{Buffer, BufferSpec, Compiler, Device, Kernel, Recorder, buffers};
use crate::layout::diffusion::{DiffusionParams, LEVELS_ROOM, LevelStep, N_PATCHES, levels};
use crate::layout::frame::GridRecord;

use bounces::Bounces;
pub use bounces::{BouncePush, SeenPush};
pub use push::{CoarsestPush, FluxPush, PairPush, SourcesPush, SweepPush, SystemPush};
use solids::Solids;
pub use solids::{FacesPush, PatchesPush, SolidsPush, SolidsWork};

/// Sweeps of the coarsest grid.
const COARSEST_SWEEPS: u32 = 16;

bindings! {
    /// The buffers of the pass that others share.
    pub struct DiffusionBuffers {
        /// `LightRecord` by light.
        lights,
        /// `RegionRecord` by region, surfaces first.
        regions,
        /// `f32` by cell: extinction per length.
        density,
        /// `FacetRecord` by facet; without surfaces and ground not read.
        facets,
        /// `f32` optical depth by facet and light; alike.
        depths,
        /// Output, four `[f32; 4]` by cell: φ and F along each axis, and beside φ the mean fluence
        /// of suns and lamps.
        field,
        /// Output, four `[f32; 4]` by patch of the box: φ and F along each axis; without surfaces
        /// and ground not written.
        patches,
    }
}

/// The march toward suns and lamps, and the cycles.
#[derive(Debug, Clone, Copy)]
pub struct DiffusionWork {
    /// Number of lights.
    pub n_lights: u32,
    /// Number of surfaces that may hide a light.
    pub n_surfaces: u32,
    /// Step in cells.
    pub step_cells: f64,
    /// The most steps of a march.
    pub max_steps: u32,
    /// Number of cycles.
    pub n_cycles: u32,
    /// Number of bounces.
    pub n_bounces: u32,
    /// Light of surfaces and ground.
    pub solids: SolidsWork,
}

/// Room for the grids of the solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Room {
    /// Cells of all levels.
    pub n_cells: u64,
    /// Sets of equations: 1 where channels share them, else 3.
    pub n_sets: u32,
    /// The fluence of suns and lamps is wanted in every cell.
    pub has_slopes: bool,
    /// Facets of surfaces and ground.
    pub n_solid_facets: u64,
    /// Bounces follow diffusion.
    pub has_bounces: bool,
}

impl Room {
    /// Returns the room for a grid of at most `n_cells`.
    pub fn new(
        n_cells: u64,
        n_sets: u32,
        (has_slopes, has_bounces): (bool, bool),
        n_solid_facets: u64,
    ) -> Room {
        let n_cells = LEVELS_ROOM * n_cells;
        Room { n_cells, n_sets, has_slopes, n_solid_facets, has_bounces }
    }

    /// Returns the number of patches through which light passes to and from surfaces and ground.
    pub fn n_patches(&self) -> u64 {
        if self.n_solid_facets > 0 { u64::from(N_PATCHES) } else { 0 }
    }
}

buffers! {
    /// Scratch of the pass.
    pub struct Scratch(room: Room) {
        /// By set and cell: what flows to the next cell along each axis, and what is lost, by φ.
        operators: Buffer => [f32; 4], room.n_cells * u64::from(room.n_sets),
            "diffusion.operators", Texels;
        /// φ by cell, before and after every second sweep.
        phi: Buffer => [f32; 4], room.n_cells, "diffusion.phi", Texels;
        /// φ by cell after the other sweeps, and in the end.
        next_phi: Buffer => [f32; 4], room.n_cells, "diffusion.next_phi", Texels;
        /// Right-hand sides by cell.
        source: Buffer => [f32; 4], room.n_cells, "diffusion.source", Texels;
        /// By facet of surfaces and ground: place and area, normal, radiosity.
        solids: Buffer => [[f32; 4]; 3], room.n_solid_facets, "diffusion.solids", Texels;
        /// Their light by patch of the box.
        faces: Buffer => [f32; 4], room.n_patches(), "diffusion.faces";
    }
}

/// Lists the sizes of all scratch buffers.
pub fn specs(room: Room) -> Vec<BufferSpec> {
    let bounces = match room.has_bounces {
        true => bounces::Scratch::specs(room.n_cells / LEVELS_ROOM),
        false => vec![],
    };
    [Scratch::specs(room), bounces].concat()
}

/// The pipelines and scratch buffers of the pass.
pub struct Diffusion {
    sources: Kernel,
    system: Kernel,
    coarsen: Kernel,
    sweep: Kernel,
    corrected: Kernel,
    coarsest: Kernel,
    restrict: Kernel,
    flux: Kernel,
    /// Light from and to surfaces and ground, where a scene has them.
    solids: Option<Solids>,
    /// Bounces between cells, where a scene has them.
    bounces: Option<Bounces>,
    scratch: Scratch,
    room: Room,
}

impl Diffusion {
    /// Creates the pipelines and the scratch buffers.
    ///
    /// # Errors
    /// Fails if a shader does not compile or the device cannot hold the buffers.
    pub fn new(device: &Device, compiler: &Compiler, room: Room) -> Result<Diffusion> {
        let has_solids = room.n_solid_facets > 0;
        let macros = [
            ("N_SETS", room.n_sets),
            ("SLOPES", u32::from(room.has_slopes)),
            ("SOLIDS", u32::from(has_solids)),
            ("BOUNCES", u32::from(room.has_bounces)),
        ];
        let kernel = |name: &str, fields: &_| {
            Kernel::with_macros(device, compiler, name, fields, &[], &macros)
        };
        Ok(Diffusion {
            solids: has_solids.then(|| Solids::new(device, compiler)).transpose()?,
            sources: kernel("diffusion.sources", SourcesPush::FIELDS)?,
            system: kernel("diffusion.system", SystemPush::FIELDS)?,
            coarsen: kernel("diffusion.coarsen", PairPush::FIELDS)?,
            sweep: kernel("diffusion.sweep", SweepPush::FIELDS)?,
            corrected: Kernel::with_macros(
                device,
                compiler,
                "diffusion.sweep",
                SweepPush::FIELDS,
                &[],
                &[("N_SETS", room.n_sets), ("CORRECTED", 1)],
            )?,
            coarsest: kernel("diffusion.coarsest", CoarsestPush::FIELDS)?,
            restrict: kernel("diffusion.restrict", PairPush::FIELDS)?,
            flux: kernel("diffusion.flux", FluxPush::FIELDS)?,
            bounces: match room.has_bounces {
                true => Some(Bounces::new(
                    device,
                    compiler,
                    room.n_cells / LEVELS_ROOM,
                    (room.n_sets, has_solids),
                )?),
                false => None,
            },
            scratch: Scratch::new(device, room)?,
            room,
        })
    }

    /// Writes φ and F of every cell of `grid`, and with surfaces or ground of its patches.
    ///
    /// # Errors
    /// Fails if the grid has more cells than there is room for.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &DiffusionBuffers<'_>,
        grid: &GridRecord,
        of: &DiffusionParams,
        work: &DiffusionWork,
    ) -> Result<()> {
        let (steps, n_all) = levels(grid);
        if u64::from(n_all) > self.room.n_cells {
            return Err(Error::limit(format!(
                "diffusion on {n_all} cells of all levels, where there is room for {}",
                self.room.n_cells
            )));
        }
        let DiffusionBuffers { lights, regions, density, facets, depths, field, patches } =
            *buffers;
        let Scratch { operators, phi, next_phi, source, solids, faces } = &self.scratch;
        let n_cells = steps[0].level.n_total();
        if let Some(kernels) = &self.solids {
            let given = [facets, lights, depths, regions];
            kernels.record_faces(rec, given, [solids, faces], grid, &work.solids)?;
        }
        let push = SourcesPush {
            grid: *grid,
            albedo: of.albedo,
            inverse_chord: of.inverse_chord,
            g: of.g,
            straight: of.straight,
            n_lights: work.n_lights,
            n_surfaces: work.n_surfaces,
            step_length: (work.step_cells * f64::from(grid.cell)) as f32,
            max_steps: work.max_steps,
            densest: of.densest,
        };
        match &self.bounces {
            None => {
                let buffers = [lights, regions, density, field];
                rec.dispatch(&self.sources, &buffers, &push, n_cells)?;
            }
            Some(bounces) => {
                let buffers = [lights, regions, density, field, &bounces.scratch.arrived];
                rec.dispatch(&self.sources, &buffers, &push, n_cells)?;
            }
        }
        let system_push = SystemPush {
            grid: *grid,
            absorbed: of.absorbed,
            inverse_chord: of.inverse_chord,
            kept: of.kept,
            n_lights: work.n_lights,
            n_all,
            densest: of.densest,
        };
        let system = [lights, density, field, operators, phi, source, faces];
        let n_buffers = 6 + usize::from(self.solids.is_some());
        rec.dispatch(&self.system, &system[..n_buffers], &system_push, n_cells)?;
        for pair in steps.windows(2) {
            let push = pair_push(pair, n_all);
            rec.dispatch(&self.coarsen, &[operators], &push, pair[1].level.n_total())?;
        }
        for i in 0..work.n_cycles {
            self.record_cycle(rec, &steps, n_all, i == 0)?;
        }
        let push_of_flux = FluxPush {
            grid: *grid,
            kept: of.kept,
            inverse_chord: of.inverse_chord,
            even: of.even,
            densest: of.densest,
            forward: of.forward,
        };
        let flux = [density, next_phi, field];
        match &self.bounces {
            None => rec.dispatch(&self.flux, &flux, &push_of_flux, n_cells)?,
            Some(bounces) => {
                let bounces::Scratch { arrived, sent, change } = &bounces.scratch;
                let all = [density, next_phi, field, arrived, sent];
                rec.dispatch(&self.flux, &all, &push_of_flux, n_cells)?;
                for _ in 0..work.n_bounces {
                    bounces.record_gather(rec, [lights, field, faces], grid, of, work.n_lights)?;
                    // No light comes in at the box: the bounce has it.
                    let push = SystemPush { n_lights: 0, ..system_push };
                    let system = [lights, density, change, operators, phi, source];
                    rec.dispatch(&bounces.system, &system, &push, n_cells)?;
                    for i in 0..work.n_cycles {
                        self.record_cycle(rec, &steps, n_all, i == 0)?;
                    }
                    bounces.record_correction(rec, flux, &push_of_flux)?;
                }
            }
        }
        match &self.solids {
            Some(kernels) => kernels.record_patches(rec, [field, patches], grid),
            None => Ok(()),
        }
    }

    /// Two sweeps on every level on the way down, and two on the way up. The first sweep from φ = 0
    /// is part of what makes the right-hand sides.
    fn record_cycle(
        &self,
        rec: &mut Recorder<'_>,
        steps: &[LevelStep],
        n_all: u32,
        is_first: bool,
    ) -> Result<()> {
        let Scratch { operators, phi, next_phi, source, .. } = &self.scratch;
        for (i, pair) in steps.windows(2).enumerate() {
            let push = pair_push(pair, n_all);
            if i == 0 && !is_first {
                self.record_sweep(rec, &self.sweep, [next_phi, phi], &push, true)?;
            }
            self.record_sweep(rec, &self.sweep, [phi, next_phi], &push, false)?;
            let buffers = [operators, source, next_phi, phi];
            rec.dispatch(&self.restrict, &buffers, &push, pair[1].level.n_total())?;
        }
        let level = steps[steps.len() - 1].level;
        let push = CoarsestPush { level, n_all, n_sweeps: COARSEST_SWEEPS };
        rec.dispatch_groups(&self.coarsest, &[operators, source, next_phi], &push, 1)?;
        for pair in steps.windows(2).rev() {
            let push = pair_push(pair, n_all);
            self.record_sweep(rec, &self.corrected, [next_phi, phi], &push, true)?;
            self.record_sweep(rec, &self.sweep, [phi, next_phi], &push, false)?;
        }
        Ok(())
    }

    /// Writes the radiance that each cell scatters toward the eye, with bounces. `of` is the
    /// medium, the number of lights, and the eye.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record_seen(
        &self,
        rec: &mut Recorder<'_>,
        [lights, field, seen]: [&Buffer; 3],
        grid: &GridRecord,
        of: (&DiffusionParams, u32, [f32; 3]),
    ) -> Result<()> {
        let Some(bounces) = &self.bounces else { return Ok(()) };
        let all = [lights, field, seen, &self.scratch.faces];
        bounces.record_seen(rec, all, grid, of)
    }

    fn record_sweep(
        &self,
        rec: &mut Recorder<'_>,
        kernel: &Kernel,
        [from, to]: [&Buffer; 2],
        &PairPush { fine, coarse, halved, n_all }: &PairPush,
        is_long: bool,
    ) -> Result<()> {
        let Scratch { operators, source, .. } = &self.scratch;
        let push = SweepPush { level: fine, coarse, halved, n_all, is_long: u32::from(is_long) };
        rec.dispatch(kernel, &[operators, source, from, to], &push, fine.n_total())
    }
}

fn pair_push(pair: &[LevelStep], n_all: u32) -> PairPush {
    PairPush { fine: pair[0].level, coarse: pair[1].level, halved: pair[0].halved, n_all }
}
