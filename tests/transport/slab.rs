//! An even medium between two planes, for which transfer is solved.

use glam::DVec3;
use nimbus::model::phase::Phase;
use nimbus::reference::transport::{
    Collision, Lights, Medium, Ray, Scatterer, Solids, Stream, TransportScene,
};

/// Extinction 1 between y = −depth and y = 0.
pub struct Slab {
    pub depth: f64,
    pub scatterer: Scatterer,
}

impl Slab {
    pub fn new(depth: f64, albedo: f64, g: f64) -> Slab {
        let phase = Phase::HenyeyGreenstein { g };
        Slab { depth, scatterer: Scatterer { albedo: DVec3::splat(albedo), phase } }
    }

    /// Returns the distances along `ray` at which the slab begins and ends, before `end`.
    fn within(&self, ray: &Ray, end: f64) -> (f64, f64) {
        let [a, b] = [0.0, -self.depth].map(|y| (y - ray.origin.y) / ray.direction.y);
        // A ray along the slab is in it or not.
        (a.min(b).max(0.0), a.max(b).min(end))
    }
}

impl Medium for Slab {
    fn depth(&self, ray: &Ray, end: f64) -> f64 {
        let (from, to) = self.within(ray, end);
        (to - from).max(0.0)
    }

    fn collide(&self, ray: &Ray, end: f64, stream: &mut Stream) -> Option<Collision> {
        let (from, to) = self.within(ray, end);
        let distance = from + stream.exponential();
        (distance < to).then_some(Collision { distance, scatterer: self.scatterer })
    }
}

/// Returns a slab in that light.
pub fn lit(slab: Slab, lights: Lights) -> TransportScene<Slab> {
    TransportScene { medium: slab, solids: Solids::default(), lights }
}

/// Returns the ray that arrives at the slab's upper face, or its lower one, at an angle of that
/// cosine to its normal.
pub fn toward(slab_depth: f64, from_above: bool, cosine: f64) -> Ray {
    let side = (1.0 - cosine * cosine).sqrt();
    if from_above {
        Ray { origin: DVec3::new(0.0, 1.0, 0.0), direction: DVec3::new(side, -cosine, 0.0) }
    } else {
        let origin = DVec3::new(0.0, -slab_depth - 1.0, 0.0);
        Ray { origin, direction: DVec3::new(side, cosine, 0.0) }
    }
}
