//! The laws that an estimate consists of, one function each (transport.md, "Paths").

use glam::DVec3;

/// The estimator's laws. [`Unbiased`] takes them as they are; a test of the tests replaces one.
pub trait Estimator {
    /// Returns the share of light that gets through an optical depth.
    fn transmittance(depth: f64) -> f64 {
        (-depth).exp()
    }

    /// Returns the weight of a path after a collision.
    fn scattered(weight: DVec3, albedo: DVec3) -> DVec3 {
        weight * albedo
    }

    /// Returns the phase function's value for light that is turned by an angle of that cosine.
    fn phase(of: impl Fn(f64) -> f64, cosine: f64) -> f64 {
        of(cosine)
    }

    /// Returns the weight of a direction in multiple importance sampling, by the balance heuristic
    /// (Veach 1997). `own` is the density by which it was sampled, and `other` that of the other
    /// strategy.
    fn mis_weight(own: f64, other: f64) -> f64 {
        own / (own + other)
    }

    /// Returns the light of a sampled direction: the radiance over the density.
    fn drawn(light: DVec3, density: f64) -> DVec3 {
        light / density
    }

    /// Returns the factor of a path that Russian roulette lets go on with that chance.
    fn roulette_weight(chance: f64) -> f64 {
        1.0 / chance
    }

    /// Returns the light that a surface receives at an angle of that cosine to its normal.
    fn received(light: DVec3, cosine: f64) -> DVec3 {
        light * cosine
    }

    /// Returns whether light arrives from what stands in the way.
    fn arrives(is_hidden: bool) -> bool {
        !is_hidden
    }

    /// Returns the opacity of a ray of that optical depth.
    fn opacity(depth: f64) -> f64 {
        -libm::expm1(-depth)
    }
}

/// The laws as they are.
pub struct Unbiased;

impl Estimator for Unbiased {}
