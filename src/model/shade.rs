//! Light that changes linearly across a blob (model.md §18, "Light inside a blob").

use glam::DVec3;

use super::shape::Shape;

/// Greatest change of the light over a σ, as a share of that at the centre. A steeper slope is
/// reduced to it.
pub const STEEPEST: f64 = 0.25;
/// Greatest radiance of a blob's centre over that of its facet, where a facet stands for several.
pub const MOST_OF_FACET: f64 = 2.0;
/// Optical depth beyond which a blob is not seen any nearer to its front.
pub const DEEPEST_SEEN: f64 = 8.0;
/// Coefficients of h(τ) = τ (a + b τ), the distance in σ before its centre at which a blob of
/// optical depth τ is seen. Up to [`DEEPEST_SEEN`] it is within 0.013 σ of the mean of z over
/// e^{−τ Φ(z)} dΦ(z).
pub const SEEN_BEFORE: [f64; 2] = [0.2943, -0.01546];

/// Change of the light of a facet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FacetSlope {
    /// Relative change per length.
    pub relative: DVec3,
    /// Place of the facet, relative to the lighting origin.
    pub position: DVec3,
}

/// The light of a blob, as a factor on its facet's radiance: base (1 + slope·(x − p)), at least 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shade {
    /// Factor at the blob's centre p.
    pub base: f64,
    /// Relative change per length.
    pub slope: DVec3,
}

impl Shade {
    /// Returns the light of a blob of `sigma` and `shape`, `from_facet` away from its facet, where
    /// the light changes by `slope` per length.
    pub fn new(slope: DVec3, from_facet: DVec3, sigma: f64, shape: &Shape) -> Shade {
        let base = (1.0 + slope.dot(from_facet)).clamp(0.0, MOST_OF_FACET);
        if base == 0.0 {
            return Shade { base, slope: DVec3::ZERO };
        }
        let slope = slope / base;
        let steep = sigma * shape.stretch(slope).length();
        Shade { base, slope: if steep > STEEPEST { slope * (STEEPEST / steep) } else { slope } }
    }
}

/// Returns h(τ): the distance in σ before its centre at which a blob is seen.
pub fn seen_before(tau: f64) -> f64 {
    let tau = tau.min(DEEPEST_SEEN);
    tau * (SEEN_BEFORE[0] + SEEN_BEFORE[1] * tau)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blob_is_seen_where_its_light_comes_from() {
        // −∫z e^{−τΦ(z)} φ(z) dz / ∫e^{−τΦ(z)} φ(z) dz by sums; Gaussians make them exact.
        let below = |z: f64| 0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2);
        let mean = |tau: f64| {
            let (mut sum, mut all) = (0.0, 0.0);
            for k in -900..=900 {
                let z = f64::from(k) * 0.01;
                let shown = (-0.5 * z * z - tau * below(z)).exp();
                (sum, all) = (sum - z * shown, all + shown);
            }
            sum / all
        };
        // 1/(2√π) = 0.2821 a unit of τ where a blob is thin.
        assert!((mean(1e-3) / 1e-3 - 0.282_094_8).abs() < 1e-4);
        let off = (1..=80).map(|k| 0.1 * f64::from(k)).map(|t| (seen_before(t) - mean(t)).abs());
        let most = off.fold(0.0, f64::max);
        assert!(most < 0.013 && most > 0.005, "{most}");
        assert_eq!(seen_before(8.0), seen_before(1e9));
    }

    #[test]
    fn slopes_are_limited_by_the_blobs_size() {
        let small = Shade::new(DVec3::X * 0.5, DVec3::ZERO, 0.4, &Shape::BALL);
        assert_eq!(small, Shade { base: 1.0, slope: DVec3::X * 0.5 });
        let wide = Shade::new(DVec3::X * 0.5, DVec3::ZERO, 4.0, &Shape::upright(0.025));
        assert_eq!(wide, Shade { base: 1.0, slope: DVec3::X * 0.0625 });
        // 1 + ½ at a member of a group; a third of the facet's slope is its own. None below 0.
        let member = Shade::new(DVec3::X * 0.5, DVec3::X, 0.1, &Shape::BALL);
        assert!((member.base - 1.5).abs() < 1e-15 && (member.slope.x - 1.0 / 3.0).abs() < 1e-15);
        let dark = Shade::new(DVec3::X * 0.5, DVec3::X * -3.0, 1.0, &Shape::BALL);
        assert_eq!(dark, Shade { base: 0.0, slope: DVec3::ZERO });
        let most = Shade::new(DVec3::X * 0.5, DVec3::X * 30.0, 0.1, &Shape::BALL).base;
        assert_eq!(most, MOST_OF_FACET);
    }
}
