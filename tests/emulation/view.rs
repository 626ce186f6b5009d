//! A receiver's view of the facets: visibility, lobes, and the light that arrives.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use super::exchange::{Exchange, Facet};
use super::form::{PairGeometry, half_angle, lobe, width};
use super::gathered::Gathered;
use super::occluder::{Ball, shadow};
use super::roundings::{ROUNDINGS, U};
use super::rules::{LOBE_REACH, TURN};
use super::source::Sender;
use nimbus::reference::bounded::{Bounded, Decision};
use nimbus::reference::occlude::{Rectangle, Source};

/// A receiver's view.
pub(super) struct View<'a> {
    /// The exchange.
    pub exchange: &'a Exchange<'a>,
    /// The receiver.
    pub receiver: &'a Facet,
    /// Rectangles that may hide part of every emitting region.
    pub before: Vec<Vec<(&'a Rectangle, Decision)>>,
    /// Light on every facet.
    pub senders: &'a [Sender<'a>],
}

impl Exchange<'_> {
    /// Returns the light on facet `j` from all regions, with `gathered` for each of them.
    pub(super) fn received<'a>(
        &'a self,
        j: usize,
        senders: &'a [Sender<'a>],
        gathered: impl Fn(&View<'a>, usize) -> Gathered,
    ) -> Gathered {
        let receiver = &self.facets[j];
        let before = (0..self.regions.len()).map(|e| self.before(receiver, e)).collect();
        let view = View { exchange: self, receiver, before, senders };
        let from = |e: &usize| self.is_pair(receiver.i_region, *e);
        let of = |e: usize| {
            Gathered::choose(self.is_hidden(receiver, e), Gathered::default, || gathered(&view, e))
        };
        let mut sum: Gathered = (0..self.regions.len()).filter(from).map(of).collect();
        let region = &self.regions[receiver.i_region];
        let albedo = region.brdf.kd * receiver.color * FRAC_1_PI;
        let front = (self.eye - receiver.position).dot(receiver.normal) > 0.0;
        let ks = if front { region.brdf.ks } else { DVec3::ZERO };
        sum.second = albedo * sum.indirect + ks * sum.glossy;
        // The sums are rounded as often as they have terms, which adds at most a hundredth of the
        // bound in `error`.
        sum.indirect_error = sum.error[0];
        sum.second_error = albedo * sum.error[0] + ks * sum.error[1];
        sum
    }
}

impl View<'_> {
    /// Returns the geometry of the pair with `q` on facet `i`.
    pub(super) fn way(&self, i: usize, q: DVec3) -> PairGeometry {
        let o = q - self.receiver.position;
        let n_i = self.exchange.facets[i].normal;
        let turn = self.exchange.turn(o.length());
        PairGeometry {
            n_j: self.receiver.normal,
            n_i,
            way: o.normalize_or_zero(),
            d2: o.length_squared(),
            turn,
        }
    }

    /// Returns whether part of an emitter `side` wide may be in front of the receiver, and the
    /// receiver in front of the emitter.
    pub(super) fn faces(&self, way: &PairGeometry, side: f64) -> Decision {
        let d = way.d2.sqrt();
        let slack = ROUNDINGS * way.turn * d;
        let ahead = Decision::above(d * way.n_j.dot(way.way), -side, slack);
        ahead.and(Decision::above(-d * way.n_i.dot(way.way), 0.0, slack))
    }

    /// Returns whether an emitter `b` wide at `q` on facet `i` meets a lobe and is wider than
    /// `step` allows.
    pub(super) fn facet_meets_lobe(
        &self,
        i: usize,
        way: &PairGeometry,
        q: DVec3,
        b: Bounded,
        step: f64,
    ) -> Decision {
        let (x, lit) = (self.exchange, &self.senders[i].lights);
        let angles = (0..x.lights.len()).filter(|k| lit[*k].mean.value > 0.0);
        let angles = angles.filter_map(|k| Some((Decision::YES, x.light_angle(k, q, way, 0.0)?)));
        self.meets_lobe(x.facets[i].i_region, angles, way, b, step * x.pairs.size)
    }

    /// Returns whether an emitter `b` wide meets a lobe and is wider than `limit` widths of it: the
    /// emitter's own lobe for a light with its angle, or the receiver's.
    pub(super) fn meets_lobe(
        &self,
        i_region: usize,
        mut lights: impl Iterator<Item = (Decision, Bounded)>,
        way: &PairGeometry,
        b: Bounded,
        limit: f64,
    ) -> Decision {
        let met = |ns: f64, angle: Bounded| {
            let slack = angle.error + b.error;
            let near = Decision::above(TURN * b.value + LOBE_REACH * width(ns), angle.value, slack);
            near.and(Decision::above(b.value, limit * width(ns), b.error))
        };
        let source = &self.exchange.regions[i_region];
        let receiver = &self.exchange.regions[self.receiver.i_region];
        let mut found = Decision::NO;
        if source.lobe.is_some() {
            found = lights
                .by_ref()
                .map(|(shines, angle)| shines.and(met(source.brdf.ns, angle)))
                .fold(found, Decision::or);
        }
        if receiver.lobe.is_some() {
            found = found.or(met(receiver.brdf.ns, self.eye_angle(way)));
        }
        found
    }

    /// Returns the angle of the receiver's half vector between `way` and the eye.
    fn eye_angle(&self, way: &PairGeometry) -> Bounded {
        let to_eye = self.exchange.eye - self.receiver.position;
        let turn = way.turn + self.exchange.turn(to_eye.length());
        half_angle(self.receiver.normal, way.way, to_eye.normalize_or_zero(), turn)
    }

    /// Returns whether a shadow edge crosses a ball on a region, seen from the receiver.
    pub(super) fn is_crossed(&self, i_region: usize, ball: &Ball) -> Decision {
        let from = Source::At(self.receiver.position);
        let crossed =
            |(r, counts): &(&Rectangle, Decision)| counts.and(shadow(r, from, ball).crossed);
        self.before[i_region].iter().map(crossed).fold(Decision::NO, Decision::or)
    }

    /// Returns Π (1 − h_r), the visible share of a ball on a region.
    pub(super) fn visible_share(&self, i_region: usize, ball: &Ball) -> Bounded {
        let from = Source::At(self.receiver.position);
        let seen = |(r, counts): &(&Rectangle, Decision)| {
            shadow(r, from, ball).share.select(*counts, Bounded::ZERO).complement()
        };
        self.before[i_region].iter().map(seen).fold(Bounded::ONE, Bounded::times)
    }

    /// Returns the light from `q` on facet `i` under shares `g` of the lights, times `by`.
    pub(super) fn sent(
        &self,
        i: usize,
        way: &PairGeometry,
        q: DVec3,
        g: &[Bounded],
        by: Bounded,
    ) -> Gathered {
        self.arrives(way, self.exchange.radiance(i, way, q, g), by)
    }

    /// Returns the light of a radiance with its error, times `by`, along the way.
    pub(super) fn arrives(
        &self,
        way: &PairGeometry,
        (radiance, radiance_error): (DVec3, DVec3),
        by: Bounded,
    ) -> Gathered {
        let e = radiance * by.value;
        let error = radiance.abs() * by.error
            + radiance_error * (by.value + by.error)
            + e.abs() * (ROUNDINGS * U);
        let taken = match &self.exchange.regions[self.receiver.i_region].lobe {
            Some(table) => lobe(table, self.eye_angle(way)),
            None => Bounded::ZERO,
        };
        Gathered {
            indirect: e,
            glossy: e * taken.value,
            error: [error, error * taken.value.abs() + (e.abs() + error) * taken.error],
            ..Gathered::default()
        }
    }
}
