//! A Gaussian blob of extinction, model.md §14: a ball or an ellipsoid. Optical depths along lines
//! through it, and the slopes between which it is seen, in f64.

use glam::{DMat2, DMat3, DVec2, DVec3};

use crate::model::cloud::{SQRT_TAU, Shape};

/// A blob of extinction ρ(x) = κ exp(−|M (x − p)|²/2σ²), M that of its shape, relative to the
/// lighting origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blob {
    /// p: centre.
    pub position: DVec3,
    /// σ along the first axis of its shape: of an upright one that along x and z.
    pub sigma: f64,
    /// Its shape.
    pub shape: Shape,
    /// κ: peak extinction per unit length.
    pub kappa: f64,
}

/// A whole line through a blob.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// b/σ, the distance from the centre where the blob is scaled to a ball: τ falls off as
    /// e^{−b²/2σ²}.
    pub off: f64,
    /// τ of a line of the same direction through the centre.
    pub depth: f64,
}

impl Line {
    /// Returns τ of the line.
    pub fn tau(&self) -> f64 {
        self.depth * (-0.5 * self.off * self.off).exp()
    }
}

impl Blob {
    /// Returns M v: the space in which the blob is a ball of σ.
    pub fn whiten(&self, v: DVec3) -> DVec3 {
        self.shape.whiten(v)
    }

    /// Returns M/σ, which takes the blob to the unit ball.
    pub fn white_matrix(&self) -> DMat3 {
        let axes = self.shape.axes();
        axes * DMat3::from_diagonal((self.sigma * self.shape.lengths()).recip()) * axes.transpose()
    }

    /// Returns the standard deviations along x, y and z.
    pub fn extents(&self) -> DVec3 {
        self.sigma * self.shape.extents()
    }

    /// Returns the greatest σ over all directions.
    pub fn widest(&self) -> f64 {
        self.sigma * self.shape.widest()
    }

    /// Returns the least σ over all directions.
    pub fn narrowest(&self) -> f64 {
        self.sigma * self.shape.narrowest()
    }

    /// Returns a bound on the optical depth of any line: √(2π) κ times the greatest σ.
    pub fn deepest(&self) -> f64 {
        SQRT_TAU * self.kappa * self.widest()
    }

    /// Returns m = ∫ρ dV = κ (2π)^{3/2} σ³ V, V the shape's volume.
    pub fn mass(&self) -> f64 {
        self.kappa * (SQRT_TAU * self.sigma).powi(3) * self.shape.volume()
    }

    /// Returns the line along `d`, of any length, that passes the centre at offset `c`.
    pub fn along(&self, c: DVec3, d: DVec3) -> Line {
        let (white, ray) = (self.whiten(c), self.whiten(d));
        let off = white.cross(ray).length() / (ray.length() * self.sigma);
        Line { off, depth: SQRT_TAU * self.kappa * self.sigma * (d.length() / ray.length()) }
    }

    /// Returns the slopes along `side` over `forward`, unit vectors, between which lines through
    /// the eye can meet the blob out to `reach` σ. `c` is its centre from the eye. All slopes if
    /// the blob reaches beside the eye or lies behind it.
    pub fn slopes(&self, c: DVec3, [side, forward]: [DVec3; 2], reach: f64) -> (f64, f64) {
        let at = DVec2::new(c.dot(side), c.dot(forward));
        if self.shape == Shape::BALL {
            return disc_slopes(at, reach * self.sigma);
        }
        // The planes n·x = 0 with (n·c)² = nᵀ S n touch the blob, S its matrix and n = (1, −slope).
        let r = reach * self.sigma;
        let [s, f] = [side, forward].map(|axis| r * self.shape.stretch(axis));
        let shape =
            DMat2::from_cols(DVec2::new(s.dot(s), s.dot(f)), DVec2::new(s.dot(f), f.dot(f)));
        let (x, z) = (at.x, at.y);
        let a = z * z - shape.col(1).y;
        if !(a > 0.0 && z > 0.0) {
            return (f64::NEG_INFINITY, f64::INFINITY);
        }
        let b = x * z - shape.col(0).y;
        let c = x * x - shape.col(0).x;
        let root = (b * b - a * c).max(0.0).sqrt();
        ((b - root) / a, (b + root) / a)
    }
}

/// Returns the slopes between which lines through the eye can touch a disc of radius `reach` at
/// (side, depth).
fn disc_slopes(at: DVec2, reach: f64) -> (f64, f64) {
    const ALL: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);
    let sine = reach / at.x.hypot(at.y);
    if sine.is_nan() || sine >= 1.0 {
        return ALL;
    }
    let (mid, spread) = (at.x.atan2(at.y), sine.asin());
    // A disc that reaches beside or behind the eye is touched by lines of either sign.
    if mid.abs() + spread >= std::f64::consts::FRAC_PI_2 {
        return ALL;
    }
    ((mid - spread).tan(), (mid + spread).tan())
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;
    use crate::model::shape::Turn;

    fn of_shape(shape: Shape) -> Blob {
        Blob { position: DVec3::ZERO, sigma: 2.0, shape, kappa: 0.5 }
    }

    fn blob(aspect: f64) -> Blob {
        of_shape(Shape::upright(aspect))
    }

    fn turned(aspect: f64, aspect_z: f64) -> Shape {
        let axis = DVec3::new(0.36, 0.48, -0.8);
        Shape { aspect, aspect_z, turn: Turn::new(DQuat::from_axis_angle(axis, 1.3)) }
    }

    #[test]
    fn depths_are_the_integrals_along_lines() {
        // Sums along the line: dense trapezoids of a Gaussian are exact to rounding.
        let integral = |blob: &Blob, c: DVec3, d: DVec3| {
            let unit = d.normalize();
            let step = 0.01;
            let rho = |t: f64| {
                let x = blob.whiten(t * unit - c);
                blob.kappa * (-0.5 * x.length_squared() / blob.sigma.powi(2)).exp()
            };
            (-20_000..=20_000).map(|k| step * rho(step * f64::from(k))).sum::<f64>()
        };
        for (shape, c, d) in [
            (Shape::upright(1.0), DVec3::new(0.5, 1.0, 9.0), DVec3::Z),
            (Shape::upright(0.1), DVec3::new(1.0, 0.1, 5.0), DVec3::new(0.1, 0.05, 3.0)),
            (Shape::upright(0.05), DVec3::new(0.3, 0.02, -1.0), DVec3::Y),
            (Shape::upright(3.0), DVec3::new(-1.0, 2.0, 4.0), DVec3::new(1.0, -2.0, 0.5)),
            (turned(0.3, 0.05), DVec3::new(0.2, -0.1, 5.0), DVec3::new(0.1, 0.05, 3.0)),
            (turned(1.0, 0.2), DVec3::new(-0.4, 0.3, 2.0), DVec3::new(1.0, -2.0, 0.5)),
        ] {
            let blob = of_shape(shape);
            let line = blob.along(c, d);
            assert!((line.tau() / integral(&blob, c, d) - 1.0).abs() < 1e-10, "{shape:?} {line:?}");
            assert!(line.depth <= blob.deepest() * (1.0 + 1e-15));
        }
        // Along y it is a times as deep as across.
        assert!(
            (blob(0.1).along(DVec3::ZERO, DVec3::Y * 7.0).depth / (0.1 * SQRT_TAU) - 1.0).abs()
                < 1e-15
        );
        assert_eq!(blob(0.1).along(DVec3::ZERO, DVec3::X).depth, SQRT_TAU);
    }

    #[test]
    fn slopes_touch_the_silhouette() {
        let axes = [DVec3::new(0.6, 0.8, 0.0), DVec3::new(0.8, -0.6, 0.0)];
        let upright = [0.2, 0.999_999_999, 1.0, 4.0].map(Shape::upright);
        for shape in upright.into_iter().chain([turned(0.3, 0.05), turned(1.0, 0.2)]) {
            let (blob, c) = (of_shape(shape), 40.0 * axes[1] + 7.0 * axes[0] + DVec3::Z);
            let (low, high) = blob.slopes(c, axes, 3.0);
            for (slope, name) in [(low, "low"), (high, "high")] {
                // Of all lines with that slope, whatever the third coordinate, the nearest passes
                // at 3 σ.
                let ray = |third: f64| axes[1] + slope * axes[0] + third * DVec3::Z;
                let off = (-40_000..40_000)
                    .map(|k| blob.along(c, ray(2.5e-5 * f64::from(k))).off)
                    .fold(f64::INFINITY, f64::min);
                assert!((off - 3.0).abs() < 1e-5, "{shape:?} {name} {off}");
            }
        }
        // A flat blob above the eye's height, beside, around and behind the eye.
        let flat = |c: DVec3| blob(0.1).slopes(c, [DVec3::Y, DVec3::Z], 3.0);
        let (low, high) = flat(DVec3::new(0.0, 1.0, 20.0));
        assert!(low < 1.0 / 20.0 && high > 1.0 / 20.0 && high < 0.2, "{low} {high}");
        for c in [DVec3::new(0.0, 1.0, 5.9), DVec3::ZERO, DVec3::new(0.0, 1.0, -20.0)] {
            assert_eq!(flat(c), (f64::NEG_INFINITY, f64::INFINITY));
        }
    }
}
