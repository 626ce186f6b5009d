//! Facets that exchange light, and the geometry between them.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use super::occluder::{Ball, hides_all, meets};
use super::roundings::{MARCH, MIN_DISTANCE, ROUNDINGS, U};
use nimbus::model::grid::GridSpec;
use nimbus::model::light::Light;
use nimbus::model::material::Brdf;
use nimbus::model::pairings::Pairing;
use nimbus::model::scene::Pairs;
use nimbus::reference::bounded::{Bounded, Decision};
use nimbus::reference::grid::sample;
use nimbus::reference::occlude::Rectangle;
use nimbus::reference::transmit::crossing;

/// Facets of one material: a surface with its rectangle, or a cloud.
pub struct Region {
    /// Rectangle of a surface; `None` for a cloud.
    pub rectangle: Option<Rectangle>,
    /// Material.
    pub brdf: Brdf,
    /// Table of the material's lobe, if it has one.
    pub lobe: Option<Vec<f64>>,
}

/// A facet of the exchange.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facet {
    /// Centre.
    pub position: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// Area.
    pub area: f64,
    /// Index of its region.
    pub i_region: usize,
    /// Colour, a factor on K_d.
    pub color: DVec3,
}

/// Everything that a gather needs, relative to the lighting origin.
pub struct Exchange<'a> {
    /// All facets.
    pub facets: &'a [Facet],
    /// All regions.
    pub regions: &'a [Region],
    /// All lights.
    pub lights: &'a [Light],
    /// Transmittance toward the lights. *Shape*: [facet][light].
    pub transmittance: &'a [f64],
    /// Transmittance of the clouds alone. *Shape*: [facet][light].
    pub through: &'a [f64],
    /// Place of the density grid.
    pub spec: &'a GridSpec,
    /// Densities of its cells.
    pub cells: &'a [f64],
    /// g; 1 without particles.
    pub forward: f64,
    /// March step, cells.
    pub step: f64,
    /// Accuracy of pairs.
    pub pairs: Pairs,
    /// Position of the eye.
    pub eye: DVec3,
    /// Regions that send light to each region, and the surfaces that may stand between.
    pub pairings: &'a [Vec<Pairing>],
    /// Greatest coordinate, which sets the positions' rounding.
    pub reach: f64,
}

impl Exchange<'_> {
    fn pairing(&self, i_receiver: usize, i_emitter: usize) -> Option<&Pairing> {
        self.pairings[i_receiver].iter().find(|p| p.i_emitter == i_emitter)
    }

    /// Returns whether regions can exchange light: not two surfaces that face away, nor a plane
    /// with itself.
    pub(super) fn is_pair(&self, a: usize, b: usize) -> bool {
        let is_surface = |i: usize| self.regions[i].rectangle.is_some();
        !(is_surface(a) && is_surface(b)) || (a != b && self.pairing(a, b).is_some())
    }

    /// Returns all rectangles except those of two regions.
    pub(super) fn others(&self, a: usize, b: usize) -> impl Iterator<Item = (usize, &Rectangle)> {
        let all = self.regions.iter().enumerate();
        all.filter(move |(k, _)| *k != a && *k != b)
            .filter_map(|(k, r)| Some((k, r.rectangle.as_ref()?)))
    }

    /// Returns the rectangles that may hide part of region `e` from `receiver`; for a cloud all of
    /// them.
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

    /// Returns whether one rectangle alone hides all of region `e`, a surface.
    pub(super) fn is_hidden(&self, receiver: &Facet, e: usize) -> Decision {
        let occluders = self.pairing(receiver.i_region, e).map_or(&[][..], |p| &p.occluders);
        let rectangle = |k: usize| self.regions[k].rectangle.as_ref();
        let all = occluders.iter().filter_map(|k| rectangle(*k).zip(rectangle(e)));
        all.map(|(r, e)| hides_all(r, e, receiver.position, self.slack()))
            .fold(Decision::NO, Decision::or)
    }

    /// Returns the error of a point's distance from a plane.
    pub(super) fn slack(&self) -> f64 {
        8.0 * U * self.reach
    }

    /// Returns a point's rounding as an angle at distance `d`.
    pub(super) fn turn(&self, d: f64) -> f64 {
        (4.0 * U * (1.0 + self.reach / d.max(MIN_DISTANCE))).min(1.0)
    }

    /// Returns the half axes of facet `i`; `None` for a cloud's.
    pub(super) fn axes(&self, i: usize) -> Option<(DVec3, DVec3)> {
        Some(self.regions[self.facets[i].i_region].rectangle?.facet)
    }

    /// Returns the radius of the ball about facet `i`.
    pub(super) fn radius(&self, i: usize) -> f64 {
        self.axes(i).map_or((self.facets[i].area * FRAC_1_PI).sqrt(), |(u, v)| (u + v).length())
    }

    /// Returns the ball about facet `i`.
    pub(super) fn ball(&self, i: usize) -> Ball {
        let radius = Bounded::exact(self.radius(i));
        Ball { at: self.facets[i].position, radius, slack: self.slack() }
    }

    /// Returns e^{−(1−g)τ} between two points by equal steps within the grid's box; `q` errs by
    /// `moved`.
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
        // If rounding takes a length past a whole number of steps, the number of steps changes.
        let step = self.step / self.spec.cells_along(d.normalize_or(DVec3::X));
        let steps = |length: f64| ((length / step).ceil() as u32).clamp(1, self.pairs.steps);
        let (n, slack) = (steps(length), self.slack() + moved + length * ROUNDINGS * U);
        let others =
            [steps(length - slack), steps(length + slack)].into_iter().filter(|other| *other != n);
        others.fold(by(n), |known, other| known.or(by(other)))
    }
}
