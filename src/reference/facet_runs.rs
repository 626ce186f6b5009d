//! Facets of runs of particles, model.md §5 and passes.md "facets": a run of particles in Morton
//! order is merged to one blob, which has one facet.
//!
//! In: the density grid, the placed blobs and the runs. Out: facets as in [`super::facets`], with
//! their colours.

use glam::DVec3;

use super::Blob;
use super::facets::{Facet, FacetSources, area, facet_at};
use super::grid::sample;
use crate::model::cloud::{MIN_ASPECT, Shape};
use crate::model::grid::GridSpec;

/// A run of particles merged to one blob.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MergedBlob {
    /// p̄ = Σ m p/Σ m, m the masses.
    pub position: DVec3,
    /// σ_g = √(Σ m (σ² + |p − p̄|²/3)/Σ m). If some blobs are ellipsoids: √(Σ m (σ_w² + (x² +
    /// z²)/2)/Σ m) of p − p̄, σ_w² a blob's mean variance along x and z.
    pub sigma: f64,
    /// Upright, with √(Σ m (σ_y² + y²)/Σ m) along y; a ball if all blobs are balls. A run of one
    /// blob has its shape.
    pub shape: Shape,
    /// Mean σ̄ of the particles' groups, by mass.
    pub sigma_mean: f64,
    /// Sum of the particles' facet areas.
    pub area: f64,
    /// Mean colour by area.
    pub color: DVec3,
}

/// Normalises weights; if all are 0 they count alike.
fn weights(of: impl Iterator<Item = f64>) -> Vec<f64> {
    let weights: Vec<f64> = of.collect();
    let sum: f64 = weights.iter().sum();
    let equal = 1.0 / weights.len() as f64;
    weights.into_iter().map(|w| if sum > 0.0 { w / sum } else { equal }).collect()
}

/// Merges the particles `run` to one blob. `ellipsoids` tells whether some of the scene's blobs are
/// not balls.
pub fn merged(m: &FacetSources<'_>, run: &[u32], ellipsoids: bool) -> MergedBlob {
    let at = |i: &u32| m.blobs[*i as usize];
    let by_mass = weights(run.iter().map(|i| at(i).mass()));
    let areas: Vec<f64> = run.iter().map(|i| area(&at(i))).collect();
    let by_area = weights(areas.iter().copied());
    let position: DVec3 = run.iter().zip(&by_mass).map(|(i, w)| *w * at(i).position).sum();
    let spread = |of: &dyn Fn(Blob, DVec3) -> f64| {
        run.iter()
            .zip(&by_mass)
            .map(|(i, w)| w * of(at(i), at(i).position - position))
            .sum::<f64>()
            .sqrt()
    };
    let (sigma, shape) = match (run, ellipsoids) {
        ([one], _) => (at(one).sigma, at(one).shape),
        (_, false) => (spread(&|b, d| b.sigma.powi(2) + d.length_squared() / 3.0), Shape::BALL),
        (_, true) => {
            let own = |b: Blob| (b.sigma * b.shape.extents()).powf(2.0);
            let wide = spread(&|b, d| 0.5 * (own(b).x + own(b).z) + 0.5 * (d.x * d.x + d.z * d.z));
            let high = spread(&|b, d| own(b).y + d.y * d.y);
            let aspect = (high / wide).clamp(MIN_ASPECT, 1.0 / MIN_ASPECT);
            (wide, if wide > 0.0 { Shape::upright(aspect) } else { Shape::BALL })
        }
    };
    MergedBlob {
        position,
        sigma,
        shape,
        sigma_mean: run.iter().zip(&by_mass).map(|(i, w)| w * m.sigma_means[*i as usize]).sum(),
        area: areas.iter().sum(),
        color: run.iter().zip(&by_area).map(|(i, w)| *w * m.colors[*i as usize]).sum(),
    }
}

/// Returns one facet a run of `order`, with its colour. A run [first, end) holds particles of one
/// cloud.
pub fn grouped(
    spec: &GridSpec,
    cells: &[f64],
    sources: &FacetSources<'_>,
    cloud_centers: &[DVec3],
    order: &[u32],
    runs: &[(u64, u64)],
) -> Vec<(Facet, DVec3)> {
    let ellipsoids = sources.blobs.iter().any(|b| b.shape != Shape::BALL);
    let of = |&(first, end): &(u64, u64)| {
        let run = &order[first as usize..end as usize];
        let b = merged(sources, run, ellipsoids);
        let region = sources.regions[run[0] as usize];
        let (shape, center) =
            ((b.sigma.max(b.sigma_mean), b.shape), cloud_centers[region as usize]);
        let density = |x| sample(spec, cells, x);
        let facet = facet_at(sources.place, b.position, shape, b.area, region, center, density);
        (Facet { sigma: b.sigma, ..facet }, b.color)
    };
    runs.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use glam::UVec3;

    use super::*;
    use crate::reference::deposit::deposit;
    use crate::reference::facets::{FacetPlace, facets};

    const SPEC: GridSpec =
        GridSpec { aspect: 1.0, n_cells: UVec3::splat(50), cell: 0.2, low: DVec3::splat(-5.0) };

    #[test]
    fn a_run_is_one_blob_of_its_members() {
        let blob = |x: f64, sigma, kappa| Blob {
            shape: Shape::BALL,
            position: DVec3::X * x,
            sigma,
            kappa,
        };
        // Masses 2·1³ and 1·2³, 1 to 4: p̄ = 4, σ_g² = ((1 + 16/3) + 4 (4 + 1/3))/5 = 71/15.
        let blobs =
            [blob(0.0, 1.0, 2.0), blob(5.0, 2.0, 1.0), blob(1.0, 0.0, 1.0), blob(3.0, 1.0, 0.0)];
        let colors = [DVec3::X, DVec3::Y, DVec3::ZERO, DVec3::ONE];
        let members = FacetSources {
            blobs: &blobs,
            sigma_means: &[1.0, 6.0, 2.0, 4.0],
            regions: &[0; 4],
            colors: &colors,
            place: FacetPlace::Shell,
        };
        let b = merged(&members, &[0, 1], false);
        assert!(
            (b.position - DVec3::X * 4.0).length() < 1e-14 && (b.sigma_mean - 5.0).abs() < 1e-14
        );
        assert!((b.sigma.powi(2) - 71.0 / 15.0).abs() < 1e-14);
        let (a0, a1) = (area(&blobs[0]), area(&blobs[1]));
        assert!((b.area - a0 - a1).abs() < 1e-13);
        assert!((b.color - DVec3::new(a0, a1, 0.0) / (a0 + a1)).length() < 1e-15);
        // Neither of the last two has mass or area, so they count alike.
        let b = merged(&members, &[2, 3], false);
        assert_eq!(
            (b.position, b.sigma_mean, b.area, b.color),
            (DVec3::X * 2.0, 3.0, 0.0, DVec3::splat(0.5))
        );
        // (0 + 1)/2 + 1/3.
        assert!((b.sigma.powi(2) - 5.0 / 6.0).abs() < 1e-15);
    }

    #[test]
    fn runs_of_one_are_the_particles_facets() {
        let ball = Blob { shape: Shape::BALL, position: DVec3::ZERO, sigma: 1.2, kappa: 1.0 };
        let cells = deposit(&SPEC, &[ball]);
        let blob = |x: f64| Blob {
            shape: Shape::BALL,
            position: DVec3::new(x, 0.4, -0.3),
            sigma: 0.3 + 0.1 * x,
            kappa: 1.0,
        };
        let (blobs, means, regions) =
            ([blob(0.5), blob(-1.0), blob(2.0)], [0.1, 0.4, 0.2], [0, 1, 1]);
        let centers = [DVec3::Y, DVec3::Z];
        let colors = [DVec3::X; 3];
        let members = FacetSources {
            blobs: &blobs,
            sigma_means: &means,
            regions: &regions,
            colors: &colors,
            place: FacetPlace::Shell,
        };
        let single = facets(&SPEC, &cells, &members, &centers);
        let of_runs =
            grouped(&SPEC, &cells, &members, &centers, &[0, 2, 1], &[(0, 1), (1, 2), (2, 3)]);
        for ((facet, color), i) in of_runs.into_iter().zip([0, 2, 1]) {
            // √σ² is σ to an ulp.
            assert!((facet.position - single[i].position).length() < 1e-14 && color == DVec3::X);
            assert!(
                (facet.normal - single[i].normal).length() < 1e-13 && facet.area == single[i].area
            );
            assert_eq!(facet.region, single[i].region);
        }
    }
}
