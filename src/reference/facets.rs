//! Facets of cloud particles, model.md §5 and §11 "facets": one a particle, on the blob's shell, its normal from
//! the density around it where that has a direction, else away from the cloud's centre.
//! In: the density grid and the placed blobs. Out: positions relative to O, unit normals, areas in scene units².

use std::f64::consts::PI;

use glam::DVec3;

use super::Blob;
use super::grid::sample;
use crate::model::cloud::{SIGMA_PER_RADIUS, SQRT_TAU};
use crate::model::grid::GridSpec;

/// Radius of the ball that the gradient is averaged over, in σ.
pub const GRADIENT_RADIUS_SIGMA: f64 = 2.0;
/// A facet's distance from its blob's centre, in σ.
pub const SHELL_SIGMA: f64 = 1.5;
/// Conditioning q below which only the cloud's centre decides, and above which only the gradient does.
pub const CONDITIONING: (f64, f64) = (0.02, 0.10);
/// Weights of the 14-point quadrature of degree 5 on the sphere: 6/15 + 8·3/40 = 1.
const AXIS_WEIGHT: f64 = 1.0 / 15.0;
const CORNER_WEIGHT: f64 = 3.0 / 40.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facet {
    pub position: DVec3,
    pub normal: DVec3,
    pub area: f64,
    /// Number of the cloud.
    pub region: u32,
    /// q = |G|/S: 0 where the density around has no direction, at most 1.
    pub conditioning: f64,
}

/// The 14 directions and their weights.
pub fn directions() -> [(DVec3, f64); 14] {
    let corner = 1.0 / 3f64.sqrt();
    std::array::from_fn(|i| {
        if i < 6 {
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            return (sign * DVec3::AXES[i / 2], AXIS_WEIGHT);
        }
        let sign = |bit: usize| if (i - 6) >> bit & 1 == 0 { corner } else { -corner };
        (DVec3::new(sign(0), sign(1), sign(2)), CORNER_WEIGHT)
    })
}

/// G = Σ w ρ(p + 2σd) d, which the divergence theorem makes a multiple of ∇ρ averaged over the ball, and
/// S = Σ w ρ(p + 2σd).
pub fn gradient(spec: &GridSpec, cells: &[f64], p: DVec3, sigma: f64) -> (DVec3, f64) {
    directions().iter().fold((DVec3::ZERO, 0.0), |(g, s), &(d, w)| {
        let density = w * sample(spec, cells, p + GRADIENT_RADIUS_SIGMA * sigma * d);
        (g + density * d, s + density)
    })
}

/// Unit normal and conditioning q of a blob at `p` in a cloud about `center`.
pub fn normal(spec: &GridSpec, cells: &[f64], p: DVec3, sigma: f64, center: DVec3) -> (DVec3, f64) {
    let away = (p - center).try_normalize().unwrap_or(DVec3::Y);
    let (g, s) = gradient(spec, cells, p, sigma);
    let q = if s > 0.0 { g.length() / s } else { 0.0 };
    let t = smoothstep(CONDITIONING, q);
    // t > 0 only where q > 0, hence |G| > 0.
    let down = if t > 0.0 { -g.normalize() } else { DVec3::ZERO };
    ((t * down + (1.0 - t) * away).try_normalize().unwrap_or(away), q)
}

/// GLSL's smoothstep: the cubic with zero slope at both ends.
pub fn smoothstep(ends: (f64, f64), x: f64) -> f64 {
    let t = ((x - ends.0) / (ends.1 - ends.0)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// π R² (1 − e^{−τ₀}), R = 3σ, τ₀ = √(2π) κ σ.
pub fn area(sigma: f64, kappa: f64) -> f64 {
    let radius = sigma / SIGMA_PER_RADIUS;
    -PI * radius * radius * libm::expm1(-SQRT_TAU * kappa * sigma)
}

/// One facet a blob; `regions[j]` is the cloud of blob j, `cloud_centers` are relative to O.
pub fn facets(
    spec: &GridSpec,
    cells: &[f64],
    blobs: &[Blob],
    regions: &[u32],
    cloud_centers: &[DVec3],
) -> Vec<Facet> {
    let facet = |(blob, &region): (&Blob, &u32)| {
        let center = cloud_centers[region as usize];
        let (normal, conditioning) = normal(spec, cells, blob.position, blob.sigma, center);
        let position = blob.position + SHELL_SIGMA * blob.sigma * normal;
        Facet { position, normal, area: area(blob.sigma, blob.kappa), region, conditioning }
    };
    blobs.iter().zip(regions).map(facet).collect()
}
