//! The gather from every pair of facets.

use glam::DVec2;

use super::cells::Cell;
use super::exchange::Exchange;
use super::form::PairGeometry;
use super::gathered::Gathered;
use super::roundings::ROUNDINGS;
use super::rules::{EDGE_WIDTH, LOBE_STEP, SINGLE_EDGE_WIDTH};
use super::source::Sender;
use super::view::View;
use nimbus::reference::bounded::{Bounded, Decision};

impl Exchange<'_> {
    /// Returns I_i and L2 of facet `j` from `senders`.
    pub fn gather(&self, j: usize, senders: &[Sender]) -> Gathered {
        let of_region = |e: usize| {
            (0..self.facets.len()).filter(move |&i| i != j && self.facets[i].i_region == e)
        };
        self.received(j, senders, |view, e| of_region(e).map(|i| view.of_facet(i)).collect())
    }
}

impl View<'_> {
    /// Returns the light from facet `i`, as a whole or by its cells.
    pub(super) fn of_facet(&self, i: usize) -> Gathered {
        let (x, q) = (self.exchange, self.exchange.facets[i].position);
        let way = self.way(i, q);
        let Some((u, v)) = x.axes(i) else {
            return self.whole(i, &way, way.disc_form(x.facets[i].area));
        };
        let side = 2.0 * u.length().max(v.length());
        let b = side / way.d2.sqrt();
        let b = Bounded { value: b, error: b * ROUNDINGS * way.turn };
        let form = way.part_form(u, v);
        let above = |share: f64| Decision::above(b.value, share * x.pairs.size, b.error);
        let wide = self
            .faces(&way, side)
            .and(above(1.0).or(self.facet_meets_lobe(i, &way, q, b, LOBE_STEP)));
        let sends = |rim: f64| form.is_positive().and(above(rim));
        let (sender, ball, i_region) = (&self.senders[i], x.ball(i), x.facets[i].i_region);
        let crossed = if sends(EDGE_WIDTH).is_possible() {
            self.is_crossed(i_region, &ball)
        } else {
            Decision::NO
        };
        // A shadow edge of a light matters only where the facet is seen.
        let light = if sender.crossed.is_possible() && sends(SINGLE_EDGE_WIDTH).is_possible() {
            sender.crossed.and(self.visible_share(i_region, &ball).is_positive())
        } else {
            Decision::NO
        };
        let by_rims = sends(SINGLE_EDGE_WIDTH)
            .and(crossed.or(light))
            .or(sends(EDGE_WIDTH).and(crossed.and(sender.crossed)));
        let cell = Cell { level: 0, at: DVec2::ZERO };
        Gathered::choose(
            wide.or(by_rims),
            || self.cell(i, &cell, sender),
            || self.whole(i, &way, form),
        )
    }

    /// Returns the light from facet `i` as one emitter.
    pub(super) fn whole(&self, i: usize, way: &PairGeometry, form: Bounded) -> Gathered {
        let x = self.exchange;
        if form.is_zero() {
            return Gathered::default();
        }
        let (q, p) = (x.facets[i].position, self.receiver.position);
        let seen = self.visible_share(x.facets[i].i_region, &x.ball(i));
        let g: Vec<Bounded> = self.senders[i].lights.iter().map(|l| l.mean).collect();
        self.sent(
            i,
            way,
            q,
            &g,
            form.times(seen).times(x.through(p, q, 0.0)).scaled(x.facets[i].area),
        )
    }
}
