//! Clusters as a receiver sees them, and which it opens: model.md §11 "tree".

use std::f64::consts::FRAC_1_SQRT_2;

use libm::erf;

use super::*;
use crate::reference::second::rims::Ball;
use crate::reference::second::shapes::{Way, lobe};

/// The opening angle of a cloud's clusters by that of surfaces'.
const CLOUD_THETA: f64 = 0.4;
/// Torn clusters are opened down to this share of θ.
const TORN: f64 = 0.5;
/// Of ρ times the normals' spread, what a cloud's cluster may be wrong by.
const MIXED: f64 = 0.5;
/// Longer mean normals are of one normal.
const EVEN: f64 = 0.9999;
/// No nearer counts a surface's cluster its nearest point.
const NEAREST: f64 = 0.01;
/// Of the deviation, what an f32 evaluation of the positive part may err: an erf that is known to
/// 2.5e-6, times half of up to six deviations, less the farther out.
const OF_POSITIVE_PART: f64 = 3e-6;

/// A cluster as a receiver sees it.
struct Sight<'a> {
    cluster: &'a Cluster,
    is_surface: bool,
    /// With its mean normal, and the turn that the cluster's own place leaves it.
    way: Way,
    /// ρ.
    rho: Known,
    /// Of 1/d², what it is known to.
    of_inverse: f64,
}

impl Sight<'_> {
    /// With the mean normal made a unit vector.
    fn unit_way(&self) -> Way {
        let length = self.way.n_i.length().max(LEAST_DISTANCE);
        Way {
            n_i: self.way.n_i / length,
            turn: (self.way.turn + 2.0 * self.cluster.turned / length).min(1.0),
            ..self.way
        }
    }

    fn c_j(&self) -> Known {
        Known { value: self.way.n_j.dot(self.way.way), error: self.way.turn }
    }

    fn c_i(&self) -> Known {
        Known { value: -self.way.n_i.dot(self.way.way), error: self.way.turn + self.cluster.turned }
    }

    /// The mean of cos cos/d² over the cluster.
    fn form(&self) -> Known {
        let (c_i, c_j) = (self.c_i(), self.c_j());
        let both = c_i.is_positive().and(c_j.is_positive());
        let spread = trace(&self.cluster.moments) / self.way.d2;
        let apart = (1.0 - self.way.n_i.length_squared()) / 3.0;
        let [of_i, of_j] = match self.is_surface {
            true => [c_i, c_j].map(|c| Known { value: c.value.max(0.0), ..c }),
            false => {
                let off = 2.0 * self.cluster.turned / 3.0 + ROUNDINGS * U;
                let moments = self.cluster.moments_error / self.way.d2 + spread * self.of_inverse;
                [
                    positive(c_i, Known { value: apart, error: off }),
                    positive(c_j, Known { value: spread / 3.0, error: moments }),
                ]
            }
        };
        let sum = if self.is_surface {
            of_i.times(of_j).plus(self.bend()).where_or(both, Known::NOTHING)
        } else {
            of_i.times(of_j).plus(self.bend().where_or(both, Known::NOTHING))
        };
        let value = sum.value.max(0.0);
        let error = if sum.value + sum.error > 0.0 {
            sum.error + value * (self.of_inverse + ROUNDINGS * U)
        } else {
            0.0
        };
        Known { value, error }.scaled(1.0 / self.way.d2)
    }

    /// Half the second derivatives times the moments. Its terms are products of the cosines and of
    /// N with unit vectors, each at most tr N: they change by 14 (c_i) + 14 (c_j) + 24 + 20 turns
    /// of the way at most, by 14 + 4 + 5 of the normal's, and by 12 + 2 + 8 + 1 of N's error.
    fn bend(&self) -> Known {
        let Sight { cluster, way, .. } = self;
        let (c_i, c_j) = (self.c_i().value, self.c_j().value);
        let n = cluster.moments * (1.0 / way.d2);
        let along = n * way.way;
        let value = c_i * c_j * (12.0 * way.way.dot(along) - 2.0 * trace(&n))
            - 4.0 * (c_i * way.n_j.dot(along) - c_j * way.n_i.dot(along))
            - way.n_j.dot(n * way.n_i);
        let of_moments = cluster.moments_error / way.d2 + trace(&n) * self.of_inverse;
        let error = trace(&n) * (72.0 * way.turn + 23.0 * cluster.turned) + 23.0 * of_moments;
        Known { value, error }
    }

    /// What the extent may change of the form factor, more than θ allows.
    fn is_coarse(&self, theta: f64) -> Decision {
        let (c_i, c_j, cluster) = (self.c_i(), self.c_j(), self.cluster);
        let length = Known { value: self.way.n_i.length(), error: cluster.turned + 8.0 * U };
        // `s` errors more of each.
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
        let known = Known::between(wrong(-1.0), wrong(0.0), wrong(1.0));
        Decision::above(known.value, theta.powi(4), known.error)
    }
}

fn positive(mean: Known, variance: Known) -> Known {
    let at = |s: f64| {
        positive_part(mean.value + s * mean.error, (variance.value + s * variance.error).max(0.0))
    };
    let known = Known::between(at(-1.0), at(0.0), at(1.0));
    // Nor is a deviation less than 1e-6 told from that.
    let of_evaluation = OF_POSITIVE_PART * (variance.value + variance.error).max(0.0).sqrt() + 1e-6;
    Known { error: known.error + of_evaluation, ..known }
}

impl View<'_> {
    /// What the facets below a node send to receiver `j`.
    pub fn of_node(&self, j: usize, clusters: &Clusters, i_region: usize, node: usize) -> Gathered {
        if clusters.n_nodes[node] == 1 {
            let i = clusters.facets[node];
            return if i == j { Gathered::default() } else { self.of_facet(i) };
        }
        let sight = self.sight(&clusters.nodes[node], i_region);
        let below =
            || clusters.children(node).map(|c| self.of_node(j, clusters, i_region, c)).collect();
        let cluster = sight.cluster;
        let ball = Ball {
            at: cluster.position,
            radius: cluster.radius,
            slack: self.exchange.slack() + cluster.moved,
        };
        let form = sight.form();
        let torn = match form.is_positive().and(above(sight.rho.scaled(2.0), TORN * clusters.theta))
        {
            Decision { taken: false, sure: true } => Decision::NO,
            reached => reached.and(self.is_torn(i_region, &ball)),
        };
        let open = self.is_wide(&sight, i_region, clusters.theta).or(torn);
        Gathered::by(open, below, || self.of_cluster(&sight, i_region, &ball, form))
    }

    fn sight<'a>(&self, cluster: &'a Cluster, i_region: usize) -> Sight<'a> {
        let x = self.exchange;
        let o = cluster.position - self.receiver.position;
        let d = o.length();
        let moved = cluster.moved / d.max(LEAST_DISTANCE);
        let turn = (x.turn(d) + 2.0 * moved).min(1.0);
        let of_distance = ROUNDINGS * x.turn(d) + moved;
        let rho = cluster.radius.value / d;
        Sight {
            cluster,
            is_surface: x.regions[i_region].rectangle.is_some(),
            way: Way {
                n_j: self.receiver.normal,
                n_i: cluster.normal,
                way: o.normalize_or_zero(),
                d2: d * d,
                turn,
            },
            rho: Known { value: rho, error: cluster.radius.error / d + 2.0 * rho * of_distance },
            of_inverse: 3.0 * of_distance,
        }
    }

    /// Some of it may be before the receiver and the receiver before it, and it is too near, too
    /// coarse, or too wide for a lobe.
    fn is_wide(&self, sight: &Sight, i_region: usize, theta: f64) -> Decision {
        let (x, cluster) = (self.exchange, sight.cluster);
        let length = sight.way.n_i.length();
        let mixed = Decision::above(EVEN, length, cluster.turned + 8.0 * U);
        let c_j = sight.c_j();
        let before =
            Decision::above(c_j.value, -2.0 * sight.rho.value, c_j.error + 2.0 * sight.rho.error);
        let sends = before.and(above(sight.c_i(), 0.0).or(mixed));
        let near = above(sight.rho, 1.0);
        if !sends.is_possible() || (near == Decision::YES) {
            return sends.and(near);
        }
        let theta_of = if sight.is_surface { theta } else { CLOUD_THETA * theta };
        let way = sight.unit_way();
        let angles = (0..x.lights.len()).filter_map(|k| {
            let shines = cluster.lights[k].is_positive();
            Some((shines, x.light_angle(k, cluster.position, &way, cluster.moved)?))
                .filter(|_| shines.is_possible())
        });
        let lobes =
            self.meets_lobe(i_region, angles, &way, sight.rho.scaled(2.0), LOBE_STEP * theta_of);
        sends.and(near.or(sight.is_coarse(theta)).or(lobes))
    }

    /// A cluster as one.
    fn of_cluster(&self, sight: &Sight, i_region: usize, ball: &Ball, form: Known) -> Gathered {
        if form.is_nothing() {
            return Gathered::default();
        }
        let (x, cluster, region) = (self.exchange, sight.cluster, &self.exchange.regions[i_region]);
        let way = sight.unit_way();
        let (mut sent, mut error) = (cluster.flux, cluster.flux_error);
        for (k, (light, g)) in
            x.lights.iter().zip(&cluster.lights).enumerate().filter(|(_, (_, g))| !g.is_nothing())
        {
            let glossy =
                region.lobe.as_ref().zip(x.light_angle(k, cluster.position, &way, cluster.moved));
            let glossy =
                glossy.map_or(Known::NOTHING, |(table, angle)| lobe(table, angle)).times(*g);
            sent += light.energy() * region.brdf.ks * glossy.value;
            error += light.energy() * region.brdf.ks * glossy.error;
        }
        let by = form.times(self.seen_of_ball(i_region, ball));
        let by = by.times(x.through(self.receiver.position, cluster.position, cluster.moved));
        self.arrives(&way, (sent, error), by)
    }
}

/// a > b.
fn above(a: Known, b: f64) -> Decision {
    Decision::above(a.value, b, a.error)
}

/// P(m, s²): the mean of the positive part of a normal distribution.
pub fn positive_part(mean: f64, variance: f64) -> f64 {
    let s = variance.max(0.0).sqrt();
    if s == 0.0 {
        return mean.max(0.0);
    }
    let z = mean / s;
    let below = 0.5 + 0.5 * erf(z * FRAC_1_SQRT_2);
    s * (-0.5 * z * z).exp() / (2.0 * PI).sqrt() + mean * below
}
