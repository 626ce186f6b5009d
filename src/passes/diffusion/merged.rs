//! Merged cells, between which bounces lead.

use super::Room;
use super::cells::Cells;
use crate::error::{Error, Result};
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder, buffers};
use crate::layout::diffusion::{DiffusionParams, LevelRecord};
use crate::layout::frame::GridRecord;
use crate::layout::record;

record! {
    /// Push constants of `diffusion_merge.comp`.
    pub struct MergePush {
        /// The cells of the grid.
        fine: LevelRecord,
        /// The merged ones.
        merged: LevelRecord,
        /// Cells by which the first merged one reaches beyond the grid.
        before: [u32; 3],
        /// Edge of a merged cell, in cells.
        edge: u32,
        /// 1 − ϖg.
        kept: [f32; 3],
        /// c, 1/length.
        inverse_chord: f32,
        /// Extinction beyond which a merged cell counts as no denser, 1/length.
        densest: f32,
    }
}

record! {
    /// Push constants of `diffusion_spread.comp`.
    pub struct SpreadPush {
        /// The cells of the grid.
        fine: LevelRecord,
        /// The merged ones.
        merged: LevelRecord,
        /// Cells by which the first merged one reaches beyond the grid.
        before: [u32; 3],
        /// Edge of a merged cell, in cells.
        edge: u32,
    }
}

buffers! {
    /// Merged cells, as the cells have them.
    pub struct Scratch(room: Room) {
        /// `f32` by cell: extinction per length.
        density: Buffer => f32, room.n_bounce_cells(), "diffusion.merged_density", Floats;
        /// Q0 and q, then φ and F.
        field: Buffer => [[f32; 4]; 4], room.n_bounce_cells(), "diffusion.merged_field", Texels;
        /// φ and F before the bounces.
        before: Buffer => [[f32; 4]; 4], room.n_bounce_cells(), "diffusion.merged_before", Texels;
        /// Light that suns and lamps make each cell send out, beside its extinction.
        arrived: Buffer => [[f32; 4]; 4], room.n_bounce_cells(), "diffusion.merged_arrived", Texels;
    }
}

/// The kernels, and the merged cells.
pub(super) struct Merged {
    merge: Kernel,
    spread: Kernel,
    pub scratch: Scratch,
    pub edge: u32,
    most: u64,
}

impl Merged {
    /// Creates the kernels, and room for the merged cells of a grid.
    pub fn new(device: &Device, compiler: &Compiler, room: Room) -> Result<Merged> {
        let most = room.n_bounce_cells();
        Ok(Merged {
            merge: Kernel::new(device, compiler, "diffusion.merge", MergePush::FIELDS)?,
            spread: Kernel::new(device, compiler, "diffusion.spread", SpreadPush::FIELDS)?,
            scratch: Scratch::new(device, room)?,
            edge: room.bounce_cells,
            most,
        })
    }

    /// Merges cells whose sources are known, and returns the merged ones. `arrived` is what suns
    /// and lamps make each cell send out.
    ///
    /// # Errors
    /// Fails if there is no room for them.
    pub fn record_merge(
        &self,
        rec: &mut Recorder<'_>,
        cells: &Cells<'_>,
        arrived: &Buffer,
    ) -> Result<Cells<'_>> {
        let Scratch { density, field, arrived: merged, .. } = &self.scratch;
        let grid = cells.grid.merged(self.edge);
        let of = DiffusionParams { densest: cells.of.densest / self.edge as f32, ..cells.of };
        let few = Cells { grid, density, field, of };
        if u64::from(few.n_total()) > self.most {
            return Err(Error::limit(format!(
                "bounces between {} cells, where there is room for {}",
                few.n_total(),
                self.most
            )));
        }
        let push = MergePush {
            fine: level(&cells.grid),
            merged: level(&grid),
            before: cells.grid.cells_before(self.edge),
            edge: self.edge,
            kept: of.kept,
            inverse_chord: of.inverse_chord,
            densest: of.densest,
        };
        let all = [cells.field, arrived, density, field, merged];
        rec.dispatch(&self.merge, &all, &push, few.n_total())?;
        Ok(few)
    }

    /// Adds what bounces have changed to φ and F of the cells.
    pub fn record_spread(&self, rec: &mut Recorder<'_>, cells: &Cells<'_>) -> Result<()> {
        let Scratch { field, .. } = &self.scratch;
        let merged = level(&cells.grid.merged(self.edge));
        let (fine, before) = (level(&cells.grid), cells.grid.cells_before(self.edge));
        let push = SpreadPush { fine, merged, before, edge: self.edge };
        let all = [field, &self.scratch.before, cells.field];
        rec.dispatch(&self.spread, &all, &push, cells.n_total())
    }
}

fn level(grid: &GridRecord) -> LevelRecord {
    LevelRecord { n_cells: grid.n_cells, i_first: 0 }
}
