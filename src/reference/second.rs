//! The second reflection, C (16), from every pair of facets: model.md §7 and §11 "second". In:
//! facets, regions, lights and their transmittances, the density grid, all relative to O. Out, a
//! receiver: I_i (W m⁻²) and L2 (W m⁻² sr⁻¹) toward the eye, RGB, and what an f32 evaluation of the
//! same may differ.

mod closely;
mod doubt;
mod gathered;
mod rims;
mod shapes;
mod source;
mod stencil;
#[cfg(test)]
mod tests;
pub mod tree;

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec2, DVec3};

use closely::Cell;
use doubt::{Decision, Known};
pub use gathered::Gathered;
use rims::{Ball, hides_all, meets, shadow};
use shapes::{Way, half_angle, lobe, width};
use source::Sender;

use super::area::visibility::{Source, source_of};
use super::grid::sample;
use super::occlude::Rectangle;
use super::transmit::crossing;
use crate::model::grid::GridSpec;
use crate::model::light::Light;
use crate::model::material::Brdf;
use crate::model::pairings::Pairing;
use crate::model::scene::Pairs;

/// Lobes are met within this many of their widths.
const LOBE_REACH: f64 = 4.0;
/// Widths of a lobe, times pair_size, that a facet may be wide; and a cell, which meets lobes in
/// its quarters.
const LOBE_STEP: f64 = 3.0;
const CELL_STEP: f64 = 4.5;
/// Of a width over its distance, what the half vector turns from centre to corner.
const TURN: f64 = 0.75;
/// Facets that a shadow's rim runs through are looked at closely where wider than this share of
/// pair_size; where both the receiver's view and a light's is torn, than this.
const RIM: f64 = 0.25;
const BOTH_RIMS: f64 = 0.125;
/// Wider facets are discs.
const NEAR: f64 = 1.0;
/// f32's unit round-off.
const U: f64 = 1.0 / 16_777_216.0;
/// Roundings of a product of some ten factors, each a sum of a few.
const ROUNDINGS: f64 = 16.0;
/// Nearer a place's rounding turns the way anywhere.
const LEAST_DISTANCE: f64 = 1e-12;

/// Of an optical depth: samples of a density that may double within a cell, at places off by their
/// rounding in cells, and deposited in f32's rounding by some hundreds of blobs.
const MARCH: f64 = 256.0;

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

/// A receiver, and by emitting region the rectangles that count before it.
struct View<'a> {
    exchange: &'a Exchange<'a>,
    receiver: &'a Facet,
    before: Vec<Vec<(&'a Rectangle, Decision)>>,
    senders: &'a [Sender<'a>],
}

impl Exchange<'_> {
    /// I_i and L2 of facet `j` from `senders`.
    pub fn gather(&self, j: usize, senders: &[Sender]) -> Gathered {
        let of_region = |e: usize| {
            (0..self.facets.len()).filter(move |&i| i != j && self.facets[i].i_region == e)
        };
        self.received(j, senders, |view, e| of_region(e).map(|i| view.of_facet(i)).collect())
    }

    /// What facet `j` gathers where `gathered` says from each region what.
    fn received<'a>(
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
            Gathered::by(self.is_hidden(receiver, e), Gathered::default, || gathered(&view, e))
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

    fn pairing(&self, i_receiver: usize, i_emitter: usize) -> Option<&Pairing> {
        self.pairings[i_receiver].iter().find(|p| p.i_emitter == i_emitter)
    }

    /// Surfaces of which none is before the other are no pair, and a plane does not see itself.
    fn is_pair(&self, a: usize, b: usize) -> bool {
        let is_surface = |i: usize| self.regions[i].rectangle.is_some();
        !(is_surface(a) && is_surface(b)) || (a != b && self.pairing(a, b).is_some())
    }

    /// Rectangles but those of two regions.
    fn others(&self, a: usize, b: usize) -> impl Iterator<Item = (usize, &Rectangle)> {
        let all = self.regions.iter().enumerate();
        all.filter(move |(k, _)| *k != a && *k != b)
            .filter_map(|(k, r)| Some((k, r.rectangle.as_ref()?)))
    }

    /// The rectangles that may hide some of region `e` from `receiver`, of a cloud all.
    fn before(&self, receiver: &Facet, e: usize) -> Vec<(&Rectangle, Decision)> {
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
    fn is_hidden(&self, receiver: &Facet, e: usize) -> Decision {
        let occluders = self.pairing(receiver.i_region, e).map_or(&[][..], |p| &p.occluders);
        let rectangle = |k: usize| self.regions[k].rectangle.as_ref();
        let all = occluders.iter().filter_map(|k| rectangle(*k).zip(rectangle(e)));
        all.map(|(r, e)| hides_all(r, e, receiver.position, self.slack()))
            .fold(Decision::NO, Decision::or)
    }

    /// What the distance of a place from a plane is known to.
    fn slack(&self) -> f64 {
        8.0 * U * self.reach
    }

    /// A place's rounding as an angle, `d` away.
    fn turn(&self, d: f64) -> f64 {
        (4.0 * U * (1.0 + self.reach / d.max(LEAST_DISTANCE))).min(1.0)
    }

    /// Half axes of facet `i`, none of a cloud's.
    fn axes(&self, i: usize) -> Option<(DVec3, DVec3)> {
        Some(self.regions[self.facets[i].i_region].rectangle?.facet)
    }

    /// Radius of the ball about facet `i`.
    fn radius(&self, i: usize) -> f64 {
        self.axes(i).map_or((self.facets[i].area * FRAC_1_PI).sqrt(), |(u, v)| (u + v).length())
    }

    /// The ball about facet `i`.
    fn ball(&self, i: usize) -> Ball {
        let radius = Known { value: self.radius(i), error: 0.0 };
        Ball { at: self.facets[i].position, radius, slack: self.slack() }
    }

    /// e^{−(1−g)τ} between two points, of which `q` is off by `moved`: equal steps over what lies
    /// in the grid's box.
    fn through(&self, p: DVec3, q: DVec3, moved: f64) -> Known {
        let d = q - p;
        let Some((enter, leave)) = crossing(self.spec, p, d, 1.0).filter(|_| self.forward < 1.0)
        else {
            return Known::ONE;
        };
        let length = (leave - enter) * d.length();
        let turn = self.turn(d.length());
        let off = MARCH * turn
            + 2.0
                * moved
                * (1.0 / self.spec.edges().min_element() + 1.0 / d.length().max(LEAST_DISTANCE));
        let by = |n: u32| {
            let at =
                |k: u32| p + d * (enter + (leave - enter) * (f64::from(k) + 0.5) / f64::from(n));
            let sum: f64 = (0..n).map(|k| sample(self.spec, self.cells, at(k))).sum();
            let depth = (1.0 - self.forward) * sum * length / f64::from(n);
            Known { value: (-depth).exp(), error: (-depth).exp() * depth * off }
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

impl View<'_> {
    /// The way to `q` on facet `i`.
    fn way(&self, i: usize, q: DVec3) -> Way {
        let o = q - self.receiver.position;
        let n_i = self.exchange.facets[i].normal;
        let turn = self.exchange.turn(o.length());
        Way {
            n_j: self.receiver.normal,
            n_i,
            way: o.normalize_or_zero(),
            d2: o.length_squared(),
            turn,
        }
    }

    /// What facet `i` sends, as a whole or by its cells.
    fn of_facet(&self, i: usize) -> Gathered {
        let (x, q) = (self.exchange, self.exchange.facets[i].position);
        let way = self.way(i, q);
        let Some((u, v)) = x.axes(i) else {
            return self.whole(i, &way, way.disc_form(x.facets[i].area));
        };
        let side = 2.0 * u.length().max(v.length());
        let b = side / way.d2.sqrt();
        let b = Known { value: b, error: b * ROUNDINGS * way.turn };
        let form = way.part_form(u, v);
        let above = |share: f64| Decision::above(b.value, share * x.pairs.size, b.error);
        let wide = self
            .faces(&way, side)
            .and(above(1.0).or(self.facet_meets_lobe(i, &way, q, b, LOBE_STEP)));
        let sends = |rim: f64| form.is_positive().and(above(rim));
        let (sender, ball, i_region) = (&self.senders[i], x.ball(i), x.facets[i].i_region);
        let torn = if sends(BOTH_RIMS).is_possible() {
            self.is_torn(i_region, &ball)
        } else {
            Decision::NO
        };
        // What of a light is torn matters where something of the facet is seen.
        let light = if sender.torn.is_possible() && sends(RIM).is_possible() {
            sender.torn.and(self.seen_of_ball(i_region, &ball).is_positive())
        } else {
            Decision::NO
        };
        let by_rims =
            sends(RIM).and(torn.or(light)).or(sends(BOTH_RIMS).and(torn.and(sender.torn)));
        let cell = Cell { level: 0, at: DVec2::ZERO };
        Gathered::by(wide.or(by_rims), || self.cell(i, &cell, sender), || self.whole(i, &way, form))
    }

    /// Some of what is `side` wide may be before the receiver, and the receiver is before it.
    fn faces(&self, way: &Way, side: f64) -> Decision {
        let d = way.d2.sqrt();
        let slack = ROUNDINGS * way.turn * d;
        let ahead = Decision::above(d * way.n_j.dot(way.way), -side, slack);
        ahead.and(Decision::above(-d * way.n_i.dot(way.way), 0.0, slack))
    }

    /// A lobe is met by what is `b` wide at `q` on facet `i`, and wider than `step` says.
    fn facet_meets_lobe(&self, i: usize, way: &Way, q: DVec3, b: Known, step: f64) -> Decision {
        let (x, lit) = (self.exchange, &self.senders[i].lights);
        let angles = (0..x.lights.len()).filter(|k| lit[*k].mean.value > 0.0);
        let angles = angles.filter_map(|k| Some((Decision::YES, x.light_angle(k, q, way, 0.0)?)));
        self.meets_lobe(x.facets[i].i_region, angles, way, b, step * x.pairs.size)
    }

    /// A lobe is met by what is `b` wide, and wider than `limit` widths of it: the emitter's by one
    /// of the lights that shine there, each with its angle; the receiver's.
    fn meets_lobe(
        &self,
        i_region: usize,
        mut lights: impl Iterator<Item = (Decision, Known)>,
        way: &Way,
        b: Known,
        limit: f64,
    ) -> Decision {
        let met = |ns: f64, angle: Known| {
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
    fn eye_angle(&self, way: &Way) -> Known {
        let to_eye = self.exchange.eye - self.receiver.position;
        let turn = way.turn + self.exchange.turn(to_eye.length());
        half_angle(self.receiver.normal, way.way, to_eye.normalize_or_zero(), turn)
    }

    /// A rim runs through a ball on a region as the receiver sees it.
    fn is_torn(&self, i_region: usize, ball: &Ball) -> Decision {
        let from = Source::At(self.receiver.position);
        let torn = |(r, counts): &(&Rectangle, Decision)| counts.and(shadow(r, from, ball).torn);
        self.before[i_region].iter().map(torn).fold(Decision::NO, Decision::or)
    }

    /// Π (1 − h_r) of a ball on a region.
    fn seen_of_ball(&self, i_region: usize, ball: &Ball) -> Known {
        let from = Source::At(self.receiver.position);
        let seen = |(r, counts): &(&Rectangle, Decision)| {
            shadow(r, from, ball).share.where_or(*counts, Known::NOTHING).rest()
        };
        self.before[i_region].iter().map(seen).fold(Known::ONE, Known::times)
    }

    /// Facet `i` as one.
    fn whole(&self, i: usize, way: &Way, form: Known) -> Gathered {
        let x = self.exchange;
        if form.is_nothing() {
            return Gathered::default();
        }
        let (q, p) = (x.facets[i].position, self.receiver.position);
        let seen = self.seen_of_ball(x.facets[i].i_region, &x.ball(i));
        let g: Vec<Known> = self.senders[i].lights.iter().map(|l| l.mean).collect();
        self.sent(
            i,
            way,
            q,
            &g,
            form.times(seen).times(x.through(p, q, 0.0)).scaled(x.facets[i].area),
        )
    }

    /// What facet `i` sends from `q` under shares `g` of the lights, times `by`.
    fn sent(&self, i: usize, way: &Way, q: DVec3, g: &[Known], by: Known) -> Gathered {
        self.arrives(way, self.exchange.radiance(i, way, q, g), by)
    }

    /// A radiance and its error times `by`, along the way.
    fn arrives(
        &self,
        way: &Way,
        (radiance, radiance_error): (DVec3, DVec3),
        by: Known,
    ) -> Gathered {
        let e = radiance * by.value;
        let error = radiance.abs() * by.error
            + radiance_error * (by.value + by.error)
            + e.abs() * (ROUNDINGS * U);
        let taken = match &self.exchange.regions[self.receiver.i_region].lobe {
            Some(table) => lobe(table, self.eye_angle(way)),
            None => Known::NOTHING,
        };
        Gathered {
            indirect: e,
            glossy: e * taken.value,
            error: [error, error * taken.value.abs() + (e.abs() + error) * taken.error],
            ..Gathered::default()
        }
    }
}
