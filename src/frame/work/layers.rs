//! The number of layers that a pixel is made of, counted along some rays of a frame.

use glam::DVec3;

use crate::layout::frame::CameraRecord;
use crate::layout::particle::{ParticleRecord, PlacedRecord};
use crate::model::cloud::SQRT_TAU;
use crate::model::edge::Edge;
use crate::model::shape::Shape;

/// Most pairs of ray and blob that are tested: about a tenth of a second.
const MOST_TESTS: usize = 20_000_000;
/// Most rays along a side of the picture.
const MOST_ALONG: usize = 32;
/// Least rays along a side of the picture.
const LEAST_ALONG: usize = 4;

/// Rays through pixels that lie in a lattice over the picture.
pub(super) struct Rays(Vec<DVec3>);

impl Rays {
    /// Returns unit vectors through the centres of pixels of a picture of `size`; fewer for many
    /// blobs.
    pub fn new(camera: &CameraRecord, size: [u32; 2], n_blobs: usize) -> Rays {
        let most = (MOST_TESTS / n_blobs.max(1)).isqrt();
        let n = size.map(|n| most.clamp(LEAST_ALONG, MOST_ALONG).min(n as usize));
        let [right, up, forward] = [camera.right, camera.up, camera.forward].map(vector);
        let at = |i: usize, n: usize, pixels: u32| {
            let pixel = ((i as f64 + 0.5) * f64::from(pixels) / n as f64).floor() + 0.5;
            2.0 * pixel / f64::from(pixels) - 1.0
        };
        let ray = |k: usize| {
            let (x, y) = (at(k % n[0], n[0], size[0]), at(k / n[0], n[1], size[1]));
            let [x, y] = [x * f64::from(camera.tan_x), -y * f64::from(camera.tan_y)];
            (x * right + y * up + forward).normalize()
        };
        Rays((0..n[0] * n[1]).map(ray).collect())
    }
}

/// A blob before the near plane, from the eye.
struct Seen {
    offset: DVec3,
    sigma: f64,
    /// View depth.
    depth: f64,
    shape: Shape,
    /// Square of the distance of rays that may meet it.
    reach_squared: f64,
    /// Optical depth of a line through the centre on which σ is that of the first axis.
    tau: f64,
}

/// Returns the mean number of layers along `rays`: blobs that have not ended there, near to far,
/// until what passes is below `saturated`. Blobs that a solid in one of the boxes `solids` (low and
/// high corner) may hide are none: those whose centres are not nearer than the box.
pub(super) fn layers(
    rays: &Rays,
    camera: &CameraRecord,
    placed: &[PlacedRecord],
    particles: &[ParticleRecord],
    solids: &[[DVec3; 2]],
    (edge, saturated): (Edge, f64),
) -> f64 {
    let (eye, forward) = (vector(camera.eye), vector(camera.forward));
    let near = f64::from(camera.near);
    let seen = |(place, particle): (&PlacedRecord, &ParticleRecord)| {
        let (offset, sigma) = (vector(place.position) - eye, f64::from(place.sigma));
        let (depth, shape) = (offset.dot(forward), particle.shape());
        let tau = SQRT_TAU * f64::from(particle.kappa) * sigma;
        let cut = edge.cut(tau * shape.widest());
        let is_seen = cut > 0.0 && depth >= near;
        // A hundred roundings of the squares of distances: they must leave no blob out, and the
        // test below decides.
        let rounding = 1e-14 * offset.length_squared();
        let reach_squared = 2.0 * cut * (sigma * shape.widest()).powi(2) + rounding;
        is_seen.then_some(Seen { offset, sigma, depth, shape, reach_squared, tau })
    };
    let seen: Vec<Seen> = placed.iter().zip(particles).filter_map(seen).collect();
    let of_ray = |ray: &DVec3| {
        let nearest = solids.iter().map(|solid| entry(eye, *ray, solid));
        let hidden = nearest.fold(f64::INFINITY, f64::min) * ray.dot(forward);
        let mut met = Vec::new();
        for &Seen { offset, sigma, depth, shape, reach_squared, tau } in &seen {
            let along = offset.dot(*ray);
            if offset.length_squared() - along * along > reach_squared {
                continue;
            }
            // In units in which the blob is round.
            let (offset, ray) = (shape.whiten(offset), shape.whiten(*ray));
            let along = offset.dot(ray) / ray.length();
            let apart = offset.length_squared() - along * along;
            let tau = tau / ray.length();
            let (off, cut) = (0.5 * apart / (sigma * sigma), edge.cut(tau));
            if off > cut || cut <= 0.0 || depth > hidden || tau <= 0.0 {
                continue;
            }
            met.push((depth, tau * (-off).exp()));
        }
        met.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut n = 0;
        let mut depth = 0.0f64;
        for (_, tau) in met {
            if (-depth).exp() < saturated {
                break;
            }
            (n, depth) = (n + 1, depth + tau);
        }
        n
    };
    let n: usize = rays.0.iter().map(of_ray).sum();
    n as f64 / rays.0.len().max(1) as f64
}

/// Returns the distance from `eye` along `ray` to a box; infinity where the ray misses it.
fn entry(eye: DVec3, ray: DVec3, [low, high]: &[DVec3; 2]) -> f64 {
    let (mut enter, mut leave) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        let [a, b] = [low, high].map(|face| (face[axis] - eye[axis]) / ray[axis]);
        // A ray within the plane of a face has no number there, which leaves all as it is.
        (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
    }
    if enter <= leave { enter } else { f64::INFINITY }
}

fn vector(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUT: Edge = Edge::at(3.0);

    fn camera() -> CameraRecord {
        CameraRecord {
            eye: [0.0; 3],
            tan_x: 1.0,
            right: [1.0, 0.0, 0.0],
            tan_y: 1.0,
            up: [0.0, 1.0, 0.0],
            near: 0.1,
            forward: [0.0, 0.0, -1.0],
            unused: 0.0,
        }
    }

    fn blob(z: f32, sigma: f32, kappa: f32) -> (PlacedRecord, ParticleRecord) {
        let position = [0.0, 0.0, z];
        (
            PlacedRecord { position, sigma },
            ParticleRecord {
                sigma,
                kappa,
                aspect: 1.0,
                aspect_z: 1.0,
                ..ParticleRecord::default()
            },
        )
    }

    fn count(blobs: &[(PlacedRecord, ParticleRecord)], saturated: f64) -> f64 {
        let (placed, particles): (Vec<_>, Vec<_>) = blobs.iter().copied().unzip();
        // One pixel: its ray is the view direction.
        let rays = Rays::new(&camera(), [1, 1], placed.len());
        assert_eq!(rays.0, [DVec3::NEG_Z]);
        layers(&rays, &camera(), &placed, &particles, &[], (CUT, saturated))
    }

    #[test]
    fn blobs_before_the_eye_and_before_the_pixel_is_full_are_layers() {
        let thin = |z| blob(z, 1.0, 1e-3);
        assert_eq!(count(&[thin(-5.0), thin(-9.0), thin(4.0)], 1e-3), 2.0);
        // Twice the blobs, twice the layers, while the pixel is not full.
        assert_eq!(count(&[thin(-5.0); 4], 1e-3), 4.0);
        // A blob of depth 20 hides what is behind it, and not what is before it.
        let dense = blob(-7.0, 1.0, 8.0);
        assert_eq!(count(&[thin(-9.0), thin(-5.0), dense], 1e-3), 2.0);
        // Blobs without extinction are no layers.
        assert_eq!(count(&[blob(-5.0, 1.0, 0.0)], 1e-3), 0.0);
    }

    #[test]
    fn a_blob_counts_for_its_share_of_the_rays() {
        // The cone about a cut of 3 σ = 5 units at distance 10 has the tangent 1/√3. The picture's
        // sides have the tangent 1: the cone is π/3 of the 4 units of its area.
        let (placed, particle) = blob(-10.0, 5.0 / 3.0, 1e-3);
        let rays = Rays::new(&camera(), [640, 640], 1);
        assert_eq!(rays.0.len(), MOST_ALONG * MOST_ALONG);
        let share = layers(&rays, &camera(), &[placed], &[particle], &[], (CUT, 1e-3));
        assert!((share - std::f64::consts::PI / 12.0).abs() < 0.02, "{share}");
    }

    #[test]
    fn blobs_behind_a_box_of_solids_are_not_certain() {
        let blobs = [blob(-5.0, 1.0, 1e-3), blob(-9.0, 1.0, 1e-3)];
        let (placed, particles): (Vec<_>, Vec<_>) = blobs.iter().copied().unzip();
        let rays = Rays::new(&camera(), [1, 1], 2);
        let n = |solids: &[[DVec3; 2]]| {
            layers(&rays, &camera(), &placed, &particles, solids, (CUT, 1e-3))
        };
        let at = |x: f64, z: f64| [DVec3::new(x - 1.0, -1.0, z - 0.5), DVec3::new(x + 1.0, 1.0, z)];
        assert_eq!(n(&[at(0.0, -7.0)]), 1.0);
        assert_eq!(n(&[at(0.0, -7.0), at(0.0, -3.0)]), 0.0);
        assert_eq!(n(&[at(0.0, -10.0)]), 2.0);
        // Beside the ray, and behind the eye.
        assert_eq!(n(&[at(5.0, -7.0), at(0.0, 3.0)]), 2.0);
        // About the eye.
        assert_eq!(n(&[at(0.0, 0.2)]), 0.0);
    }

    #[test]
    fn flat_blobs_count_within_their_own_form() {
        let at = |y: f32, aspect: f32| {
            let (mut placed, mut particle) = blob(-10.0, 1.0, 1e-3);
            (placed.position[1], particle.aspect) = (y, aspect);
            (placed, particle)
        };
        // The ray passes 2 below the centre: 2 σ of a round blob, 4 σ of one half as high.
        assert_eq!(count(&[at(2.0, 1.0)], 1e-3), 1.0);
        assert_eq!(count(&[at(2.0, 0.5)], 1e-3), 0.0);
        assert_eq!(count(&[at(1.4, 0.5)], 1e-3), 1.0);
    }

    #[test]
    fn blobs_end_at_an_optical_depth() {
        // The ray passes 2 σ from a blob of depth 0.1 e²: 0.1 is left.
        let (mut placed, particle) = blob(-10.0, 1.0, (0.1 * 2f64.exp() / SQRT_TAU) as f32);
        placed.position[1] = 2.0;
        let rays = Rays::new(&camera(), [1, 1], 1);
        let of = |tau| {
            let bounds = (Edge { tau, ..CUT }, 1e-3);
            layers(&rays, &camera(), &[placed], &[particle], &[], bounds)
        };
        assert_eq!([of(0.0999), of(0.1001), of(1.0)], [1.0, 0.0, 0.0]);
    }

    #[test]
    fn many_blobs_take_few_rays() {
        assert_eq!(Rays::new(&camera(), [640, 480], 200_000).0.len(), 100);
        assert_eq!(Rays::new(&camera(), [640, 480], usize::MAX).0.len(), 16);
    }
}
