//! Groups of particles that share an origin.

use glam::DVec3;

use super::shape::Shapes;

/// A run of consecutive particles that share an origin: a box, or a whole particle list. Positions
/// relative to that origin keep their accuracy in f32 wherever the origin lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Group {
    /// Index of the cloud.
    pub i_cloud: usize,
    /// Index of the first particle.
    pub i_first: u32,
    /// Number of particles.
    pub n_particles: u32,
    /// Origin of the group's positions, relative to the cloud's.
    pub center: DVec3,
    /// Centre of the cloud's growth, relative to its origin.
    pub cloud_center: DVec3,
    /// Point that its facets face away from, relative to the cloud's origin.
    pub facing_from: DVec3,
    /// Lengths over those at time 0; 1 unless returned by [`Group::grown`].
    pub scale: f64,
    /// Bound on positions: they lie within center ± half_extent.
    pub half_extent: DVec3,
    /// Bound on σ along x and z.
    pub sigma_max: f64,
    /// Bound on σ along y.
    pub sigma_y_max: f64,
    /// Mean σ along x and z; of turned ellipsoids along their longest axes.
    pub sigma_mean: f64,
    /// The same, weighted by the areas that particles cover: Σσ³/Σσ². Of discs and animated
    /// particles it is the plain mean.
    pub sigma_by_area: f64,
    /// Least, mean and greatest aspect: σ along y over σ along x and z. Of turned ellipsoids, the
    /// least counts as that of the shortest axis over σ.
    pub aspects: [f64; 3],
    /// Greatest σ in any direction of the ellipsoids that are not upright; 0 without any.
    pub turned_max: f64,
    /// Greatest peak extinction.
    pub kappa_max: f64,
    /// Greatest mass κ (2π)^{3/2} σ³ of a blob times its shape's volume.
    pub mass_max: f64,
    /// Greatest displacement by the cloud's gusts.
    pub gust_reach: f64,
}

/// Returns the least and the greatest aspect of all particles; `None` if some ellipsoids are
/// turned.
pub fn aspects_of(groups: &[Group]) -> Option<[f64; 2]> {
    let filled = || groups.iter().filter(|g| g.n_particles > 0);
    let ends = filled().fold([f64::INFINITY, 0.0_f64], |[least, greatest], g| {
        [least.min(g.aspects[0]), greatest.max(g.aspects[2])]
    });
    filled().all(|g| g.shapes() < Shapes::Turned).then_some(ends)
}

/// Returns the mean aspect of all particles; `None` if all blobs are balls.
pub(super) fn mean_aspect_of(groups: &[Group]) -> Option<f64> {
    if groups.iter().all(|g| g.shapes() == Shapes::Balls) {
        return None;
    }
    let n: f64 = groups.iter().map(|g| f64::from(g.n_particles)).sum();
    Some(groups.iter().map(|g| f64::from(g.n_particles) * g.aspects[1]).sum::<f64>() / n)
}

impl Group {
    /// Returns the group with particles from `low` to `high`.
    pub(super) fn between(self, low: DVec3, high: DVec3) -> Group {
        Group { center: 0.5 * (low + high), half_extent: 0.5 * (high - low), ..self }
    }

    /// Returns a bound on σ along every axis.
    pub fn sigma_bounds(&self) -> DVec3 {
        DVec3::new(self.sigma_max, self.sigma_y_max, self.sigma_max)
    }

    /// Returns a bound on σ in every direction.
    pub fn sigma_widest(&self) -> f64 {
        self.sigma_bounds().max_element().max(self.turned_max)
    }

    /// Returns the shapes of the blobs.
    pub fn shapes(&self) -> Shapes {
        match self.n_particles > 0 {
            true if self.turned_max > 0.0 => Shapes::Turned,
            true if self.aspects != [1.0; 3] => Shapes::Upright,
            _ => Shapes::Balls,
        }
    }

    /// Returns the group when its cloud has grown to `scale`. Every place x moves to c + s (x − c),
    /// c the cloud's centre; lengths grow by s, κ is the same. At scale 1 the group is unchanged to
    /// the bit.
    pub fn grown(&self, scale: f64) -> Group {
        if scale == 1.0 {
            return *self;
        }
        Group {
            center: self.cloud_center + scale * (self.center - self.cloud_center),
            scale,
            half_extent: scale * self.half_extent,
            sigma_max: scale * self.sigma_max,
            sigma_y_max: scale * self.sigma_y_max,
            sigma_mean: scale * self.sigma_mean,
            sigma_by_area: scale * self.sigma_by_area,
            turned_max: scale * self.turned_max,
            mass_max: scale.powi(3) * self.mass_max,
            ..*self
        }
    }
}

/// Divides n places into `n_runs` (at most `n`) runs [first, end): [⌊g n/G⌋, ⌊(g+1) n/G⌋).
pub fn runs(n: u64, n_runs: u64) -> impl Iterator<Item = (u64, u64)> {
    // The product fits u64, since both counts fit u32.
    let bound = move |g: u64| g * n / n_runs;
    (0..n_runs).map(move |g| (bound(g), bound(g + 1)))
}

/// Returns a bound on the mass of every blob of `groups`.
pub fn max_blob_mass(groups: &[Group]) -> f64 {
    groups.iter().filter(|g| g.n_particles > 0).map(|g| g.mass_max).fold(0.0, f64::max)
}
