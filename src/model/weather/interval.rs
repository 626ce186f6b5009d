//! The blobs between two steps, or of one step alone. They are laid out once; any moment is then
//! one interpolation a blob.

use std::sync::OnceLock;

use glam::DVec3;

use super::detail::{self, Detail, Effect};
use super::grid::Grid;
use super::particles::{Layout, WeatherBlob};

/// The clouds of a step.
#[derive(Debug, Clone)]
pub struct StepClouds {
    /// Grid of the step.
    pub grid: Grid,
    /// Extinction of every cell, m⁻¹.
    pub extinction: Vec<f64>,
}

/// Blobs of two neighbouring steps, or of one step.
#[derive(Debug, Clone, PartialEq)]
pub struct Interval {
    from: Vec<WeatherBlob>,
    layout: Layout,
    grid: Grid,
    /// The effects of the first detail that was asked for and has no wind.
    still: OnceLock<(Detail, Vec<Effect>)>,
    /// `None` for a single step.
    to: Option<Vec<WeatherBlob>>,
}

impl Interval {
    /// Places the blobs of `layout` for a step and the next one on a grid of the same shape, or for
    /// a step alone.
    pub fn laid_out(layout: &Layout, a: &StepClouds, b: Option<&StepClouds>) -> Self {
        let blobs = |step: &StepClouds| layout.blobs(&step.grid, &step.extinction);
        let (layout, grid) = (layout.clone(), a.grid.clone());
        Interval { from: blobs(a), to: b.map(blobs), layout, grid, still: OnceLock::new() }
    }

    /// Returns all blobs at `weight` of the way, with the detail that they have at a time.
    pub fn blobs(&self, weight: f64, detail: &Detail, time_s: f64) -> Vec<WeatherBlob> {
        let mut all: Vec<WeatherBlob> =
            (0..self.from.len()).filter_map(|i| self.blob(i, weight)).collect();
        let effects = || detail.effects(&self.layout, &self.grid, time_s);
        if detail.wind != DVec3::ZERO {
            detail::apply(&effects(), &mut all, &self.layout);
            return all;
        }
        let (of, kept) = self.still.get_or_init(|| (*detail, effects()));
        let made = if of == detail { None } else { Some(effects()) };
        detail::apply(made.as_ref().unwrap_or(kept), &mut all, &self.layout);
        all
    }

    /// Returns a blob at `weight` of the way from the first step to the second, or `None` past the
    /// last blob. Place, widths and mass are linear in it, so that the clouds' mass is, too.
    pub fn blob(&self, i: usize, weight: f64) -> Option<WeatherBlob> {
        let from = *self.from.get(i)?;
        let Some(to) = self.to.as_ref().map(|to| to[i]).filter(|_| weight != 0.0) else {
            return Some(from);
        };
        let mix = |a: f64, b: f64| a + weight * (b - a);
        let mut blob = WeatherBlob {
            position: from.position.lerp(to.position, weight),
            sigma_xy: mix(from.sigma_xy, to.sigma_xy),
            sigma_z: mix(from.sigma_z, to.sigma_z),
            kappa: 1.0,
        };
        blob.kappa = mix(from.mass(), to.mass()) / blob.mass();
        Some(blob)
    }
}
