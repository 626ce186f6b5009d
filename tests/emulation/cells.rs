//! Light from a facet by its cells, and from cells by 4 × 4 points: passes.md "second",
//! *Refinement*.

use glam::DVec2;

use super::coverage::{Coverage, Patch};
use super::gathered::Gathered;
use super::roundings::ROUNDINGS;
use super::rules::{CELL_WIDTH, LOBE_PARTS, LOBE_STEP};
use super::source::Sender;
use super::view::View;
use nimbus::reference::bounded::{Bounded, Decision};
use nimbus::reference::occlude::{Rectangle, Source};

/// Area of a part over that of its cell.
const PART: f64 = 1.0 / 16.0;

/// A cell of a facet: one of 4^level.
#[derive(Debug, Clone, Copy)]
pub struct Cell {
    /// Number of divisions.
    pub level: u32,
    /// Centre, in the facet's half axes.
    pub at: DVec2,
}

impl Cell {
    /// Returns the cell's size as a share of the facet's.
    pub fn scale(&self) -> f64 {
        0.5f64.powi(self.level as i32)
    }

    fn quarter(&self, k: u32) -> Cell {
        let to = DVec2::new(f64::from(k & 1), f64::from(k >> 1)) * 2.0 - 1.0;
        Cell { level: self.level + 1, at: self.at + to * 0.5 * self.scale() }
    }
}

impl View<'_> {
    /// Returns the light from a cell of facet `i` of a surface, by its quarters or by points.
    pub fn cell(&self, i: usize, cell: &Cell, sender: &Sender) -> Gathered {
        let (x, scale) = (self.exchange, cell.scale());
        let (u, v) = x.axes(i).unwrap_or_default();
        let q = x.facets[i].position + cell.at.x * u + cell.at.y * v;
        let patch = Patch { q, u: scale * u, v: scale * v };
        let way = self.way(i, q);
        let side = 2.0 * patch.u.length().max(patch.v.length());
        let b = side / way.d2.sqrt();
        let b = Bounded { value: b, error: b * ROUNDINGS * way.turn };
        let wide = Decision::above(b.value, CELL_WIDTH * x.pairs.size, b.error);
        let open = self.faces(&way, side).and(wide.or(self.facet_meets_lobe(
            i,
            &way,
            q,
            b,
            LOBE_STEP * LOBE_PARTS,
        )));
        if cell.level == x.pairs.levels {
            let count = |is: bool| f64::from(u8::from(is));
            let (n_unresolved, n_doubted) = (count(open.is_true), count(!open.is_sure));
            return Gathered { n_unresolved, n_doubted, ..self.by_points(i, cell, &patch, sender) };
        }
        let quarters = || (0..4).map(|k| self.cell(i, &cell.quarter(k), sender)).collect();
        Gathered::choose(open, quarters, || self.by_points(i, cell, &patch, sender))
    }

    /// Returns the light from a cell by the centres of its parts, with lobes evaluated by quarters.
    fn by_points(&self, i: usize, cell: &Cell, patch: &Patch, sender: &Sender) -> Gathered {
        let (x, p) = (self.exchange, self.receiver.position);
        let area = 4.0 * patch.u.length() * patch.v.length();
        let edges = |(r, counts): &(&Rectangle, Decision)| {
            let edges = Coverage::new(r, Source::At(p), patch, x.slack());
            (!edges.is_zero()).then_some((edges, *counts))
        };
        let occluders: Vec<_> =
            self.before[x.facets[i].i_region].iter().filter_map(edges).collect();
        let shares: Vec<_> = (0..x.lights.len())
            .map(|k| x.shares_of(i, k, sender, (cell.scale(), cell.at), patch))
            .collect();
        let mut sums = vec![[Bounded::ZERO; 4]; x.lights.len()];
        for (n, at) in Patch::middles().enumerate() {
            let place = patch.point(at);
            let seen = occluders
                .iter()
                .map(|(e, counts)| e.hidden(at).select(*counts, Bounded::ZERO).complement());
            let form = seen
                .fold(self.way(i, place).part_form(0.25 * patch.u, 0.25 * patch.v), Bounded::times);
            if form.is_zero() {
                continue;
            }
            let quarter = Patch::quarter_of(at);
            for (k, sum) in sums.iter_mut().enumerate() {
                sum[quarter] = sum[quarter].plus(form.times(shares[k][n]));
            }
        }
        let through = x.through(p, patch.q, 0.0).scaled(area);
        let mut sent = Gathered::default();
        for (quarter, middle) in patch.quarters().into_iter().enumerate() {
            let g: Vec<Bounded> = sums.iter().map(|s| s[quarter].scaled(PART)).collect();
            sent.add(&self.sent(i, &self.way(i, middle), middle, &g, through));
        }
        sent
    }
}
