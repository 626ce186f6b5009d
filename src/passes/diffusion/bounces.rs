//! Bounces: light on straight ways between cells, scattered again where it arrives.

use super::push::{FluxPush, SystemPush};
use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder, buffers};
use crate::layout::diffusion::DiffusionParams;
use crate::layout::frame::GridRecord;
use crate::layout::record;

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
    /// Light that cells send out, four `[f32; 4]` by cell: evenly, beside the extinction, and three
    /// times the flux along each axis.
    pub struct Scratch(n_cells: u64) {
        /// That of suns and lamps.
        arrived: Buffer => [[f32; 4]; 4], n_cells, "diffusion.arrived", Texels;
        /// All of it.
        sent: Buffer => [[f32; 4]; 4], n_cells, "diffusion.sent", Texels;
        /// Q0 and q of what a bounce has changed.
        change: Buffer => [[f32; 4]; 4], n_cells, "diffusion.change", Texels;
    }
}

/// The kernels, and their scratch.
pub(super) struct Bounces {
    bounce: Kernel,
    /// The equations of a change.
    pub system: Kernel,
    correct: Kernel,
    seen: Kernel,
    pub scratch: Scratch,
    has_solids: bool,
}

impl Bounces {
    /// Creates the kernels, and scratch for `n_cells`.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        n_cells: u64,
        (n_sets, has_solids): (u32, bool),
    ) -> Result<Bounces> {
        let solids = [("N_SETS", n_sets), ("SOLIDS", u32::from(has_solids))];
        let kernel = |name: &str, fields: &_, macros: &[(&str, u32)]| {
            Kernel::with_macros(device, compiler, name, fields, &[], macros)
        };
        let alone = [("N_SETS", n_sets), ("SOLIDS", 0)];
        Ok(Bounces {
            bounce: kernel("diffusion.bounce", BouncePush::FIELDS, &solids)?,
            system: kernel("diffusion.system", SystemPush::FIELDS, &alone)?,
            correct: kernel(
                "diffusion.flux",
                FluxPush::FIELDS,
                &[("BOUNCES", 1), ("CORRECTS", 1)],
            )?,
            seen: kernel("diffusion.seen", SeenPush::FIELDS, &solids)?,
            scratch: Scratch::new(device, n_cells)?,
            has_solids,
        })
    }

    /// Replaces φ and F of `field` by those of what cells gather, and writes their change.
    pub fn record_gather(
        &self,
        rec: &mut Recorder<'_>,
        [lights, field, faces]: [&Buffer; 3],
        grid: &GridRecord,
        of: &DiffusionParams,
        n_lights: u32,
    ) -> Result<()> {
        let Scratch { sent, change, .. } = &self.scratch;
        let times = |a: [f32; 3], b: f32| a.map(|a| a * b);
        let push = BouncePush {
            grid: *grid,
            weakened: of.weakened,
            n_lights,
            even: of.scattered(),
            inverse_chord: of.inverse_chord,
            forward: times(of.albedo, 3.0 * (of.g - of.straight)),
            kept: of.kept,
            ..BouncePush::default()
        };
        let all = [lights, sent, field, change, faces];
        let n_buffers = 4 + usize::from(self.has_solids);
        rec.dispatch(&self.bounce, &all[..n_buffers], &push, grid.n_cells.iter().product())
    }

    /// Adds what diffusion makes of the change.
    pub fn record_correction(
        &self,
        rec: &mut Recorder<'_>,
        [density, phi, field]: [&Buffer; 3],
        push: &FluxPush,
    ) -> Result<()> {
        let Scratch { arrived, sent, change } = &self.scratch;
        let buffers = [density, phi, field, arrived, sent, change];
        rec.dispatch(&self.correct, &buffers, push, push.grid.n_cells.iter().product())
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
        let all = [lights, field, &self.scratch.arrived, seen, faces];
        let n_buffers = 4 + usize::from(self.has_solids);
        rec.dispatch(&self.seen, &all[..n_buffers], &push, grid.n_cells.iter().product())
    }
}
