//! The blobs of all moments between two steps, or of one step alone: laid out once, and then as
//! cheap as a mean of two numbers a blob.

use super::grid::Grid;
use super::particles::{Layout, WeatherBlob};

/// What a step says of its clouds.
#[derive(Debug, Clone, Copy)]
pub struct StepClouds<'a> {
    pub grid: &'a Grid,
    /// m⁻¹, a cell each.
    pub extinction: &'a [f64],
}

#[derive(Debug, Clone, PartialEq)]
pub struct Interval {
    from: Vec<WeatherBlob>,
    /// None where a step stands alone.
    to: Option<Vec<WeatherBlob>>,
}

impl Interval {
    /// From a step to the next one, on a grid of the same shape, or a step alone; `layout` stands
    /// for them, and maybe for more.
    pub fn laid_out(layout: &Layout, a: StepClouds, b: Option<StepClouds>) -> Self {
        Interval {
            from: layout.blobs(a.grid, a.extinction),
            to: b.map(|b| layout.blobs(b.grid, b.extinction)),
        }
    }

    pub fn len(&self) -> usize {
        self.from.len()
    }

    pub fn is_empty(&self) -> bool {
        self.from.is_empty()
    }

    /// A blob `weight` of the way from the first step to the second: place, widths and mass are
    /// linear in it, so that the clouds' mass is.
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
