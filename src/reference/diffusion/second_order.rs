//! The second order of what cells send out.

use std::f64::consts::PI;

use glam::DVec3;

use crate::reference::harmonics::harmonics;

/// Values by harmonic of the second order.
pub type Second = [DVec3; 5];

/// Returns Y_2m of a unit direction times √(4π/5). The sum of the products at two directions is
/// Legendre's polynomial of the cosine between them.
pub fn second_order(w: DVec3) -> [f64; 5] {
    let all = harmonics(w);
    std::array::from_fn(|m| all[4 + m] * (4.0 * PI / 5.0).sqrt())
}

/// Returns the second order along `w`.
pub fn along(second: &Second, w: DVec3) -> DVec3 {
    second.iter().zip(second_order(w)).map(|(of, y)| y * *of).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn harmonics_of_two_directions_make_legendres_polynomial() {
        let first = DVec3::new(0.6, -0.48, 0.64);
        for other in [DVec3::new(-2.0, 3.0, 6.0) / 7.0, first, DVec3::Z] {
            let c = first.dot(other);
            let products = second_order(first).into_iter().zip(second_order(other));
            let sum: f64 = products.map(|(a, b)| a * b).sum();
            // A dozen roundings of numbers below 1.
            assert!((sum - (1.5 * c * c - 0.5)).abs() < 2e-15, "{sum}");
        }
    }
}
