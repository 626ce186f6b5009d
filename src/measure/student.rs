//! Student's distribution, for intervals whose spread is itself estimated.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// The 97.5th percentile of the normal distribution.
const Z: f64 = 1.959_963_984_540_054;

/// Returns the 97.5th percentile of Student's distribution: a 95 % interval reaches that many
/// standard errors to each side.
///
/// `degrees` are the degrees of freedom, at least 2.
pub fn student_95(degrees: f64) -> f64 {
    Z * student_by_normal(degrees)
}

/// Returns the chance of a value of Student's distribution that is further from 0 than `t`, to
/// either side. `degrees` are above 0.
pub(super) fn student_tail(t: f64, degrees: f64) -> f64 {
    // Only degrees that are not above 0 fail.
    StudentsT::new(0.0, 1.0, degrees).map_or(1.0, |of| 2.0 * of.sf(t.abs()))
}

/// Returns the 97.5th percentile of Student's distribution divided by that of the normal one.
///
/// *Source*: Abramowitz and Stegun 26.7.5, accurate to 1 % from two degrees of freedom on and to
/// 0.05 % from four.
pub(super) fn student_by_normal(degrees: f64) -> f64 {
    let (z2, v) = (Z * Z, degrees);
    let terms = [
        (z2 + 1.0) / 4.0,
        ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0,
        (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0,
        ((((79.0 * z2 + 776.0) * z2 + 1482.0) * z2 - 1920.0) * z2 - 945.0) / 92_160.0,
    ];
    1.0 + terms.iter().rev().fold(0.0, |sum, term| (sum + term) / v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_the_tabled_ones() {
        // t at 97.5 %, from any table of it.
        for (degrees, t, tolerance) in
            [(2.0, 4.303, 1e-2), (4.0, 2.776, 5e-4), (10.0, 2.228, 5e-4), (28.0, 2.048, 5e-4)]
        {
            let got = student_95(degrees);
            assert!((got / t - 1.0_f64).abs() < tolerance, "{got} for {t}");
        }
    }

    #[test]
    fn tails_are_the_tabled_ones() {
        // Both tails beyond t, from any table of it; and the exact one of one degree, 1 − 2
        // atan(t)/π, far out.
        for (t, degrees, p) in [(2.776, 4.0, 0.05), (4.587, 10.0, 0.001), (2.763, 28.0, 0.01)] {
            let got = student_tail(t, degrees);
            assert!((got / p - 1.0_f64).abs() < 1e-3, "{got} for {p}");
        }
        let far = 1.0 - 2.0 * 1e6_f64.atan() / std::f64::consts::PI;
        assert!((student_tail(1e6, 1.0) / far - 1.0).abs() < 1e-6);
        assert_eq!((student_tail(f64::INFINITY, 5.0), student_tail(0.0, 5.0)), (0.0, 1.0));
    }
}
