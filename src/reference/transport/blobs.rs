//! Clouds of Gaussian blobs as a medium: optical depths in closed form, and free flights without a
//! grid (transport.md, "Free flight").

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

use glam::{DMat3, DVec3};
use statrs::function::erf::erfc_inv;

use super::bvh::{Bounds, Bvh};
use super::medium::{Collision, Medium, Scatterer};
use super::ray::Ray;
use super::stream::Stream;
use crate::model::cloud::SQRT_TAU;
use crate::reference::Blob;

/// Optical depth, of any line, that is left out beyond a blob's end.
const OMITTED: f64 = 1e-7;
/// Distance in σ from which on a Gaussian's integral is 0 or 1: what is left is 10⁻¹⁶ of it.
const WHOLE: f64 = 8.2;

/// A blob in the space in which it is a ball of σ = 1.
#[derive(Debug, Clone, Copy)]
struct White {
    center: DVec3,
    /// Takes the blob to the unit ball.
    whiten: DMat3,
    /// √(2π) κ: optical depth of a line through the centre on which σ is 1.
    depth: f64,
    /// b²/2 at which lines leave it out.
    cut: f64,
    i_scatterer: u32,
}

/// The line of a ray in a blob: its optical depth is a normal distribution along it.
#[derive(Debug, Clone, Copy)]
struct Passage {
    /// Distance of the middle.
    middle: f64,
    /// 1/σ along the line.
    inverse: f64,
    /// Optical depth of the whole line.
    depth: f64,
}

/// Blobs with what scatters in them. The extinction at a point is the sum over all blobs, each out
/// to where any line has 10⁻⁷ of optical depth left.
#[derive(Debug, Clone)]
pub struct BlobMedium {
    /// In the order of the tree's leaves.
    blobs: Vec<White>,
    scatterers: Vec<Scatterer>,
    bvh: Bvh,
}

impl BlobMedium {
    /// Returns the medium of `blobs`, each with the index of what scatters in it.
    pub fn new(blobs: &[Blob], i_scatterer: &[u32], scatterers: Vec<Scatterer>) -> BlobMedium {
        let shown: Vec<(usize, f64)> = blobs
            .iter()
            .map(|b| (b.deepest() / OMITTED).ln())
            .enumerate()
            .filter(|(i, cut)| *cut > 0.0 && blobs[*i].sigma > 0.0)
            .collect();
        let boxes: Vec<Bounds> = shown
            .iter()
            .map(|&(i, cut)| {
                let reach = (2.0 * cut).sqrt() * blobs[i].extents();
                Bounds { low: blobs[i].position - reach, high: blobs[i].position + reach }
            })
            .collect();
        let bvh = Bvh::new(&boxes);
        let white = |&k: &u32| {
            let (i, cut) = shown[k as usize];
            White {
                center: blobs[i].position,
                whiten: blobs[i].white_matrix(),
                depth: SQRT_TAU * blobs[i].kappa,
                cut,
                i_scatterer: i_scatterer[i],
            }
        };
        BlobMedium { blobs: bvh.order.iter().map(white).collect(), scatterers, bvh }
    }
}

impl White {
    /// Returns the line of `ray` in the blob; `None` if it passes beyond the blob's end.
    fn passage(&self, ray: &Ray) -> Option<Passage> {
        let from = self.whiten * (ray.origin - self.center);
        let along = self.whiten * ray.direction;
        let square = along.length_squared();
        let middle = -from.dot(along) / square;
        let off = 0.5 * (from + middle * along).length_squared();
        if off > self.cut {
            return None;
        }
        let inverse = square.sqrt();
        Some(Passage { middle, inverse, depth: self.depth / inverse * (-off).exp() })
    }
}

impl Passage {
    /// Returns the depth from the ray's origin up to the distance `end`.
    fn up_to(&self, end: f64) -> f64 {
        let (from, to) = (-self.middle * self.inverse, (end - self.middle) * self.inverse);
        // Beyond the middle the tails are subtracted, so that nothing cancels.
        let share =
            if from > 0.0 { normal(-from) - normal(-to) } else { normal(to) - normal(from) };
        self.depth * share
    }

    /// Returns the distance at which the depth from the origin is `depth`; infinity if it never is.
    fn reaches(&self, depth: f64) -> f64 {
        let share = depth / self.depth;
        let from = -self.middle * self.inverse;
        // Beyond the middle the rest is what counts.
        let (p, sign) =
            if from > 0.0 { (normal(-from) - share, -1.0) } else { (normal(from) + share, 1.0) };
        if p <= 0.0 || p >= 1.0 {
            return f64::INFINITY;
        }
        let u = sign * inverse_normal(p);
        // Rounding must not lead back.
        (self.middle + u / self.inverse).max(0.0)
    }
}

/// Returns the share of a normal distribution below `u`.
fn normal(u: f64) -> f64 {
    if u.abs() > WHOLE {
        return if u > 0.0 { 1.0 } else { 0.0 };
    }
    0.5 * libm::erfc(-FRAC_1_SQRT_2 * u)
}

/// Returns the u below which the share `p` of a normal distribution lies.
fn inverse_normal(p: f64) -> f64 {
    -SQRT_2 * erfc_inv(2.0 * p)
}

impl Medium for BlobMedium {
    fn depth(&self, ray: &Ray, end: f64) -> f64 {
        let mut sum = 0.0;
        self.bvh.visit(ray, end, |k, end| {
            if let Some(passage) = self.blobs[k].passage(ray) {
                sum += passage.up_to(end);
            }
            end
        });
        sum
    }

    /// Collisions with each blob alone are a Poisson process along the ray, and collisions with all
    /// of them are the union of these processes. The first collision is therefore the first of all
    /// blobs' own first ones, each drawn by itself, and its blob is what scatters.
    fn collide(&self, ray: &Ray, end: f64, stream: &mut Stream) -> Option<Collision> {
        let mut found = None;
        self.bvh.visit(ray, end, |k, end| {
            let Some(passage) = self.blobs[k].passage(ray) else { return end };
            let wanted = stream.exponential();
            // Most blobs are too thin, whatever part of them lies on the way.
            if wanted >= passage.depth {
                return end;
            }
            let distance = passage.reaches(wanted);
            if distance >= end {
                return end;
            }
            found = Some((distance, k));
            distance
        });
        let (distance, k) = found?;
        let scatterer = self.scatterers[self.blobs[k].i_scatterer as usize];
        Some(Collision { distance, scatterer })
    }
}
