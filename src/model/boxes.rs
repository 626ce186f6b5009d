//! A cloud's macrostructure as boxes: P, Table 1 and P (1)–(11). The two readings of the equations,
//! the radius law's constants and the bound on rejection, which the GPU and the reference share.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

use super::named::named;

/// Attempts before a particle is folded back into its box. P's Fig. 1 sets no bound, but a box as
/// thin as a needle accepts almost nothing. At an acceptance of 50 %, 64 attempts fail once in 2⁶⁴
/// particles.
pub const MAX_ATTEMPTS: u32 = 64;

/// One line of a box file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudBox {
    /// Number of particles.
    pub n_particles: u32,
    /// X_L, Y_L, Z_L: whole edge lengths along x, y, z.
    pub extent: DVec3,
    /// C: centre, relative to the cloud's position.
    pub center: DVec3,
    /// R_max.
    pub radius_max: f64,
}

named! {
    /// A reading of P (1)–(11).
    pub enum Form {
        /// Corrected: positions from [−L, L), y from Y, radii scaled so that P (9) holds.
        Centred = "centred",
        /// The equations as printed: positions from [0, L), y from Z, radii that exceed R_max.
        Printed = "printed",
    }
}

/// How a cloud's particles are made from its boxes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxLaw {
    /// Reading of P (1)–(11).
    pub form: Form,
    /// Optical depth through the centre of a blob of a box's mean radius.
    pub optical_depth: f64,
    /// Factor on the radii of the box file.
    pub radius_scale: f64,
}

impl BoxLaw {
    /// Returns the law of a scene that sets neither optical depth nor scale: both are 1.
    pub const fn new(form: Form) -> BoxLaw {
        BoxLaw { form, optical_depth: 1.0, radius_scale: 1.0 }
    }
}

/// Returns P (10)–(11) without scale: R + π/2 sin R.
pub fn radius_shape(r: f64) -> f64 {
    r + FRAC_PI_2 * r.sin()
}

/// Returns the greatest value of [`radius_shape`] over [0, `radius_max`].
///
/// Interior maxima lie at R* + 2πk, cos R* = −2/π, and grow with k. Only the last one inside and
/// the right end can be greatest.
fn radius_shape_max(radius_max: f64) -> f64 {
    let first = (-2.0 / PI).acos();
    let end = radius_shape(radius_max);
    if radius_max < first {
        return end;
    }
    let k = ((radius_max - first) / (2.0 * PI)).floor();
    end.max(radius_shape(first + 2.0 * PI * k))
}

/// Returns the factor on P (11)'s radius: 1 as printed; in the centred form the one for which the
/// greatest radius is R_max.
pub fn radius_factor(form: Form, radius_max: f64) -> f64 {
    match form {
        Form::Printed => 1.0,
        Form::Centred if radius_max > 0.0 => radius_max / radius_shape_max(radius_max),
        Form::Centred => 0.0,
    }
}

/// Returns the mean radius of a box's particles: the mean of `factor`·(R + π/2 sin R) over R
/// uniform in [0, R_max].
pub fn mean_radius(form: Form, radius_max: f64) -> f64 {
    if radius_max <= 0.0 {
        return 0.0;
    }
    // 1 − cos R = 2 sin²(R/2) keeps its accuracy for small R.
    let half = (0.5 * radius_max).sin();
    radius_factor(form, radius_max)
        * (0.5 * radius_max + FRAC_PI_2 * 2.0 * half * half / radius_max)
}

/// Returns the mean radius weighted by the particles' areas, ∫r³/∫r² over R, by the midpoint rule.
pub fn mean_radius_by_area(form: Form, radius_max: f64) -> f64 {
    /// The rule errs by some (R/n)²/24 of r''/r, far less than a slice's thickness matters.
    const N: u32 = 64;
    if radius_max <= 0.0 {
        return 0.0;
    }
    let at = |i: u32| radius_shape(radius_max * (f64::from(i) + 0.5) / f64::from(N));
    let sum = |power: i32| (0..N).map(|i| at(i).powi(power)).sum::<f64>();
    radius_factor(form, radius_max) * sum(3) / sum(2)
}

/// Returns the greatest radius that a particle of the box can have.
pub fn max_radius(form: Form, radius_max: f64) -> f64 {
    radius_factor(form, radius_max) * radius_shape_max(radius_max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radius_maximum_by_scan() {
        for radius_max in [0.3, 1.0, 2.0, 2.26, 2.3, 3.0, 5.0, 8.0, 8.6, 20.0] {
            let scan = (0..=200_000)
                .map(|i| radius_shape(radius_max * f64::from(i) / 200_000.0))
                .fold(0.0, f64::max);
            // The scan's step h misses a maximum by at most h²/2 · max|g''| = (R/2e5)²/2 · π/2 <
            // 1e-8.
            assert!((radius_shape_max(radius_max) - scan).abs() < 1e-8, "{radius_max}");
        }
    }

    #[test]
    fn centred_radii_obey_p9_and_printed_ones_do_not() {
        for radius_max in [1e-30, 0.5, 2.1, 3.0, 40.0] {
            let greatest = max_radius(Form::Centred, radius_max);
            assert!((greatest / radius_max - 1.0).abs() < 1e-15);
        }
        assert!(max_radius(Form::Printed, 2.1) > 2.1);
        assert_eq!(max_radius(Form::Centred, 0.0), 0.0);
    }

    #[test]
    fn mean_radius_by_area_of_small_radii_by_hand() {
        // For small R the shape is a line through 0: ∫R³/∫R² over [0, 1] is (1/4)/(1/3).
        for radius_max in [1e-6, 1e-3] {
            let mean = mean_radius_by_area(Form::Printed, radius_max);
            let greatest = max_radius(Form::Printed, radius_max);
            assert!((mean / greatest - 0.75).abs() < 1e-4, "{radius_max} {}", mean / greatest);
        }
        for radius_max in [1.0, 2.1, 6.0] {
            let [mean, by_area, most] = [mean_radius, mean_radius_by_area, max_radius]
                .map(|f| f(Form::Centred, radius_max));
            assert!(mean < by_area && by_area < most, "{radius_max}: {mean} {by_area} {most}");
        }
        assert_eq!(mean_radius_by_area(Form::Centred, 0.0), 0.0);
    }

    #[test]
    fn mean_radius_by_midpoint_rule() {
        for form in [Form::Centred, Form::Printed] {
            for radius_max in [0.01, 2.0, 7.0] {
                let n = 20_000;
                let sum: f64 = (0..n)
                    .map(|i| radius_shape(radius_max * (f64::from(i) + 0.5) / f64::from(n)))
                    .sum();
                let mean = radius_factor(form, radius_max) * sum / f64::from(n);
                // Midpoint rule: R²/24n² · max|g''| relative to g: below 1e-7.
                assert!((mean_radius(form, radius_max) / mean - 1.0).abs() < 1e-7);
            }
        }
    }
}
