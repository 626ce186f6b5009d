//! Clouds as a medium: how much of the light at a blob is scattered toward the eye (model.md §18).

use glam::DVec3;

use super::cloud::{CloudSource, Group, mass};
use super::grid::GridSpec;
use super::lighting::{Lighting, LightingMode, Octaves};
use super::material::Material;
use super::phase::{Phase, albedo_of};
use super::scene::Scene;

/// The medium of a cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Medium {
    /// K_d of the material.
    pub kd: DVec3,
    /// Albedo ϖ of white particles, where the material gives it.
    pub given: Option<DVec3>,
    /// Phase function.
    pub phase: Phase,
}

impl Medium {
    /// Returns the medium of `material` at `time_s`; `forward` is the mean cosine where the
    /// material gives no phase function.
    pub fn new(material: &Material, time_s: f64, forward: f64) -> Medium {
        let kd = material.at(time_s).kd;
        let (_, phase) = material.scattering.of(kd, forward);
        Medium { kd, given: material.scattering.albedo, phase }
    }

    /// Returns the albedo of particles of a colour, which multiplies K_d or the given albedo.
    pub fn albedo(&self, color: DVec3) -> DVec3 {
        match self.given {
            Some(albedo) => (albedo * color).min(DVec3::ONE),
            None => albedo_of(self.kd * color, self.phase.mean_cosine()),
        }
    }

    /// Returns f: the share of what is scattered that counts as not scattered, because it goes
    /// straight on.
    pub fn straight(&self, lighting: &Lighting) -> f64 {
        let g = self.phase.mean_cosine();
        match lighting.mode {
            LightingMode::Similarity => g,
            LightingMode::Diffusion => straight_of(g, lighting.order()),
            _ => 0.0,
        }
    }
}

/// Returns g^(n+1), the share that goes straight on where the phase function counts up to order n.
/// It is none where most light goes back.
fn straight_of(g: f64, order: i32) -> f64 {
    g.max(0.0).powi(order + 1)
}

/// The light that a blob scatters toward the eye once, in a mode of lighting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScatterLaw {
    /// ϖ' = ϖ(1 − f)/(1 − ϖf).
    pub albedo: DVec3,
    /// s = 1 − ϖf: share of the optical depth that counts.
    pub depth: DVec3,
    /// Phase function p' of what is not scattered straight on.
    pub phase: Phase,
    /// Its terms.
    pub terms: Octaves,
}

/// The one term of modes without octaves.
const ONCE: Octaves = Octaves { n: 1, light: 1.0, depth: 1.0, phase: 1.0 };

impl ScatterLaw {
    /// Returns the law of `medium` for particles of a colour.
    pub fn new(lighting: &Lighting, medium: &Medium, color: DVec3) -> ScatterLaw {
        let (f, albedo) = (medium.straight(lighting), medium.albedo(color));
        let depth = DVec3::ONE - albedo * f;
        ScatterLaw {
            // Where all goes straight on, 0/0 is 0.
            albedo: albedo * (1.0 - f) / depth.max(DVec3::splat(f64::MIN_POSITIVE)),
            depth,
            phase: without(medium.phase, f),
            terms: terms(lighting),
        }
    }

    /// Returns the share of a light's irradiance that is scattered per solid angle, by channel.
    /// `cosine` is that of the angle between its way and the way to the eye, and `tau` the optical
    /// depth that it has passed.
    pub fn toward_eye(&self, cosine: f64, tau: f64) -> DVec3 {
        self.sum(tau, |c| self.phase.flattened(c).at(cosine))
    }

    /// Returns the light of a sky that is scattered toward the eye. The sky's radiance is 1 above
    /// the horizon, and `constant` more from everywhere. `up` is the cosine between the way to the
    /// eye and the zenith, and `tau` the optical depth toward the zenith.
    pub fn of_sky(&self, up: f64, constant: f64, tau: f64) -> DVec3 {
        let g = self.phase.mean_cosine();
        self.sum(tau, |c| 0.5 - (forward_half(c * g) - 0.5) * up + constant)
    }

    /// Sums the terms; `share` returns what is scattered by the phase function times c.
    fn sum(&self, tau: f64, share: impl Fn(f64) -> f64) -> DVec3 {
        let Octaves { n, light, depth, phase } = self.terms;
        let term = |i: u32| {
            let [a, b, c] = [light, depth, phase].map(|x| x.powi(i as i32));
            let through = (-b * tau * self.depth).exp();
            a * share(c) * self.albedo * through
        };
        (0..n).map(term).sum()
    }
}

/// Returns the terms of a mode.
pub fn terms(lighting: &Lighting) -> Octaves {
    match lighting.mode {
        LightingMode::Octaves => lighting.octaves,
        _ => ONCE,
    }
}

/// Returns the phase function of what is left of `phase` without the share `f` that goes straight
/// on. It is `phase` itself for f = 0, else Henyey and Greenstein's with the mean cosine
/// (g − f)/(1 − f).
pub fn without(phase: Phase, f: f64) -> Phase {
    if f == 0.0 {
        return phase;
    }
    // f is a power of g, so that f = 1 has g = 1.
    let g = if f < 1.0 { (phase.mean_cosine() - f) / (1.0 - f) } else { 0.0 };
    Phase::HenyeyGreenstein { g }
}

/// Returns the share that Henyey and Greenstein's phase function scatters by less than 90°: ½ for
/// g = 0, 1 for g = 1.
pub fn forward_half(g: f64) -> f64 {
    // ∫₀¹ 2π p dμ, with the differences of nearly equal terms divided out.
    let q = (1.0 + g * g).sqrt();
    (1.0 + g) / (q * (q + 1.0 - g))
}

/// Means over a scene's blobs that the diffusion of light depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanMedium {
    /// ϖ.
    pub albedo: DVec3,
    /// g, mean cosine of the phase function.
    pub g: f64,
    /// f = g^(n+1), n being the order of the phase function that counts: share that counts as not
    /// scattered.
    pub straight: f64,
    /// 5(g² − f)/(1 − f), the factor of the second order in what is scattered, over ϖ'; 0 where
    /// n is 1.
    pub second: f64,
}

/// Transport mean free paths across a cell beyond which it counts as no denser. With 4, light grows
/// from bounce to bounce in clouds of optical depth 10⁴.
const MOST_DEPTH: f64 = 2.0;
/// Least 1 − ϖg of which that depth is reckoned.
const LEAST_KEPT: f64 = 1e-6;

impl MeanMedium {
    /// Returns s = 1 − ϖf: the share of the optical depth that counts.
    pub fn weakened(&self) -> DVec3 {
        DVec3::ONE - self.albedo * self.straight
    }

    /// Returns ϖ' = ϖ(1 − f)/s and 3ϖ'g' = 3ϖ(g − f)/s: factors of φ and of the flux in what is
    /// scattered. Where all goes straight on, they are 0.
    pub fn scattered(&self) -> [DVec3; 2] {
        let MeanMedium { albedo, g, straight, .. } = *self;
        let all = albedo / self.weakened().max(DVec3::splat(f64::MIN_POSITIVE));
        [1.0 - straight, 3.0 * (g - straight)].map(|share| share * all)
    }

    /// Returns g' = (g − f)/(1 − f), the mean cosine of what is scattered.
    pub fn scattered_g(&self) -> f64 {
        (self.g - self.straight) / (1.0 - self.straight).max(f64::MIN_POSITIVE)
    }

    /// Returns the extinction beyond which a cell of `grid` counts as no denser, 1/length: two
    /// transport mean free paths across its shortest edge, of the channel that scatters most.
    ///
    /// Light that an opaque cell sends out comes from its faces. A cell has one φ, that of its
    /// middle, which grows with the depth of the faces before it.
    pub fn densest(&self, grid: &GridSpec) -> f64 {
        let kept = DVec3::ONE - self.albedo * self.g;
        MOST_DEPTH / (grid.edges().min_element() * kept.min_element().max(LEAST_KEPT))
    }

    /// Returns the mean over the particles of all clouds, weighted by their greatest mass: the
    /// medium itself where all have the same, and one that scatters nothing without particles.
    /// Particles count alike if none has mass yet.
    pub fn new(scene: &Scene, groups: &[Group], time_s: f64) -> MeanMedium {
        MeanMedium::weighted(scene, groups, time_s, true)
            .or_else(|| MeanMedium::weighted(scene, groups, time_s, false))
            .unwrap_or(MeanMedium { albedo: DVec3::ZERO, g: 0.0, straight: 0.0, second: 0.0 })
    }

    /// Returns the mean by mass or by number; `None` if that is 0.
    fn weighted(scene: &Scene, groups: &[Group], time_s: f64, by_mass: bool) -> Option<MeanMedium> {
        let (mut total, mut albedo, mut g) = (0.0, DVec3::ZERO, 0.0);
        let mut add = |[mass, n]: [f64; 2], medium: &Medium, color: DVec3| {
            let m = if by_mass { mass } else { n };
            total += m;
            albedo += m * medium.albedo(color);
            g += m * medium.phase.mean_cosine();
        };
        for (i, cloud) in scene.clouds.iter().enumerate() {
            let material = &scene.materials[cloud.i_material];
            let medium = Medium::new(material, time_s, scene.lighting.forward);
            match &cloud.source {
                CloudSource::Particles(list) => {
                    let of =
                        list.iter().map(|p| (mass(p.kappa, p.sigma) * p.shape.volume(), p.color));
                    of.for_each(|(m, color)| add([m, 1.0], &medium, color));
                }
                _ => {
                    for group in groups.iter().filter(|g| g.i_cloud == i) {
                        let n = f64::from(group.n_particles);
                        add([n * group.mass_max, n], &medium, DVec3::ONE);
                    }
                }
            }
        }
        let (g, order) = (g / total, scene.lighting.order());
        let straight = straight_of(g, order);
        let second = match order {
            1 => 0.0,
            _ => 5.0 * (g * g - straight) / (1.0 - straight).max(f64::MIN_POSITIVE),
        };
        (total > 0.0).then(|| MeanMedium { albedo: albedo / total, g, straight, second })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    const MEDIUM: Medium = Medium {
        kd: DVec3::ZERO,
        given: Some(DVec3::new(1.0, 0.9, 0.5)),
        phase: Phase::HenyeyGreenstein { g: 0.8 },
    };

    const SOME: Lighting = Lighting {
        mode: LightingMode::Single,
        grid: 64,
        step: 1.0,
        forward: 0.85,
        bases: 1,
        sampling: crate::model::basis::Sampling::Log,
        exponents: [1.0; 2],
        gather: crate::model::scene::Gather::Exact,
        theta: 0.4,
        facets_per_cloud: crate::model::scene::FacetCount::Every,
        layers: None,
        pairs: crate::model::scene::Pairs { size: 0.5, levels: 1, steps: 1 },
        sums: crate::model::sums::Sums {
            summation: crate::model::sums::Summation::Plain,
            precision: crate::model::sums::Precision::F32,
        },
        sun_radius: 0.005,
        octaves: ONCE,
        diffusion: crate::model::scene::DiffusionSettings {
            cycles: 1,
            bounces: 0,
            bounce_cells: 1,
            bounce_order: 1,
            slopes: false,
        },
        budget: crate::model::scene::LightBudget { ms: None, error: None },
    };

    fn lighting(mode: LightingMode) -> Lighting {
        let octaves = Octaves { n: 3, light: 0.5, depth: 0.25, phase: 0.5 };
        Lighting { mode, octaves, ..SOME }
    }

    fn law(mode: LightingMode) -> ScatterLaw {
        ScatterLaw::new(&lighting(mode), &MEDIUM, DVec3::ONE)
    }

    #[test]
    fn once_scattered_light_by_hand() {
        let of = law(LightingMode::Single).toward_eye(0.0, 2.0);
        // 0.36/(4π 1.64^1.5) e^{−2}.
        let p = 0.36 / (4.0 * PI * 1.64f64.powf(1.5)) * (-2f64).exp();
        assert!((of - p * DVec3::new(1.0, 0.9, 0.5)).abs().max_element() < 1e-15);
    }

    #[test]
    fn what_goes_straight_on_counts_as_not_scattered() {
        // f = 0.8: s = 0.2, 0.28, 0.6; ϖ' = ϖ 0.2/s; evenly.
        let of = law(LightingMode::Similarity);
        assert!((of.depth - DVec3::new(0.2, 0.28, 0.6)).abs().max_element() < 1e-15);
        assert!((of.albedo - DVec3::new(1.0, 0.18 / 0.28, 0.1 / 0.6)).abs().max_element() < 1e-15);
        assert_eq!(of.phase, Phase::HenyeyGreenstein { g: 0.0 });
        // f = 0.64: g' = 0.16/0.36.
        let of = law(LightingMode::Diffusion);
        assert!((of.phase.mean_cosine() - 0.8 / 1.8).abs() < 1e-15);
        // Absorption and the weakening of straight light with it stay: s(1 − ϖ') = 1 − ϖ.
        for mode in [LightingMode::Similarity, LightingMode::Diffusion] {
            let of = law(mode);
            let absorbed = of.depth * (DVec3::ONE - of.albedo);
            assert!((absorbed - DVec3::new(0.0, 0.1, 0.5)).abs().max_element() < 1e-15);
        }
    }

    #[test]
    fn octaves_by_hand() {
        let p = |g: f64| (1.0 - g * g) / (4.0 * PI * (1.0 + g * g).powf(1.5));
        let by_hand = p(0.8) * (-2f64).exp()
            + 0.5 * p(0.4) * (-0.5f64).exp()
            + 0.25 * p(0.2) * (-0.125f64).exp();
        let of = law(LightingMode::Octaves).toward_eye(0.0, 2.0);
        assert!((of.x - by_hand).abs() < 1e-15 && (of.z - 0.5 * by_hand).abs() < 1e-15);
    }

    #[test]
    fn half_of_the_light_goes_forward_without_a_preference_and_all_with_g_of_1() {
        assert_eq!((forward_half(0.0), forward_half(1.0)), (0.5, 1.0));
        // By quadrature, g = 0.85.
        let phase = Phase::HenyeyGreenstein { g: 0.85 };
        let n = 200_000;
        let at = |i: i32| phase.at((f64::from(i) + 0.5) / f64::from(n));
        let sum = 2.0 * PI * (0..n).map(at).sum::<f64>() / f64::from(n);
        assert!((forward_half(0.85) - sum).abs() < 1e-8);
        // The other half goes backward.
        assert!((forward_half(0.85) + forward_half(-0.85) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_sky_of_even_light_is_seen_as_it_is() {
        // ½ from above at every angle of an even phase function, and the constant.
        let even = Medium { phase: Phase::HenyeyGreenstein { g: 0.0 }, ..MEDIUM };
        let of = ScatterLaw::new(&lighting(LightingMode::Single), &even, DVec3::ONE);
        for up in [-1.0, 0.3, 1.0] {
            assert!((of.of_sky(up, 0.25, 0.0).x - 0.75).abs() < 1e-15);
        }
        // From below a cloud's light has gone forward.
        let forward = law(LightingMode::Single);
        assert!(forward.of_sky(-1.0, 0.0, 0.0).x > 0.9 && forward.of_sky(1.0, 0.0, 0.0).x < 0.1);
    }
}
