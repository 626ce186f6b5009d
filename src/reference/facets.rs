//! Facets of cloud particles, model.md §5 and passes.md "facets". A facet lies on its blob's shell.
//! Its normal follows the density's gradient if that has a direction, and otherwise points away
//! from the cloud's centre.
//!
//! In: the density grid and the placed blobs. Out: positions relative to O, unit normals, areas in
//! scene units².

use std::f64::consts::PI;

use glam::DVec3;

use super::Blob;
use super::grid::{density, sample};
use crate::model::cloud::{SIGMA_PER_RADIUS, SQRT_TAU, Shape};
use crate::model::grid::GridSpec;
use crate::model::parallel::parallel_map;

/// Radius of the quadrature's sphere, σ: points at √5 s integrate a Gaussian of standard deviation
/// s = 2σ to degree 5.
pub const GRADIENT_RADIUS_SIGMA: f64 = 4.472_135_954_999_58;
/// Distance of a facet from its blob's centre, σ.
pub const SHELL_SIGMA: f64 = 1.5;
/// Range of the conditioning q: below, only the cloud's centre decides the normal; above, only the
/// gradient.
pub const CONDITIONING: (f64, f64) = (0.02, 0.10);
/// Weights of the 14-point quadrature of degree 5 on the sphere: 6/15 + 8·3/40 = 1.
const AXIS_WEIGHT: f64 = 1.0 / 15.0;
const CORNER_WEIGHT: f64 = 3.0 / 40.0;

/// A facet that receives and reflects light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facet {
    /// Centre.
    pub position: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// Area, scene units².
    pub area: f64,
    /// Index of the region; of the cloud in this module.
    pub region: u32,
    /// σ of the blobs that it stands for; 0 on surfaces and ground.
    pub sigma: f64,
    /// q = |G|/S, from 0, where the density has no direction, to 1.
    pub conditioning: f64,
}

/// Returns the quadrature's 14 directions with their weights.
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

/// Returns G = Σ w ρ(p + 2√5 σ A d) d, a multiple of the gradient of the density ρ smoothed by a
/// Gaussian of 2σ, and S = Σ w ρ(p + 2√5 σ A d). A gives the sphere the blob's shape, along
/// its axes, so that the gradient is one in the space where the blob is a ball (§14).
pub fn gradient(
    density: impl Fn(DVec3) -> f64,
    p: DVec3,
    sigma: f64,
    shape: &Shape,
) -> (DVec3, f64) {
    directions().iter().fold((DVec3::ZERO, 0.0), |(g, s), &(d, w)| {
        let density = w * density(p + GRADIENT_RADIUS_SIGMA * sigma * shape.from_ball(d));
        (g + density * d, s + density)
    })
}

/// Returns the unit normal of a blob at `p` in a cloud about `center`, from the gradient G and the
/// sum S, and the conditioning q.
fn blended_normal((g, s): (DVec3, f64), shape: &Shape, p: DVec3, center: DVec3) -> (DVec3, f64) {
    let away = (p - center).try_normalize().unwrap_or(DVec3::Y);
    let q = if s > 0.0 { g.length() / s } else { 0.0 };
    let t = smoothstep(CONDITIONING, q);
    // t > 0 only where q > 0, hence |G| > 0.
    let down = if t > 0.0 { -shape.gradient_from_ball(g).normalize() } else { DVec3::ZERO };
    ((t * down + (1.0 - t) * away).try_normalize().unwrap_or(away), q)
}

/// Returns the cubic step with zero slope at both ends, as GLSL's smoothstep.
pub fn smoothstep(ends: (f64, f64), x: f64) -> f64 {
    let t = ((x - ends.0) / (ends.1 - ends.0)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Returns the area of a facet: π R² w (1 − e^{−τ₀}), R = 3σ, τ₀ = √(2π) κ σ a b/w.
///
/// 1, a and b are the lengths of the axes over σ. w is an ellipsoid's projected area, averaged over
/// all directions, over that of a ball of R. It is taken from Thomsen's formula
/// ((a^p + b^p + (ab)^p)/3)^{1/p}, p = 1.6075, which is within 1.1 % of a quarter of the surface.
pub fn area(blob: &Blob) -> f64 {
    const P: f64 = 1.6075;
    let radius = blob.sigma / SIGMA_PER_RADIUS;
    let Shape { aspect: a, aspect_z: b, .. } = blob.shape;
    let wider = ((a.powf(P) + b.powf(P) + (a * b).powf(P)) / 3.0).powf(1.0 / P);
    let depth = SQRT_TAU * blob.kappa * blob.sigma * blob.shape.volume() / wider;
    -PI * radius * radius * wider * libm::expm1(-depth)
}

/// Returns the point of a blob's shell of 1.5 σ where the normal is `n`.
fn shell(p: DVec3, (sigma, shape): (f64, Shape), n: DVec3) -> DVec3 {
    let to = shape.stretch(shape.stretch(n));
    p + SHELL_SIGMA * sigma / n.dot(to).sqrt() * to
}

/// The particles that facets are made of. *Shape*: all by particle.
#[derive(Debug, Clone, Copy)]
pub struct FacetSources<'a> {
    /// Placed blobs.
    pub blobs: &'a [Blob],
    /// Mean σ of each particle's group, which bounds the scale of its facet from below.
    pub sigma_means: &'a [f64],
    /// Index of each particle's cloud.
    pub regions: &'a [u32],
    /// Colours, linear RGB.
    pub colors: &'a [DVec3],
    /// Where facets lie.
    pub place: FacetPlace,
}

/// Where the facets of blobs lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FacetPlace {
    /// On the blobs' shells.
    Shell,
    /// At the blobs' centres, in modes in which clouds are a medium. Their normals mean nothing and
    /// are up.
    Center,
}

/// Returns one facet a blob, with normals from the density grid. `cloud_centers` are relative to
/// the lighting origin.
pub fn facets(
    spec: &GridSpec,
    cells: &[f64],
    sources: &FacetSources<'_>,
    cloud_centers: &[DVec3],
) -> Vec<Facet> {
    let facet = |i| facet_of(sources, i, cloud_centers, |x| sample(spec, cells, x));
    (0..sources.blobs.len()).map(facet).collect()
}

/// Returns one facet a blob, with normals from the blobs' own density instead of a grid's.
pub fn from_density(sources: &FacetSources<'_>, cloud_centers: &[DVec3]) -> Vec<Facet> {
    parallel_map(sources.blobs.len(), |i| {
        facet_of(sources, i, cloud_centers, |x| density(sources.blobs, x))
    })
}

fn facet_of(
    sources: &FacetSources<'_>,
    i: usize,
    cloud_centers: &[DVec3],
    density: impl Fn(DVec3) -> f64,
) -> Facet {
    let (blob, region) = (&sources.blobs[i], sources.regions[i]);
    let shape = (blob.sigma.max(sources.sigma_means[i]), blob.shape);
    let center = cloud_centers[region as usize];
    let facet = facet_at(sources.place, blob.position, shape, area(blob), region, center, density);
    Facet { sigma: blob.sigma, ..facet }
}

/// Returns the facet of a blob of σ and shape at `p`, on its shell or at its centre.
pub(super) fn facet_at(
    place: FacetPlace,
    p: DVec3,
    shape: (f64, Shape),
    area: f64,
    region: u32,
    center: DVec3,
    density: impl Fn(DVec3) -> f64,
) -> Facet {
    if place == FacetPlace::Center {
        return Facet {
            position: p,
            normal: DVec3::Y,
            area,
            region,
            sigma: 0.0,
            conditioning: 1.0,
        };
    }
    let gradient = gradient(density, p, shape.0, &shape.1);
    let (normal, conditioning) = blended_normal(gradient, &shape.1, p, center);
    Facet { position: shell(p, shape, normal), normal, area, region, sigma: 0.0, conditioning }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::deposit::deposit;
    use glam::UVec3;

    const SPEC: GridSpec =
        GridSpec { aspect: 1.0, n_cells: UVec3::splat(50), cell: 0.2, low: DVec3::splat(-5.0) };

    fn sources<'a>(
        blobs: &'a [Blob],
        sigma_means: &'a [f64],
        regions: &'a [u32],
    ) -> FacetSources<'a> {
        FacetSources { blobs, sigma_means, regions, colors: &[], place: FacetPlace::Shell }
    }

    fn ball() -> Vec<f64> {
        deposit(
            &SPEC,
            &[Blob { shape: Shape::BALL, position: DVec3::ZERO, sigma: 1.2, kappa: 1.0 }],
        )
    }

    /// The unit normal and q of a blob of shape (σ, aspect) at `p` in a cloud about `center`.
    fn normal(cells: &[f64], p: DVec3, [sigma, aspect]: [f64; 2], center: DVec3) -> (DVec3, f64) {
        let shape = Shape::upright(aspect);
        blended_normal(gradient(|x| sample(&SPEC, cells, x), p, sigma, &shape), &shape, p, center)
    }

    #[test]
    fn the_directions_are_a_quadrature_of_degree_5() {
        let mean =
            |f: &dyn Fn(DVec3) -> f64| directions().iter().map(|&(d, w)| w * f(d)).sum::<f64>();
        // Moments over the unit sphere: 1, 1/3, 1/5, 1/15; odd ones vanish.
        for (value, expected) in [
            (mean(&|_| 1.0), 1.0),
            (mean(&|d| d.y * d.y), 1.0 / 3.0),
            (mean(&|d| d.z.powi(4)), 0.2),
            (mean(&|d| (d.x * d.y).powi(2)), 1.0 / 15.0),
            (mean(&|d| d.x * d.y), 0.0),
            (mean(&|d| d.x * d.y * d.z), 0.0),
        ] {
            assert!((value - expected).abs() < 1e-15);
        }
        assert!(directions().iter().all(|(d, _)| (d.length() - 1.0).abs() < 1e-15));
    }

    #[test]
    fn of_a_linear_density_the_gradient_is_exact() {
        // ρ = 3 + 0.2 x − 0.1 z at the cell centres, which trilinear sampling keeps: G = (r/3)∇ρ, S
        // = ρ(p).
        let at = |i: usize, axis: u32| -4.9 + 0.2 * (i / 50usize.pow(axis) % 50) as f64;
        let cells: Vec<f64> = (0..125_000).map(|i| 3.0 + 0.2 * at(i, 0) - 0.1 * at(i, 2)).collect();
        let p = DVec3::new(0.33, -0.71, 0.52);
        let (g, s) = gradient(|x| sample(&SPEC, &cells, x), p, 0.6, &Shape::BALL);
        let r = 2.0 * 5f64.sqrt() * 0.6;
        assert!((g - r / 3.0 * DVec3::new(0.2, 0.0, -0.1)).length() < 1e-13);
        assert!((s - (3.0 + 0.066 - 0.052)).abs() < 1e-13);
    }

    #[test]
    fn normals_of_a_ball_point_outward_wherever_the_cloud_is_centred() {
        let cells = ball();
        for p in [DVec3::new(1.0, 0.5, 0.3), DVec3::new(-0.7, 0.2, 1.5), DVec3::new(0.0, -2.0, 0.0)]
        {
            let (n, q) = normal(&cells, p, [0.4, 1.0], DVec3::new(3.0, 3.0, -3.0));
            // q ≈ (2σ/3)|p|/1.2² > 0.1, so the gradient alone decides. Its direction errs by the
            // deposit's cut at 3σ (a cube: 0.27 %) and by cells of 0.2: below one degree.
            assert!(
                q > CONDITIONING.1 && n.dot(p.normalize()) > 1f64.to_radians().cos(),
                "{p} {n} {q}"
            );
        }
    }

    #[test]
    fn in_closed_form_a_ball_has_the_gradient_of_its_gaussian() {
        // For one blob the quadrature's points lie at p + r d: along −∇ρ up to its degree, and
        // exactly so by symmetry on an axis. Far from all blobs only the cloud's centre counts.
        let blobs = [
            Blob { shape: Shape::BALL, position: DVec3::ZERO, sigma: 1.2, kappa: 1.0 },
            Blob { shape: Shape::BALL, sigma: 0.4, position: DVec3::X, kappa: 0.0 },
        ];
        let facets =
            from_density(&sources(&blobs, &[0.4, 0.4], &[0, 0]), &[DVec3::new(0.0, 9.0, 0.0)]);
        assert!(
            (facets[1].normal - DVec3::X).length() < 1e-12
                && facets[1].conditioning > CONDITIONING.1
        );
        assert!((facets[1].position - DVec3::X * 1.6).length() < 1e-12);
        // At its own centre the gradient vanishes: the normal points away from the cloud's.
        assert!((facets[0].normal + DVec3::Y).length() < 1e-12);
        // A fine grid gives the same.
        let off = [blobs[0], Blob { position: DVec3::new(0.9, -0.5, 0.3), ..blobs[1] }];
        let by_grid =
            super::facets(&SPEC, &ball(), &sources(&off, &[0.4; 2], &[0; 2]), &[DVec3::ZERO])[1];
        let found = from_density(&sources(&off, &[0.4; 2], &[0; 2]), &[DVec3::ZERO])[1];
        assert!(found.normal.dot(by_grid.normal) > 1f64.to_radians().cos());
    }

    #[test]
    fn normals_blend_without_a_jump() {
        let cells = ball();
        let at = |k: i32| {
            normal(&cells, DVec3::X * 1e-3 * f64::from(k), [0.3, 1.0], DVec3::NEG_Y * 20.0)
        };
        // q grows by some (2√5·0.3/3)/1.2² = 0.31 a unit, t by at most 1.5/0.08 times that, and the
        // normal turns from +y to ±x by at most twice dt: 1.2e-2 a step of 1e-3.
        for k in -1500..1500 {
            assert!((at(k + 1).0 - at(k).0).length() < 2e-2, "{k}");
        }
        let middle = at(0);
        assert!(middle.1 < CONDITIONING.0 && middle.0.dot(DVec3::Y) > 0.999);
        assert!(at(1500).0.x > 0.99 && at(-1500).0.x < -0.99);
        assert_eq!([0.02, 0.1, 7.0].map(|q| smoothstep(CONDITIONING, q)), [0.0, 1.0, 1.0]);
        assert!((smoothstep(CONDITIONING, 0.06) - 0.5).abs() < 1e-15);
    }

    #[test]
    fn a_facet_lies_on_its_shell_and_without_direction_faces_up() {
        let blob = Blob { shape: Shape::BALL, position: DVec3::ONE, sigma: 0.5, kappa: 2.0 };
        let empty = vec![0.0; 125_000];
        let facets = facets(
            &SPEC,
            &empty,
            &sources(&[blob, blob], &[0.0; 2], &[1, 0]),
            &[DVec3::new(1.0, 1.0, 4.0), DVec3::ONE],
        );
        assert_eq!(
            (facets[0].normal, facets[0].conditioning, facets[0].region),
            (DVec3::Y, 0.0, 1)
        );
        assert_eq!(facets[0].position, DVec3::new(1.0, 1.75, 1.0));
        assert_eq!((facets[1].normal, facets[1].position.z), (DVec3::NEG_Z, 0.25));
        // τ₀ = √(2π); π·1.5²·(1 − e^{−2.5066…}) = 6.49216….
        assert!((facets[0].area - 2.25 * PI * (1.0 - (-2.506_628_274_631f64).exp())).abs() < 1e-11);
    }
}
