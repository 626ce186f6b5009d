//! The blobs between two steps, or of one step alone. They are laid out once; any moment is then
//! one interpolation a blob.

use super::grid::Grid;
use super::particles::{Layout, WeatherBlob};

/// The clouds of a step.
#[derive(Debug, Clone, Copy)]
pub struct StepClouds<'a> {
    /// Grid of the step.
    pub grid: &'a Grid,
    /// Extinction of every cell, m⁻¹.
    pub extinction: &'a [f64],
}

/// Blobs of two neighbouring steps, or of one step.
#[derive(Debug, Clone, PartialEq)]
pub struct Interval {
    from: Vec<WeatherBlob>,
    /// `None` for a single step.
    to: Option<Vec<WeatherBlob>>,
}

impl Interval {
    /// Places the blobs of `layout` for a step and the next one on a grid of the same shape, or for
    /// a step alone.
    pub fn laid_out(layout: &Layout, a: StepClouds, b: Option<StepClouds>) -> Self {
        Interval {
            from: layout.blobs(a.grid, a.extinction),
            to: b.map(|b| layout.blobs(b.grid, b.extinction)),
        }
    }

    /// Returns the number of blobs.
    pub fn len(&self) -> usize {
        self.from.len()
    }

    /// Returns whether there are no blobs.
    pub fn is_empty(&self) -> bool {
        self.from.is_empty()
    }

    /// Returns a blob at `weight` of the way from the first step to the second. Place, widths and
    /// mass are linear in it, so that the clouds' mass is, too.
    pub fn blob(&self, i: usize, weight: f64) -> WeatherBlob {
        let from = self.from[i];
        let Some(to) = self.to.as_ref().map(|to| to[i]).filter(|_| weight != 0.0) else {
            return from;
        };
        let mix = |a: f64, b: f64| a + weight * (b - a);
        let mut blob = WeatherBlob {
            position: from.position.lerp(to.position, weight),
            sigma_xy: mix(from.sigma_xy, to.sigma_xy),
            sigma_z: mix(from.sigma_z, to.sigma_z),
            kappa: 1.0,
        };
        blob.kappa = mix(from.mass(), to.mass()) / blob.mass();
        blob
    }
}
