//! Light that a facet receives from the lights and sends on, and the shadows on it: passes.md
//! "second".

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::coverage::{Coverage, Patch};
use super::exchange::Exchange;
use super::form::{PairGeometry, half_angle, lobe};
use super::occluder::shadow;
use super::roundings::{MARCH, MIN_DISTANCE, ROUNDINGS, U};
use nimbus::model::light::{Light, MIN_PENUMBRA};
use nimbus::reference::bounded::{Bounded, Decision};
use nimbus::reference::occlude::{Rectangle, Source, source_of};

/// Rounding to 16 bits of a number from 0 to 1, and f32's rounding before.
const SIXTEEN_BITS: f64 = 0.5 / 65_535.0 + 4.0 * U;

/// Light of one source on a facet.
pub struct LightOnFacet<'a> {
    /// Whether a shadow edge crosses the facet.
    pub crossed: Decision,
    /// Rectangles whose shadow meets the facet, and the source.
    rectangles: Vec<&'a Rectangle>,
    source: Source,
    /// g_l at the points of a surface's facet, rounded to 16 bits of their greatest.
    points: Vec<Bounded>,
    /// g, the mean over the facet.
    pub mean: Bounded,
}

/// Light of all sources on a facet.
pub struct Sender<'a> {
    /// Light of every source.
    pub lights: Vec<LightOnFacet<'a>>,
    /// Whether a shadow edge of some source crosses the facet.
    pub crossed: Decision,
}

impl Exchange<'_> {
    /// Returns the light of all sources on every facet.
    pub fn senders(&self) -> Vec<Sender<'_>> {
        let of = |i: usize| {
            let lights: Vec<_> = (0..self.lights.len()).map(|k| self.lit(i, k)).collect();
            Sender {
                crossed: lights.iter().map(|l| l.crossed).fold(Decision::NO, Decision::or),
                lights,
            }
        };
        (0..self.facets.len()).map(of).collect()
    }

    fn lit(&self, i: usize, i_light: usize) -> LightOnFacet<'_> {
        let (facet, ball, source) =
            (&self.facets[i], self.ball(i), source_of(&self.lights[i_light]));
        let Some((u, v)) = self.axes(i) else {
            let mean = self.share_at(
                i,
                i_light,
                facet.position,
                self.known(self.transmittance, i, i_light),
            );
            return LightOnFacet {
                crossed: Decision::NO,
                rectangles: vec![],
                source,
                points: vec![],
                mean,
            };
        };
        let shadows = self.others(facet.i_region, facet.i_region);
        let shadows = shadows.map(|(_, r)| (r, shadow(r, source, &ball)));
        // A rectangle that only rounding brings here hides nothing of the facet, which lies within
        // the ball.
        let met: Vec<_> = shadows.filter(|(_, s)| s.crossed.or(s.hidden).is_possible()).collect();
        let crossed = met.iter().map(|(_, s)| s.crossed).fold(Decision::NO, Decision::or);
        let rectangles = met.into_iter().map(|(r, _)| r).collect();
        let mut lit =
            LightOnFacet { crossed, rectangles, source, points: vec![], mean: Bounded::ZERO };
        lit.points = self.shares_over(i, i_light, &lit, &Patch { q: facet.position, u, v });
        lit.mean = lit.points.iter().copied().fold(Bounded::ZERO, Bounded::plus).scaled(1.0 / 16.0);
        let greatest = lit.points.iter().map(|p| p.value).fold(0.0, f64::max);
        lit.points.iter_mut().for_each(|p| p.error += greatest * SIXTEEN_BITS);
        lit
    }

    /// Returns g_l at a cell's points.
    fn shares_over(
        &self,
        i: usize,
        i_light: usize,
        lit: &LightOnFacet,
        patch: &Patch,
    ) -> Vec<Bounded> {
        let edges =
            lit.rectangles.iter().map(|r| Coverage::new(r, lit.source, patch, self.slack()));
        let edges: Vec<_> = edges.filter(|e| !e.is_zero()).collect();
        let through = self.known(self.through, i, i_light);
        let at = |at: DVec2| {
            let v = edges.iter().map(|e| e.hidden(at).complement()).fold(through, Bounded::times);
            self.share_at(i, i_light, patch.point(at), v)
        };
        Patch::middles().map(at).collect()
    }

    /// Returns g_l at a cell's points: its own if a shadow edge crosses its facet, else those of
    /// the facet's sixteenths.
    pub(super) fn shares_of(
        &self,
        i: usize,
        i_light: usize,
        sender: &Sender,
        (scale, at): (f64, DVec2),
        patch: &Patch,
    ) -> Vec<Bounded> {
        let lit = &sender.lights[i_light];
        let part = |point: DVec2| {
            let on_facet = at + point * scale;
            let index = ((on_facet + 1.0) * 2.0).floor().as_usizevec2();
            lit.points[index.x + 4 * index.y]
        };
        let of_facet: Vec<_> = Patch::middles().map(part).collect();
        if scale == 1.0 || !sender.crossed.is_possible() {
            return of_facet;
        }
        let own = self.shares_over(i, i_light, lit, patch);
        own.into_iter()
            .zip(of_facet)
            .map(|(own, other)| own.select(sender.crossed, other))
            .collect()
    }

    /// Returns a transmittance of facet `i` with its error.
    fn known(&self, transmittances: &[f64], i: usize, i_light: usize) -> Bounded {
        let value = transmittances[i * self.lights.len() + i_light];
        let depth = if value > 0.0 { -value.ln() } else { 0.0 };
        Bounded { value, error: value * depth * MARCH * 4.0 * U }
    }

    /// Returns g at `x` on facet `i` where the transmittance is `v`.
    fn share_at(&self, i: usize, i_light: usize, x: DVec3, v: Bounded) -> Bounded {
        let (light, n) = (&self.lights[i_light], self.facets[i].normal);
        let arrival = light.arrival(x);
        let own = |v: f64| light.share(n, &arrival, v);
        let cone = match light {
            Light::Spot { cos_inner, cos_outer, .. } => {
                2.0 / (cos_inner - cos_outer).max(MIN_PENUMBRA)
            }
            _ => 0.0,
        };
        let turned = self.turn(arrival.distance) * v.value * arrival.falloff * (2.0 + cone);
        // The lamp is so far behind the facet that no rounding brings it before.
        let behind = !light.is_sky() && n.dot(arrival.toward) < -self.turn(arrival.distance);
        let error = if behind {
            0.0
        } else {
            v.error * (own(1.0) - own(0.0)) + ROUNDINGS * U * own(v.value) + turned
        };
        Bounded { value: own(v.value), error }
    }

    /// Returns the angle between the unit normal at the end `q` of `way` and the half vector of a
    /// light and the way back; `None` for a sky. `q` errs by `moved`.
    pub(super) fn light_angle(
        &self,
        i_light: usize,
        q: DVec3,
        way: &PairGeometry,
        moved: f64,
    ) -> Option<Bounded> {
        let light = &self.lights[i_light];
        let arrival = light.arrival(q);
        let turn = way.turn
            + self.turn(arrival.distance)
            + 2.0 * moved / arrival.distance.max(MIN_DISTANCE);
        (!light.is_sky()).then(|| half_angle(way.n_i, arrival.toward, -way.way, turn))
    }

    /// Returns the radiance of facet `i` against `way` from `q` under shares `g` of the lights, and
    /// its error.
    pub(super) fn radiance(
        &self,
        i: usize,
        way: &PairGeometry,
        q: DVec3,
        g: &[Bounded],
    ) -> (DVec3, DVec3) {
        let source = &self.facets[i];
        let region = &self.regions[source.i_region];
        let (mut sum, mut error) = (DVec3::ZERO, DVec3::ZERO);
        for (k, (light, g)) in
            self.lights.iter().zip(g).enumerate().filter(|(_, (_, g))| !g.is_zero())
        {
            let glossy = region.lobe.as_ref().zip(self.light_angle(k, q, way, 0.0));
            let glossy = glossy.map_or(Bounded::ZERO, |(table, angle)| lobe(table, angle));
            let f = region.brdf.kd * source.color / PI + region.brdf.ks * glossy.value;
            sum += light.energy() * f * g.value;
            error += light.energy()
                * (f.abs() * g.error + region.brdf.ks * glossy.error * (g.value + g.error));
        }
        (sum, error)
    }
}
