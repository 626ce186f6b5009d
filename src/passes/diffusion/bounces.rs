//! Bounces: light on straight ways between cells, scattered again where it arrives.

use super::Room;
use super::cells::Cells;
use super::merged::{self, Merged};
use super::push::{FluxPush, SystemPush};
use crate::error::Result;
use crate::gpu::{Buffer, BufferSpec, Compiler, Device, Kernel, Recorder, buffers};
use crate::layout::diffusion::DiffusionParams;
use crate::layout::frame::GridRecord;
use crate::layout::record;

/// Directions over which a bounce sums.
pub const N_DIRECTIONS: usize = 24;

record! {
    /// Push constants of `diffusion_bounce.comp`.
    pub struct BouncePush {
        /// The density grid.
        grid: GridRecord,
        /// s.
        weakened: [f32; 3],
        /// Number of lights.
        n_lights: u32,
        /// ϖ(1 − f).
        even: [f32; 3],
        /// c, 1/length.
        inverse_chord: f32,
        /// 3ϖ(g − f).
        forward: [f32; 3],
        /// Factor of the second order in what is scattered, over ϖ'.
        second: f32,
        /// 1 − ϖg.
        kept: [f32; 3],
    }
}

record! {
    /// Push constants of `diffusion_toward.comp`.
    pub struct TowardPush {
        /// The density grid.
        grid: GridRecord,
        /// ϖ'.
        even: [f32; 3],
        /// g.
        g: f32,
        /// 3ϖ'g'.
        forward: [f32; 3],
        /// f.
        straight: f32,
        /// Eye, relative to the lighting origin.
        eye: [f32; 3],
        /// Edge of a cell that bounces lead between, in cells.
        edge: u32,
        /// Cells by which the first of those reaches beyond the grid.
        before: [u32; 3],
        /// Padding.
        unused: u32,
        /// Cells that bounces lead between, along each axis.
        n_bounce_cells: [u32; 3],
    }
}

record! {
    /// Push constants of `diffusion_seen.comp`.
    pub struct SeenPush {
        /// The density grid.
        grid: GridRecord,
        /// s.
        weakened: [f32; 3],
        /// Number of lights.
        n_lights: u32,
        /// Eye, relative to the lighting origin.
        eye: [f32; 3],
    }
}

buffers! {
    /// Scratch by cell that bounces lead between.
    struct Scratch(room: Room) {
        /// Light that cells send out, by direction and cell, beside the extinction.
        sent: Buffer => [[f32; 4]; N_DIRECTIONS], room.n_bounce_cells(),
            "diffusion.sent", TexelStores;
        /// Q0 and q of what a bounce has changed.
        change: Buffer => [[f32; 4]; 4], room.n_bounce_cells(), "diffusion.change", Texels;
        /// The second order of what they scatter, by harmonic.
        of_second: Buffer => [f32; 4], room.n_of_second(), "diffusion.of_second", Texels;
    }
}

buffers! {
    /// Scratch by cell of the grid.
    struct Arrived(room: Room) {
        /// Light of suns and lamps that it scatters: ϖ'U, beside the extinction, and ϖ'W
        /// along each axis.
        arrived: Buffer => [[f32; 4]; 4], room.n_grid_cells(), "diffusion.arrived", Texels;
        /// Q0 and q.
        carried: Buffer => [[f32; 4]; 4], room.n_grid_cells(), "diffusion.carried", Texels;
        /// Light that it sends out toward the eye, beside the extinction.
        toward: Buffer => [f32; 4], room.n_grid_cells(), "diffusion.toward", Texels;
    }
}

/// The kernels, and their scratch.
pub(super) struct Bounces {
    flux: Kernel,
    bounce: Kernel,
    /// The equations of a change.
    pub system: Kernel,
    correct: Kernel,
    /// Corrects after the last bounce, when no cell sends light to another any more.
    correct_last: Kernel,
    toward: Kernel,
    seen: Kernel,
    arrived: Arrived,
    scratch: Scratch,
    /// The cells that bounces lead between, where they are not those of the grid.
    pub merged: Option<Merged>,
    has_solids: bool,
    has_second: bool,
}

impl Bounces {
    /// Lists the sizes of all scratch buffers; none without bounces.
    pub fn specs(room: Room) -> Vec<BufferSpec> {
        match room.bounce_cells {
            0 => vec![],
            1 => [Arrived::specs(room), Scratch::specs(room)].concat(),
            _ => {
                [Arrived::specs(room), Scratch::specs(room), merged::Scratch::specs(room)].concat()
            }
        }
    }

    /// Creates the kernels and the scratch.
    pub fn new(device: &Device, compiler: &Compiler, room: Room) -> Result<Bounces> {
        let has_solids = room.n_solid_facets > 0;
        let solids = [("N_SETS", room.n_sets), ("SOLIDS", u32::from(has_solids))];
        let second = ("SECOND", u32::from(room.has_second));
        let bounce = [&solids[..], &[second]].concat();
        let kernel = |name: &str, fields: &_, macros: &[(&str, u32)]| {
            Kernel::with_macros(device, compiler, name, fields, &[], macros)
        };
        let of_change = [("N_SETS", room.n_sets), ("SOLIDS", 0), ("CHANGE", 1)];
        let is_merged = room.bounce_cells > 1;
        Ok(Bounces {
            flux: kernel("diffusion.flux", FluxPush::FIELDS, &[("FACES", 1), ("BOUNCES", 1)])?,
            bounce: kernel("diffusion.bounce", BouncePush::FIELDS, &bounce)?,
            system: kernel("diffusion.system", SystemPush::FIELDS, &of_change)?,
            correct: kernel(
                "diffusion.flux",
                FluxPush::FIELDS,
                &[("FACES", 1), ("BOUNCES", 1), ("CHANGE", 1), second],
            )?,
            correct_last: kernel(
                "diffusion.flux",
                FluxPush::FIELDS,
                &[("FACES", 1), ("CHANGE", 1)],
            )?,
            toward: kernel("diffusion.toward", TowardPush::FIELDS, &[second])?,
            seen: kernel("diffusion.seen", SeenPush::FIELDS, &solids)?,
            arrived: Arrived::new(device, room)?,
            scratch: Scratch::new(device, room)?,
            merged: is_merged.then(|| Merged::new(device, compiler, room)).transpose()?,
            has_solids,
            has_second: room.has_second,
        })
    }

    /// Returns what suns and lamps make each cell of the grid send out.
    pub fn arrived(&self) -> &Buffer {
        &self.arrived.arrived
    }

    /// Returns Q0 and q of what a bounce has changed.
    pub fn change(&self) -> &Buffer {
        &self.scratch.change
    }

    /// Returns a copy of Q0 and q, which "flux" overwrites and reads in the cells beside its own.
    pub fn record_carried(&self, rec: &mut Recorder<'_>, cells: &Cells<'_>) -> &Buffer {
        let n_bytes = u64::from(cells.n_total()) * size_of::<[[f32; 4]; 4]>() as u64;
        rec.copy_runs(cells.field, &self.arrived.carried, &[[0, 0, n_bytes]]);
        &self.arrived.carried
    }

    /// Writes φ and F, and what each cell sends out.
    pub fn record_flux(
        &self,
        rec: &mut Recorder<'_>,
        cells: &Cells<'_>,
        [phi, arrived]: [&Buffer; 2],
    ) -> Result<()> {
        let carried = self.record_carried(rec, cells);
        let all = [cells.density, phi, cells.field, carried, arrived, &self.scratch.sent];
        rec.dispatch(&self.flux, &all, &cells.flux_push(), cells.n_total())
    }

    /// Replaces φ and F of the cells by those of what they gather, and writes their change.
    pub fn record_gather(
        &self,
        rec: &mut Recorder<'_>,
        cells: &Cells<'_>,
        [lights, faces]: [&Buffer; 2],
        n_lights: u32,
    ) -> Result<()> {
        let Scratch { sent, change, of_second } = &self.scratch;
        let (of, times) = (&cells.of, |a: [f32; 3], b: f32| a.map(|a| a * b));
        let push = BouncePush {
            grid: cells.grid,
            weakened: of.weakened,
            n_lights,
            even: of.scattered(),
            inverse_chord: of.inverse_chord,
            forward: times(of.albedo, 3.0 * (of.g - of.straight)),
            second: of.second,
            kept: of.kept,
        };
        let of_solids = self.has_solids.then_some(faces);
        let of_second = self.has_second.then_some(of_second);
        let all = [lights, sent, cells.field, change].into_iter();
        let all: Vec<&Buffer> = all.chain(of_solids).chain(of_second).collect();
        rec.dispatch(&self.bounce, &all, &push, cells.n_total())
    }

    /// Adds what diffusion makes of the change.
    pub fn record_correction(
        &self,
        rec: &mut Recorder<'_>,
        cells: &Cells<'_>,
        [phi, arrived]: [&Buffer; 2],
        is_last: bool,
    ) -> Result<()> {
        let Scratch { sent, change, of_second } = &self.scratch;
        let all = [cells.density, phi, cells.field, change, arrived, sent, of_second];
        let (kernel, n_buffers) = match is_last {
            true => (&self.correct_last, 4),
            false => (&self.correct, 6 + usize::from(self.has_second)),
        };
        rec.dispatch(kernel, &all[..n_buffers], &cells.flux_push(), cells.n_total())
    }

    /// Writes the radiance that each cell scatters toward the eye.
    pub fn record_seen(
        &self,
        rec: &mut Recorder<'_>,
        [lights, field, seen, faces]: [&Buffer; 4],
        grid: &GridRecord,
        (of, n_lights, eye): (&DiffusionParams, u32, [f32; 3]),
    ) -> Result<()> {
        let edge = self.merged.as_ref().map_or(1, |merged| merged.edge);
        let Arrived { arrived, toward, .. } = &self.arrived;
        let push = TowardPush {
            grid: *grid,
            even: of.even,
            g: of.g,
            forward: of.forward,
            straight: of.straight,
            eye,
            edge,
            before: grid.cells_before(edge),
            unused: 0,
            n_bounce_cells: grid.merged(edge).n_cells,
        };
        let all = [field, arrived, toward, &self.scratch.of_second];
        let n_buffers = 3 + usize::from(self.has_second);
        rec.dispatch(&self.toward, &all[..n_buffers], &push, grid.n_cells.iter().product())?;
        let push = SeenPush { grid: *grid, weakened: of.weakened, n_lights, eye };
        let all = [lights, toward, seen, faces];
        let n_buffers = 3 + usize::from(self.has_solids);
        rec.dispatch(&self.seen, &all[..n_buffers], &push, grid.n_cells.iter().product())
    }
}
