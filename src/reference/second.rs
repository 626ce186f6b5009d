//! The second reflection, C (16), from every pair of facets: model.md §7 and §11 "second". In: facets, regions, lights and
//! their shares, the density grid, all relative to O. Out, a receiver: I_i (W m⁻²) and L2 (W m⁻² sr⁻¹) toward the eye,
//! RGB, and what an f32 evaluation of the same may differ.

mod shapes;
#[cfg(test)]
mod tests;

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec2, DVec3};

use shapes::{Shadow, disc_form, half_gap, lobe_and_slope, meets, rectangle_form, shadow, width};

use super::grid::sample;
use super::occlude::Rectangle;
use super::transmit::{SHARE_SIDE, crossing, share_points};
use crate::model::grid::GridSpec;
use crate::model::light::Light;
use crate::model::material::Brdf;
use crate::model::pairings::Pairing;
use crate::model::scene::Pairs;

/// Lobes are met within this many of their widths.
const LOBE_REACH: f64 = 4.0;
/// Widths of a lobe, times pair_size, that a cell may be wide.
const LOBE_STEP: f64 = 3.0;
/// Of a cell's width over its distance, what the half vector turns from centre to corner.
const TURN: f64 = 0.75;
/// Down to this share of pair_size cells that a shadow's rim runs through are quartered.
const RIM: f64 = 0.5;
/// Wider cells are discs.
const NEAR: f64 = 1.0;
/// f32's unit round-off.
const U: f64 = 1.0 / 16_777_216.0;
/// Roundings of a product of some ten factors, each a sum of a few.
const ROUNDINGS: f64 = 16.0;

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

/// All that a gather needs. `shares`: what surfaces leave and what clouds do, [facet × light].
pub struct Exchange<'a> {
    pub facets: &'a [Facet],
    pub regions: &'a [Region],
    pub lights: &'a [Light],
    pub shares: &'a [[f64; 2]],
    pub spec: &'a GridSpec,
    pub cells: &'a [f64],
    /// g, and the march's step in cells; without particles g = 1.
    pub forward: f64,
    pub step: f64,
    pub pairs: Pairs,
    pub eye: DVec3,
    /// Which surfaces may stand between two regions: others tear no cells.
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
}

/// A part of facet `i`: 4^level of them, this one at `at`.
#[derive(Clone, Copy)]
struct Cell {
    level: u32,
    at: DVec2,
}

impl Exchange<'_> {
    /// I_i and L2 of facet `j`.
    pub fn gather(&self, j: usize) -> Gathered {
        let (receiver, mut sum) = (&self.facets[j], Gathered::default());
        for i in 0..self.facets.len() {
            let own = self.facets[i].i_region == receiver.i_region;
            if i != j && !(own && self.regions[receiver.i_region].rectangle.is_some()) {
                sum.add(&self.cell(j, i, Cell { level: 0, at: DVec2::ZERO }));
            }
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

    /// What a cell of facet `i` sends to facet `j`, whole or by its quarters.
    fn cell(&self, j: usize, i: usize, cell: Cell) -> Gathered {
        let (receiver, source) = (&self.facets[j], &self.facets[i]);
        let region = &self.regions[source.i_region];
        let scale = 0.5f64.powi(cell.level as i32);
        let (u, v) = region.rectangle.map_or((DVec3::ZERO, DVec3::ZERO), |r| r.facet);
        let side = 2.0 * u.length().max(v.length()) * scale;
        let q = source.position + cell.at.x * u + cell.at.y * v;
        let offset = q - receiver.position;
        let (d2, way) = (offset.length_squared(), offset.normalize_or_zero());
        let b = side / d2.sqrt();
        // A position's rounding as an angle.
        let turn = 4.0 * U * (1.0 + self.reach / d2.sqrt());
        let excess = self.excess(j, i, q, way, b);
        let (ahead, behind) = (receiver.normal.dot(offset) + side, source.normal.dot(offset));
        let facing = ahead > 0.0 && behind < 0.0;
        let may_split = cell.level < self.pairs.levels && region.rectangle.is_some();
        let quarters = || {
            let quarter = |k: u32| {
                let to = DVec2::new(f64::from(k & 1), f64::from(k >> 1)) * 2.0 - 1.0;
                Cell { level: cell.level + 1, at: cell.at + to * 0.5 * scale }
            };
            let mut sum = Gathered::default();
            (0..4).for_each(|k| sum.add(&self.cell(j, i, quarter(k))));
            sum
        };
        let slack = d2.sqrt() * 8.0 * turn;
        let whole = || self.whole(j, i, &cell, q, b, facing && excess > 1.0);
        // Where rounding may turn a decision both are found, and their difference is what it may change.
        let excess_doubt = (excess - 1.0).abs() <= 64.0 * turn * (1.0 + excess) && facing;
        let facing_doubt =
            (ahead.abs() < slack || behind.abs() < slack) && excess > 1.0 && ahead > -slack && behind < slack;
        let doubt = may_split && (excess_doubt || facing_doubt);
        if may_split && facing && excess > 1.0 {
            let value = quarters();
            return if doubt { value.or(&whole()) } else { value };
        }
        let rim = if may_split && b > self.pairs.size * RIM * (1.0 - 64.0 * turn) {
            self.rim(j, i, &cell, q)
        } else {
            Shadow::default()
        };
        let rim_doubt = rim.unsure_torn || (b / (self.pairs.size * RIM) - 1.0).abs() <= 64.0 * turn;
        let torn = rim.torn && b > self.pairs.size * RIM;
        // What sends nothing is not looked at.
        let sends = self.form(j, i, &cell, q, b) > 0.0;
        if torn && sends {
            let value = quarters();
            return if rim_doubt || doubt { value.or(&whole()) } else { value };
        }
        let value = whole();
        let any_doubt = doubt || (may_split && rim_doubt && sends && (rim.torn || rim.unsure_torn));
        if any_doubt { value.or(&quarters()) } else { value }
    }

    /// How much wider than asked for, by distance and by the lobes that are met.
    fn excess(&self, j: usize, i: usize, q: DVec3, way: DVec3, b: f64) -> f64 {
        let (receiver, source) = (&self.facets[j], &self.facets[i]);
        let by_lobe = |ns: f64, gap: f64| {
            let met = (2.0 * gap).sqrt() < TURN * b + LOBE_REACH * width(ns);
            if met { b / (LOBE_STEP * self.pairs.size * width(ns)) } else { 0.0 }
        };
        let mut excess = b / self.pairs.size;
        if self.regions[source.i_region].lobe.is_some() {
            let gaps = self.lights.iter().zip(0..).filter(|(l, k)| !l.is_sky() && self.mean_share(i, *k) > 0.0);
            let gaps = gaps.map(|(l, _)| half_gap(source.normal, l.arrival(q).toward, -way));
            let least = gaps.fold(2.0, f64::min);
            excess = excess.max(by_lobe(self.regions[source.i_region].brdf.ns, least));
        }
        if self.regions[receiver.i_region].lobe.is_some() {
            let outgoing = (self.eye - receiver.position).normalize();
            excess =
                excess.max(by_lobe(self.regions[receiver.i_region].brdf.ns, half_gap(receiver.normal, way, outgoing)));
        }
        excess
    }

    /// g of a whole facet.
    fn mean_share(&self, i: usize, i_light: usize) -> f64 {
        let (source, light) = (&self.facets[i], &self.lights[i_light]);
        let [clear, through] = self.shares[i * self.lights.len() + i_light];
        let at = |p: DVec3, v: f64| light.share(source.normal, &light.arrival(p), v);
        let lamp = matches!(light, Light::Point { .. } | Light::Spot { .. });
        match &self.regions[source.i_region].rectangle {
            Some(r) if lamp => {
                let points = share_points(source.position, r.facet);
                clear * through * points.iter().map(|p| at(*p, 1.0)).sum::<f64>() / f64::from(SHARE_SIDE * SHARE_SIDE)
            }
            _ => at(source.position, clear * through),
        }
    }

    /// Rectangles but those of two regions.
    fn others(&self, a: usize, b: usize) -> impl Iterator<Item = (usize, &Rectangle)> {
        let all = self.regions.iter().enumerate();
        all.filter(move |(k, _)| *k != a && *k != b).filter_map(|(k, r)| Some((k, r.rectangle.as_ref()?)))
    }

    fn slack(&self) -> f64 {
        8.0 * U * self.reach
    }

    fn before_light(&self, i_region: usize, light: &Light, q: DVec3, radius: f64) -> Shadow {
        let from = match light {
            Light::Point { position, .. } | Light::Spot { position, .. } => Ok(*position),
            _ => Err(light.arrival(q).toward),
        };
        let shadows = self.others(i_region, i_region).map(|(_, r)| shadow(r, from, q, radius, self.slack()));
        shadows.fold(Shadow::default(), Shadow::over)
    }

    fn before_receiver(&self, j: usize, i: usize, q: DVec3, radius: f64) -> Shadow {
        let (a, b) = (&self.facets[j], &self.facets[i]);
        let emitter = self.regions[b.i_region].rectangle.as_ref();
        let pairing = self.pairings[a.i_region].iter().find(|p| p.i_emitter == b.i_region);
        let of = |(k, r): (usize, &Rectangle)| {
            let found = shadow(r, Ok(a.position), q, radius, self.slack());
            match emitter {
                // What hides no point of the surface tears none of its cells, however far their balls reach.
                Some(e)
                    if found.torn
                        && !(pairing.is_some_and(|p| p.occluders.contains(&k)) && meets(r, e, a.position)) =>
                {
                    Shadow { torn: false, ..found }
                }
                _ => found,
            }
        };
        self.others(a.i_region, b.i_region).map(of).fold(Shadow::default(), Shadow::over)
    }

    /// Rims through the cell, of what is before the receiver and before the lights.
    fn rim(&self, j: usize, i: usize, cell: &Cell, q: DVec3) -> Shadow {
        let source = &self.facets[i];
        let Some(r) = &self.regions[source.i_region].rectangle else { return Shadow::default() };
        let diagonal = (r.facet.0 + r.facet.1).length();
        let radius = diagonal * 0.5f64.powi(cell.level as i32);
        let mut found = self.before_receiver(j, i, q, radius);
        // A hidden middle without rims sends nothing, whatever its light.
        if found.torn || found.hidden {
            return found;
        }
        for light in self.lights {
            let of_light = self.before_light(source.i_region, light, q, radius);
            found = found.over(Shadow { hidden: false, unsure_hidden: false, ..of_light });
        }
        found
    }

    /// cos cos/d² of a cell, b wide over its distance.
    fn form(&self, j: usize, i: usize, cell: &Cell, q: DVec3, b: f64) -> f64 {
        let (receiver, source) = (&self.facets[j], &self.facets[i]);
        let offset = q - receiver.position;
        let (d2, way) = (offset.length_squared(), offset.normalize_or_zero());
        let scale = 0.5f64.powi(cell.level as i32);
        match &self.regions[source.i_region].rectangle {
            Some(r) if b <= NEAR => {
                rectangle_form(receiver.normal, source.normal, way, d2, scale * r.facet.0, scale * r.facet.1)
            }
            _ => disc_form(receiver.normal, source.normal, way, d2, scale * scale * source.area),
        }
    }

    /// The cell as one.
    fn whole(&self, j: usize, i: usize, cell: &Cell, q: DVec3, b: f64, is_wide: bool) -> Gathered {
        let receiver = &self.facets[j];
        let offset = q - receiver.position;
        let (d2, way) = (offset.length_squared(), offset.normalize_or_zero());
        let part = 0.25f64.powi(cell.level as i32);
        let form = self.form(j, i, cell, q, b);
        let unresolved = f64::from(u8::from(is_wide));
        let turn = 4.0 * U * (1.0 + self.reach / d2.sqrt());
        let shadow = self.before_receiver(j, i, q, 0.0);
        let depth = self.depth(receiver.position, q);
        let v = if shadow.hidden { 0.0 } else { (-depth).exp() };
        let (leaving, leaving_error) = self.leaving(i, cell, q, way, turn);
        let (e, taken) = (leaving * (part * form * v), self.taken(j, way, turn));
        // The form's own error: of each cosine a turn, of their product and of 1/d² the roundings.
        let form_error = part * (2.0 * turn / d2 + ROUNDINGS * turn * form);
        let error = leaving.abs() * form_error * v
            + leaving_error * (part * form) * v
            + e.abs() * (ROUNDINGS * U + depth * MARCH * turn);
        let doubt = if shadow.unsure_hidden { leaving.abs() * (part * form) } else { DVec3::ZERO };
        Gathered {
            indirect: e,
            glossy: e * taken.0,
            n_unresolved: unresolved,
            error: [error + doubt, (error + doubt) * taken.0.abs() + e.abs() * taken.1],
            ..Gathered::default()
        }
    }

    /// The receiver's lobe, and its error.
    fn taken(&self, j: usize, way: DVec3, turn: f64) -> (f64, f64) {
        let receiver = &self.facets[j];
        let Some(table) = &self.regions[receiver.i_region].lobe else { return (0.0, 0.0) };
        let outgoing = (self.eye - receiver.position).normalize();
        lobe_and_slope(table, half_gap(receiver.normal, way, outgoing), 4.0 * turn)
    }

    /// Λ of facet `i` from a cell at `q` against `way`, and its error.
    fn leaving(&self, i: usize, cell: &Cell, q: DVec3, way: DVec3, turn: f64) -> (DVec3, DVec3) {
        let source = &self.facets[i];
        let region = &self.regions[source.i_region];
        let (mut sum, mut error) = (DVec3::ZERO, DVec3::ZERO);
        for (k, light) in self.lights.iter().enumerate() {
            let arrival = light.arrival(q);
            let [_, through] = self.shares[i * self.lights.len() + k];
            let shadow =
                if cell.level > 0 { self.before_light(source.i_region, light, q, 0.0) } else { Shadow::default() };
            let own = |v: f64| light.share(source.normal, &arrival, v);
            let g = match cell.level {
                0 => self.mean_share(i, k),
                _ => own(if shadow.hidden { 0.0 } else { through }),
            };
            let doubt = if shadow.unsure_hidden { own(through) } else { 0.0 };
            let (lobe, slope) = match &region.lobe {
                Some(table) if !light.is_sky() => {
                    lobe_and_slope(table, half_gap(source.normal, arrival.toward, -way), 4.0 * turn)
                }
                _ => (0.0, 0.0),
            };
            let energy = light.energy() * source.area;
            let f = region.brdf.kd * source.color / PI + region.brdf.ks * lobe;
            sum += energy * f * g;
            let g_error = doubt + ROUNDINGS * U * g + 2.0 * turn * arrival.falloff;
            error += energy * (f.abs() * g_error + region.brdf.ks * slope * g);
        }
        (sum, error)
    }

    /// (1 − g) τ between two points: equal steps over what lies in the grid's box.
    fn depth(&self, p: DVec3, q: DVec3) -> f64 {
        let d = q - p;
        if self.forward >= 1.0 {
            return 0.0;
        }
        let Some((enter, leave)) = crossing(self.spec, p, d, 1.0) else { return 0.0 };
        let length = (leave - enter) * d.length();
        let n = ((length / (self.step * self.spec.cell)).ceil() as u32).clamp(1, self.pairs.steps);
        let at = |k: u32| p + d * (enter + (leave - enter) * (f64::from(k) + 0.5) / f64::from(n));
        let sum: f64 = (0..n).map(|k| sample(self.spec, self.cells, at(k))).sum();
        (1.0 - self.forward) * sum * length / f64::from(n)
    }
}
