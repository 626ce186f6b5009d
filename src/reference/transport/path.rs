//! Random paths from the eye (transport.md, "Paths").

use glam::DVec3;

use super::estimator::{Estimator, Unbiased};
use super::lights::{LightSample, Lights};
use super::medium::{Collision, Medium};
use super::ray::{Ray, around};
use super::solids::{SolidHit, Solids};
use super::stream::Stream;
use crate::reference::brdf;

/// Layers of a path's light: scattered once, twice and more, each from suns and lamps, and from the
/// sky.
pub const N_LAYERS: usize = 6;

/// Number of scatterings from which on a path may end by chance.
const ROULETTE_FROM: u32 = 8;
/// Share of the paths that go on, at most, from [`LONG`] scatterings on: between white walls and in
/// a medium that absorbs nothing a path need not end by itself.
const GO_ON: f64 = 0.999;
/// Number of scatterings of a long path.
const LONG: u32 = 4096;

/// The light that one path carries to the eye.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathLight {
    /// Radiance by layer: scattered once by suns and lamps, once by the sky, twice, …
    pub layers: [DVec3; N_LAYERS],
    /// Opacity along the ray.
    pub alpha: f64,
}

impl PathLight {
    /// Returns the radiance of all layers.
    pub fn radiance(&self) -> DVec3 {
        self.layers.iter().sum()
    }
}

/// Everything that light meets.
#[derive(Debug, Clone)]
pub struct TransportScene<M> {
    /// The medium.
    pub medium: M,
    /// Surfaces and ground.
    pub solids: Solids,
    /// Emitters.
    pub lights: Lights,
}

/// Where a path scatters.
enum Vertex {
    Cloud(Collision),
    Solid(SolidHit),
}

impl<M: Medium> TransportScene<M> {
    /// Traces one path along `ray`. Emitters are not seen themselves: a path that scatters nowhere
    /// carries no light.
    pub fn trace(&self, ray: Ray, stream: &mut Stream) -> PathLight {
        self.trace_by::<Unbiased>(ray, stream)
    }

    /// Traces one path by the laws of `E`.
    pub fn trace_by<E: Estimator>(&self, ray: Ray, stream: &mut Stream) -> PathLight {
        let mut light = PathLight { layers: [DVec3::ZERO; N_LAYERS], alpha: 0.0 };
        let mut ray = ray;
        let mut throughput = DVec3::ONE;
        // Density with which the ray's direction was drawn; there is none for the eye's ray.
        let mut drawn_by: Option<f64> = None;
        for n in 1.. {
            let met = self.solids.nearest(&ray, f64::INFINITY);
            if drawn_by.is_none() {
                light.alpha = match met {
                    Some(_) => 1.0,
                    None => E::opacity(self.medium.depth(&ray, f64::INFINITY)),
                };
            }
            let end = met.map_or(f64::INFINITY, |hit| hit.distance);
            let vertex = match (self.medium.collide(&ray, end, stream), met) {
                (Some(collision), _) => {
                    throughput = E::scattered(throughput, collision.scatterer.albedo);
                    Vertex::Cloud(collision)
                }
                (None, Some(hit)) if hit.is_front => Vertex::Solid(hit),
                (None, Some(_)) => break,
                (None, None) => {
                    if let Some(own) = drawn_by {
                        // The other strategy for the same light.
                        let share =
                            E::mis_weight(own, self.lights.density(ray.origin, ray.direction));
                        let beyond = self.lights.environment(ray.direction);
                        add(&mut light, n - 1, beyond.map(|l| throughput * l * share));
                    }
                    break;
                }
            };
            if !survives::<E>(&mut throughput, n, stream) {
                break;
            }
            let (position, toward_eye) = (ray.at(vertex.distance()), -ray.direction);
            if let Some(sample) = self.lights.sample(position, stream) {
                let seen = self.seen::<E>(&vertex, position, toward_eye, &sample);
                add(&mut light, n, seen.map(|l| throughput * l));
            }
            let Some((direction, factor, density)) = vertex.sample::<E>(toward_eye, stream) else {
                break;
            };
            throughput *= factor;
            ray = Ray { origin: position, direction };
            drawn_by = Some(density);
        }
        light
    }

    /// Returns the light of `sample` that scatters to the eye: of suns, and of the sky.
    fn seen<E: Estimator>(
        &self,
        vertex: &Vertex,
        position: DVec3,
        toward_eye: DVec3,
        sample: &LightSample,
    ) -> [DVec3; 2] {
        let LightSample { toward, distance, light, density } = *sample;
        let (factor, own) = vertex.evaluate::<E>(toward_eye, toward);
        let ray = Ray { origin: position, direction: toward };
        if factor == DVec3::ZERO || !E::arrives(self.solids.hides(&ray, distance)) {
            return [DVec3::ZERO; 2];
        }
        let through = E::transmittance(self.medium.depth(&ray, distance));
        let of = |light: DVec3| match density {
            Some(density) => E::drawn(light, density) * E::mis_weight(density, own),
            None => light,
        };
        light.map(|l| factor * of(l) * through)
    }
}

/// Adds light that was scattered `n` times.
fn add(light: &mut PathLight, n: u32, [of_suns, of_sky]: [DVec3; 2]) {
    let i = 2 * (n.min(3) as usize - 1);
    light.layers[i] += of_suns;
    light.layers[i + 1] += of_sky;
}

/// Lets paths of little throughput end by chance, and gives the others the throughput of those.
fn survives<E: Estimator>(throughput: &mut DVec3, n: u32, stream: &mut Stream) -> bool {
    let most = throughput.max_element();
    if n < ROULETTE_FROM {
        return most > 0.0;
    }
    let chance = most.min(if n < LONG { 1.0 } else { GO_ON });
    if chance >= 1.0 {
        return true;
    }
    if stream.uniform() >= chance {
        return false;
    }
    *throughput *= E::roulette_weight(chance);
    true
}

impl Vertex {
    fn distance(&self) -> f64 {
        match self {
            Vertex::Cloud(collision) => collision.distance,
            Vertex::Solid(hit) => hit.distance,
        }
    }

    /// Returns f cos θ of light from the unit vector `from` toward the eye, and the density by
    /// which [`Vertex::sample`] samples `from`.
    fn evaluate<E: Estimator>(&self, toward_eye: DVec3, from: DVec3) -> (DVec3, f64) {
        match self {
            Vertex::Cloud(Collision { scatterer, .. }) => {
                let p = E::phase(|cosine| scatterer.phase.at(cosine), -from.dot(toward_eye));
                (DVec3::splat(p), p)
            }
            Vertex::Solid(hit) => {
                let cosine = hit.normal.dot(from);
                if cosine <= 0.0 {
                    return (DVec3::ZERO, 0.0);
                }
                let f = brdf::reflectance(&hit.brdf, hit.normal, from, toward_eye);
                (E::received(f, cosine), brdf::density(&hit.brdf, hit.normal, toward_eye, from))
            }
        }
    }

    /// Samples the direction that light comes from. Returns it with f cos θ over its density, and
    /// with the density.
    fn sample<E: Estimator>(
        &self,
        toward_eye: DVec3,
        stream: &mut Stream,
    ) -> Option<(DVec3, DVec3, f64)> {
        match self {
            Vertex::Cloud(Collision { scatterer, .. }) => {
                let cosine = scatterer.phase.sample(|| stream.uniform());
                let direction = around(-toward_eye, cosine, stream.uniform());
                Some((direction, DVec3::ONE, scatterer.phase.at(cosine)))
            }
            Vertex::Solid(hit) => {
                let u = [stream.uniform(), stream.uniform(), stream.uniform(), 0.0];
                let direction = brdf::direction(&hit.brdf, hit.normal, toward_eye, u);
                let (factor, density) = self.evaluate::<E>(toward_eye, direction);
                (density > 0.0).then(|| (direction, factor / density, density))
            }
        }
    }
}
