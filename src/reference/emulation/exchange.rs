//! Facets that exchange light, and the geometry between them.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use super::bounded::{Bounded, Decision};
use super::occluder::{Ball, hides_all, meets};
use super::roundings::{MARCH, MIN_DISTANCE, ROUNDINGS, U};
use crate::model::grid::GridSpec;
use crate::model::light::Light;
use crate::model::material::Brdf;
use crate::model::pairings::Pairing;
use crate::model::scene::Pairs;
use crate::reference::grid::sample;
use crate::reference::occlude::Rectangle;
use crate::reference::transmit::crossing;

/// Facets of one material: a surface with its rectangle, or a cloud.
pub struct Region {
    pub rectangle: Option<Rectangle>,
    pub brdf: Brdf,
    /// The lobe's table, where the region has one.
    pub lobe: Option<Vec<f64>>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facet {
    pub position: DVec3,
    pub normal: DVec3,
    pub area: f64,
    pub i_region: usize,
    pub color: DVec3,
}

/// All that a gather needs. `transmittance`: of the lights, [facet × light]; `through`: what clouds
/// alone leave.
pub struct Exchange<'a> {
    pub facets: &'a [Facet],
    pub regions: &'a [Region],
    pub lights: &'a [Light],
    pub transmittance: &'a [f64],
    pub through: &'a [f64],
    pub spec: &'a GridSpec,
    pub cells: &'a [f64],
    /// g, and the march's step in cells; without particles g = 1.
    pub forward: f64,
    pub step: f64,
    pub pairs: Pairs,
    pub eye: DVec3,
    /// Which surfaces send light to which, and which may stand between them: no others hide one
    /// from the other.
    pub pairings: &'a [Vec<Pairing>],
    /// The greatest coordinate, whose rounding positions have.
    pub reach: f64,
}

impl Exchange<'_> {
    fn pairing(&self, i_receiver: usize, i_emitter: usize) -> Option<&Pairing> {
        self.pairings[i_receiver].iter().find(|p| p.i_emitter == i_emitter)
    }

    /// Surfaces of which none is before the other are no pair, and a plane does not see itself.
    pub(super) fn is_pair(&self, a: usize, b: usize) -> bool {
        let is_surface = |i: usize| self.regions[i].rectangle.is_some();
        !(is_surface(a) && is_surface(b)) || (a != b && self.pairing(a, b).is_some())
    }

    /// Rectangles but those of two regions.
    pub(super) fn others(&self, a: usize, b: usize) -> impl Iterator<Item = (usize, &Rectangle)> {
        let all = self.regions.iter().enumerate();
        all.filter(move |(k, _)| *k != a && *k != b)
            .filter_map(|(k, r)| Some((k, r.rectangle.as_ref()?)))
    }

    /// The rectangles that may hide some of region `e` from `receiver`, of a cloud all.
    pub(super) fn before(&self, receiver: &Facet, e: usize) -> Vec<(&Rectangle, Decision)> {
        let (emitter, pairing) = (&self.regions[e].rectangle, self.pairing(receiver.i_region, e));
        let counts = |k: usize, r: &Rectangle| match emitter {
            Some(_) if !pairing.is_some_and(|p| p.occluders.contains(&k)) => Decision::NO,
            Some(e) => meets(r, e, receiver.position, self.slack()),
            None => Decision::YES,
        };
        let all = self.others(receiver.i_region, e).map(|(k, r)| (r, counts(k, r)));
        all.filter(|(_, counts)| counts.is_possible()).collect()
    }

    /// One rectangle alone hides all of region `e`, a surface.
    pub(super) fn is_hidden(&self, receiver: &Facet, e: usize) -> Decision {
        let occluders = self.pairing(receiver.i_region, e).map_or(&[][..], |p| &p.occluders);
        let rectangle = |k: usize| self.regions[k].rectangle.as_ref();
        let all = occluders.iter().filter_map(|k| rectangle(*k).zip(rectangle(e)));
        all.map(|(r, e)| hides_all(r, e, receiver.position, self.slack()))
            .fold(Decision::NO, Decision::or)
    }

    /// What the distance of a place from a plane is known to.
    pub(super) fn slack(&self) -> f64 {
        8.0 * U * self.reach
    }

    /// A place's rounding as an angle, `d` away.
    pub(super) fn turn(&self, d: f64) -> f64 {
        (4.0 * U * (1.0 + self.reach / d.max(MIN_DISTANCE))).min(1.0)
    }

    /// Half axes of facet `i`, none of a cloud's.
    pub(super) fn axes(&self, i: usize) -> Option<(DVec3, DVec3)> {
        Some(self.regions[self.facets[i].i_region].rectangle?.facet)
    }

    /// Radius of the ball about facet `i`.
    pub(super) fn radius(&self, i: usize) -> f64 {
        self.axes(i).map_or((self.facets[i].area * FRAC_1_PI).sqrt(), |(u, v)| (u + v).length())
    }

    /// The ball about facet `i`.
    pub(super) fn ball(&self, i: usize) -> Ball {
        let radius = Bounded { value: self.radius(i), error: 0.0 };
        Ball { at: self.facets[i].position, radius, slack: self.slack() }
    }

    /// e^{−(1−g)τ} between two points, of which `q` is off by `moved`: equal steps over what lies
    /// in the grid's box.
    pub(super) fn through(&self, p: DVec3, q: DVec3, moved: f64) -> Bounded {
        let d = q - p;
        let Some((enter, leave)) = crossing(self.spec, p, d, 1.0).filter(|_| self.forward < 1.0)
        else {
            return Bounded::ONE;
        };
        let length = (leave - enter) * d.length();
        let turn = self.turn(d.length());
        let off = MARCH * turn
            + 2.0
                * moved
                * (1.0 / self.spec.edges().min_element() + 1.0 / d.length().max(MIN_DISTANCE));
        let by = |n: u32| {
            let at =
                |k: u32| p + d * (enter + (leave - enter) * (f64::from(k) + 0.5) / f64::from(n));
            let sum: f64 = (0..n).map(|k| sample(self.spec, self.cells, at(k))).sum();
            let depth = (1.0 - self.forward) * sum * length / f64::from(n);
            Bounded { value: (-depth).exp(), error: (-depth).exp() * depth * off }
        };
        // A length that rounding takes past a whole number of steps has another number of them.
        let step = self.step / self.spec.cells_along(d.normalize_or(DVec3::X));
        let steps = |length: f64| ((length / step).ceil() as u32).clamp(1, self.pairs.steps);
        let (n, slack) = (steps(length), self.slack() + moved + length * ROUNDINGS * U);
        let others =
            [steps(length - slack), steps(length + slack)].into_iter().filter(|other| *other != n);
        others.fold(by(n), |known, other| known.or(by(other)))
    }
}
