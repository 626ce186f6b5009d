//! The blobs between two steps, or of one step alone. They are laid out once; any moment is then
//! one interpolation a blob.

use std::sync::Arc;

use glam::DVec3;

use super::detail::{self, Detail, Effect, Spot, Wind};
use super::flow::{Carrier, Flow, Winds};
use super::grid::Grid;
use super::particles::{Layout, Place, WeatherBlob};

/// The clouds of a step.
#[derive(Debug, Clone)]
pub struct StepClouds {
    /// Grid of the step.
    pub grid: Grid,
    /// Extinction of every cell, m⁻¹.
    pub extinction: Vec<f64>,
    /// The winds, if they take detail along.
    pub winds: Option<Arc<Winds>>,
}

/// Blobs of two neighbouring steps, or of one step.
#[derive(Debug, Clone, PartialEq)]
pub struct Interval {
    from: Vec<WeatherBlob>,
    layout: Layout,
    grid: Grid,
    detail: Detail,
    /// Winds of the file at both steps, if they take detail along, and its life in them, s.
    flow: Option<([Arc<Winds>; 2], f64)>,
    /// Where the blobs are without detail.
    spots: Vec<Spot>,
    /// The effects of the detail, where no wind changes them.
    still: Option<Vec<Effect>>,
    /// `None` for a single step.
    to: Option<Vec<WeatherBlob>>,
    /// Vertical optical depth of every cell's blobs at both steps; empty for a single step.
    depths: Vec<[f64; 2]>,
}

/// Returns the vertical optical depth of every cell's blobs, of two sets of blobs of a layout.
fn depths(layout: &Layout, grid: &Grid, both: [&[WeatherBlob]; 2]) -> Vec<[f64; 2]> {
    let n_columns = grid.shape().n_columns();
    let mut depths = vec![[0.0; 2]; grid.shape().n_cells()];
    for (k, blobs) in both.into_iter().enumerate() {
        for (blob, place) in blobs.iter().zip(layout.places()) {
            let i = place.i_cell as usize;
            depths[i][k] += blob.mass() / grid.ground.area_m2(i % n_columns);
        }
    }
    depths
}

/// Vertical optical depth of a cell that is faint: what is seen of less changes as the depth does.
/// Of 0.1, 0.3, 0.5, 1, 3 and 10, 0.1 makes the greatest change of a frame least (tests/motion.rs).
const FAINT_DEPTH: f64 = 0.1;

/// Returns the optical depth of a cell at `weight` of the way between those of two steps, over what
/// is linear; at most 1. The logarithm of depth plus [`FAINT_DEPTH`] is linear. With linear depths
/// a thick cell would be opaque from soon after it begins to come until just before it has gone.
fn deepening([a, b]: [f64; 2], weight: f64) -> f64 {
    let mixed = a + weight * (b - a);
    let even = (a + FAINT_DEPTH).powf(1.0 - weight) * (b + FAINT_DEPTH).powf(weight) - FAINT_DEPTH;
    if mixed > 0.0 { (even / mixed).clamp(0.0, 1.0) } else { 1.0 }
}

impl Interval {
    /// Places the blobs of `layout` for a step and the next one on a grid of the same shape, or for
    /// a step alone. `life_s` is that of detail in the winds of the file, if they take it along.
    pub fn laid_out(
        layout: &Layout,
        a: &StepClouds,
        b: Option<&StepClouds>,
        (detail, life_s): (Detail, f64),
    ) -> Self {
        let blobs = |step: &StepClouds| layout.blobs(&step.grid, &step.extinction);
        let (from, to) = (blobs(a), b.map(blobs));
        let depths = to.as_ref().map(|to| depths(layout, &a.grid, [&from, to]));
        let is_still = detail.wind == Wind::Given(DVec3::ZERO) || detail.strength == 0.0;
        let spots = detail.spots(layout, &a.grid);
        let still = is_still.then(|| detail.effects(&spots, layout, &a.grid, &Carrier::NONE));
        let winds = a.winds.as_ref().zip(b.unwrap_or(a).winds.as_ref());
        Interval {
            from,
            to,
            depths: depths.unwrap_or_default(),
            flow: winds.map(|(from, to)| ([from.clone(), to.clone()], life_s)),
            spots: if is_still { vec![] } else { spots },
            still,
            layout: layout.clone(),
            grid: a.grid.clone(),
            detail,
        }
    }

    /// Returns all blobs at `weight` of the way, with the detail that they have at a time.
    pub fn blobs(&self, weight: f64, time_s: f64) -> Vec<WeatherBlob> {
        let Interval { layout, grid, detail, spots, still, .. } = self;
        let deepenings: Vec<f64> = self.depths.iter().map(|of| deepening(*of, weight)).collect();
        let mut all: Vec<WeatherBlob> = match &self.to {
            Some(to) if weight != 0.0 => {
                let ends = self.from.iter().zip(to).zip(layout.places());
                let of_blob = |((from, to), place): ((&WeatherBlob, &WeatherBlob), &Place)| {
                    between(from, to, weight, deepenings[place.i_cell as usize])
                };
                ends.map(of_blob).collect()
            }
            _ => self.from.clone(),
        };
        match still {
            Some(effects) => detail::apply(effects, &mut all, layout),
            None => {
                let carrier = self.carrier(weight, time_s);
                detail::apply(&detail.effects(spots, layout, grid, &carrier), &mut all, layout);
            }
        }
        all
    }

    /// Returns what has carried the detail at a moment.
    fn carrier(&self, weight: f64, time_s: f64) -> Carrier<'_> {
        match (&self.flow, self.detail.wind) {
            (Some(([from, to], life_s)), _) => {
                Carrier::Flow(Flow { winds: [from, to], weight, life_s: *life_s, time_s })
            }
            (None, Wind::Given(wind)) => Carrier::Evenly(wind, time_s),
            // No detail is there to be carried.
            (None, Wind::OfFile) => Carrier::NONE,
        }
    }
}

/// Returns a blob at `weight` of the way from one step to another, with `share` of the mass in
/// between. Place, widths and the mass before that are linear.
fn between(from: &WeatherBlob, to: &WeatherBlob, weight: f64, share: f64) -> WeatherBlob {
    let mix = |a: f64, b: f64| a + weight * (b - a);
    let mut blob = WeatherBlob {
        position: from.position.lerp(to.position, weight),
        sigma_xy: mix(from.sigma_xy, to.sigma_xy),
        sigma_z: mix(from.sigma_z, to.sigma_z),
        kappa: 1.0,
    };
    blob.kappa = share * mix(from.mass(), to.mass()) / blob.mass();
    blob
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_come_and_go_evenly_by_hand() {
        // From nothing to a depth of 9.9: √(0.1 · 10) − 0.1 = 0.9 halfway, where linear is 4.95.
        assert!((deepening([0.0, 9.9], 0.5) - 0.9 / 4.95).abs() < 1e-12);
        assert!((deepening([9.9, 0.0], 0.5) - 0.9 / 4.95).abs() < 1e-12);
        // Thin cells are nearly linear, and ends are exact.
        assert!((deepening([1e-4, 3e-4], 0.5) - 1.0).abs() < 1e-3);
        for weight in [0.0, 1.0] {
            assert!((deepening([2.0, 7.0], weight) - 1.0).abs() < 1e-12);
        }
        assert_eq!((deepening([0.0; 2], 0.3), deepening([0.0, 5.0], 0.0)), (1.0, 1.0));
        assert!((deepening([2000.0, 1900.0], 0.5) - 1.0).abs() < 1e-3);
    }
}
