//! A receiver's view of the facets: visibility, lobes, and the light that arrives.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use super::bounded::{Bounded, Decision};
use super::exchange::{Exchange, Facet};
use super::form::{PairGeometry, half_angle, lobe, width};
use super::gathered::Gathered;
use super::occluder::{Ball, shadow};
use super::roundings::{ROUNDINGS, U};
use super::source::Sender;
use crate::model::pair_rules::{LOBE_REACH, TURN};
use crate::reference::occlude::{Rectangle, Source};

/// A receiver, and by emitting region the rectangles that count before it.
pub(super) struct View<'a> {
    pub exchange: &'a Exchange<'a>,
    pub receiver: &'a Facet,
    pub before: Vec<Vec<(&'a Rectangle, Decision)>>,
    pub senders: &'a [Sender<'a>],
}

impl Exchange<'_> {
    /// What facet `j` gathers where `gathered` says from each region what.
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
        // Their sums pass as many roundings as there are terms: a hundredth of the bound already in
        // `error` at most.
        sum.indirect_error = sum.error[0];
        sum.second_error = albedo * sum.error[0] + ks * sum.error[1];
        sum
    }
}

impl View<'_> {
    /// The way to `q` on facet `i`.
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

    /// Some of what is `side` wide may be before the receiver, and the receiver is before it.
    pub(super) fn faces(&self, way: &PairGeometry, side: f64) -> Decision {
        let d = way.d2.sqrt();
        let slack = ROUNDINGS * way.turn * d;
        let ahead = Decision::above(d * way.n_j.dot(way.way), -side, slack);
        ahead.and(Decision::above(-d * way.n_i.dot(way.way), 0.0, slack))
    }

    /// A lobe is met by what is `b` wide at `q` on facet `i`, and wider than `step` says.
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

    /// A lobe is met by what is `b` wide, and wider than `limit` widths of it: the emitter's by one
    /// of the lights that shine there, each with its angle; the receiver's.
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

    /// Of the receiver's half vector between `way` and the eye.
    pub(super) fn eye_angle(&self, way: &PairGeometry) -> Bounded {
        let to_eye = self.exchange.eye - self.receiver.position;
        let turn = way.turn + self.exchange.turn(to_eye.length());
        half_angle(self.receiver.normal, way.way, to_eye.normalize_or_zero(), turn)
    }

    /// A rim runs through a ball on a region as the receiver sees it.
    pub(super) fn is_crossed(&self, i_region: usize, ball: &Ball) -> Decision {
        let from = Source::At(self.receiver.position);
        let crossed =
            |(r, counts): &(&Rectangle, Decision)| counts.and(shadow(r, from, ball).crossed);
        self.before[i_region].iter().map(crossed).fold(Decision::NO, Decision::or)
    }

    /// Π (1 − h_r) of a ball on a region.
    pub(super) fn visible_share(&self, i_region: usize, ball: &Ball) -> Bounded {
        let from = Source::At(self.receiver.position);
        let seen = |(r, counts): &(&Rectangle, Decision)| {
            shadow(r, from, ball).share.select(*counts, Bounded::ZERO).complement()
        };
        self.before[i_region].iter().map(seen).fold(Bounded::ONE, Bounded::times)
    }

    /// What facet `i` sends from `q` under shares `g` of the lights, times `by`.
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

    /// A radiance and its error times `by`, along the way.
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
