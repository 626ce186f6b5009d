//! Counts of what takes time in some work.

use std::iter::Sum;
use std::ops::{Add, Mul};

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

/// Amounts of what takes time. They are f64 because they exceed 2⁵³ and are multiplied by shares.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, Pod, Zeroable)]
#[serde(deny_unknown_fields)]
#[repr(C)]
pub struct Amounts {
    /// Frames or samples, each of which takes some time whatever it shows.
    #[serde(default)]
    pub steps: f64,
    /// Particles, times the steps in which they are moved, sorted and drawn.
    pub particle_steps: f64,
    /// Cells of the density grid that particles add to and that light rays read.
    #[serde(default)]
    pub cells: f64,
    /// Samples of pixels: one for the background, and one for each layer of blobs over it.
    pub pixel_samples: f64,
    /// Pairs of facets that exchange light, counted once and once more for every rectangle that may
    /// occlude them.
    pub facet_pairs: f64,
    /// Times that the textures of a scene are made.
    #[serde(default)]
    pub textures: f64,
}

impl Amounts {
    /// The number of different amounts.
    pub const N: usize = 6;

    /// Returns all amounts in the order of their fields.
    pub fn to_array(self) -> [f64; Amounts::N] {
        bytemuck::cast(self)
    }
}

impl Add for Amounts {
    type Output = Amounts;

    fn add(self, other: Amounts) -> Amounts {
        let (ours, theirs) = (self.to_array(), other.to_array());
        bytemuck::cast(std::array::from_fn::<f64, { Amounts::N }, _>(|i| ours[i] + theirs[i]))
    }
}

impl Mul<f64> for Amounts {
    type Output = Amounts;

    fn mul(self, factor: f64) -> Amounts {
        bytemuck::cast(self.to_array().map(|amount| amount * factor))
    }
}

impl Sum for Amounts {
    fn sum<I: Iterator<Item = Amounts>>(all: I) -> Amounts {
        all.fold(Amounts::default(), Add::add)
    }
}
