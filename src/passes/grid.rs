//! grid: deposits the blobs' extinction on a grid of cells.
//!
//! In: placed particles and their extinction. Out: density (extinction per length), cell (x, y, z)
//! at x + n_x (y + n_y z). Law: mass-conserving deposit, separable unless an ellipsoid is turned.
//! Source: model.md §8 and §14, passes.md. Error: half a quantum of the fixed-point sum a deposit,
//! and at most 2.5e-6 of a weight. Of these 3e-7 are from the formula of erf, and the rest from
//! rounding (1e-6 measured). Weights of turned ellipsoids also have the error of the places of
//! their slabs and rows. Where there are many blobs, wide ones are deposited on grids of wider
//! cells, each of which is spread to the one of half its edges. Where there are more, those of some
//! cells are deposited narrower than they are, and blurred.

use crate::error::{Error, Result};
use crate::gpu::{Buffer, BufferSpec, Compiler, Device, Kernel, Recorder, buffers};
use crate::layout::frame::{FIRST_BLUR, GridRecord, LAST_BLUR};
use crate::layout::particle::Shapes;
use crate::layout::record;

mod narrow;

use narrow::Narrow;
pub use narrow::{BlurPush, NarrowPush};

record! {
    /// Push constants of `grid_deposit.comp`.
    pub struct DepositPush {
        /// The density grid.
        grid: GridRecord,
        /// Number of particles.
        n_particles: u32,
        /// Quanta of a unit of mass.
        quanta_per_mass: f32,
        /// Number of grids, of ever wider cells.
        n_levels: u32,
        /// 1: blobs are deposited on wider cells, and else on the finest.
        is_wide: u32,
        /// 1: `grid_narrow.comp` deposits some blobs.
        has_narrow: u32,
    }
}

record! {
    /// Push constants of `grid_resolve.comp`.
    pub struct ResolvePush {
        /// Number of cells.
        n_cells: u32,
        /// Extinction per length of a quantum.
        density_per_quantum: f32,
    }
}

record! {
    /// Push constants of `grid_spread.comp`.
    pub struct SpreadPush {
        /// Cells of the grid along each axis.
        n_cells: [u32; 3],
        /// Place of its first cell in its buffers.
        i_first: u32,
        /// Cells of the grid of wider cells; 0 if there is none.
        n_wider: [u32; 3],
        /// Place of its first cell.
        i_first_wider: u32,
        /// Extinction per length of a quantum in one of the grid's cells.
        density_per_quantum: f32,
    }
}

/// Quanta of the heaviest particle's mass: 2³¹ in one cell fits a 32-bit word with room for
/// rounding up, and 2³³ such particles fit the 64-bit sum.
const QUANTA_OF_HEAVIEST: f64 = 2_147_483_648.0;

buffers! {
    /// Scratch of the pass for a number of cells, and for those of wider grids.
    pub struct Scratch(n_cells: u64, n_wide: u64) {
        /// Fixed-point sums by cell.
        sums: Buffer => [u32; 2], n_cells, "grid.sums";
        /// The same by wider cell.
        wide_sums: Buffer => [u32; 2], n_wide, "grid.wide_sums";
        /// Density by wider cell.
        wide: Buffer => f32, n_wide, "grid.wide";
    }
}

/// The deposits that there is room for.
#[derive(Debug, Clone, Copy)]
pub struct Room {
    /// Most cells of the grid.
    pub n_cells: u64,
    /// Whether blobs may be deposited on wider cells.
    pub has_levels: bool,
    /// Whether blobs may be deposited narrower than they are.
    pub has_narrow: bool,
}

impl Room {
    /// Returns the room for the cells of all wider grids: half of those of the finest. An axis has
    /// five cells or more, of which the next grid has at most three, and so on: less than a third
    /// together.
    fn n_wide(self) -> u64 {
        if self.has_levels { self.n_cells / 2 } else { 0 }
    }
}

/// Returns the sizes of the scratch buffers.
pub fn specs(room: Room) -> Vec<BufferSpec> {
    let mut specs = Scratch::specs(room.n_cells, room.n_wide());
    if room.has_narrow {
        specs.extend(narrow::specs(room.n_cells));
    }
    specs
}

/// The deposit of a frame.
#[derive(Debug, Clone, Copy)]
pub struct Deposit<'a> {
    /// The density grid.
    pub grid: &'a GridRecord,
    /// Number of particles.
    pub n_particles: u32,
    /// At least the greatest mass κ (2π)^{3/2} σ³ of a particle.
    pub heaviest: f64,
    /// Number of grids that particles may be deposited on, each with cells twice as wide.
    pub n_levels: u32,
    /// Greatest number of blurs; 0: no blob is deposited narrower than it is.
    pub n_blurs: u32,
}

/// The pipelines and scratch buffers of the pass.
pub struct Grid {
    deposit: Kernel,
    /// For ellipsoids whose axes are turned.
    turned: Option<Kernel>,
    resolve: Kernel,
    /// For wider grids, and for the finest where there are some.
    spread: Option<[Kernel; 2]>,
    narrow: Option<Narrow>,
    scratch: Scratch,
    room: Room,
}

impl Grid {
    /// Creates the pipelines and the scratch buffers.
    ///
    /// # Errors
    /// Fails if a shader does not compile or the device cannot hold the buffers.
    pub fn new(device: &Device, compiler: &Compiler, room: Room, shapes: Shapes) -> Result<Grid> {
        // A workgroup of one subgroup does not wait at its barriers, and a blob's few cells fill
        // it.
        let width = device.limits().subgroup_size.clamp(8, 64);
        let is_turned = shapes == Shapes::Turned;
        let macros = [("WORKGROUP", width), ("TURNED", u32::from(is_turned))];
        let fields = DepositPush::FIELDS;
        let kernel = |name| Kernel::with_macros(device, compiler, name, fields, &[], &macros);
        let spread = |finest: u32| {
            let macros = [("FINEST", finest)];
            let fields = SpreadPush::FIELDS;
            Kernel::with_macros(device, compiler, "grid.spread", fields, &[], &macros)
        };
        Ok(Grid {
            deposit: kernel("grid.deposit")?,
            turned: is_turned.then(|| kernel("grid.turned")).transpose()?,
            resolve: Kernel::new(device, compiler, "grid.resolve", ResolvePush::FIELDS)?,
            spread: if room.has_levels { Some([spread(0)?, spread(1)?]) } else { None },
            narrow: match room.has_narrow {
                true => Some(Narrow::new(device, compiler, room.n_cells)?),
                false => None,
            },
            scratch: Scratch::new(device, room.n_cells, room.n_wide())?,
            room,
        })
    }

    /// Returns the number of cells that the scratch buffers hold.
    pub fn capacity(&self) -> u64 {
        self.room.n_cells
    }

    /// Reallocates the scratch buffers for `n_cells` cells.
    ///
    /// # Errors
    /// Fails if the device cannot hold them.
    pub fn set_capacity(&mut self, device: &Device, n_cells: u64) -> Result<()> {
        let room = Room { n_cells, ..self.room };
        self.scratch = Scratch::new(device, room.n_cells, room.n_wide())?;
        if let Some(narrow) = &mut self.narrow {
            narrow.set_capacity(device, n_cells)?;
        }
        self.room = room;
        Ok(())
    }

    /// Writes the density of every cell of a grid.
    ///
    /// `placed`: `PlacedRecord`; `particles`: `ParticleRecord`; `density`: `f32` by cell.
    ///
    /// # Errors
    /// Fails if the grid has more cells than the scratch buffers.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        [placed, particles, density]: [&Buffer; 3],
        of: &Deposit<'_>,
    ) -> Result<()> {
        let Scratch { sums, wide_sums, .. } = &self.scratch;
        let levels = Levels::new(of);
        if levels.n_finest() > self.room.n_cells {
            return Err(Error::limit(format!(
                "a density grid of {} cells, where there is room for {}",
                levels.n_finest(),
                self.room.n_cells
            )));
        }
        let room = self.room.n_wide();
        if levels.n_wide() > room {
            return Err(Error::limit(format!(
                "density grids of {} wide cells, where there is room for {room}",
                levels.n_wide()
            )));
        }
        let quanta_per_mass =
            if of.heaviest > 0.0 { QUANTA_OF_HEAVIEST / of.heaviest } else { 0.0 };
        let quanta_per_mass = quanta_per_mass as f32;
        let narrow = self.narrow.as_ref().filter(|_| of.n_blurs > 0);
        let has_room = narrow.is_some() && (FIRST_BLUR + 1..=LAST_BLUR).contains(&of.n_blurs);
        if of.n_blurs > 0 && !has_room {
            return Err(Error::limit(format!(
                "a density grid with {} blurs, where there is no room for them",
                of.n_blurs
            )));
        }
        let push = DepositPush {
            grid: *of.grid,
            n_particles: of.n_particles,
            quanta_per_mass,
            n_levels: levels.0.len() as u32,
            is_wide: 0,
            has_narrow: narrow.is_some().into(),
        };
        let finest = &levels.0[0];
        rec.fill(sums, 0);
        self.deposit(rec, &[placed, particles, sums], &push)?;
        match self.spread.as_ref().filter(|_| levels.n_wide() > 0) {
            None => self.resolve(rec, density, finest)?,
            Some([spread, spread_finest]) => {
                rec.fill(wide_sums, 0);
                let push = DepositPush { is_wide: 1, ..push };
                self.deposit(rec, &[placed, particles, wide_sums], &push)?;
                let wide = &self.scratch.wide;
                for level in levels.0[1..].iter().rev() {
                    let n_cells = level.n_cells.iter().product();
                    rec.dispatch(spread, &[wide_sums, wide], level, n_cells)?;
                }
                let n_cells = finest.n_cells.iter().product();
                rec.dispatch(spread_finest, &[sums, wide, density], finest, n_cells)?;
            }
        }
        let Some(narrow) = narrow else { return Ok(()) };
        let Deposit { grid, n_particles, n_blurs, .. } = *of;
        let push = NarrowPush { grid: *grid, n_particles, quanta_per_mass, n_blurs };
        narrow.record(rec, [placed, particles, density], finest.density_per_quantum, &push)
    }

    /// Adds the particles' mass to the sums of the finest grid, or of all wider ones.
    fn deposit(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &[&Buffer; 3],
        push: &DepositPush,
    ) -> Result<()> {
        let kernels = [Some(&self.deposit), self.turned.as_ref()];
        for kernel in kernels.into_iter().flatten() {
            rec.dispatch_groups(kernel, buffers, push, push.n_particles)?;
        }
        Ok(())
    }

    /// Converts the sums of the finest grid to density.
    fn resolve(&self, rec: &mut Recorder<'_>, density: &Buffer, of: &SpreadPush) -> Result<()> {
        let n_cells = of.n_cells.iter().product();
        let push = ResolvePush { n_cells, density_per_quantum: of.density_per_quantum };
        rec.dispatch(&self.resolve, &[&self.scratch.sums, density], &push, n_cells)
    }
}

/// The grids of a frame, the finest first.
struct Levels(Vec<SpreadPush>);

impl Levels {
    fn new(of: &Deposit<'_>) -> Levels {
        let grid = of.grid;
        let volume = f64::from(grid.cell).powi(3) * f64::from(grid.aspect);
        // At most as many as 32 bits can shift by; the cells of a grid end long before.
        let n_levels = of.n_levels.clamp(1, u32::BITS - 1);
        let cells = |level: u32| grid.n_cells.map(|n| n.div_ceil(1 << level));
        let n_total = |level: u32| cells(level).iter().product::<u32>();
        let mut i_next = 0;
        let of_level = |level: u32| {
            let i_first = i_next;
            i_next += if level > 0 { n_total(level) } else { 0 };
            let n_wider = if level + 1 < n_levels { cells(level + 1) } else { [0; 3] };
            let wider = f64::from(1 << level).powi(3);
            let density = of.heaviest / QUANTA_OF_HEAVIEST / (volume * wider);
            SpreadPush {
                n_cells: cells(level),
                i_first,
                n_wider,
                i_first_wider: i_next,
                density_per_quantum: density as f32,
            }
        };
        Levels((0..n_levels).map(of_level).collect())
    }

    fn n_finest(&self) -> u64 {
        self.0[0].n_cells.iter().map(|n| u64::from(*n)).product()
    }

    fn n_wide(&self) -> u64 {
        let of = |level: &SpreadPush| level.n_cells.iter().map(|n| u64::from(*n)).product::<u64>();
        self.0[1..].iter().map(of).sum()
    }
}
