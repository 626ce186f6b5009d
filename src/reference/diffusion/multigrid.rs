//! Multigrid: the equations on ever coarser grids, and cycles through them.

use glam::{DVec3, USizeVec3};

use super::system::{System, next};
use crate::model::grid::coarser;

/// The equations on every grid, the finest first.
#[derive(Debug, Clone)]
pub struct Multigrid {
    levels: Vec<System>,
    /// Axes along which the next grid is coarser.
    halved: Vec<[bool; 3]>,
}

/// Sweeps of the coarsest grid.
const COARSEST_SWEEPS: u32 = 16;
/// Steps of a pair of sweeps: a long and a short one together damp what neighbours do not share
/// best.
const STEPS: [f64; 2] = [1.6, 0.6];

/// Returns the cell of the coarser grid that cell `c` of `n` belongs to.
fn parent(n: USizeVec3, coarse: USizeVec3, halved: [bool; 3], c: usize) -> usize {
    let at = USizeVec3::new(c % n.x, c / n.x % n.y, c / (n.x * n.y));
    let of = |axis: usize| if halved[axis] { at[axis] / 2 } else { at[axis] };
    of(0) + coarse.x * (of(1) + coarse.y * of(2))
}

impl Multigrid {
    /// Returns `finest` with all coarser grids. `edges` are those of the finest cells.
    pub fn new(finest: System, edges: DVec3) -> Multigrid {
        let (mut levels, mut halved, mut edges) = (vec![finest], vec![], edges);
        loop {
            let fine = levels.last().unwrap_or_else(|| unreachable!("there is the finest"));
            let n = fine.n_cells.as_uvec3();
            let Some((coarse, axes)) = coarser(n, edges) else { break };
            levels.push(merged(fine, coarse.as_usizevec3(), axes));
            halved.push(axes);
            edges *= DVec3::from(axes.map(|is| if is { 2.0 } else { 1.0 }));
        }
        Multigrid { levels, halved }
    }

    /// Returns φ after a number of cycles from φ = 0.
    pub fn solve(&self, n_cycles: u32) -> Vec<DVec3> {
        let mut phi = vec![DVec3::ZERO; self.levels[0].sink.len()];
        for _ in 0..n_cycles {
            self.cycle(0, &mut phi, &self.levels[0].source);
        }
        phi
    }

    /// Two sweeps, a correction by the coarser grid, and two sweeps.
    fn cycle(&self, level: usize, phi: &mut Vec<DVec3>, source: &[DVec3]) {
        let system = &self.levels[level];
        let Some(axes) = self.halved.get(level) else {
            for _ in 0..COARSEST_SWEEPS {
                system.sweep_by_colors(phi, source);
            }
            return;
        };
        STEPS.iter().for_each(|step| *phi = system.swept(phi, source, *step));
        let coarse = self.levels[level + 1].n_cells;
        let of = |c: usize| parent(system.n_cells, coarse, *axes, c);
        let n_coarse = coarse.element_product();
        let mut rest = vec![DVec3::ZERO; n_coarse];
        for c in 0..phi.len() {
            rest[of(c)] += source[c] - system.applied(phi, c);
        }
        let mut correction = vec![DVec3::ZERO; n_coarse];
        self.cycle(level + 1, &mut correction, &rest);
        for (c, phi) in phi.iter_mut().enumerate() {
            *phi += correction[of(c)];
        }
        STEPS.iter().for_each(|step| *phi = system.swept(phi, source, *step));
    }
}

impl System {
    /// Returns φ after a sweep of Jacobi's: every φ moves toward the solution of its own equation,
    /// by the given step.
    fn swept(&self, phi: &[DVec3], source: &[DVec3], step: f64) -> Vec<DVec3> {
        let of = |c: usize| phi[c] + step * (source[c] - self.applied(phi, c)) / self.diagonal(c);
        (0..phi.len()).map(of).collect()
    }

    /// Solves the equation of each cell for its own φ, first in the even cells of a chessboard,
    /// then in the odd ones.
    fn sweep_by_colors(&self, phi: &mut [DVec3], source: &[DVec3]) {
        let n = self.n_cells;
        for color in [0, 1] {
            for c in 0..phi.len() {
                let at = [c % n.x, c / n.x % n.y, c / (n.x * n.y)];
                if at.iter().sum::<usize>() % 2 == color {
                    phi[c] += (source[c] - self.applied(phi, c)) / self.diagonal(c);
                }
            }
        }
    }
}

/// Returns the equations of a coarser grid. The faces between merged cells add up, and count half
/// along a merged axis, as centres lie twice as far apart.
fn merged(fine: &System, coarse: USizeVec3, halved: [bool; 3]) -> System {
    let n = coarse.element_product();
    let mut of = System {
        n_cells: coarse,
        next: vec![[DVec3::ZERO; 3]; n],
        sink: vec![DVec3::ZERO; n],
        source: vec![],
    };
    for c in 0..fine.sink.len() {
        let own = parent(fine.n_cells, coarse, halved, c);
        of.sink[own] += fine.sink[c];
        for axis in 0..3 {
            let Some(after) = next(fine.n_cells, c, axis) else { continue };
            if parent(fine.n_cells, coarse, halved, after) != own {
                of.next[own][axis] += fine.next[c][axis] * if halved[axis] { 0.5 } else { 1.0 };
            }
        }
    }
    of
}
