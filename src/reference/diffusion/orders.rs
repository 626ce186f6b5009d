//! The second and the third order of what cells send out.

use std::f64::consts::PI;

use glam::DVec3;

use crate::reference::harmonics::harmonics;

/// Values by harmonic of the second order and of the third.
pub type High = [DVec3; 12];

/// Harmonics of the second order; those of the third follow.
const N_SECOND: usize = 5;

/// Light that cells send out, times 4π: evenly, by a cosine along each axis, and by high orders.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sent {
    pub low: [DVec3; 4],
    pub high: High,
}

impl Sent {
    /// Adds a multiple of what other cells send out.
    pub fn add(&mut self, times: f64, of: &Sent) {
        self.low.iter_mut().zip(of.low).for_each(|(sum, v)| *sum += times * v);
        self.high.iter_mut().zip(of.high).for_each(|(sum, v)| *sum += times * v);
    }
}

/// Returns the high orders of a unit direction, Y_lm times √(4π/(2l + 1)). Of two directions, the
/// sum of the products over an order is Legendre's polynomial of their cosine.
pub fn high_orders(w: DVec3) -> [f64; 12] {
    let all = harmonics(w);
    let scaled = |k: usize| all[4 + k] * (4.0 * PI / of_order(k, [5.0, 7.0])).sqrt();
    std::array::from_fn(scaled)
}

/// Returns the one of two values that belongs to the order of harmonic `k`.
pub fn of_order(k: usize, [second, third]: [f64; 2]) -> f64 {
    if k < N_SECOND { second } else { third }
}

/// Returns the sum of the orders along `w`.
pub fn along(high: &High, w: DVec3) -> DVec3 {
    high.iter().zip(high_orders(w)).map(|(of, y)| y * *of).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_of_two_directions_make_legendre_polynomials() {
        let first = DVec3::new(0.6, -0.48, 0.64);
        for (a, b) in [(first, DVec3::new(-2.0, 3.0, 6.0) / 7.0), (first, first), (first, DVec3::Z)]
        {
            let (a_orders, b_orders, c) = (high_orders(a), high_orders(b), a.dot(b));
            let products: Vec<f64> = a_orders.iter().zip(b_orders).map(|(a, b)| a * b).collect();
            let second: f64 = products[..N_SECOND].iter().sum();
            let third: f64 = products[N_SECOND..].iter().sum();
            assert!((second - (1.5 * c * c - 0.5)).abs() < 1e-15, "{second}");
            assert!((third - (2.5 * c * c - 1.5) * c).abs() < 1e-15, "{third}");
        }
    }
}
