//! The march through the density grid (shaders/transmit.comp), evaluated in f32: a running bound of
//! its optical depth.

use glam::{DVec3, IVec3};
use nimbus::model::grid::GridSpec;
use nimbus::model::light::Light;
use nimbus::model::sums::{Precision, Sums};
use nimbus::reference::{rounding, transmit};

use crate::bounded::{self, Bounded};
use crate::lights::{arrival, double};

/// The sum of terms, and what they and the sum may err: of f64 sums, when it is rounded to f32.
fn sum_of(terms: &[Bounded], sums: Sums) -> Bounded {
    if sums == Sums::default() {
        // As it grows.
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
    /// A cell's: along y a product where it is no cube.
    fn edge(&self, axis: usize) -> Bounded {
        let cell = Bounded::exact(self.spec.cell);
        if axis == 1 && self.spec.aspect != 1.0 {
            cell.times(Bounded::exact(self.spec.aspect))
        } else {
            cell
        }
    }

    /// How much shorter than `step` cells a step along `d` is: the length of d where the cells are
    /// cubes.
    fn in_widths(&self, d: [Bounded; 3]) -> Bounded {
        if self.spec.aspect == 1.0 {
            return Bounded::exact(1.0);
        }
        let up = d[1].times(Bounded::once(1.0 / self.spec.aspect));
        let [x, y, z] = [d[0], up, d[2]].map(Bounded::squared);
        x.plus(y).plus(z).root()
    }

    /// Where the way enters the box and leaves it or ends: high = low + cell·n, then a difference
    /// and a quotient, and the greatest of those that enter, the least of those that leave.
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

    /// τ of a march, term by term, and its sum as it is formed.
    pub fn depth(&self, p: [f32; 3], light: &Light, step: f64, sums: Sums) -> Bounded {
        match sums.precision {
            Precision::F32 => self.depth_in_floats(p, light, step, sums),
            Precision::F64 => self.depth_in_doubles(p, light, step, sums),
        }
    }

    fn depth_in_floats(&self, p: [f32; 3], light: &Light, step: f64, sums: Sums) -> Bounded {
        let way = light.arrival(double(p));
        // A way that passes the box by less than the rounding would pass through its outermost
        // cells, which are empty.
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
            // The lesser of two errs no more than they, and where it surely is the step no more
            // than that.
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
        // A length beside a multiple of the step: one step more or less, no longer than the error
        // of the rest. A last step that the f64 side has and the other lacks is in `last_error`
        // when it is that short; one that only the other has is as short, in no more density than
        // there is anywhere.
        let steps = length.value / s.value;
        let short = length.error + s.error * (steps + 1.0);
        let densest = self.cells.iter().cloned().fold(0.0, f64::max);
        let beside = (steps - steps.round()).abs() * s.value <= short;
        let more = if way.distance.value.is_finite() { densest * short } else { 0.0 };
        Bounded { error: tau.error + if beside { last_error + more } else { 0.0 }, ..tau }
    }

    /// The same in doubles: places err by the step, which is an f32 number, and by some hundred
    /// roundings of doubles.
    fn depth_in_doubles(&self, p: [f32; 3], light: &Light, step: f64, sums: Sums) -> Bounded {
        const SLACK: f64 = 1e-13;
        let way = light.arrival(double(p));
        let Some((enter, leave)) =
            transmit::crossing(self.spec, double(p), way.toward, way.distance)
        else {
            return Bounded::exact(0.0);
        };
        let (length, s) = (leave - enter, step / self.spec.cells_along(way.toward));
        // The step is an f32 number; where cells are no cubes so is 1/aspect, which it is divided
        // by.
        let rounded =
            (f64::from((step * self.spec.cell) as f32) / (step * self.spec.cell) - 1.0).abs() * s
                + if self.spec.aspect == 1.0 { 0.0 } else { bounded::U * s };
        let n = transmit::n_steps(length, s);
        let scale = self.spec.low.abs().max_element() + enter.abs() + length;
        let mut terms = vec![];
        let mut last_error = 0.0;
        for k in 0..n {
            let start = f64::from(k) * s;
            // The step's own error, or with the last and shorter one that of all the steps before.
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
        // A step more or less, as in floats.
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

    /// A length from the grid's corner, in cells.
    fn in_cells(&self, x: Bounded, axis: usize) -> Bounded {
        let wide = x.times(Bounded::once(1.0 / self.spec.cell));
        if axis == 1 && self.spec.aspect != 1.0 {
            wide.times(Bounded::once(1.0 / self.spec.aspect))
        } else {
            wide
        }
    }

    /// Trilinear density: what the position's error makes of it, by the steepest slope among the
    /// cells around; and the rounding of three levels of (1 − f) a + f b, three operations each, of
    /// numbers that are not negative. `u`: unit round-off, 0 where no f32 is rounded.
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

    /// Greatest difference of neighbours along each axis among the 4³ cells around, and whether any
    /// holds something.
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
