//! Radiative transfer against what is known of it: furnaces, quadrature of single scattering, slabs
//! by adding and doubling, Chandrasekhar's H, reciprocity and energy. Wrong estimators are found.

mod adding;
mod blobs;
mod known;
mod scenes;
mod slab;
mod slabs;
mod solids;
mod wrong;

use glam::DVec3;
use nimbus::model::parallel::parallel_map;
use nimbus::reference::transport::{
    Estimator, Medium, PathLight, Ray, Stream, TransportScene, Unbiased,
};

/// Mean of a channel over paths, with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Mean {
    value: f64,
    error: f64,
}

impl Mean {
    /// Returns the mean of `n` values of `f`, computed in order on all threads.
    fn of(n: usize, f: impl Fn(usize) -> f64 + Sync + Send) -> Mean {
        const JOB: usize = 1000;
        let sums = parallel_map(n.div_ceil(JOB), |job| {
            (job * JOB..n.min((job + 1) * JOB)).fold((0.0, 0.0), |(sum, squares), i| {
                let v = f(i);
                (sum + v, squares + v * v)
            })
        });
        let (sum, squares) = sums.into_iter().fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        let value = sum / n as f64;
        let variance = (squares / n as f64 - value * value).max(0.0);
        Mean { value, error: (variance / (n as f64 - 1.0)).sqrt() }
    }

    /// Returns the difference from `truth` in standard errors.
    fn off(&self, truth: f64) -> f64 {
        (self.value - truth) / self.error
    }

    /// Asserts that the mean is within four standard errors of `truth`, and that one is at most the
    /// share `accuracy` of it.
    fn assert_is(&self, what: &str, truth: f64, accuracy: f64) {
        println!("{what}: {:.6} ± {:.1e}, truth {truth:.6}", self.value, self.error);
        assert!(self.off(truth).abs() <= 4.0, "{what}: {self:?}, not {truth}");
        assert!(
            self.error <= accuracy * truth,
            "{what}: {self:?} is less accurate than {accuracy}"
        );
    }
}

/// Returns the light of paths `0..n` along one ray.
fn paths<M: Medium, E: Estimator>(
    scene: &TransportScene<M>,
    ray: Ray,
    n: usize,
    of: impl Fn(&PathLight) -> f64 + Sync + Send,
) -> Mean {
    // Rays share no random numbers.
    let bits = ray.origin.to_array().map(|x| x.to_bits() ^ (x.to_bits() >> 32));
    let number = bits.into_iter().fold(0u64, |a, b| a.wrapping_mul(0x9e37_79b9).wrapping_add(b));
    Mean::of(n, |i| of(&scene.trace_by::<E>(ray, &mut Stream::new(number as u32, i as u32))))
}

/// Returns the mean green radiance along one ray by as many paths as it takes for a standard error
/// of that absolute size.
fn radiance_within<M: Medium>(scene: &TransportScene<M>, ray: Ray, error: f64) -> Mean {
    let mut n = 20_000;
    loop {
        let mean = radiance(scene, ray, n);
        if mean.error <= error {
            return mean;
        }
        n = (1.1 * n as f64 * (mean.error / error).powi(2)) as usize;
        assert!(n < 100_000_000, "{mean:?} for {error}");
    }
}

/// Returns the mean green radiance along one ray.
fn radiance<M: Medium>(scene: &TransportScene<M>, ray: Ray, n: usize) -> Mean {
    paths::<M, Unbiased>(scene, ray, n, |light| light.radiance().y)
}

/// Returns a ray from `origin` toward `target`.
fn ray(origin: DVec3, target: DVec3) -> Ray {
    Ray { origin, direction: (target - origin).normalize() }
}

/// Nothing.
struct Vacuum;

impl Medium for Vacuum {
    fn depth(&self, _: &Ray, _: f64) -> f64 {
        0.0
    }

    fn collide(
        &self,
        _: &Ray,
        _: f64,
        _: &mut Stream,
    ) -> Option<nimbus::reference::transport::Collision> {
        None
    }
}
