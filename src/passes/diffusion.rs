//! diffusion: computes the diffuse light in every cell of the density grid.
//!
//! In: the density grid, lights, regions (rectangles), facets of surfaces and ground. Out: fluence
//! φ and flux F by cell. Law: −∇·(D∇φ) + σ(1 − ϖ)φ = Q0 − ∇·q with Marshak's condition at the box,
//! where surfaces and ground send light in, by a fixed number of multigrid cycles. Source: model.md
//! §18, passes.md. Error: of a cycle about an eighth of what the cycle before left; of rounding
//! 2e-6 of φ.

mod bounces;
mod cells;
mod merged;
mod push;
mod room;
mod solids;

use crate::error::{Error, Result};
use crate::gpu::{Buffer, BufferSpec, Compiler, Device, Kernel, Recorder, buffers};
use crate::layout::diffusion::{DiffusionParams, LevelStep, levels};
use crate::layout::frame::GridRecord;

use bounces::Bounces;
pub use bounces::{BouncePush, N_DIRECTIONS, SeenPush, TowardPush};
use cells::Cells;
pub use merged::{MergePush, SpreadPush};
pub use push::{CyclePush, FluxPush, PairPush, SourcesPush, SweepPush, SystemPush};
pub use room::{N_SECOND, Room};
use solids::Solids;
pub use solids::{FacesPush, PatchesPush, SolidsPush, SolidsWork};

/// Sweeps of the coarsest grid.
const COARSEST_SWEEPS: u32 = 16;

/// Most cells of a level that one workgroup sweeps: four an invocation on a GPU. On llvmpipe, 300
/// and 20 000 take the same time within the noise (cubes-554).
const SMALL_CELLS: u32 = 2048;

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
        /// Their light by patch of the box: irradiance, and π times the radiance by sector.
        faces: Buffer => [[f32; 4]; 1 + N_DIRECTIONS], room.n_patches(), "diffusion.faces";
    }
}

/// Lists the sizes of all scratch buffers.
pub fn specs(room: Room) -> Vec<BufferSpec> {
    [Scratch::specs(room), Bounces::specs(room)].concat()
}

/// The pipelines and scratch buffers of the pass.
pub struct Diffusion {
    sources: Kernel,
    system: Kernel,
    coarsen: Kernel,
    sweep: Kernel,
    corrected: Kernel,
    cycle: Kernel,
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
        let (has_solids, has_bounces) = (room.n_solid_facets > 0, room.bounce_cells > 0);
        let macros = [
            ("N_SETS", room.n_sets),
            ("SLOPES", u32::from(room.has_slopes)),
            ("SOLIDS", u32::from(has_solids)),
            ("BOUNCES", u32::from(has_bounces)),
        ];
        let kernel = |name: &str, fields: &_| {
            Kernel::with_macros(device, compiler, name, fields, &[], &macros)
        };
        Ok(Diffusion {
            solids: has_solids.then(|| Solids::new(device, compiler, has_bounces)).transpose()?,
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
            cycle: Kernel::with_macros(
                device,
                compiler,
                "diffusion.cycle",
                CyclePush::FIELDS,
                &[],
                &[("N_SETS", room.n_sets), ("WORKGROUP", cycle_invocations(device))],
            )?,
            restrict: kernel("diffusion.restrict", PairPush::FIELDS)?,
            flux: Kernel::with_macros(
                device,
                compiler,
                "diffusion.flux",
                FluxPush::FIELDS,
                &[],
                &[("FACES", u32::from(has_bounces))],
            )?,
            bounces: has_bounces.then(|| Bounces::new(device, compiler, room)).transpose()?,
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
        let (_, n_all) = levels(grid);
        if u64::from(n_all) > self.room.n_cells
            || u64::from(grid.n_cells.iter().product::<u32>()) > self.room.n_grid_cells()
        {
            return Err(Error::limit(format!(
                "diffusion on {n_all} cells of all levels, where there is room for {}",
                self.room.n_cells
            )));
        }
        let DiffusionBuffers { lights, regions, density, facets, depths, field, patches } =
            *buffers;
        let Scratch { solids, faces, .. } = &self.scratch;
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
        let cells = Cells { grid: *grid, density, field, of: *of };
        let arrived = self.bounces.as_ref().map(Bounces::arrived);
        let all: Vec<&Buffer> =
            [lights, regions, density, field].into_iter().chain(arrived).collect();
        rec.dispatch(&self.sources, &all, &push, cells.n_total())?;
        let merged = self.bounces.as_ref().and_then(|bounces| bounces.merged.as_ref());
        match (arrived, merged) {
            (None, _) => self.record_light(rec, lights, &cells, work)?,
            (Some(arrived), None) => {
                self.record_bounces(rec, (lights, arrived), &cells, None, work)?;
            }
            (Some(arrived), Some(merged)) => {
                let few = merged.record_merge(rec, &cells, arrived)?;
                let merged::Scratch { arrived, before, .. } = &merged.scratch;
                self.record_bounces(rec, (lights, arrived), &few, Some(before), work)?;
                self.record_light(rec, lights, &cells, work)?;
                merged.record_spread(rec, &cells)?;
            }
        }
        match &self.solids {
            Some(kernels) => kernels.record_patches(rec, [field, patches], grid),
            None => Ok(()),
        }
    }

    /// Writes φ and F of cells whose sources are known.
    fn record_light(
        &self,
        rec: &mut Recorder<'_>,
        lights: &Buffer,
        cells: &Cells<'_>,
        work: &DiffusionWork,
    ) -> Result<()> {
        self.record_fluence(rec, lights, cells, work)?;
        let carried = self.bounces.as_ref().map(|bounces| bounces.record_carried(rec, cells));
        let buffers = [cells.density, &self.scratch.next_phi, cells.field];
        let buffers: Vec<&Buffer> = buffers.into_iter().chain(carried).collect();
        rec.dispatch(&self.flux, &buffers, &cells.flux_push(), cells.n_total())
    }

    /// Writes φ and F of cells whose sources are known, after all bounces between them. Those
    /// before the first bounce are copied to `before`.
    fn record_bounces(
        &self,
        rec: &mut Recorder<'_>,
        (lights, arrived): (&Buffer, &Buffer),
        cells: &Cells<'_>,
        before: Option<&Buffer>,
        work: &DiffusionWork,
    ) -> Result<()> {
        let Some(bounces) = &self.bounces else { return Ok(()) };
        let Scratch { operators, phi, next_phi, source, faces, .. } = &self.scratch;
        let Cells { density, field, .. } = *cells;
        self.record_fluence(rec, lights, cells, work)?;
        bounces.record_flux(rec, cells, [next_phi, arrived])?;
        if let Some(before) = before {
            rec.copy(field, before);
        }
        let (steps, n_all) = levels(&cells.grid);
        for i in 0..work.n_bounces {
            bounces.record_gather(rec, cells, [lights, faces], work.n_lights)?;
            // No light comes in at the box: the bounce has it.
            let push = cells.system_push(0);
            let system = [lights, density, bounces.change(), operators, phi, source];
            rec.dispatch(&bounces.system, &system, &push, cells.n_total())?;
            // One cycle: the next bounce finds what is left.
            self.record_cycle(rec, &steps, n_all, [true, false])?;
            let is_last = i + 1 == work.n_bounces;
            bounces.record_correction(rec, cells, [next_phi, arrived], is_last)?;
        }
        Ok(())
    }

    /// Solves for φ of cells whose sources are known.
    fn record_fluence(
        &self,
        rec: &mut Recorder<'_>,
        lights: &Buffer,
        cells: &Cells<'_>,
        work: &DiffusionWork,
    ) -> Result<()> {
        let Scratch { operators, phi, source, faces, .. } = &self.scratch;
        let (steps, n_all) = levels(&cells.grid);
        let system = [lights, cells.density, cells.field, operators, phi, source, faces];
        let n_buffers = 6 + usize::from(self.solids.is_some());
        let push = cells.system_push(work.n_lights);
        rec.dispatch(&self.system, &system[..n_buffers], &push, cells.n_total())?;
        for pair in steps[..=n_large(&steps)].windows(2) {
            let push = pair_push(pair, n_all);
            rec.dispatch(&self.coarsen, &[operators], &push, pair[1].level.n_total())?;
        }
        for i in 0..work.n_cycles {
            let is_first = i == 0;
            self.record_cycle(rec, &steps, n_all, [is_first, is_first])?;
        }
        Ok(())
    }

    /// Two sweeps on every level on the way down, and two on the way up. The first sweep from φ = 0
    /// is part of what makes the right-hand sides. `is_new`: small levels have no operators yet.
    fn record_cycle(
        &self,
        rec: &mut Recorder<'_>,
        steps: &[LevelStep],
        n_all: u32,
        [is_first, is_new]: [bool; 2],
    ) -> Result<()> {
        let Scratch { operators, phi, next_phi, source, .. } = &self.scratch;
        let n_large = n_large(steps);
        for (i, pair) in steps[..=n_large].windows(2).enumerate() {
            let push = pair_push(pair, n_all);
            if i == 0 && !is_first {
                self.record_sweep(rec, &self.sweep, [next_phi, phi], &push, true)?;
            }
            self.record_sweep(rec, &self.sweep, [phi, next_phi], &push, false)?;
            let buffers = [operators, source, next_phi, phi];
            rec.dispatch(&self.restrict, &buffers, &push, pair[1].level.n_total())?;
        }
        let is_first = is_first || n_large > 0;
        let push = CyclePush::new(&steps[n_large..], n_all, COARSEST_SWEEPS, [is_first, is_new]);
        rec.dispatch_groups(&self.cycle, &[operators, source, phi, next_phi], &push, 1)?;
        for pair in steps[..=n_large].windows(2).rev() {
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

/// Returns the invocations of the workgroup that sweeps small levels. One core of a CPU runs it
/// whatever its size, and changes from invocation to invocation at every barrier.
fn cycle_invocations(device: &Device) -> u32 {
    if device.info().kind == "cpu" {
        64
    } else {
        device.limits().max_workgroup_invocations.min(512)
    }
}

/// Returns the number of levels that are swept in many workgroups. The coarsest is never one.
fn n_large(steps: &[LevelStep]) -> usize {
    steps.partition_point(|step| step.level.n_total() > SMALL_CELLS)
}

fn pair_push(pair: &[LevelStep], n_all: u32) -> PairPush {
    PairPush { fine: pair[0].level, coarse: pair[1].level, halved: pair[0].halved, n_all }
}
