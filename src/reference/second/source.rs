//! What a facet has of the lights and sends on, and how it lies in the lights' shadows: model.md §11 "second".

use super::stencil::{Edges, Patch};
use super::*;
use crate::model::light::LEAST_PENUMBRA;
use crate::reference::transmit::{SHARE_SIDE, share_points};

/// A light's shadows on a facet: whether any tears it, and the rectangles whose shadow meets it.
pub struct Shading<'a> {
    pub torn: Decision,
    rectangles: Vec<&'a Rectangle>,
    source: Source,
}

pub fn any_torn(shadings: &[Shading]) -> Decision {
    shadings.iter().map(|s| s.torn).fold(Decision::NO, Decision::or)
}

impl Shading<'_> {
    /// Edges of its rectangles over a cell.
    pub fn edges(&self, patch: &Patch, slack: f64) -> Vec<Edges> {
        if !self.torn.is_possible() {
            return Vec::new();
        }
        let all = self.rectangles.iter().map(|r| Edges::new(r, self.source, patch, slack));
        all.filter(|e| !e.is_nothing()).collect()
    }
}

impl Exchange<'_> {
    /// The lights' shadows on facet `i`.
    pub(super) fn shadings(&self, i: usize) -> Vec<Shading<'_>> {
        let (facet, radius) = (&self.facets[i], self.radius(i));
        let of = |light: &Light| {
            let source = source_of(light);
            let shadows = self.others(facet.i_region, facet.i_region);
            let shadows = shadows.map(|(_, r)| (r, shadow(r, source, facet.position, radius, self.slack())));
            let met: Vec<_> = shadows.filter(|(_, s)| s.torn.or(s.hidden).is_possible()).collect();
            let torn = met.iter().map(|(_, s)| s.torn).fold(Decision::NO, Decision::or);
            // One that only rounding may bring here hides nothing of the facet: it is within the ball.
            Shading { torn, rectangles: met.into_iter().map(|(r, _)| r).collect(), source }
        };
        self.lights.iter().map(of).collect()
    }

    /// g of what is seen as a whole.
    pub(super) fn mean_share(&self, i: usize, i_light: usize) -> Known {
        let (source, v) = (&self.facets[i], self.mean_transmittance(i, i_light));
        match self.axes(i) {
            Some(axes) if matches!(self.lights[i_light], Light::Point { .. } | Light::Spot { .. }) => {
                let points = share_points(source.position, axes);
                let all = points.iter().map(|p| self.share_at(i, i_light, *p, v));
                all.fold(Known::NOTHING, Known::plus).scaled(1.0 / f64::from(SHARE_SIDE * SHARE_SIDE))
            }
            _ => self.share_at(i, i_light, source.position, v),
        }
    }

    /// V̄.
    pub(super) fn mean_transmittance(&self, i: usize, i_light: usize) -> Known {
        let clear = self.shares[i * self.lights.len() + i_light][0];
        self.transmittance(i, i_light).scaled(clear)
    }

    /// e^{−(1−g)τ_l} of facet `i`.
    pub(super) fn transmittance(&self, i: usize, i_light: usize) -> Known {
        let value = self.shares[i * self.lights.len() + i_light][1];
        let depth = if value > 0.0 { -value.ln() } else { 0.0 };
        Known { value, error: value * depth * MARCH * 4.0 * U }
    }

    /// g at `x` on facet `i` where `v` of the light gets through.
    pub(super) fn share_at(&self, i: usize, i_light: usize, x: DVec3, v: Known) -> Known {
        let (light, n) = (&self.lights[i_light], self.facets[i].normal);
        let arrival = light.arrival(x);
        let own = |v: f64| light.share(n, &arrival, v);
        let cone = match light {
            Light::Spot { cos_inner, cos_outer, .. } => 2.0 / (cos_inner - cos_outer).max(LEAST_PENUMBRA),
            _ => 0.0,
        };
        let turned = self.turn(arrival.distance) * v.value * arrival.falloff * (2.0 + cone);
        // A lamp so far behind the facet that no rounding brings it before.
        let behind = !light.is_sky() && n.dot(arrival.toward) < -self.turn(arrival.distance);
        let error = if behind { 0.0 } else { v.error * (own(1.0) - own(0.0)) + ROUNDINGS * U * own(v.value) + turned };
        Known { value: own(v.value), error }
    }

    /// Between the normal of facet `i` and the half vector of a light that is not the sky and the way back.
    pub(super) fn light_angle(&self, i: usize, i_light: usize, q: DVec3, way: &Way) -> Option<Known> {
        let light = &self.lights[i_light];
        let arrival = light.arrival(q);
        let turn = way.turn + self.turn(arrival.distance);
        (!light.is_sky()).then(|| half_angle(self.facets[i].normal, arrival.toward, -way.way, turn))
    }

    /// Radiance of facet `i` against `way` from `q` under shares `g` of the lights, and its error.
    pub(super) fn radiance(&self, i: usize, way: &Way, q: DVec3, g: &[Known]) -> (DVec3, DVec3) {
        let source = &self.facets[i];
        let region = &self.regions[source.i_region];
        let (mut sum, mut error) = (DVec3::ZERO, DVec3::ZERO);
        for (k, (light, g)) in self.lights.iter().zip(g).enumerate().filter(|(_, (_, g))| !g.is_nothing()) {
            let glossy = region.lobe.as_ref().zip(self.light_angle(i, k, q, way));
            let glossy = glossy.map_or(Known::NOTHING, |(table, angle)| lobe(table, angle));
            let f = region.brdf.kd * source.color / PI + region.brdf.ks * glossy.value;
            sum += light.energy() * f * g.value;
            error += light.energy() * (f.abs() * g.error + region.brdf.ks * glossy.error * (g.value + g.error));
        }
        (sum, error)
    }
}
