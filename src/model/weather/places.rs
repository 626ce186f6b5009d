//! Places of blobs in their cells and their drawing order: even, and constant for every (seed,
//! cell, number).

use glam::DVec3;

use crate::model::philox::{philox4x32_10, uniform};

/// "weat": a Philox stream of its own.
const STREAM: u32 = 0x7765_6174;
/// Roots of x³ = x + 1, whose powers spread points of a plane most evenly, and of x² = x + 1 for
/// the heights. Any first points of a cell are spread evenly. *Source*: Roberts, "The unreasonable
/// effectiveness of quasirandom sequences" (2018).
const PLANE_ROOT: f64 = 1.324_717_957_244_746;
const LINE_ROOT: f64 = 1.618_033_988_749_895;
/// Step of the widths of a cell's blobs: √2 − 1, which no step of the places repeats.
const WIDTH_STEP: f64 = std::f64::consts::SQRT_2 - 1.0;
/// Width of the widest of a cell's blobs, and of the narrowest its inverse, over the middle one.
const WIDEST: f64 = 1.5;
/// Root of the mean square of W^t for t from −1 to 1: √(sinh u/u) with u = 2 ln W.
const MEAN_WIDTH: f64 = 1.055_112_306_602_911_8;
/// Greatest width of a blob over the common one of its cell ([`CellSeed::width`]).
pub const GREATEST_WIDTH: f64 = WIDEST / MEAN_WIDTH;

/// Random numbers of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellSeed {
    shift: DVec3,
    /// Shift of the drawing order, in [0, 1).
    order: f64,
}

impl CellSeed {
    /// Draws the random numbers of a cell.
    pub fn new(seed: u32, i_cell: u32) -> Self {
        let words = philox4x32_10([seed, STREAM], [i_cell, 0, 0, 0]);
        let [x, y, z, order] = words.map(uniform);
        CellSeed { shift: DVec3::new(x, y, z), order }
    }

    /// Returns the place of the cell's `number`-th blob, in [−½, ½)³.
    pub fn place(self, number: u32) -> DVec3 {
        let steps = DVec3::new(1.0 / PLANE_ROOT, 1.0 / LINE_ROOT, 1.0 / (PLANE_ROOT * PLANE_ROOT));
        let at = self.shift + steps * (f64::from(number) + 1.0);
        at - at.floor() - 0.5
    }

    /// Returns the width of the `number`-th of `n` blobs over their common one. A blob alone has 1;
    /// of many, the logarithms are spread evenly, and the squares are 1 in the mean over cells.
    pub fn width(self, number: u32, n: u32) -> f64 {
        if n == 1 {
            return 1.0;
        }
        // The sum of uniform numbers modulo 1 is uniform, and independent of each of them.
        let shift = self.shift.element_sum();
        let even = (shift + f64::from(number) * WIDTH_STEP).fract();
        WIDEST.powf(2.0 * even - 1.0) / MEAN_WIDTH
    }

    /// Returns the position of the `number`-th of `n` blobs in the drawing order, in [0, 1). Any
    /// first part of the order holds the same part of every cell.
    pub fn order(self, number: u32, n: u32) -> f64 {
        (f64::from(number) + self.order) / f64::from(n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_even_and_keep_their_place() {
        let cell = CellSeed::new(7, 3);
        assert!((PLANE_ROOT.powi(3) - PLANE_ROOT - 1.0).abs() < 1e-14);
        assert!((LINE_ROOT.powi(2) - LINE_ROOT - 1.0).abs() < 1e-14);
        let (mut plane, mut line) = ([0; 16], [0; 16]);
        for number in 0..160 {
            let p = cell.place(number) + 0.5;
            plane[(p.x * 4.0) as usize * 4 + (p.z * 4.0) as usize] += 1;
            line[(p.y * 16.0) as usize] += 1;
        }
        // Random points would have 10 ± 3.2 and stray to 4 and 17.
        assert!(plane.iter().chain(&line).all(|n| (7..=13).contains(n)), "{plane:?} {line:?}");
        assert_ne!(CellSeed::new(7, 4), cell);
        assert_ne!(CellSeed::new(8, 3), cell);
    }

    #[test]
    fn widths_are_spread_and_keep_the_area() {
        let cell = CellSeed::new(7, 3);
        assert_eq!(cell.width(0, 1), 1.0);
        let widths: Vec<f64> = (0..400).map(|number| cell.width(number, 400)).collect();
        let least = GREATEST_WIDTH / (WIDEST * WIDEST);
        assert!(widths.iter().all(|w| (least..=GREATEST_WIDTH).contains(w)));
        // As many in each quarter of the logarithms.
        for quarter in 0..4 {
            let part = |q: i32| least * WIDEST.powf(0.5 * f64::from(q));
            let range = part(quarter)..part(quarter + 1);
            let n = widths.iter().filter(|w| range.contains(w)).count();
            assert!((96..=104).contains(&n), "{n}");
        }
        let area = widths.iter().map(|w| w * w).sum::<f64>() / 400.0;
        assert!((area - 1.0).abs() < 5e-3, "{area}");
        let u = 2.0 * WIDEST.ln();
        assert!((MEAN_WIDTH - (u.sinh() / u).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn a_first_part_of_the_order_has_that_part_of_every_cell() {
        for i_cell in 0..50 {
            let cell = CellSeed::new(1, i_cell);
            let n_first = (0..40).filter(|&number| cell.order(number, 40) < 0.25).count();
            assert!((9..=11).contains(&n_first), "{n_first}");
            assert!((0..40).all(|number| (0.0..1.0).contains(&cell.order(number, 40))));
        }
    }
}
