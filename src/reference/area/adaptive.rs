//! Adaptive cubature over triangles. Dunavant's rule of degree 8 gives the value, Radon's of degree
//! 5 the error. The cell of greatest error is halved across its longest edge until the sum of all
//! errors is small enough.

use std::collections::BinaryHeap;

use glam::{DVec2, DVec3};

use super::clip::Polygon;

/// Accuracy that an integral must reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Error as a share of the result, both in their greatest channel.
    pub relative: f64,
    /// Error that is small enough whatever the result.
    pub absolute: f64,
    /// Greatest number of evaluations of the integrand.
    pub max_evaluations: usize,
}

impl Accuracy {
    /// Returns a relative accuracy with a limit of two million evaluations.
    pub const fn relative(relative: f64) -> Accuracy {
        Accuracy { relative, absolute: 0.0, max_evaluations: 2_000_000 }
    }

    fn is_met(&self, value: DVec3, error: DVec3) -> bool {
        error.max_element() <= self.relative * value.abs().max_element() + self.absolute
    }
}

/// Radiance, irradiance, and their own known errors: (of radiance, of irradiance, 0).
pub type Sample = [DVec3; 3];

/// No light.
pub const NOTHING: Sample = [DVec3::ZERO; 3];

/// An integral with its error estimates.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Estimate {
    /// Radiance, W m⁻² sr⁻¹.
    pub radiance: DVec3,
    /// Irradiance, W m⁻².
    pub irradiance: DVec3,
    /// Estimated error of the radiance, greatest channel. It sums over cells the greater of |degree
    /// 8 − degree 5|, the error of the lesser rule, and half of the change by the last halving.
    /// Infinite if the evaluations ran out before every lobe, light and blob was resolved.
    pub error: f64,
    /// Estimated error of the irradiance, likewise.
    pub irradiance_error: f64,
    /// Number of evaluations of the integrand.
    pub n_evaluations: usize,
}

/// A triangle of region `i_region`, in its rectangle's coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Corners.
    pub corners: [DVec2; 3],
    /// Index of the region.
    pub i_region: usize,
}

/// A function over the regions of rectangles.
pub trait Integrand {
    /// Returns the value per unit area of the rectangle's coordinates.
    fn at(&self, i_region: usize, x: DVec2) -> Sample;
    /// Returns whether the cell is small enough for the rules to notice everything in it.
    fn is_resolved(&self, cell: &Cell) -> bool;
    /// Returns the squared length of the step `d`.
    fn length_squared(&self, i_region: usize, d: DVec2) -> f64;
    /// Returns the factor on the rules' difference in the error estimate. It is 1 where the
    /// integrand is smooth within cells, so that the greater degree errs much less; more where it
    /// has kinks and both err alike.
    fn safety_factor(&self) -> f64 {
        1.0
    }
}

impl Cell {
    fn area(&self) -> f64 {
        let [a, b, c] = self.corners;
        0.5 * (b - a).perp_dot(c - a).abs()
    }

    /// Halves the cell across its longest edge.
    fn halves(&self, f: &dyn Integrand) -> [Cell; 2] {
        let edge =
            |i: usize| f.length_squared(self.i_region, self.corners[(i + 1) % 3] - self.corners[i]);
        let lengths = [edge(0), edge(1), edge(2)];
        let i = (0..3).fold(0, |best, i| if lengths[i] > lengths[best] { i } else { best });
        let [a, b, c] = [self.corners[i], self.corners[(i + 1) % 3], self.corners[(i + 2) % 3]];
        let middle = 0.5 * (a + b);
        [[a, middle, c], [middle, b, c]].map(|corners| Cell { corners, ..*self })
    }
}

/// Divides a polygon into a fan of triangles.
pub fn triangles(polygon: &Polygon, i_region: usize) -> impl Iterator<Item = Cell> {
    (1..polygon.len().saturating_sub(1))
        .map(move |i| Cell { corners: [polygon[0], polygon[i], polygon[i + 1]], i_region })
}

/// Barycentric coordinates, weight in the rule of degree 8, weight in the rule of degree 5.
type Node = ([f64; 3], f64, f64);

/// Orbits of Dunavant's 16-point rule of degree 8: (one coordinate, another, weight). *Source*:
/// Int. J. Numer. Meth. Engng 21, 1985.
const DEGREE_8: [(f64, f64, f64); 5] = [
    (1.0 / 3.0, 1.0 / 3.0, 0.144_315_607_677_787_2),
    (0.459_292_588_292_723_1, 0.459_292_588_292_723_1, 0.095_091_634_267_284_6),
    (0.170_569_307_751_760_2, 0.170_569_307_751_760_2, 0.103_217_370_534_718_3),
    (0.050_547_228_317_031_0, 0.050_547_228_317_031_0, 0.032_458_497_623_198_1),
    (0.008_394_777_409_957_6, 0.263_112_829_634_638_1, 0.027_230_314_174_434_99),
];

/// Returns the 22 nodes of both rules, which share the centroid.
fn nodes() -> Vec<Node> {
    let root = 15f64.sqrt();
    let (a, b) = ((6.0 - root) / 21.0, (6.0 + root) / 21.0);
    let mut nodes = Vec::with_capacity(22);
    for &(x, y, w) in &DEGREE_8 {
        orbit(&mut nodes, x, y, w, 0.0);
    }
    nodes[0].2 = 9.0 / 40.0;
    orbit(&mut nodes, a, a, 0.0, (155.0 - root) / 1200.0);
    orbit(&mut nodes, b, b, 0.0, (155.0 + root) / 1200.0);
    nodes
}

/// Adds all different orders of (x, y, 1 − x − y).
fn orbit(nodes: &mut Vec<Node>, x: f64, y: f64, high: f64, low: f64) {
    let z = 1.0 - x - y;
    let orders: &[[f64; 3]] = match (x == y, x == 1.0 / 3.0) {
        (true, true) => &[[x, y, x]],
        (true, false) => &[[x, y, z], [y, z, x], [z, x, y]],
        _ => &[[x, y, z], [y, z, x], [z, x, y], [y, x, z], [x, z, y], [z, y, x]],
    };
    nodes.extend(orders.iter().map(|&at| (at, high, low)));
}

/// A cell with its integral.
struct CellEstimate {
    /// The error as a share of the total, of radiance or irradiance, whichever is greater. The cell
    /// with the greatest key is halved next.
    key: f64,
    cell: Cell,
    value: Sample,
    error: [DVec3; 2],
}

impl PartialEq for CellEstimate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}
impl Eq for CellEstimate {}
impl PartialOrd for CellEstimate {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for CellEstimate {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.key.total_cmp(&other.key)
    }
}

/// Least key: below it only rounding is left to halve away.
const MIN_KEY: f64 = 1e-17;

fn integrate_cell(f: &dyn Integrand, nodes: &[Node], cell: Cell) -> CellEstimate {
    let [a, b, c] = cell.corners;
    let (mut high, mut low) = (NOTHING, NOTHING);
    for &([x, y, z], w_high, w_low) in nodes {
        let value = f.at(cell.i_region, x * a + y * b + z * c);
        for k in 0..2 {
            high[k] += w_high * value[k];
            low[k] += w_low * value[k];
        }
        // The known error may be infinite, and the lesser rule's nodes have no weight in the value.
        if w_high > 0.0 {
            high[2] += w_high * value[2];
        }
    }
    let area = cell.area();
    let error = [0, 1].map(|k| f.safety_factor() * area * (high[k] - low[k]).abs());
    CellEstimate { key: 0.0, cell, value: high.map(|v| area * v), error }
}

/// Raises the errors of both halves to half of the change by halving. Where the integrand is smooth
/// the change is less than the rules' difference; across a jump it is not.
fn widen_errors(halves: &mut [CellEstimate; 2], whole: &CellEstimate) {
    for k in 0..2 {
        let change = 0.5 * (halves[0].value[k] + halves[1].value[k] - whole.value[k]).abs();
        halves.iter_mut().for_each(|half| half.error[k] = half.error[k].max(change));
    }
}

fn key(m: &CellEstimate, scale: [f64; 2]) -> f64 {
    let share = |k: usize| if scale[k] > 0.0 { m.error[k].max_element() / scale[k] } else { 0.0 };
    share(0).max(share(1))
}

/// Sums value and error over all cells, on top of the part that is known exactly.
fn total<'a>(known: Sample, cells: impl Iterator<Item = &'a CellEstimate>) -> (Sample, [DVec3; 2]) {
    cells.fold((known, [DVec3::ZERO; 2]), |(v, e), m| {
        (
            [v[0] + m.value[0], v[1] + m.value[1], v[2] + m.value[2]],
            [e[0] + m.error[0], e[1] + m.error[1]],
        )
    })
}

/// Halves cells until each is resolved. The second value tells whether the number of cells
/// sufficed.
fn resolve(
    f: &dyn Integrand,
    cells: impl Iterator<Item = Cell>,
    max_cells: usize,
) -> (Vec<Cell>, bool) {
    let (mut open, mut done): (Vec<Cell>, _) = (cells.collect(), Vec::new());
    while let Some(cell) = open.pop() {
        if f.is_resolved(&cell) {
            done.push(cell);
        } else if open.len() + done.len() < max_cells {
            open.extend(cell.halves(f));
        } else {
            done.push(cell);
            done.append(&mut open);
            return (done, false);
        }
    }
    (done, true)
}

/// Integrates over `cells`, and adds `known`.
pub fn integrate(
    f: &dyn Integrand,
    cells: impl Iterator<Item = Cell>,
    known: Sample,
    accuracy: &Accuracy,
) -> Estimate {
    let nodes = nodes();
    let (cells, all_resolved) = resolve(f, cells, (accuracy.max_evaluations / nodes.len()).max(1));
    let mut n_evaluations = cells.len() * nodes.len();
    let estimates: Vec<CellEstimate> =
        cells.into_iter().map(|cell| integrate_cell(f, &nodes, cell)).collect();
    let (mut value, mut error) = total(known, estimates.iter());
    let scale = [0, 1].map(|k| value[k].abs().max_element() + error[k].max_element());
    let keyed = |mut m: CellEstimate| {
        m.key = key(&m, scale);
        m
    };
    let mut heap: BinaryHeap<CellEstimate> = estimates.into_iter().map(keyed).collect();
    let met =
        |v: &Sample, e: &[DVec3; 2]| accuracy.is_met(v[0], e[0]) && accuracy.is_met(v[1], e[1]);
    while all_resolved
        && n_evaluations + 2 * nodes.len() <= accuracy.max_evaluations
        && !met(&value, &error)
    {
        let Some(worst) = heap.pop() else { break };
        if worst.key.is_nan() || worst.key <= MIN_KEY {
            heap.push(worst);
            break;
        }
        let mut halves = worst.cell.halves(f).map(|cell| integrate_cell(f, &nodes, cell));
        widen_errors(&mut halves, &worst);
        for half in halves.map(keyed) {
            (0..3).for_each(|k| value[k] += half.value[k]);
            (0..2).for_each(|k| error[k] += half.error[k]);
            heap.push(half);
        }
        (0..3).for_each(|k| value[k] -= worst.value[k]);
        // The running sum may round below the true rest, but never below 0.
        (0..2).for_each(|k| error[k] = (error[k] - worst.error[k]).max(DVec3::ZERO));
        n_evaluations += 2 * nodes.len();
    }
    // The final sums are free of the running sums' roundings.
    let (value, error) = total(known, heap.iter());
    let known_error =
        |k: usize| if all_resolved { error[k].max_element() + value[2][k] } else { f64::INFINITY };
    Estimate {
        radiance: value[0],
        irradiance: value[1],
        error: known_error(0),
        irradiance_error: known_error(1),
        n_evaluations,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::area::clip::WHOLE;

    struct Function<F: Fn(DVec2) -> f64>(F);

    impl<F: Fn(DVec2) -> f64> Integrand for Function<F> {
        fn at(&self, _: usize, x: DVec2) -> Sample {
            [DVec3::splat((self.0)(x)), DVec3::ZERO, DVec3::ZERO]
        }
        fn is_resolved(&self, _: &Cell) -> bool {
            true
        }
        fn length_squared(&self, _: usize, d: DVec2) -> f64 {
            d.length_squared()
        }
    }

    fn over_square(f: impl Fn(DVec2) -> f64, accuracy: &Accuracy) -> Estimate {
        integrate(&Function(f), triangles(&WHOLE.to_vec(), 0), NOTHING, accuracy)
    }

    #[test]
    fn the_rules_have_their_degrees() {
        // ∫ x^i y^j over the unit triangle = i! j! / (i + j + 2)!; the mean is twice that.
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        let nodes = nodes();
        assert_eq!(nodes.len(), 22);
        let off = |i: i32, j: i32, weight: fn(&Node) -> f64| {
            let mean: f64 = nodes.iter().map(|n| weight(n) * n.0[0].powi(i) * n.0[1].powi(j)).sum();
            (mean - 2.0 * factorial(i) * factorial(j) / factorial(i + j + 2)).abs()
        };
        for (i, j) in (0..=8).flat_map(|i| (0..=8 - i).map(move |j| (i, j))) {
            // Nodes of 16 digits: 22 roundings of 1e-16.
            assert!(off(i, j, |n| n.1) < 4e-15, "{i} {j} {}", off(i, j, |n| n.1));
            assert!(i + j > 5 || off(i, j, |n| n.2) < 4e-16, "{i} {j}");
        }
        assert!(off(3, 6, |n| n.1) > 1e-7 && off(2, 4, |n| n.2) > 1e-6);
    }

    #[test]
    fn smooth_integrands_converge_with_the_rule_and_the_error_bounds_the_truth() {
        // ∫∫ e^{s + 2t} over the square = (e − 1/e)(e² − e^{−2})/2.
        let truth = 4.0 * 1f64.sinh() * 2f64.sinh() / 2.0;
        let with =
            |relative| over_square(|x| (x.x + 2.0 * x.y).exp(), &Accuracy::relative(relative));
        for relative in [1e-3, 1e-6, 1e-9, 1e-12] {
            let e = with(relative);
            let off = (e.radiance.x - truth).abs();
            assert!(
                off <= e.error + 1e-14 * truth && e.error <= relative * truth,
                "{relative} {off} {e:?}"
            );
        }
        // Halving every edge takes 4 times the cells; the value's error falls with 2^-10 (degree 9
        // is odd on pairs of triangles), the estimate's with 2^-6. Four halvings of area.
        let fixed = |n_cells: usize| {
            let accuracy =
                Accuracy { relative: 0.0, absolute: 0.0, max_evaluations: 22 * (2 * n_cells - 2) };
            over_square(|x| (x.x + 2.0 * x.y).exp(), &accuracy)
        };
        let (coarse, fine) = (fixed(8), fixed(32));
        let ratio = |f: &dyn Fn(&Estimate) -> f64| f(&coarse) / f(&fine);
        assert!(ratio(&|e| e.error) > 2f64.powi(5), "{}", ratio(&|e| e.error));
        assert!(ratio(&|e| (e.radiance.x - truth).abs()) > 2f64.powi(8));
    }

    #[test]
    fn the_error_bounds_a_jump_within_any_number_of_evaluations() {
        // The quarter disc's edge crosses the cells: area π/4.
        let step =
            |x: DVec2| if x.length_squared() < 1.0 && x.x > 0.0 && x.y > 0.0 { 1.0 } else { 0.0 };
        for max_evaluations in [500, 5_000, 50_000] {
            let e = over_square(step, &Accuracy { relative: 0.0, absolute: 0.0, max_evaluations });
            let off = (e.radiance.x - std::f64::consts::FRAC_PI_4).abs();
            assert!(off <= e.error && e.n_evaluations <= max_evaluations, "{off} {e:?}");
        }
        let e = over_square(step, &Accuracy::relative(1e-2));
        assert!(e.error <= 1e-2 * e.radiance.x);
    }
}
