//! Number of a cloud's particles that are drawn and their weights, C (4)–(6), model.md §3.

/// Returns n/n₀ as C prints it: (r/r₀)³ (1 − α), α = 1 − e^{p/a}, p = −d/d₀. If `normalised` it is
/// divided by its value at d₀ and r₀.
pub fn printed(d_over_d0: f64, r_over_r0: f64, a: f64, normalised: bool) -> f64 {
    let kept = |d: f64| 1.0 + libm::expm1(-d / a);
    let share = r_over_r0 * r_over_r0 * r_over_r0 * kept(d_over_d0);
    if normalised { share / kept(1.0) } else { share }
}

/// Returns the factor on κ of each of a group's `n` particles where n/n₀ = `share`: 1 for whole
/// particles, the remainder for the last, 0 for those not drawn. With `conserve` all are divided by
/// the share, by at most n.
pub fn weights(n: u32, share: f64, conserve: bool) -> Vec<f64> {
    let share = share.min(1.0);
    let x = f64::from(n) * share;
    let whole = |k: u32| (x - f64::from(k)).clamp(0.0, 1.0);
    let dense = if conserve { f64::from(n).min(1.0 / share) } else { 1.0 };
    (0..n).map(|k| whole(k) * dense).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_count_at_its_own_distance() {
        // e^{−1/280} = 0.996434941…: C's n₀ is not its count there.
        assert!((printed(1.0, 1.0, 280.0, false) - 0.996_434_941).abs() < 1e-9);
        assert_eq!(printed(1.0, 1.0, 280.0, true), 1.0);
        assert_eq!(printed(0.0, 1.0, 280.0, false), 1.0);
        // At 280 ln 2 half are left; a cloud twice as large has eight times as many.
        let half = 280.0 * std::f64::consts::LN_2;
        assert!((printed(half, 1.0, 280.0, false) - 0.5).abs() < 1e-15);
        assert!((printed(half, 2.0, 280.0, false) - 4.0).abs() < 1e-14);
    }

    #[test]
    fn weights_are_ones_a_rest_and_zeros() {
        assert_eq!(weights(4, 0.625, false), [1.0, 1.0, 0.5, 0.0]);
        assert_eq!(weights(4, 0.625, true), [1.6, 1.6, 0.8, 0.0]);
        assert_eq!(weights(4, 0.5, false), [1.0, 1.0, 0.0, 0.0]);
        // Half a particle stands for half of all four.
        assert_eq!(weights(4, 0.125, true), [2.0, 0.0, 0.0, 0.0]);
        assert_eq!((weights(3, 7.0, true), weights(0, 0.5, true)), (vec![1.0; 3], vec![]));
    }
}
