//! Settings of a scene's lighting.

use super::basis::Sampling;
use super::named::named;
use super::sums::Sums;

named! {
    /// How light is computed.
    pub enum LightingMode {
        /// Not at all: particles show their own colours.
        None = "none",
        /// The first reflection, C (15).
        First = "first",
        /// The first and the second reflection, C (15) and (16).
        TwoReflection = "two-reflection",
        /// Clouds as a medium that scatters light once.
        Single = "single",
        /// Once, in the medium that scatters alike without forward scattering.
        Similarity = "similarity",
        /// Once, in octaves of ever thinner media.
        Octaves = "octaves",
        /// Once, and all further scatterings by diffusion.
        Diffusion = "diffusion",
    }
}

impl LightingMode {
    /// Returns whether clouds are a medium that scatters (model.md §18), and not facets that
    /// reflect.
    pub fn is_medium(self) -> bool {
        match self {
            LightingMode::None | LightingMode::First | LightingMode::TwoReflection => false,
            LightingMode::Single
            | LightingMode::Similarity
            | LightingMode::Octaves
            | LightingMode::Diffusion => true,
        }
    }
}

named! {
    /// Method of the second reflection's gather.
    pub enum Gather {
        /// The faster one at the scene's number of facets.
        Auto = "auto",
        /// Every pair of facets.
        Exact = "exact",
        /// Clusters of facets, opened where they are large compared with their distance.
        Tree = "tree",
    }
}

/// The terms of "octaves" (model.md §18).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Octaves {
    /// n: number of terms.
    pub n: u32,
    /// a: light of a term over that of the term before.
    pub light: f64,
    /// b: optical depth, alike.
    pub depth: f64,
    /// c: mean cosine of the phase function, alike.
    pub phase: f64,
}

/// Settings of "diffusion" (model.md §18).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiffusionSettings {
    /// Cycles of the multigrid solver.
    pub cycles: u32,
    /// Bounces between the cells that follow.
    pub bounces: u32,
    /// The light changes linearly inside of each blob.
    pub slopes: bool,
}

/// Lighting settings of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lighting {
    /// How light is computed.
    pub mode: LightingMode,
    /// Number of cells along the density grid's longest axis.
    pub grid: u32,
    /// March step toward a light, in cells.
    pub step: f64,
    /// g: share of τ that light passes by scattering forward.
    pub forward: f64,
    /// N_b: number of bases, the diffuse one included (model.md §6).
    pub bases: u32,
    /// Spacing of the lobes that the basis is made from.
    pub sampling: Sampling,
    /// Range of n_s that the basis is made for.
    pub exponents: [f64; 2],
    /// Method of the second reflection's gather.
    pub gather: Gather,
    /// θ: radius over distance above which clusters are opened.
    pub theta: f64,
    /// Greatest number of facets of a cloud; `None` makes one facet a particle.
    pub facets_per_cloud: Option<u32>,
    /// Accuracy of pairs of facets.
    pub pairs: Pairs,
    /// Formation of long sums.
    pub sums: Sums,
    /// Angular radius of directional lights in the reference "transport", radians.
    pub sun_radius: f64,
    /// Terms of "octaves".
    pub octaves: Octaves,
    /// Settings of "diffusion".
    pub diffusion: DiffusionSettings,
}

impl Lighting {
    /// Returns whether the light changes inside of each blob.
    pub fn has_slopes(&self) -> bool {
        self.mode == LightingMode::Diffusion && self.diffusion.slopes
    }

    /// Returns whether bounces between cells follow diffusion.
    pub fn has_bounces(&self) -> bool {
        self.mode == LightingMode::Diffusion && self.diffusion.bounces > 0
    }
}

/// Greatest number of octaves.
pub const MAX_OCTAVES: u32 = 16;

/// Greatest number of cycles of the multigrid solver: what is left is rounding.
pub const MAX_CYCLES: u32 = 32;

/// Greatest number of bounces between cells: with the correction of each, many more than light
/// needs.
pub const MAX_BOUNCES: u32 = 64;

/// Greatest number of divisions of an emitter: it is 2¹⁶ times smaller then.
pub const MAX_PAIR_LEVELS: u32 = 16;

/// Accuracy with which a pair of facets is evaluated (model.md §7).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pairs {
    /// pair_size: an emitter is quartered while it is wider than this share of its distance.
    pub size: f64,
    /// Greatest number of divisions of an emitter.
    pub levels: u32,
    /// Greatest number of steps of the march through the density grid between two facets.
    pub steps: u32,
}
