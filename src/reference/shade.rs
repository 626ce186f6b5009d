//! The light inside a blob along one ray: model.md §18, "Light inside a blob".
//!
//! In: a blob's shade and view, the ray's offset, τ. Out: factors on the blob's radiance, and
//! bounds on what a device's may differ.

use std::f64::consts::FRAC_1_SQRT_2;

use glam::{DVec2, DVec3};

use super::Blob;
use super::composed::U;
use super::composite::Rounding;
use super::view::View;
use crate::model::cloud::SQRT_TAU;
use crate::model::shade::{Shade, seen_before};

/// The shade of a blob as a view sees it.
pub(super) struct SeenShade {
    base: f64,
    /// Change by the difference of the ray's slopes from the centre's.
    lateral: DVec2,
    /// Change by σ toward the eye.
    nearer: f64,
    /// Slopes of the centre.
    slopes: DVec2,
    /// z |slope|, and σ/z of the widest axis.
    scaled: f64,
    width: f64,
}

/// The light along a ray through a blob: base max(0, across + nearer h), h in σ toward the eye.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SeenLight {
    base: f64,
    across: f64,
    nearer: f64,
    /// By how much a device's `across` may differ.
    off: f64,
    /// Relative error of τ.
    off_tau: f64,
}

impl SeenShade {
    /// Returns the shade of `blob`, whose centre is `c` from the eye.
    ///
    /// δ is the difference of the slopes of ray and centre. To first order the ray's nearest point
    /// to the centre, where the blob is made a ball, is z δ − ĉ (w·z δ) away, w = M²ĉ/|Mĉ|².
    pub fn new(view: &View, blob: &Blob, c: DVec3, shade: &Shade) -> SeenShade {
        let (pose, toward) = (&view.pose, c.normalize_or(view.pose.forward));
        let (z, white) = (c.dot(pose.forward), blob.whiten(toward));
        let along = shade.slope.dot(toward);
        let w = blob.whiten(white) / white.length_squared();
        let lateral = z * (shade.slope - along * w);
        SeenShade {
            base: shade.base,
            lateral: DVec2::new(lateral.dot(pose.right), lateral.dot(pose.up)),
            nearer: -along * blob.sigma / white.length(),
            slopes: view.slopes_of(c),
            scaled: z * (shade.slope.length() + along.abs() * w.length()),
            width: blob.widest() / z,
        }
    }

    /// Returns the light along the ray at an offset of `delta` in slopes; τ there has the relative
    /// error of `r`.
    ///
    /// A device's offset has the error of the place, `edge` of σ at up to 4 σ, and that of a
    /// difference of slopes. Its slope has those of some ten products and sums.
    pub fn toward(&self, delta: DVec2, r: &Rounding) -> SeenLight {
        let sides = self.lateral * delta;
        let off_place =
            4.0 * r.edge * self.width + 4.0 * U * (self.slopes.length() + delta.length());
        let off = self.lateral.length() * off_place
            + 16.0 * U * (1.0 + self.scaled * delta.length() + self.nearer.abs())
            + 4.0 * r.edge * (self.nearer.abs() + f64::from(u8::from(self.base != 1.0)));
        let is_exact = r.edge == 0.0 && r.unit == 0.0;
        SeenLight {
            base: self.base,
            across: 1.0 + sides.x + sides.y,
            nearer: self.nearer,
            off: if is_exact { 0.0 } else { off },
            off_tau: r.tau,
        }
    }
}

impl SeenLight {
    /// The blob's radiance throughout.
    pub const PLAIN: SeenLight =
        SeenLight { base: 1.0, across: 1.0, nearer: 0.0, off: 0.0, off_tau: 0.0 };

    /// Returns the factor of a blob that is composed as a whole, and its bound.
    pub fn whole(&self, tau: f64) -> (f64, f64) {
        let (h, nearer) = (seen_before(tau), self.nearer.abs());
        // h is at most 0.3 τ, and its own slope below that.
        let off = self.off + nearer * (0.3 * tau.min(8.0) * self.off_tau + 8.0 * U * h);
        (self.base * (self.across + self.nearer * h).max(0.0), self.base * off)
    }

    /// Returns the factor at `z` σ behind the centre.
    pub fn at(&self, z: f64) -> f64 {
        self.base * (self.across - self.nearer * z).max(0.0)
    }

    /// Returns the integral of the factor over a normal distribution between `from` and `to`, σ
    /// behind the centre, if it is nowhere negative; `share` is that of the distribution. The
    /// second value bounds the error of a device whose share errs by `off_share`, beyond what it
    /// makes by the factor itself.
    pub fn between(&self, [from, to]: [f64; 2], share: f64, off_share: f64) -> (f64, f64) {
        if *self == SeenLight::PLAIN {
            return (share, 0.0);
        }
        // ∫z φ(z) dz = φ(from) − φ(to).
        let middle = density(from) - density(to);
        let light = (share * self.across - self.nearer * middle).max(0.0);
        // The greatest slopes of φ and of its mean are below that of the share.
        let off = self.off * share + self.nearer.abs() * (off_share + 8.0 * U);
        (self.base * light, self.base * off)
    }
}

/// Returns the share of the unit normal distribution below `x`.
pub(super) fn below(x: f64) -> f64 {
    0.5 * libm::erfc(-x * FRAC_1_SQRT_2)
}

fn density(x: f64) -> f64 {
    (-0.5 * x * x).exp() / SQRT_TAU
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::cloud::Shape;

    /// A view along −z with the blob's centre off the axis.
    fn seen(aspect: f64, slope: DVec3) -> (SeenShade, Blob, DVec3) {
        let c = DVec3::new(30.0, -20.0, -100.0);
        let blob = Blob { position: c, sigma: 0.5, shape: Shape::upright(aspect), kappa: 1.0 };
        let shade = Shade { base: 0.5, slope };
        (SeenShade::new(&View::ONE_PIXEL, &blob, c, &shade), blob, c)
    }

    #[test]
    fn the_light_is_that_at_the_rays_nearest_point() {
        for (aspect, slope) in [
            (1.0, DVec3::new(0.3, -0.1, 0.2)),
            (0.2, DVec3::new(0.3, -0.1, 0.2)),
            (3.0, DVec3::new(-0.05, 0.1, 0.1)),
        ] {
            let (seen, blob, c) = seen(aspect, slope);
            for offset in [DVec2::new(0.7, 0.4), DVec2::new(-0.2, 0.9), DVec2::ZERO] {
                let ray = DVec3::new(c.x / 100.0, c.y / 100.0, -1.0) + offset.extend(0.0) / 100.0;
                let (white, to) = (blob.whiten(ray), blob.whiten(c));
                let nearest = to.dot(white) / white.length_squared() * ray;
                let light = seen.toward(offset / 100.0, &Rounding::NONE);
                let exact = 1.0 + slope.dot(nearest - c);
                // Of second order in the angle, here a hundredth.
                assert!((light.across - exact).abs() < 4e-3, "{aspect} {} {exact}", light.across);
                // A σ along the ray.
                let step = ray / white.length() * blob.sigma;
                let nearer = 0.5 * (exact - slope.dot(step)).max(0.0);
                assert!((light.at(-1.0) - nearer).abs() < 4e-3);
            }
        }
    }

    #[test]
    fn parts_of_a_blob_add_up_to_its_mean() {
        let (seen, ..) = seen(1.0, DVec3::new(0.1, 0.2, 0.3));
        let light = seen.toward(DVec2::new(1e-3, -2e-3), &Rounding::NONE);
        let part = |[from, to]: [f64; 2]| light.between([from, to], below(to) - below(from), 0.0).0;
        let whole = part([f64::NEG_INFINITY, f64::INFINITY]);
        assert!((whole - light.at(0.0)).abs() < 1e-15);
        let parts = [[f64::NEG_INFINITY, -0.4], [-0.4, 1.1], [1.1, f64::INFINITY]];
        assert!((parts.map(part).iter().sum::<f64>() - whole).abs() < 1e-15);
        // A thin slice has the light at its place.
        let thin = part([-1.3, -1.299]) / (below(-1.299) - below(-1.3));
        assert!((thin - light.at(-1.2995)).abs() < 1e-6);
    }
}
