//! Winds of a weather file, and how they carry the detail of its clouds (model.md §15).

use std::f64::consts::PI;

use glam::DVec3;

use super::grid::{Grid, Shape};
use super::noise_space::NoiseSpace;

/// Deformation of detail from its birth to its death: the root mean square of the wind's gradient
/// times that time. Ages are half of it in the mean, and so detail that is seen is deformed by 1.5.
/// An eddy of turbulence lives for about a deformation of 1. 3 is a choice.
const DEFORMATION: f64 = 3.0;
/// Numbers of noises before the first one comes again.
const N_NOISES: i64 = 1 << 20;

/// Horizontal winds of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Winds {
    shape: Shape,
    /// Velocity eastward and southward of every cell, m/s.
    cells: Vec<[f64; 2]>,
}

impl Winds {
    /// Combines winds in m/s on the faces of cells. A cell has the mean of its faces.
    ///
    /// *Shape*: `eastward` [nz][ny][nx + 1] on western and eastern faces, `northward`
    /// [nz][ny + 1][nx] on southern and northern ones.
    pub fn new(shape: Shape, eastward: &[f64], northward: &[f64]) -> Winds {
        let Shape { nx, ny, .. } = shape;
        let of = |i: usize| {
            let (x, y, k) = (i % nx, i / nx % ny, i / (nx * ny));
            let west = x + (nx + 1) * (y + ny * k);
            let south = x + nx * (y + (ny + 1) * k);
            let mean = |a: f64, b: f64| 0.5 * (a + b);
            [
                mean(eastward[west], eastward[west + 1]),
                -mean(northward[south], northward[south + nx]),
            ]
        };
        Winds { shape, cells: (0..shape.n_cells()).map(of).collect() }
    }

    /// Returns the velocity, m/s, at a place of a cell, which is from −½ to ½ eastward, upward and
    /// southward. It is trilinear between the middles of cells, and even beyond the outermost.
    pub fn at(&self, i_cell: usize, at: DVec3) -> DVec3 {
        let Shape { nx, ny, nz } = self.shape;
        let cell = [i_cell % nx, i_cell / (nx * ny), i_cell / nx % ny];
        // Rows run north, and z points south.
        let lean = [at.x, at.y, -at.z];
        let next = [0, 1, 2].map(|axis| {
            let n = [nx, nz, ny][axis];
            if lean[axis] < 0.0 {
                cell[axis].saturating_sub(1)
            } else {
                (cell[axis] + 1).min(n - 1)
            }
        });
        let mut sum = [0.0; 2];
        for corner in 0..8 {
            let (mut weight, mut of) = (1.0, cell);
            for axis in 0..3 {
                let beyond = lean[axis].abs();
                if corner >> axis & 1 == 1 {
                    (weight, of[axis]) = (weight * beyond, next[axis]);
                } else {
                    weight *= 1.0 - beyond;
                }
            }
            let wind = self.cells[of[0] + nx * (of[2] + ny * of[1])];
            sum = [sum[0] + weight * wind[0], sum[1] + weight * wind[1]];
        }
        DVec3::new(sum[0], 0.0, sum[1])
    }

    /// Returns the square of the gradient of the velocity in a cell, s⁻². Velocities and lengths
    /// are in the units of the noise, and the squares of the gradient's entries add up.
    fn gradient_squared(&self, grid: &Grid, space: &NoiseSpace, i_cell: usize) -> f64 {
        let i_column = i_cell % grid.shape().n_columns();
        let (dx, dy) = (grid.ground.dx_m[i_column], grid.ground.dy_m[i_column]);
        let lengths = DVec3::new(dx / space.unit_m.x, 1.0 / space.levels, dy / space.unit_m.z);
        // Half a cell to both sides.
        let of = |axis: DVec3| {
            let change = self.at(i_cell, 0.5 * axis) - self.at(i_cell, -0.5 * axis);
            (space.in_units(change) / axis.dot(lengths)).length_squared()
        };
        DVec3::AXES.into_iter().map(of).sum()
    }
}

/// A step whose winds carry detail.
#[derive(Debug, Clone, Copy)]
pub struct CarriedStep<'a> {
    /// Grid of the step.
    pub grid: &'a Grid,
    /// Extinction of every cell, m⁻¹.
    pub extinction: &'a [f64],
    /// Its winds.
    pub winds: &'a Winds,
}

/// Returns the life of detail in the winds of some steps, s. It goes by the mean over the cells
/// with extinction, or over all cells where none has any. It is infinite in even winds.
pub fn life_s(steps: &[CarriedStep]) -> f64 {
    let mean_square = |of_all: bool| {
        let (mut sum, mut n) = (0.0, 0.0);
        for CarriedStep { grid, extinction, winds } in steps {
            let space = NoiseSpace::new(grid);
            for i in (0..extinction.len()).filter(|&i| of_all || extinction[i] > 0.0) {
                sum += winds.gradient_squared(grid, &space, i);
                n += 1.0;
            }
        }
        (n > 0.0).then(|| sum / n)
    };
    match mean_square(false).or_else(|| mean_square(true)) {
        Some(square) if square > 0.0 => DEFORMATION / square.sqrt(),
        _ => f64::INFINITY,
    }
}

/// The wind that carries the noise of a detail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Carrier<'a> {
    /// One velocity, m/s, for a time, s.
    Evenly(DVec3, f64),
    /// Winds of two moments.
    Flow(Flow<'a>),
}

/// Winds at a moment between two steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flow<'a> {
    /// Winds at both steps.
    pub winds: [&'a Winds; 2],
    /// Part of the way to the second step.
    pub weight: f64,
    /// Life of the detail, s ([`life_s`]).
    pub life_s: f64,
    /// The moment, s from any beginning.
    pub time_s: f64,
}

/// A noise of several that are added.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Noise {
    /// Its number: others are independent.
    pub number: u32,
    /// Its factor. Squares of factors add up to 1, and so noises keep their variance.
    pub factor: f64,
    /// Time for which it has been carried, s.
    pub age_s: f64,
}

impl Carrier<'_> {
    /// No wind.
    pub const NONE: Carrier<'static> = Carrier::Evenly(DVec3::ZERO, 0.0);

    /// Returns the noises of this moment.
    pub(super) fn noises(&self) -> Vec<Noise> {
        match self {
            Carrier::Evenly(_, time_s) => noises(*time_s, f64::INFINITY),
            Carrier::Flow(flow) => noises(flow.time_s, flow.life_s),
        }
    }

    /// Returns the velocity at a place of a cell ([`Winds::at`]), m/s.
    pub(super) fn velocity(&self, i_cell: usize, at: DVec3) -> DVec3 {
        match self {
            Carrier::Evenly(velocity, _) => *velocity,
            Carrier::Flow(Flow { winds: [from, to], weight, .. }) => {
                from.at(i_cell, at).lerp(to.at(i_cell, at), *weight)
            }
        }
    }
}

/// Returns the noises at a time. Winds deform what they carry, more with every second. So a noise
/// is born again after a life, as another one. Of two, one is in the middle of its life while the
/// other changes, unseen.
fn noises(time_s: f64, life_s: f64) -> Vec<Noise> {
    if !life_s.is_finite() {
        return vec![Noise { number: 0, factor: 1.0, age_s: time_s }];
    }
    let of = |k: i64| {
        let lives = time_s / life_s + 0.5 * k as f64;
        let age = lives - lives.floor();
        let number = (2 * lives.floor() as i64 + k).rem_euclid(N_NOISES) as u32;
        Noise { number, factor: (PI * age).sin(), age_s: age * life_s }
    };
    [0, 1].map(of).into_iter().filter(|noise| noise.factor > 0.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::weather::grid::Ground;

    const SHAPE: Shape = Shape { nx: 3, ny: 2, nz: 2 };

    /// Winds of 10 x + y + 100 k m/s eastward on western faces, and of 7 y northward.
    fn winds() -> Winds {
        let east = (0..16).map(|i| 10 * (i % 4) + i / 4 % 2 + 100 * (i / 8));
        let north = (0..18).map(|i| 7 * (i / 3 % 3));
        let numbers = |all: Vec<i32>| all.into_iter().map(f64::from).collect::<Vec<f64>>();
        Winds::new(SHAPE, &numbers(east.collect()), &numbers(north.collect()))
    }

    fn grid() -> Grid {
        let ones = vec![1.0; 6];
        let ground = Ground::new(SHAPE, (100.0, 200.0), (&ones, &ones), false).unwrap();
        Grid::new(ground, (0..18).map(|i| 50.0 * f64::from(i / 6)).collect()).unwrap()
    }

    #[test]
    fn winds_by_hand() {
        let winds = winds();
        // Column 1 of row 1 at level 1: between 111 and 121; northward between 7 and 14.
        let is = |i_cell: usize, at: [f64; 3], expected: [f64; 2]| {
            let off = winds.at(i_cell, DVec3::from(at)) - DVec3::new(expected[0], 0.0, expected[1]);
            assert!(off.length() < 1e-12, "{i_cell} {at:?}: {off}");
        };
        is(10, [0.0; 3], [116.0, -10.5]);
        // Halfway to the next column, level and row, which lies north; and beyond the last ones.
        is(1, [0.5, 0.0, 0.0], [20.0, -3.5]);
        is(1, [0.0, 0.5, 0.0], [65.0, -3.5]);
        is(1, [0.0, 0.0, -0.5], [15.5, -7.0]);
        is(10, [0.0, 0.4, -0.3], [116.0, -10.5]);
        is(8, [0.5, 0.0, 0.0], [125.0, -3.5]);
        // A face has one wind.
        let [a, b] = [(0, 0.5), (1, -0.5)].map(|(i, x)| winds.at(i, DVec3::new(x, 0.1, 0.2)));
        assert!(a.distance(b) < 1e-12, "{a} {b}");
    }

    #[test]
    fn the_life_of_detail_by_hand() {
        // A unit is two cells wide, and two cells' width over their height, 2 or 4 of them, high.
        let grid = grid();
        let mut extinction = [0.0; 12];
        extinction[1] = 1.0;
        let space = NoiseSpace::new(&grid);
        assert_eq!((space.unit_m, space.levels), (DVec3::new(200.0, 200.0, 400.0), 4.0));
        // Changes over half a cell to both sides. Eastward they are 10 m/s in half a unit, and
        // southward 3.5 m/s and −0.5 m/s in half of one. Upward they are 50 m/s in a quarter, as
        // there is no level below.
        let squares = [10.0 / 100.0, 0.5 / 100.0, 3.5 / 200.0, 50.0 / 50.0].map(|v: f64| v * v);
        let expected = 3.0 / squares.iter().sum::<f64>().sqrt();
        let (winds, clear) = (winds(), vec![0.0; 12]);
        let step = |extinction, winds| CarriedStep { grid: &grid, extinction, winds };
        let cloudy = step(&extinction[..], &winds);
        assert!((life_s(&[cloudy]) / expected - 1.0).abs() < 1e-12);
        let even = Winds { shape: SHAPE, cells: vec![[30.0, -4.0]; 12] };
        assert_eq!(life_s(&[step(&extinction[..], &even)]), f64::INFINITY);
        // A clear step says nothing, unless all are clear, and an even one half.
        assert_eq!(life_s(&[step(&clear[..], &winds), cloudy]), life_s(&[cloudy]));
        assert!(life_s(&[step(&clear[..], &winds)]).is_finite());
        let both = life_s(&[step(&extinction[..], &even), cloudy]);
        assert!((both / (expected * 2f64.sqrt()) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn noises_change_unseen_and_keep_their_variance() {
        let life_s = 80.0;
        assert_eq!(noises(0.0, life_s), [Noise { number: 1, factor: 1.0, age_s: 40.0 }]);
        for step in -200..200 {
            let at = 1.3 * f64::from(step);
            let (now, soon) = (noises(at, life_s), noises(at + 1e-3, life_s));
            let variance: f64 = now.iter().map(|noise| noise.factor.powi(2)).sum();
            assert!((variance - 1.0).abs() < 1e-12);
            for noise in &now {
                assert!((0.0..life_s).contains(&noise.age_s) && noise.factor > 0.0);
                // It is there a millisecond later, as much and as much older, or it has gone.
                match soon.iter().find(|other| other.number == noise.number) {
                    Some(other) => {
                        assert!((other.factor - noise.factor).abs() < 1e-4);
                        assert!((other.age_s - noise.age_s - 1e-3).abs() < 1e-9);
                    }
                    None => assert!(noise.factor < 1e-4),
                }
            }
        }
        // Two lives later both are others.
        let numbers = |at: f64| noises(at, life_s).iter().map(|n| n.number).collect::<Vec<u32>>();
        assert_eq!(numbers(10.0), [0, 1]);
        assert_eq!(numbers(50.0), [0, 3]);
        assert_eq!(numbers(90.0), [2, 3]);
        assert_eq!(numbers(-10.0), [(N_NOISES - 2) as u32, 1]);
        assert_eq!(noises(7.0, f64::INFINITY), [Noise { number: 0, factor: 1.0, age_s: 7.0 }]);
    }
}
