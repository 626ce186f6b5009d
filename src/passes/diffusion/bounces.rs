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
        /// Padding.
        unused: f32,
        /// 1 − ϖg.
        kept: [f32; 3],
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
    }
}

buffers! {
    /// Scratch by cell that bounces lead between.
    struct Scratch(n_cells: u64) {
        /// Light that cells send out, by direction and cell, beside the extinction.
        sent: Buffer => [[f32; 4]; N_DIRECTIONS], n_cells, "diffusion.sent", TexelStores;
        /// Q0 and q of what a bounce has changed.
        change: Buffer => [[f32; 4]; 4], n_cells, "diffusion.change", Texels;
    }
}

buffers! {
    /// Scratch by cell of the grid.
    struct Arrived(n_cells: u64) {
        /// Light that suns and lamps make it send out: evenly, beside the extinction, and three
        /// times the flux along each axis.
        arrived: Buffer => [[f32; 4]; 4], n_cells, "diffusion.arrived", Texels;
        /// Q0 and q.
        carried: Buffer => [[f32; 4]; 4], n_cells, "diffusion.carried", Texels;
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
    seen: Kernel,
    arrived: Arrived,
    scratch: Scratch,
    /// The cells that bounces lead between, where they are not those of the grid.
    pub merged: Option<Merged>,
    has_solids: bool,
}

impl Bounces {
    /// Lists the sizes of all scratch buffers; none without bounces.
    pub fn specs(room: Room) -> Vec<BufferSpec> {
        let (n, few) = (room.n_grid_cells(), room.n_bounce_cells());
        match room.bounce_cells {
            0 => vec![],
            1 => [Arrived::specs(n), Scratch::specs(n)].concat(),
            _ => [Arrived::specs(n), Scratch::specs(few), merged::Scratch::specs(few)].concat(),
        }
    }

    /// Creates the kernels and the scratch.
    pub fn new(device: &Device, compiler: &Compiler, room: Room) -> Result<Bounces> {
        let has_solids = room.n_solid_facets > 0;
        let solids = [("N_SETS", room.n_sets), ("SOLIDS", u32::from(has_solids))];
        let kernel = |name: &str, fields: &_, macros: &[(&str, u32)]| {
            Kernel::with_macros(device, compiler, name, fields, &[], macros)
        };
        let of_change = [("N_SETS", room.n_sets), ("SOLIDS", 0), ("CHANGE", 1)];
        let is_merged = room.bounce_cells > 1;
        Ok(Bounces {
            flux: kernel("diffusion.flux", FluxPush::FIELDS, &[("FACES", 1), ("BOUNCES", 1)])?,
            bounce: kernel("diffusion.bounce", BouncePush::FIELDS, &solids)?,
            system: kernel("diffusion.system", SystemPush::FIELDS, &of_change)?,
            correct: kernel(
                "diffusion.flux",
                FluxPush::FIELDS,
                &[("FACES", 1), ("BOUNCES", 1), ("CHANGE", 1)],
            )?,
            correct_last: kernel(
                "diffusion.flux",
                FluxPush::FIELDS,
                &[("FACES", 1), ("CHANGE", 1)],
            )?,
            seen: kernel("diffusion.seen", SeenPush::FIELDS, &solids)?,
            arrived: Arrived::new(device, room.n_grid_cells())?,
            scratch: Scratch::new(device, room.n_bounce_cells())?,
            merged: is_merged.then(|| Merged::new(device, compiler, room)).transpose()?,
            has_solids,
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
        let Scratch { sent, change } = &self.scratch;
        let (of, times) = (&cells.of, |a: [f32; 3], b: f32| a.map(|a| a * b));
        let push = BouncePush {
            grid: cells.grid,
            weakened: of.weakened,
            n_lights,
            even: of.scattered(),
            inverse_chord: of.inverse_chord,
            forward: times(of.albedo, 3.0 * (of.g - of.straight)),
            kept: of.kept,
            ..BouncePush::default()
        };
        let all = [lights, sent, cells.field, change, faces];
        let n_buffers = 4 + usize::from(self.has_solids);
        rec.dispatch(&self.bounce, &all[..n_buffers], &push, cells.n_total())
    }

    /// Adds what diffusion makes of the change.
    pub fn record_correction(
        &self,
        rec: &mut Recorder<'_>,
        cells: &Cells<'_>,
        [phi, arrived]: [&Buffer; 2],
        is_last: bool,
    ) -> Result<()> {
        let Scratch { sent, change } = &self.scratch;
        let all = [cells.density, phi, cells.field, change, arrived, sent];
        let (kernel, buffers) =
            if is_last { (&self.correct_last, &all[..4]) } else { (&self.correct, &all[..]) };
        rec.dispatch(kernel, buffers, &cells.flux_push(), cells.n_total())
    }

    /// Writes the radiance that each cell scatters toward the eye.
    pub fn record_seen(
        &self,
        rec: &mut Recorder<'_>,
        [lights, field, seen, faces]: [&Buffer; 4],
        grid: &GridRecord,
        (of, n_lights, eye): (&DiffusionParams, u32, [f32; 3]),
    ) -> Result<()> {
        let push = SeenPush {
            grid: *grid,
            weakened: of.weakened,
            n_lights,
            even: of.even,
            g: of.g,
            forward: of.forward,
            straight: of.straight,
            eye,
        };
        let all = [lights, field, self.arrived(), seen, faces];
        let n_buffers = 4 + usize::from(self.has_solids);
        rec.dispatch(&self.seen, &all[..n_buffers], &push, grid.n_cells.iter().product())
    }
}
