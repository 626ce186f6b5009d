//! Clusters of facets that send light as one: passes.md "tree".

use std::f64::consts::FRAC_1_PI;
use std::ops::Range;

use glam::{DMat3, DVec3};

use super::exchange::Exchange;
use super::roundings::{ROUNDINGS, U};
use super::source::Sender;
use nimbus::model::tree::Tree;
use nimbus::reference::bounded::Bounded;

/// The facets below a node as one emitter. Beside each number stands a bound on its error.
#[derive(Debug, Clone)]
pub(super) struct Cluster {
    pub(super) position: DVec3,
    pub(super) moved: f64,
    pub(super) normal: DVec3,
    pub(super) turned: f64,
    pub(super) radius: Bounded,
    pub(super) area: f64,
    pub(super) moments: DMat3,
    pub(super) moments_error: f64,
    /// Sum of the facets' diffuse fluxes, RGB.
    pub(super) flux: DVec3,
    pub(super) flux_error: DVec3,
    /// Σ A g by light.
    pub(super) lights: Vec<Bounded>,
}

/// The trees over the facets of all regions.
pub struct Clusters {
    pub(super) theta: f64,
    pub(super) n_nodes: Vec<u32>,
    pub(super) nodes: Vec<Cluster>,
    /// Facet of every leaf.
    pub(super) facets: Vec<usize>,
    /// Nodes of every region, the root first.
    pub(super) regions: Vec<Range<usize>>,
}

impl Clusters {
    pub(super) fn children(&self, node: usize) -> impl Iterator<Item = usize> {
        children(&self.n_nodes, node)
    }
}

/// Returns the children of a node.
fn children(n_nodes: &[u32], node: usize) -> impl Iterator<Item = usize> {
    let end = node + n_nodes[node] as usize;
    let next = move |from: usize| (from < end).then_some(from);
    std::iter::successors(next(node + 1), move |c| next(c + n_nodes[*c] as usize))
}

/// Returns x xᵀ.
pub(super) fn square(x: DVec3) -> DMat3 {
    DMat3::from_cols(x * x.x, x * x.y, x * x.z)
}

pub(super) fn trace(m: &DMat3) -> f64 {
    m.x_axis.x + m.y_axis.y + m.z_axis.z
}

fn sum_of(channels: DVec3, error: DVec3) -> Bounded {
    Bounded {
        value: channels.element_sum(),
        error: error.element_sum() + 3.0 * U * channels.element_sum(),
    }
}

impl Exchange<'_> {
    /// Builds the trees of clusters over `order`, the facet of each place.
    pub fn clusters(&self, order: &[u32], senders: &[Sender], theta: f64) -> Clusters {
        let mut tree = Tree::default();
        let regions: Vec<_> = (0..self.regions.len())
            .map(|e| {
                let n = self.facets.iter().filter(|f| f.i_region == e).count();
                tree.push(n as u32) as usize..tree.n_nodes.len()
            })
            .collect();
        let mut facets = vec![usize::MAX; tree.n_nodes.len()];
        tree.leaves
            .iter()
            .zip(order)
            .for_each(|(node, facet)| facets[*node as usize] = *facet as usize);
        // Children stand behind their parents.
        let mut nodes: Vec<Option<Cluster>> = vec![None; facets.len()];
        for region in &regions {
            for node in region.clone().rev() {
                let below: Vec<&Cluster> =
                    children(&tree.n_nodes, node).filter_map(|c| nodes[c].as_ref()).collect();
                let i_facet = facets[node];
                let made = if below.is_empty() {
                    self.leaf(i_facet, &senders[i_facet])
                } else {
                    self.merged(&below)
                };
                nodes[node] = Some(made);
            }
        }
        Clusters {
            theta,
            n_nodes: tree.n_nodes,
            nodes: nodes.into_iter().flatten().collect(),
            facets,
            regions,
        }
    }

    /// Returns a facet as a leaf.
    fn leaf(&self, i: usize, sender: &Sender) -> Cluster {
        let (facet, radius) = (&self.facets[i], self.radius(i));
        let kd = facet.area * FRAC_1_PI * self.regions[facet.i_region].brdf.kd * facet.color;
        let lights: Vec<Bounded> =
            sender.lights.iter().map(|l| l.mean.scaled(facet.area)).collect();
        let by = |of: &dyn Fn(&Bounded) -> f64| -> DVec3 {
            self.lights
                .iter()
                .zip(&sender.lights)
                .map(|(light, l)| light.energy() * of(&l.mean))
                .sum()
        };
        let flux = kd * by(&|g| g.value);
        let moments =
            self.axes(i).map_or(DMat3::ZERO, |(u, v)| (square(u) + square(v)) * (1.0 / 3.0));
        Cluster {
            position: facet.position,
            moved: 0.0,
            normal: facet.normal,
            turned: 0.0,
            radius: Bounded { value: radius, error: ROUNDINGS * U * radius },
            area: facet.area,
            moments,
            moments_error: ROUNDINGS * U * trace(&moments),
            flux,
            flux_error: kd * by(&|g| g.error) + flux * (ROUNDINGS * U),
            lights,
        }
    }

    /// Merges nodes of one region.
    fn merged(&self, below: &[&Cluster]) -> Cluster {
        let fluxes: Vec<Bounded> = below.iter().map(|c| sum_of(c.flux, c.flux_error)).collect();
        let shines = fluxes.iter().copied().fold(Bounded::ZERO, Bounded::plus).is_positive();
        let areas = below.iter().map(|c| Bounded { value: c.area, error: ROUNDINGS * U * c.area });
        let weights = if shines.is_true { fluxes } else { areas.collect() };
        let total = weights.iter().copied().fold(Bounded::ZERO, Bounded::plus);
        let inverse = if total.value > 0.0 { 1.0 / total.value } else { 0.0 };
        // Error of a weight as a share of the whole; 1 if rounding may choose the other weights.
        let off = |k: usize| match total.value > total.error && shines.is_sure {
            true => weights[k].error / (total.value - total.error),
            false => 1.0,
        };
        let all = || below.iter().enumerate();
        let most = |of: &dyn Fn(&Cluster) -> f64| below.iter().map(|c| of(c)).fold(0.0, f64::max);
        let mean = |of: &dyn Fn(&Cluster) -> DVec3| match total.value > 0.0 {
            true => all().map(|(k, c)| of(c) * (weights[k].value * inverse)).sum(),
            false => of(below[0]),
        };
        let (position, normal): (DVec3, DVec3) = (mean(&|c| c.position), mean(&|c| c.normal));
        let moved = all().map(|(k, c)| off(k) * c.position.distance(position)).sum::<f64>()
            + most(&|c| c.moved)
            + ROUNDINGS * U * self.reach;
        // All facets of a surface have the plane's normal.
        let is_one = below.iter().all(|c| c.normal == below[0].normal && c.turned == 0.0);
        let spread: f64 = all().map(|(k, c)| off(k) * c.normal.distance(normal)).sum();
        let turned = if is_one { 0.0 } else { spread + most(&|c| c.turned) + ROUNDINGS * U };
        let spread = |c: &Cluster| c.moments + square(c.position - position);
        let of_spread = |c: &Cluster| {
            c.moments_error + 2.0 * (c.position.distance(position) + moved) * (c.moved + moved)
        };
        let moments =
            all().fold(DMat3::ZERO, |sum, (k, c)| sum + spread(c) * (weights[k].value * inverse));
        let reach = |c: &Cluster| c.position.distance(position) + c.radius.value;
        let radius = most(&reach);
        let grown = 1.0 + ROUNDINGS * U;
        Cluster {
            position,
            moved,
            normal: if is_one { below[0].normal } else { normal },
            turned,
            radius: Bounded {
                value: radius,
                error: moved + most(&|c| c.moved + c.radius.error) + 8.0 * U * radius,
            },
            area: below.iter().map(|c| c.area).sum(),
            moments,
            moments_error: all().map(|(k, c)| off(k) * trace(&spread(c))).sum::<f64>()
                + most(&of_spread)
                + ROUNDINGS * U * trace(&moments),
            flux: below.iter().map(|c| c.flux).sum(),
            flux_error: below.iter().map(|c| c.flux_error * grown + c.flux * (4.0 * U)).sum(),
            lights: (0..self.lights.len())
                .map(|l| below.iter().map(|c| c.lights[l]).fold(Bounded::ZERO, Bounded::plus))
                .map(|sum| Bounded { error: sum.error + 4.0 * U * sum.value, ..sum })
                .collect(),
        }
    }
}
