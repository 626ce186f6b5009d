//! A pixel composed near to far in f32, passes.md "tiles", with a bound on what a device may
//! differ.

use glam::DVec3;

use super::composite::{OpaquePixel, Rounding};
use super::shine::Shine;

/// Unit round-off of f32.
pub(super) const U: f64 = 1.0 / 16_777_216.0;

/// A pixel while it is composed: exact values, and bounds on the device's differences.
#[derive(Debug, Clone)]
pub(super) struct Composed {
    /// Composed colour.
    pub color: DVec3,
    /// Transmittance.
    pub passed: f64,
    /// Bound on the colour's difference.
    pub off_color: DVec3,
    /// Bound on the transmittance's difference.
    pub off_passed: f64,
}

impl Composed {
    /// Nothing composed yet.
    pub(super) const NOTHING: Composed =
        Composed { color: DVec3::ZERO, passed: 1.0, off_color: DVec3::ZERO, off_passed: 0.0 };

    /// Adds a layer of opacity `alpha`, which the device has within `off`.
    pub(super) fn under(&mut self, alpha: f64, off: f64, shine: Shine) {
        let Shine { radiance, off: off_radiance } = shine;
        let (passed, here) = (self.passed, self.passed * alpha);
        // T = 1 - A is rounded; (T + dT)(a + da) - T a, rounded once.
        let off_one_minus = U * (passed + self.off_passed);
        let inherited = (self.off_passed + off_one_minus) * (alpha + off) + passed * off;
        let off_here = inherited + U * (here + inherited);
        self.off_color += radiance.abs() * off_here + (here + off_here) * off_radiance;
        self.color += here * radiance;
        // here L and the sum with it.
        self.off_color +=
            U * (here + off_here) * radiance.abs() + U * (self.color.abs() + self.off_color);
        self.passed -= here;
        // A + T a: the error of A is multiplied by 1 − a, and the sum is rounded.
        self.off_passed = self.off_passed * ((1.0 - alpha).abs() + off)
            + passed * off
            + off_one_minus * (alpha + off)
            + U * (here + off_here)
            + U * (1.0 - self.passed + self.off_passed);
    }

    /// Returns the pixel over its background, and its bound. `most` is the brightest radiance.
    pub(super) fn over(
        &self,
        under: &OpaquePixel,
        r: &Rounding,
        saturated: f64,
        most: f64,
    ) -> ([f64; 4], [f64; 4]) {
        // Layers behind a tile all of whose pixels let less than `saturated` through are left out.
        let skipped = if self.passed - self.off_passed < saturated { saturated } else { 0.0 };
        let channel = |k: usize| {
            let (front, off, most) = match k {
                3 => (1.0 - self.passed, self.off_passed, 1.0),
                _ => (self.color[k], self.off_color[k], 2.0 * most),
            };
            let value = front + self.passed * under.color[k];
            let passed_most = self.passed + self.off_passed + U;
            let inherited = off
                + self.off_passed * under.color[k].abs()
                + passed_most * under.bound[k]
                + skipped * most;
            let inherited = inherited + 2.0 * U * (value.abs() + inherited);
            if r.step > 0.0 {
                // The result is clamped once at the end, and rounded to one of the two neighbouring
                // steps.
                return (value.clamp(0.0, 1.0), inherited + r.step);
            }
            (value, inherited + 2.0 * r.unit * (value.abs() + inherited).max(r.least_normal))
        };
        let channels = [0, 1, 2, 3].map(channel);
        (channels.map(|c| c.0), channels.map(|c| c.1))
    }
}
