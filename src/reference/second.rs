//! The second reflection, C (16), from every pair of facets: model.md §7 and §11 "second". In: facets, regions, lights and
//! their transmittances, the density grid, all relative to O. Out, a receiver: I_i (W m⁻²) and L2 (W m⁻² sr⁻¹) toward the eye,
//! RGB, and what an f32 evaluation of the same may differ.

mod closely;
mod doubt;
mod rims;
mod shapes;
mod source;
mod stencil;
#[cfg(test)]
mod tests;

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec2, DVec3};

use closely::Cell;
use doubt::{Decision, Known};
use rims::{meets, shadow};
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
/// Widths of a lobe, times pair_size, that a facet may be wide; and a cell, which meets lobes in its quarters.
const LOBE_STEP: f64 = 3.0;
const CELL_STEP: f64 = 4.5;
/// Of a width over its distance, what the half vector turns from centre to corner.
const TURN: f64 = 0.75;
/// Facets that a shadow's rim runs through are looked at closely where wider than this share of pair_size; where both the
/// receiver's view and a light's is torn, than this.
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

/// Of an optical depth: samples of a density that may double within a cell, at places off by their rounding in cells, and
/// deposited in f32's rounding by some hundreds of blobs.
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

/// All that a gather needs. `transmittance`: of the lights, [facet × light]; `through`: what clouds alone leave.
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
    /// Which surfaces send light to which, and which may stand between them: no others hide one from the other.
    pub pairings: &'a [Vec<Pairing>],
    /// The greatest coordinate, whose rounding positions have.
    pub reach: f64,
}

/// What a receiver gathers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Gathered {
    pub indirect: DVec3,
    /// Σ Λ G V S of the receiver's lobe.
    glossy: DVec3,
    pub second: DVec3,
    pub n_unresolved: f64,
    /// What rounding may change of I_i and L2 (before K_d and K_s), and what decisions within rounding may.
    error: [DVec3; 2],
    pub indirect_error: DVec3,
    pub second_error: DVec3,
    /// Of n_unresolved.
    pub n_doubted: f64,
}

impl Gathered {
    fn add(&mut self, b: &Gathered) {
        self.indirect += b.indirect;
        self.glossy += b.glossy;
        self.n_unresolved += b.n_unresolved;
        self.error[0] += b.error[0];
        self.error[1] += b.error[1];
        self.n_doubted += b.n_doubted;
    }

    /// `self`, in doubt whether it is not `b`.
    fn or(mut self, b: &Gathered) -> Gathered {
        self.error[0] += (self.indirect - b.indirect).abs() + b.error[0];
        self.error[1] += (self.glossy - b.glossy).abs() + b.error[1];
        self.n_doubted += (self.n_unresolved - b.n_unresolved).abs() + b.n_doubted;
        self
    }

    /// `is` where `d`, else `other`; both where rounding may turn it.
    fn by(d: Decision, is: impl Fn() -> Gathered, other: impl Fn() -> Gathered) -> Gathered {
        match (d.taken, d.sure) {
            (true, true) => is(),
            (false, true) => other(),
            (true, false) => is().or(&other()),
            (false, false) => other().or(&is()),
        }
    }
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
        let (receiver, mut sum) = (&self.facets[j], Gathered::default());
        let before = (0..self.regions.len()).map(|e| self.before(receiver, e)).collect();
        let view = View { exchange: self, receiver, before, senders };
        for i in (0..self.facets.len()).filter(|&i| i != j && self.is_pair(receiver.i_region, self.facets[i].i_region))
        {
            sum.add(&view.of_facet(i));
        }
        let region = &self.regions[receiver.i_region];
        let albedo = region.brdf.kd * receiver.color * FRAC_1_PI;
        let front = (self.eye - receiver.position).dot(receiver.normal) > 0.0;
        let ks = if front { region.brdf.ks } else { DVec3::ZERO };
        sum.second = albedo * sum.indirect + ks * sum.glossy;
        // Their sums pass as many roundings as there are terms: a hundredth of the bound already in `error` at most.
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
        all.filter(move |(k, _)| *k != a && *k != b).filter_map(|(k, r)| Some((k, r.rectangle.as_ref()?)))
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

    /// e^{−(1−g)τ} between two points: equal steps over what lies in the grid's box.
    fn through(&self, p: DVec3, q: DVec3) -> Known {
        let d = q - p;
        let Some((enter, leave)) = crossing(self.spec, p, d, 1.0).filter(|_| self.forward < 1.0) else {
            return Known::ONE;
        };
        let length = (leave - enter) * d.length();
        let n = ((length / (self.step * self.spec.cell)).ceil() as u32).clamp(1, self.pairs.steps);
        let at = |k: u32| p + d * (enter + (leave - enter) * (f64::from(k) + 0.5) / f64::from(n));
        let sum: f64 = (0..n).map(|k| sample(self.spec, self.cells, at(k))).sum();
        let depth = (1.0 - self.forward) * sum * length / f64::from(n);
        Known { value: (-depth).exp(), error: (-depth).exp() * depth * MARCH * self.turn(d.length()) }
    }
}

impl View<'_> {
    /// The way to `q` on facet `i`.
    fn way(&self, i: usize, q: DVec3) -> Way {
        let o = q - self.receiver.position;
        let n_i = self.exchange.facets[i].normal;
        let turn = self.exchange.turn(o.length());
        Way { n_j: self.receiver.normal, n_i, way: o.normalize_or_zero(), d2: o.length_squared(), turn }
    }

    /// What facet `i` sends, as a whole or by its cells.
    fn of_facet(&self, i: usize) -> Gathered {
        let (x, q) = (self.exchange, self.exchange.facets[i].position);
        let way = self.way(i, q);
        let Some((u, v)) = x.axes(i) else { return self.whole(i, &way, way.disc_form(x.facets[i].area)) };
        let side = 2.0 * u.length().max(v.length());
        let b = side / way.d2.sqrt();
        let form = way.part_form(u, v);
        let wide = self.faces(&way, side).and(
            Decision::above(b, x.pairs.size, b * ROUNDINGS * way.turn).or(self.meets_lobe(i, &way, q, b, LOBE_STEP)),
        );
        let sends = |rim: f64| form.is_positive().and(Decision::above(b, rim * x.pairs.size, b * ROUNDINGS * way.turn));
        let sender = &self.senders[i];
        let torn = if sends(BOTH_RIMS).is_possible() { self.is_torn(i) } else { Decision::NO };
        // What of a light is torn matters where something of the facet is seen.
        let light = if sender.torn.is_possible() && sends(RIM).is_possible() {
            sender.torn.and(self.seen_of_ball(i).is_positive())
        } else {
            Decision::NO
        };
        let by_rims = sends(RIM).and(torn.or(light)).or(sends(BOTH_RIMS).and(torn.and(sender.torn)));
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

    /// A lobe is met by what is `b` wide at `q`, and wider than `step` says.
    fn meets_lobe(&self, i: usize, way: &Way, q: DVec3, b: f64, step: f64) -> Decision {
        let x = self.exchange;
        let source = &x.regions[x.facets[i].i_region];
        let receiver = &x.regions[self.receiver.i_region];
        let met = |ns: f64, angle: Known| {
            let slack = angle.error + b * ROUNDINGS * way.turn;
            let near = Decision::above(TURN * b + LOBE_REACH * width(ns), angle.value, slack);
            near.and(Decision::above(b, step * x.pairs.size * width(ns), b * ROUNDINGS * way.turn))
        };
        let mut found = Decision::NO;
        if source.lobe.is_some() {
            let lit = &self.senders[i].lights;
            let angles = (0..x.lights.len()).filter(|k| lit[*k].mean.value > 0.0);
            let angles = angles.filter_map(|k| x.light_angle(i, k, q, way));
            found = angles.map(|angle| met(source.brdf.ns, angle)).fold(found, Decision::or);
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

    /// A rim runs through facet `i` as the receiver sees it.
    fn is_torn(&self, i: usize) -> Decision {
        let x = self.exchange;
        let (q, radius, from) = (x.facets[i].position, x.radius(i), Source::At(self.receiver.position));
        let torn = |(r, counts): &(&Rectangle, Decision)| counts.and(shadow(r, from, q, radius, x.slack()).torn);
        self.before[x.facets[i].i_region].iter().map(torn).fold(Decision::NO, Decision::or)
    }

    /// Π (1 − h_r) of the ball about facet `i`.
    fn seen_of_ball(&self, i: usize) -> Known {
        let x = self.exchange;
        let (q, radius, from) = (x.facets[i].position, x.radius(i), Source::At(self.receiver.position));
        let seen = |(r, counts): &(&Rectangle, Decision)| {
            shadow(r, from, q, radius, x.slack()).share.where_or(*counts, Known::NOTHING).rest()
        };
        self.before[x.facets[i].i_region].iter().map(seen).fold(Known::ONE, Known::times)
    }

    /// Facet `i` as one.
    fn whole(&self, i: usize, way: &Way, form: Known) -> Gathered {
        let x = self.exchange;
        if form.is_nothing() {
            return Gathered::default();
        }
        let (q, p) = (x.facets[i].position, self.receiver.position);
        let seen = self.seen_of_ball(i);
        let g: Vec<Known> = self.senders[i].lights.iter().map(|l| l.mean).collect();
        self.sent(i, way, q, &g, form.times(seen).times(x.through(p, q)).scaled(x.facets[i].area))
    }

    /// What facet `i` sends from `q` under shares `g` of the lights, times `by`.
    fn sent(&self, i: usize, way: &Way, q: DVec3, g: &[Known], by: Known) -> Gathered {
        let (radiance, radiance_error) = self.exchange.radiance(i, way, q, g);
        let e = radiance * by.value;
        let error = radiance.abs() * by.error + radiance_error * (by.value + by.error) + e.abs() * (ROUNDINGS * U);
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
