//! Blinn–Phong materials, C (11): f = K_d/π + K_s (n_s+2)/(2π) cos^{n_s} γ.

use glam::DVec3;

use super::cover::Cover;
use super::phase::Scattering;

/// A material that may change over time: keys in rising time, linear between them, constant before
/// the first and after the last. A constant material has one key.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name in the scene file.
    pub name: String,
    /// Keys in rising time.
    pub keys: Vec<MaterialKey>,
    /// How a cloud of the material scatters light, for the reference "transport".
    pub scattering: Scattering,
    /// Cover of ground that is of the material.
    pub cover: Cover,
}

/// Material at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaterialKey {
    /// Time of the key.
    pub time_s: f64,
    /// Coefficients at that time.
    pub brdf: Brdf,
}

/// Coefficients of C (11), linear RGB.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Brdf {
    /// K_d, diffuse albedo.
    pub kd: DVec3,
    /// K_s, weight of the lobe.
    pub ks: DVec3,
    /// n_s, exponent of the lobe.
    pub ns: f64,
}

impl Material {
    /// Returns the coefficients at `time_s`.
    pub fn at(&self, time_s: f64) -> Brdf {
        let i = self.keys.partition_point(|k| k.time_s <= time_s);
        if i == 0 || i == self.keys.len() {
            return self.keys[i.saturating_sub(1)].brdf;
        }
        let (a, b) = (&self.keys[i - 1], &self.keys[i]);
        let t = (time_s - a.time_s) / (b.time_s - a.time_s);
        Brdf {
            kd: a.brdf.kd.lerp(b.brdf.kd, t),
            ks: a.brdf.ks.lerp(b.brdf.ks, t),
            ns: a.brdf.ns + t * (b.brdf.ns - a.brdf.ns),
        }
    }

    /// Returns whether the material changes over time.
    pub fn is_edited(&self) -> bool {
        self.keys.iter().any(|k| k.brdf != self.keys[0].brdf)
    }

    /// Returns whether the material has a lobe at some time.
    pub fn is_glossy(&self) -> bool {
        self.keys.iter().any(|k| k.brdf.ks != DVec3::ZERO)
    }

    /// Returns the least and greatest n_s over time.
    pub fn exponents(&self) -> [f64; 2] {
        let of = |pick: fn(f64, f64) -> f64| {
            self.keys.iter().map(|k| k.brdf.ns).fold(self.keys[0].brdf.ns, pick)
        };
        [of(f64::min), of(f64::max)]
    }

    /// Returns the greatest K_d + 4 K_s over channels and time. Above 1 the material can reflect
    /// more than it receives: with γ from the half vector the lobe's albedo tends to 4 K_s cos²θ
    /// (model.md §5).
    pub fn max_albedo(&self) -> f64 {
        self.keys.iter().map(|k| (k.brdf.kd + 4.0 * k.brdf.ks).max_element()).fold(0.0, f64::max)
    }
}

impl Brdf {
    /// Returns the lobe (n_s+2)/(2π) cos^{n_s} γ at 1 − cos γ = `w`. It is evaluated as exp(n
    /// ln1p(−w)), not as a power of a number near 1.
    pub fn lobe(ns: f64, w: f64) -> f64 {
        let power =
            if w >= 1.0 { if ns > 0.0 { 0.0 } else { 1.0 } } else { (ns * (-w).ln_1p()).exp() };
        (ns + 2.0) / std::f64::consts::TAU * power
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn brdf(kd: f64, ks: f64, ns: f64) -> Brdf {
        Brdf { kd: DVec3::splat(kd), ks: DVec3::splat(ks), ns }
    }

    #[test]
    fn edits_run_straight_between_keys() {
        let key = |time_s, brdf| MaterialKey { time_s, brdf };
        let keys = vec![key(1.0, brdf(0.5, 0.0, 8.0)), key(3.0, brdf(0.7, 0.2, 16.0))];
        let scattering = Scattering::default();
        let material = Material { name: "m".into(), keys, scattering, cover: Cover::Plain };
        assert_eq!(
            (material.at(0.0), material.at(9.0)),
            (brdf(0.5, 0.0, 8.0), brdf(0.7, 0.2, 16.0))
        );
        let middle = material.at(2.0);
        assert!(
            (middle.kd.x - 0.6).abs() < 1e-15
                && (middle.ks.x - 0.1).abs() < 1e-15
                && middle.ns == 12.0
        );
        assert!(
            material.is_edited()
                && material.is_glossy()
                && (material.max_albedo() - 1.5).abs() < 1e-15
        );
    }

    #[test]
    fn a_lobe_at_worked_points() {
        use std::f64::consts::PI;
        assert!((Brdf::lobe(0.0, 0.3) - 1.0 / PI).abs() < 1e-15);
        // cos 60° squared is a quarter.
        assert!((Brdf::lobe(2.0, 0.5) - 0.25 * 4.0 / (2.0 * PI)).abs() < 1e-15);
        assert_eq!((Brdf::lobe(5.0, 1.0), Brdf::lobe(0.0, 1.0)), (0.0, 1.0 / PI));
        // One hundredth of a radian off the peak of n_s = 10⁴: e^{−1/2} to the next order in γ.
        let w = 1.0 - 0.01f64.cos();
        assert!((Brdf::lobe(1e4, w) / Brdf::lobe(1e4, 0.0) / (-0.5f64).exp() - 1.0).abs() < 1e-5);
    }
}
