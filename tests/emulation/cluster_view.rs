//! A cluster as a receiver sees it: its form factor, and whether it is too coarse.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use libm::erf;

use super::cluster::{Cluster, trace};
use super::form::PairGeometry;
use super::roundings::{MIN_DISTANCE, ROUNDINGS, U};
use super::rules::{CLOUD_THETA, MIXED};
use nimbus::reference::bounded::{Bounded, Decision};

/// Least distance of a surface's cluster from its nearest point, as a share of its distance.
const NEAREST: f64 = 0.01;
/// Error of the positive part in f32, as a share of the deviation: an erf accurate to 2.5e-6, times
/// half of up to six deviations, less farther out.
const OF_POSITIVE_PART: f64 = 3e-6;

/// A cluster as a receiver sees it.
pub(super) struct ClusterView<'a> {
    /// The cluster.
    pub cluster: &'a Cluster,
    /// Whether it belongs to a surface.
    pub is_surface: bool,
    /// Geometry of the pair with the mean normal; its turn includes the error of the cluster's
    /// place.
    pub way: PairGeometry,
    /// ρ: radius over distance.
    pub rho: Bounded,
    /// Relative error of 1/d².
    pub of_inverse: f64,
}

impl ClusterView<'_> {
    /// Returns the geometry with the mean normal normalised.
    pub fn unit_way(&self) -> PairGeometry {
        let length = self.way.n_i.length().max(MIN_DISTANCE);
        PairGeometry {
            n_i: self.way.n_i / length,
            turn: (self.way.turn + 2.0 * self.cluster.turned / length).min(1.0),
            ..self.way
        }
    }

    /// Returns the cosine at the receiver.
    pub fn c_j(&self) -> Bounded {
        Bounded { value: self.way.n_j.dot(self.way.way), error: self.way.turn }
    }

    /// Returns the cosine at the cluster, for its mean normal.
    pub fn c_i(&self) -> Bounded {
        Bounded {
            value: -self.way.n_i.dot(self.way.way),
            error: self.way.turn + self.cluster.turned,
        }
    }

    /// Returns the mean of cos cos/d² over the cluster.
    pub fn form(&self) -> Bounded {
        let (c_i, c_j) = (self.c_i(), self.c_j());
        let both = c_i.is_positive().and(c_j.is_positive());
        let spread = trace(&self.cluster.moments) / self.way.d2;
        let apart = (1.0 - self.way.n_i.length_squared()) / 3.0;
        let [of_i, of_j] = match self.is_surface {
            true => [c_i, c_j].map(|c| Bounded { value: c.value.max(0.0), ..c }),
            false => {
                let off = 2.0 * self.cluster.turned / 3.0 + ROUNDINGS * U;
                let moments = self.cluster.moments_error / self.way.d2 + spread * self.of_inverse;
                [
                    positive(c_i, Bounded { value: apart, error: off }),
                    positive(c_j, Bounded { value: spread / 3.0, error: moments }),
                ]
            }
        };
        let sum = if self.is_surface {
            of_i.times(of_j).plus(self.bend()).select(both, Bounded::ZERO)
        } else {
            of_i.times(of_j).plus(self.bend().select(both, Bounded::ZERO))
        };
        let value = sum.value.max(0.0);
        let error = if sum.value + sum.error > 0.0 {
            sum.error + value * (self.of_inverse + ROUNDINGS * U)
        } else {
            0.0
        };
        Bounded { value, error }.scaled(1.0 / self.way.d2)
    }

    /// Returns half the second derivatives times the moments N.
    ///
    /// Its terms are products of the cosines and of N with unit vectors, each at most tr N. They
    /// change by at most 14 (c_i) + 14 (c_j) + 24 + 20 turns of the way, by 14 + 4 + 5 of the
    /// normal's, and by 12 + 2 + 8 + 1 of N's error.
    fn bend(&self) -> Bounded {
        let ClusterView { cluster, way, .. } = self;
        let (c_i, c_j) = (self.c_i().value, self.c_j().value);
        let n = cluster.moments * (1.0 / way.d2);
        let along = n * way.way;
        let value = c_i * c_j * (12.0 * way.way.dot(along) - 2.0 * trace(&n))
            - 4.0 * (c_i * way.n_j.dot(along) - c_j * way.n_i.dot(along))
            - way.n_j.dot(n * way.n_i);
        let of_moments = cluster.moments_error / way.d2 + trace(&n) * self.of_inverse;
        let error = trace(&n) * (72.0 * way.turn + 23.0 * cluster.turned) + 23.0 * of_moments;
        Bounded { value, error }
    }

    /// Returns whether the extent may change the form factor by more than θ allows.
    pub fn is_coarse(&self, theta: f64) -> Decision {
        let (c_i, c_j, cluster) = (self.c_i(), self.c_j(), self.cluster);
        let length = Bounded { value: self.way.n_i.length(), error: cluster.turned + 8.0 * U };
        // `s` is the number of errors added to each quantity.
        let wrong = |s: f64| {
            let rho = (self.rho.value + s * self.rho.error).max(0.0);
            let length = (length.value - s * length.error).clamp(0.0, 1.0);
            let h = if self.is_surface {
                (rho / (1.0 - rho).max(NEAREST)).powi(3)
            } else {
                rho * (rho + MIXED * (1.0 - length * length).sqrt())
            };
            let at_receiver = (c_j.value + s * c_j.error + rho).clamp(0.0, 1.0);
            let at_cluster = (c_i.value + s * c_i.error).max(0.0) + 1.0 - length;
            h * at_receiver * at_cluster * cluster.area / self.way.d2
                * (1.0 + s * (self.of_inverse + ROUNDINGS * U))
        };
        let theta = if self.is_surface { theta } else { CLOUD_THETA * theta };
        let known = Bounded::between(wrong(-1.0), wrong(0.0), wrong(1.0));
        Decision::above(known.value, theta.powi(4), known.error)
    }
}

fn positive(mean: Bounded, variance: Bounded) -> Bounded {
    let at = |s: f64| {
        positive_part(mean.value + s * mean.error, (variance.value + s * variance.error).max(0.0))
    };
    let known = Bounded::between(at(-1.0), at(0.0), at(1.0));
    // A deviation below 1e-6 is not told from that.
    let of_evaluation = OF_POSITIVE_PART * (variance.value + variance.error).max(0.0).sqrt() + 1e-6;
    Bounded { error: known.error + of_evaluation, ..known }
}

/// Returns P(m, s²), the mean of the positive part of a normal distribution.
pub fn positive_part(mean: f64, variance: f64) -> f64 {
    let s = variance.max(0.0).sqrt();
    if s == 0.0 {
        return mean.max(0.0);
    }
    let z = mean / s;
    let below = 0.5 + 0.5 * erf(z * FRAC_1_SQRT_2);
    s * (-0.5 * z * z).exp() / (2.0 * PI).sqrt() + mean * below
}
