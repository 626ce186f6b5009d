//! Scattering in a cloud's medium: the phase function and the albedo of single scattering
//! (transport.md).

use std::f64::consts::PI;

use glam::DVec3;

/// How a material scatters light in a medium; what is `None` is derived.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Scattering {
    /// Albedo ϖ of single scattering, linear RGB; by [`albedo_of`] K_d where it is `None`.
    pub albedo: Option<DVec3>,
    /// Phase function; Henyey and Greenstein's with `lighting.forward` where it is `None`.
    pub phase: Option<Phase>,
}

impl Scattering {
    /// Returns albedo and phase function of a medium that reflects `kd` where it is thick.
    /// `forward` is the mean cosine where no phase function is given.
    pub fn of(&self, kd: DVec3, forward: f64) -> (DVec3, Phase) {
        let phase = self.phase.unwrap_or(Phase::HenyeyGreenstein { g: forward });
        let albedo = self.albedo.unwrap_or_else(|| albedo_of(kd, phase.mean_cosine()));
        (albedo, phase)
    }
}

/// A phase function, normalised over all directions. It depends on the cosine of the angle between
/// the directions in which light travels before and after.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Phase {
    /// Henyey and Greenstein (1941), with the mean cosine g in (−1, 1).
    HenyeyGreenstein {
        /// g.
        g: f64,
    },
    /// Droplets of water, by a fit to Mie's theory without its rainbows: a share of Draine's phase
    /// function beside one of Henyey and Greenstein. *Source*: Jendersie and d'Eon (2023), eq. 4–7.
    Droplets {
        /// The mixture of the fit.
        mixture: Mixture,
    },
}

/// (1 − w) p(g) + w p(g_D, α), with Henyey and Greenstein's p(g) and Draine's p(g, α).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mixture {
    /// g of Henyey and Greenstein.
    pub g: f64,
    /// g of Draine.
    pub g_draine: f64,
    /// α of Draine.
    pub alpha: f64,
    /// w, the share of Draine.
    pub share: f64,
}

/// Radii of droplets that the fit is for, µm.
pub const RADII_UM: [f64; 2] = [2.5, 25.0];

impl Phase {
    /// Returns the phase function of droplets of the given radius, µm, in [`RADII_UM`].
    pub fn droplets(radius_um: f64) -> Phase {
        let d = 2.0 * radius_um;
        let mixture = Mixture {
            g: (-0.0990567 / (d - 1.67154)).exp(),
            g_draine: (-2.20679 / (d + 3.91029) - 0.428934).exp(),
            alpha: (3.62489 - 8.29288 / (d + 5.52825)).exp(),
            share: (-0.599085 / (d - 0.641583) - 0.665888).exp(),
        };
        Phase::Droplets { mixture }
    }

    /// Returns the share of light scattered per solid angle, sr⁻¹, by an angle of that cosine.
    pub fn at(&self, cosine: f64) -> f64 {
        match *self {
            Phase::HenyeyGreenstein { g } => henyey_greenstein(g, cosine),
            Phase::Droplets { mixture: m } => {
                (1.0 - m.share) * henyey_greenstein(m.g, cosine)
                    + m.share * draine(m.g_draine, m.alpha, cosine)
            }
        }
    }

    /// Returns the mean cosine of the angle.
    pub fn mean_cosine(&self) -> f64 {
        match *self {
            Phase::HenyeyGreenstein { g } => g,
            Phase::Droplets { mixture: m } => {
                // Of Draine's: g (1 + α (3 + 2g²)/5) / (1 + α (1 + 2g²)/3).
                let (g, a) = (m.g_draine, m.alpha);
                let of_draine = g * (1.0 + a * (3.0 + 2.0 * g * g) / 5.0)
                    / (1.0 + a * (1.0 + 2.0 * g * g) / 3.0);
                (1.0 - m.share) * m.g + m.share * of_draine
            }
        }
    }

    /// Returns the function with its mean cosines multiplied by `c` in [0, 1].
    pub fn flattened(&self, c: f64) -> Phase {
        match *self {
            Phase::HenyeyGreenstein { g } => Phase::HenyeyGreenstein { g: c * g },
            Phase::Droplets { mixture: m } => {
                let mixture = Mixture { g: c * m.g, g_draine: c * m.g_draine, ..m };
                Phase::Droplets { mixture }
            }
        }
    }

    /// Draws a cosine with the density 2π p. `uniform` returns independent numbers in (0, 1).
    pub fn sample(&self, mut uniform: impl FnMut() -> f64) -> f64 {
        match *self {
            Phase::HenyeyGreenstein { g } => sample_henyey_greenstein(g, uniform()),
            Phase::Droplets { mixture: m } if uniform() < m.share => {
                // Draine's is Henyey and Greenstein's times 1 + α cos², which is at most 1 + α.
                loop {
                    let cosine = sample_henyey_greenstein(m.g_draine, uniform());
                    if uniform() * (1.0 + m.alpha) <= 1.0 + m.alpha * cosine * cosine {
                        return cosine;
                    }
                }
            }
            Phase::Droplets { mixture: m } => sample_henyey_greenstein(m.g, uniform()),
        }
    }
}

fn henyey_greenstein(g: f64, cosine: f64) -> f64 {
    // (1 − g)² + 2g (1 − cos) keeps its digits near the peak.
    let d = (1.0 - g).powi(2) + 2.0 * g * (1.0 - cosine);
    // Of g = 1 nothing is scattered by any angle.
    let d = d.max(f64::MIN_POSITIVE);
    (1.0 - g * g) / (4.0 * PI * d * d.sqrt())
}

/// *Source*: Draine (2003), eq. 4.
fn draine(g: f64, alpha: f64, cosine: f64) -> f64 {
    henyey_greenstein(g, cosine) * (1.0 + alpha * cosine * cosine)
        / (1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0)
}

fn sample_henyey_greenstein(g: f64, u: f64) -> f64 {
    if g.abs() < 1e-6 {
        // To first order in g.
        let x = 2.0 * u - 1.0;
        return (x + 1.5 * g * (1.0 - x * x)).clamp(-1.0, 1.0);
    }
    let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
    ((1.0 + g * g - s * s) / (2.0 * g)).clamp(-1.0, 1.0)
}

/// Returns the single-scattering albedo ϖ of a half space that reflects the share `reflected` of
/// diffuse light, each channel by itself. `g` is the mean cosine of its phase function. A share of
/// 1 and above has the albedo 1, and 0 has 0.
///
/// *Source*: the inverse of van de Hulst's R = (1 − s)(1 − 0.139 s)/(1 + 1.17 s) with
/// s² = (1 − ϖ)/(1 − gϖ) (1980).
pub fn albedo_of(reflected: DVec3, g: f64) -> DVec3 {
    DVec3::from(reflected.to_array().map(|r| {
        let r = r.clamp(0.0, 1.0);
        // 0.139 s² − (1.139 + 1.17 R) s + (1 − R) = 0, the lesser root.
        let b = 1.139 + 1.17 * r;
        let s = 2.0 * (1.0 - r) / (b + (b * b - 0.556 * (1.0 - r)).max(0.0).sqrt());
        let squared = (s * s).min(1.0);
        // Where nothing is reflected and all goes forward, 0/0 is 0.
        (1.0 - squared) / (1.0 - g * squared).max(f64::MIN_POSITIVE)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::philox::philox4x32_10;

    fn all() -> Vec<Phase> {
        let hg = [-0.5, 0.0, 1e-7, 0.3, 0.85, 0.99].map(|g| Phase::HenyeyGreenstein { g });
        hg.into_iter().chain([2.5, 10.0, 25.0].map(Phase::droplets)).collect()
    }

    /// Integral of f over cosines, by the substitution 1 − cos = 2 e^{−x} near the peak.
    fn integral(f: impl Fn(f64) -> f64) -> f64 {
        // Both halves of [−1, 1] are integrated over the logarithm of the distance from their end.
        let n = 200_000;
        let h = 40.0 / f64::from(n);
        (0..n)
            .map(|i| {
                let d = (-(f64::from(i) + 0.5) * h).exp();
                h * d * (f(1.0 - d) + f(d - 1.0))
            })
            .sum()
    }

    #[test]
    fn phase_functions_are_normalised_and_have_their_mean_cosine() {
        for phase in all() {
            let one = integral(|c| 2.0 * PI * phase.at(c));
            let mean = integral(|c| 2.0 * PI * c * phase.at(c));
            assert!((one - 1.0).abs() < 1e-6, "{phase:?}: {one}");
            assert!((mean - phase.mean_cosine()).abs() < 1e-6, "{phase:?}: {mean}");
        }
    }

    /// By hand for g = 1/2: forward (3/4)/(1/4)^{3/2}/4π = 6/4π, backward (3/4)/(9/4)^{3/2}/4π.
    #[test]
    fn henyey_greenstein_at_worked_points() {
        let p = Phase::HenyeyGreenstein { g: 0.5 };
        assert!((p.at(1.0) - 6.0 / (4.0 * PI)).abs() < 1e-15);
        assert!((p.at(-1.0) - 0.75 / 3.375 / (4.0 * PI)).abs() < 1e-15);
        assert!((Phase::HenyeyGreenstein { g: 0.0 }.at(0.3) - 0.25 / PI).abs() < 1e-16);
    }

    /// The parameters of Jendersie and d'Eon's fit at d = 20 µm, by hand from its exponentials. The
    /// asymmetry of droplets of 10 µm is 0.86 to 0.87 in visible light.
    #[test]
    fn droplets_are_those_of_the_fit() {
        let Phase::Droplets { mixture: m } = Phase::droplets(10.0) else { unreachable!() };
        for (found, by_hand) in
            [(m.g, 0.994_610), (m.g_draine, 0.593_791), (m.alpha, 27.113_7), (m.share, 0.498_159)]
        {
            assert!((found / by_hand - 1.0).abs() < 2e-6, "{found} {by_hand}");
        }
        let g = Phase::droplets(10.0).mean_cosine();
        assert!((0.83..0.89).contains(&g), "{g}");
    }

    #[test]
    fn drawn_cosines_follow_the_phase_function() {
        for (k, phase) in all().into_iter().enumerate() {
            let mut i = 0;
            let mut uniform = || {
                i += 1;
                let word = philox4x32_10([k as u32, 1], [i, 0, 0, 0])[0];
                (f64::from(word) + 0.5) / 2f64.powi(32)
            };
            let n = 100_000;
            let drawn: Vec<f64> = (0..n).map(|_| phase.sample(&mut uniform)).collect();
            // Moments of c and c²; the standard error of a mean in [−1, 1] is at most 1/√n.
            for power in [1, 2] {
                let expected = integral(|c| 2.0 * PI * c.powi(power) * phase.at(c));
                let values = || drawn.iter().map(|c| c.powi(power));
                let mean = values().sum::<f64>() / f64::from(n);
                let variance = values().map(|v| (v - mean).powi(2)).sum::<f64>() / f64::from(n);
                let error = (variance / f64::from(n)).sqrt();
                assert!((mean - expected).abs() < 4.0 * error, "{phase:?} {power}: {mean}");
            }
        }
    }

    #[test]
    fn albedos_invert_van_de_hulsts_formula() {
        for g in [-0.3, 0.0, 0.85] {
            for r in [0.0, 0.1, 0.5, 0.9, 0.99, 1.0] {
                let a = albedo_of(DVec3::splat(r), g).x;
                let s = ((1.0 - a) / (1.0 - g * a)).sqrt();
                let back = (1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s);
                assert!((back - r).abs() < 1e-9 && (0.0..=1.0).contains(&a), "{g} {r}: {a}");
            }
        }
        // A cloud of K_d = 0.9.
        assert!((albedo_of(DVec3::splat(0.9), 0.85).x - 0.99969).abs() < 1e-5);
    }
}
