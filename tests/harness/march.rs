//! The march through the density grid (shaders/transmit.comp) in f32, with a running bound of its
//! optical depth.

use glam::{DVec3, IVec3};
use nimbus::model::grid::GridSpec;
use nimbus::model::light::Light;
use nimbus::model::sums::{Precision, Sums};
use nimbus::reference::{rounding, transmit};

use crate::bounded::{self, Bounded};
use crate::lights::{arrival, double};

/// A sum of terms with the errors of the terms and of the sum. The terms are f64 sums, which are
/// rounded to f32.
fn sum_of(terms: &[Bounded], sums: Sums) -> Bounded {
    if sums == Sums::default() {
        // The running total.
        return terms.iter().fold(Bounded::exact(0.0), |tau, term| tau.plus(*term));
    }
    let (value, error) = terms.iter().fold((0.0, 0.0), |(v, e), t| (v + t.value, e + t.error));
    let share = rounding::sum_error(sums, terms.len() as u64);
    Bounded { value, error: error + share * (value + error) + 1e-37 * terms.len() as f64 }
}

/// Numbers of the grid are f32 numbers.
pub struct March<'a> {
    pub spec: &'a GridSpec,
    pub cells: &'a [f64],
}

impl March<'_> {
    /// A cell's size; along y a product if cells are not cubes.
    fn edge(&self, axis: usize) -> Bounded {
        let cell = Bounded::exact(self.spec.cell);
        if axis == 1 && self.spec.aspect != 1.0 {
            cell.times(Bounded::exact(self.spec.aspect))
        } else {
            cell
        }
    }

    /// Returns the length of a step along `d` as a share of `step` cells: the length of d if the
    /// cells are cubes.
    fn in_widths(&self, d: [Bounded; 3]) -> Bounded {
        if self.spec.aspect == 1.0 {
            return Bounded::exact(1.0);
        }
        let up = d[1].times(Bounded::once(1.0 / self.spec.aspect));
        let [x, y, z] = [d[0], up, d[2]].map(Bounded::squared);
        x.plus(y).plus(z).root()
    }

    /// Returns where the ray enters the box, and where it leaves it or ends. high = low + cell·n,
    /// then a difference and a quotient, the largest entry and the smallest exit.
    fn crossing(&self, p: [f32; 3], d: [Bounded; 3], distance: Bounded) -> [Bounded; 2] {
        let exact = Bounded::exact;
        let (mut enter, mut leave) = (vec![exact(0.0)], vec![distance]);
        for i in (0..3).filter(|&i| d[i].value != 0.0) {
            let n = f64::from(self.spec.n_cells[i]);
            let low = exact(self.spec.low[i]);
            let high = low.plus(self.edge(i).times(exact(n)));
            let [a, b] = [low, high].map(|side| side.minus(exact(f64::from(p[i]))).over(d[i]));
            let (first, second) = if a.value < b.value { (a, b) } else { (b, a) };
            enter.push(first);
            leave.push(second);
        }
        let extreme = |of: &[Bounded], pick: fn(f64, f64) -> f64| {
            let by =
                |f: &dyn Fn(&Bounded) -> f64| of.iter().map(f).reduce(pick).expect("one at least");
            let (value, low, high) =
                (by(&|b| b.value), by(&|b| b.value - b.error), by(&|b| b.value + b.error));
            Bounded { value, error: (value - low).max(high - value) }
        };
        [extreme(&enter, f64::max), extreme(&leave, f64::min)]
    }

    /// Returns τ of a march with its terms.
    pub fn depth(&self, p: [f32; 3], light: &Light, step: f64, sums: Sums) -> Bounded {
        match sums.precision {
            Precision::F32 => self.depth_in_floats(p, light, step, sums),
            Precision::F64 => self.depth_in_doubles(p, light, step, sums),
        }
    }

    fn depth_in_floats(&self, p: [f32; 3], light: &Light, step: f64, sums: Sums) -> Bounded {
        let way = light.arrival(double(p));
        // A ray that misses the box by less than the rounding would only meet its outermost cells,
        // which are empty.
        if transmit::crossing(self.spec, double(p), way.toward, way.distance).is_none() {
            return Bounded::exact(0.0);
        }
        let way = arrival(light, p);
        let distance = if way.distance.value.is_finite() {
            way.distance
        } else {
            Bounded::exact(f64::from(f32::MAX))
        };
        let [enter, leave] = self.crossing(p, way.toward, distance);
        let length = leave.minus(enter);
        let s = Bounded::once(step * self.spec.cell);
        let s = if self.spec.aspect == 1.0 { s } else { s.over(self.in_widths(way.toward)) };
        let n = transmit::n_steps(length.value, s.value);
        let mut terms = vec![];
        let mut last_error = 0.0;
        for k in 0..n {
            let start = s.times(Bounded::exact(f64::from(k)));
            let rest = length.minus(start);
            let ds = if s.value <= rest.value { s } else { rest };
            // The minimum of two lengths errs no more than either, and if it surely is the step, no
            // more than the step.
            let surely_s = s.value + s.error < rest.value - rest.error;
            let ds =
                Bounded { error: if surely_s { s.error } else { s.error.max(rest.error) }, ..ds };
            let at = enter.plus(start.plus(ds.scaled(0.5)));
            let x =
                [0, 1, 2].map(|i| Bounded::exact(f64::from(p[i])).plus(at.times(way.toward[i])));
            let rho = self.density_at(x, bounded::U);
            terms.push(rho.times(ds));
            last_error = rho.value * (rest.error + s.error) + rho.error * s.value;
        }
        let tau = sum_of(&terms, sums);
        // The length is near a multiple of the step: one step more or fewer, no longer than the
        // error of the rest. A last step that only the f64 march has is in `last_error`. A last
        // step that only the f32 march has is as short, and its density is at most the largest one.
        let steps = length.value / s.value;
        let short = length.error + s.error * (steps + 1.0);
        let densest = self.cells.iter().cloned().fold(0.0, f64::max);
        let beside = (steps - steps.round()).abs() * s.value <= short;
        let more = if way.distance.value.is_finite() { densest * short } else { 0.0 };
        Bounded { error: tau.error + if beside { last_error + more } else { 0.0 }, ..tau }
    }

    /// In f64: positions err by the step, which is an f32 number, and by some hundred roundings of
    /// f64.
    fn depth_in_doubles(&self, p: [f32; 3], light: &Light, step: f64, sums: Sums) -> Bounded {
        const SLACK: f64 = 1e-13;
        let way = light.arrival(double(p));
        let Some((enter, leave)) =
            transmit::crossing(self.spec, double(p), way.toward, way.distance)
        else {
            return Bounded::exact(0.0);
        };
        let (length, s) = (leave - enter, step / self.spec.cells_along(way.toward));
        // The step is an f32 number; so is its divisor 1/aspect if cells are not cubes.
        let rounded =
            (f64::from((step * self.spec.cell) as f32) / (step * self.spec.cell) - 1.0).abs() * s
                + if self.spec.aspect == 1.0 { 0.0 } else { bounded::U * s };
        let n = transmit::n_steps(length, s);
        let scale = self.spec.low.abs().max_element() + enter.abs() + length;
        let mut terms = vec![];
        let mut last_error = 0.0;
        for k in 0..n {
            let start = f64::from(k) * s;
            // The step's own error; for the last, shorter step the error of all steps before it.
            let moved = f64::from(k + 1) * rounded + SLACK * scale;
            let ds = Bounded { value: s.min(length - start), error: moved.min(s) };
            let at = double(p) + (enter + (start + 0.5 * ds.value)) * way.toward;
            let x = [0, 1, 2].map(|i| Bounded {
                value: at[i],
                error: moved * way.toward[i].abs() + SLACK * scale,
            });
            let rho = self.density_at(x, 0.0);
            let ds = if length - start > s + moved {
                Bounded { error: rounded + SLACK * s, ..ds }
            } else {
                ds
            };
            let error = rho.value * ds.error + rho.error * (ds.value + ds.error);
            terms.push(Bounded {
                value: rho.value * ds.value,
                error: error + SLACK * rho.value * ds.value,
            });
            last_error = rho.value * ds.error + rho.error * s;
        }
        // A step more or fewer, as in f32.
        let steps = length / s;
        let short = (steps + 1.0) * rounded + SLACK * scale;
        let densest = self.cells.iter().cloned().fold(0.0, f64::max);
        let beside = (steps - steps.round()).abs() * s <= short;
        let tau = sum_of(&terms, sums);
        Bounded {
            error: tau.error + if beside { last_error + densest * short } else { 0.0 },
            ..tau
        }
    }

    /// Returns a length from the grid's corner, in cells.
    fn in_cells(&self, x: Bounded, axis: usize) -> Bounded {
        let wide = x.times(Bounded::once(1.0 / self.spec.cell));
        if axis == 1 && self.spec.aspect != 1.0 {
            wide.times(Bounded::once(1.0 / self.spec.aspect))
        } else {
            wide
        }
    }

    /// Returns the trilinear density. Its bound is the position's error times the steepest slope
    /// among the cells around, and the rounding of three levels of (1 − f) a + f b, three
    /// operations each, of non-negative numbers. `u`: unit round-off, 0 if nothing is rounded to
    /// f32.
    fn density_at(&self, x: [Bounded; 3], u: f64) -> Bounded {
        let value =
            nimbus::reference::grid::sample(self.spec, self.cells, DVec3::from(x.map(|x| x.value)));
        let exact = Bounded::exact;
        let g = [0, 1, 2].map(|i| match u > 0.0 {
            true => self.in_cells(x[i].minus(exact(self.spec.low[i])), i).minus(exact(0.5)),
            false => {
                let (edge, at) = (self.spec.edges()[i], x[i].value - self.spec.low[i]);
                let shape = if i == 1 && self.spec.aspect != 1.0 {
                    bounded::U * (at / edge).abs()
                } else {
                    0.0
                };
                Bounded { value: at / edge - 0.5, error: x[i].error / edge + shape }
            }
        });
        let base = IVec3::from(g.map(|g| g.value.floor() as i32));
        let (slopes, any) = self.slopes(base);
        let moved: f64 = (0..3).map(|i| slopes[i] * g[i].error).sum();
        let rounding = if any { 9.0 * u * (value + moved) * (1.0 + 1e-5) + 1e-37 } else { 0.0 };
        Bounded { value, error: moved + rounding }
    }

    /// Returns the largest difference of neighbours along each axis among the 4³ cells around, and
    /// whether any cell is not empty.
    fn slopes(&self, base: IVec3) -> ([f64; 3], bool) {
        let n = self.spec.n_cells.as_ivec3();
        let cell = |at: IVec3| {
            let inside = at.cmpge(IVec3::ZERO).all() && at.cmplt(n).all();
            if inside { self.cells[(at.x + n.x * (at.y + n.y * at.z)) as usize] } else { 0.0 }
        };
        let mut slopes = [0f64; 3];
        let mut any = false;
        for k in 0..64 {
            let at = base + IVec3::new(k % 4, k / 4 % 4, k / 16) - 1;
            let here = cell(at);
            any |= here > 0.0;
            for (axis, slope) in slopes.iter_mut().enumerate() {
                if at[axis] < base[axis] + 2 {
                    *slope = slope.max((cell(at + IVec3::AXES[axis]) - here).abs());
                }
            }
        }
        (slopes, any)
    }
}
