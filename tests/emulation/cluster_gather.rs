//! The gather from clusters: which are opened, and the light that the others send as one.

use super::cluster::{Cluster, Clusters};
use super::cluster_view::ClusterView;
use super::exchange::Exchange;
use super::form::{PairGeometry, lobe};
use super::gathered::Gathered;
use super::occluder::Ball;
use super::roundings::{MIN_DISTANCE, ROUNDINGS, U};
use super::rules::{CLOUD_THETA, CLUSTER_EDGE_WIDTH, EVEN, LOBE_STEP};
use super::source::Sender;
use super::view::View;
use nimbus::reference::bounded::{Bounded, Decision};

impl Exchange<'_> {
    /// Returns I_i and L2 of facet `j` from clusters.
    pub fn gather_from(&self, j: usize, senders: &[Sender], clusters: &Clusters) -> Gathered {
        self.received(j, senders, |view, e| {
            let root = (!clusters.regions[e].is_empty()).then_some(clusters.regions[e].start);
            root.into_iter().map(|node| view.of_node(j, clusters, e, node)).collect()
        })
    }
}

impl View<'_> {
    /// Returns the light that the facets below a node send to receiver `j`.
    fn of_node(&self, j: usize, clusters: &Clusters, i_region: usize, node: usize) -> Gathered {
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
        let crossed = match form
            .is_positive()
            .and(above(sight.rho.scaled(2.0), CLUSTER_EDGE_WIDTH * clusters.theta))
        {
            Decision { is_true: false, is_sure: true } => Decision::NO,
            reached => reached.and(self.is_crossed(i_region, &ball)),
        };
        let open = self.is_wide(&sight, i_region, clusters.theta).or(crossed);
        Gathered::choose(open, below, || self.of_cluster(&sight, i_region, &ball, form))
    }

    fn sight<'a>(&self, cluster: &'a Cluster, i_region: usize) -> ClusterView<'a> {
        let x = self.exchange;
        let o = cluster.position - self.receiver.position;
        let d = o.length();
        let moved = cluster.moved / d.max(MIN_DISTANCE);
        let turn = (x.turn(d) + 2.0 * moved).min(1.0);
        let of_distance = ROUNDINGS * x.turn(d) + moved;
        let rho = cluster.radius.value / d;
        ClusterView {
            cluster,
            is_surface: x.regions[i_region].rectangle.is_some(),
            way: PairGeometry {
                n_j: self.receiver.normal,
                n_i: cluster.normal,
                way: o.normalize_or_zero(),
                d2: d * d,
                turn,
            },
            rho: Bounded { value: rho, error: cluster.radius.error / d + 2.0 * rho * of_distance },
            of_inverse: 3.0 * of_distance,
        }
    }

    /// Returns whether the cluster must be opened: it and the receiver may see each other, and it
    /// is too near, too coarse, or too wide for a lobe.
    fn is_wide(&self, sight: &ClusterView, i_region: usize, theta: f64) -> Decision {
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

    /// Returns the light of a cluster as one emitter.
    fn of_cluster(
        &self,
        sight: &ClusterView,
        i_region: usize,
        ball: &Ball,
        form: Bounded,
    ) -> Gathered {
        if form.is_zero() {
            return Gathered::default();
        }
        let (x, cluster, region) = (self.exchange, sight.cluster, &self.exchange.regions[i_region]);
        let way = sight.unit_way();
        let (mut sent, mut error) = (cluster.flux, cluster.flux_error);
        for (k, (light, g)) in
            x.lights.iter().zip(&cluster.lights).enumerate().filter(|(_, (_, g))| !g.is_zero())
        {
            let glossy =
                region.lobe.as_ref().zip(x.light_angle(k, cluster.position, &way, cluster.moved));
            let glossy =
                glossy.map_or(Bounded::ZERO, |(table, angle)| lobe(table, angle)).times(*g);
            sent += light.energy() * region.brdf.ks * glossy.value;
            error += light.energy() * region.brdf.ks * glossy.error;
        }
        let by = form.times(self.visible_share(i_region, ball));
        let by = by.times(x.through(self.receiver.position, cluster.position, cluster.moved));
        self.arrives(&way, (sent, error), by)
    }
}

/// Returns whether a > b.
fn above(a: Bounded, b: f64) -> Decision {
    Decision::above(a.value, b, a.error)
}
