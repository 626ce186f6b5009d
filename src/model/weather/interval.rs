//! The blobs between two steps, or of one step alone. They are laid out once; any moment is then
//! one interpolation a blob.

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
    detail: Detail,
    /// The effects of the detail, where no wind changes them.
    still: Option<Vec<Effect>>,
    /// `None` for a single step.
    to: Option<Vec<WeatherBlob>>,
}

impl Interval {
    /// Places the blobs of `layout` for a step and the next one on a grid of the same shape, or for
    /// a step alone.
    pub fn laid_out(
        layout: &Layout,
        a: &StepClouds,
        b: Option<&StepClouds>,
        detail: Detail,
    ) -> Self {
        let blobs = |step: &StepClouds| layout.blobs(&step.grid, &step.extinction);
        let is_still = detail.wind == DVec3::ZERO;
        Interval {
            from: blobs(a),
            to: b.map(blobs),
            still: is_still.then(|| detail.effects(layout, &a.grid, 0.0)),
            layout: layout.clone(),
            grid: a.grid.clone(),
            detail,
        }
    }

    /// Returns all blobs at `weight` of the way, with the detail that they have at a time.
    pub fn blobs(&self, weight: f64, time_s: f64) -> Vec<WeatherBlob> {
        let mut all: Vec<WeatherBlob> =
            (0..self.from.len()).filter_map(|i| self.blob(i, weight)).collect();
        let Interval { layout, grid, detail, still, .. } = self;
        match still {
            Some(effects) => detail::apply(effects, &mut all, layout),
            None => detail::apply(&detail.effects(layout, grid, time_s), &mut all, layout),
        }
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
