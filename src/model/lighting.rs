//! Settings of a scene's lighting.

use super::basis::Sampling;
use super::named::named;
use super::overlap::SLICE;
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
        /// The one of [`RUNGS`] that a budget allows on the device.
        Auto = "auto",
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
            | LightingMode::Diffusion
            | LightingMode::Auto => true,
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
    /// Edge of the cells that bounces lead between, in cells of the grid.
    pub bounce_cells: u32,
    /// Order up to which they have the phase function.
    pub bounce_order: u32,
    /// The light changes linearly inside of each blob.
    pub slopes: bool,
}

/// Limits of the choice of "auto".
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightBudget {
    /// Greatest device time of a frame, ms.
    pub ms: Option<f64>,
    /// Greatest error against transport: root mean square over pixels of cloud, by their mean.
    pub error: Option<f64>,
}

/// A setting that "auto" may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rung {
    /// How light is computed.
    pub mode: LightingMode,
    /// Cells along the density grid's longest axis.
    pub grid: u32,
    /// Bounces of "diffusion".
    pub bounces: u32,
    /// Edge of the cells that they lead between, in cells of the grid.
    pub bounce_cells: u32,
    /// `draw.slice` where `draw.overlap` is "auto", and tiles are composed by slices then; `None`:
    /// thin.
    pub slice: Option<f64>,
    /// Error against transport of thin sprites, and of slices: the greatest of the scenes of
    /// docs/explanation/studies.md, "Clouds against transport", but weather, where all err more.
    pub errors: [f64; 2],
}

/// The settings that "auto" may take: those that no other one beats in time and error in most of
/// these scenes. Each costs more than the one before. In slices it is nearer to transport.
pub const RUNGS: [Rung; 8] = [
    rung(LightingMode::Similarity, 24, (0, 2), None, [1.01, 1.03]),
    rung(LightingMode::Diffusion, 16, (0, 2), None, [0.32, 0.31]),
    rung(LightingMode::Diffusion, 24, (0, 2), None, [0.25, 0.24]),
    rung(LightingMode::Diffusion, 32, (0, 2), None, [0.22, 0.22]),
    rung(LightingMode::Diffusion, 24, (2, 2), Some(3.0), [0.25, 0.19]),
    rung(LightingMode::Diffusion, 24, (4, 2), Some(3.0), [0.24, 0.16]),
    rung(LightingMode::Diffusion, 32, (4, 2), Some(3.0), [0.25, 0.13]),
    rung(LightingMode::Diffusion, 32, (2, 1), Some(SLICE), [0.23, 0.12]),
];

const fn rung(
    mode: LightingMode,
    grid: u32,
    (bounces, bounce_cells): (u32, u32),
    slice: Option<f64>,
    errors: [f64; 2],
) -> Rung {
    Rung { mode, grid, bounces, bounce_cells, slice, errors }
}

/// Number of facets of a cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FacetCount {
    /// One for each particle, up to a number that the mode lights in seconds on two cores.
    Auto,
    /// One for each particle.
    Every,
    /// At most so many, and at least one.
    AtMost(u32),
}

/// The most facets of a cloud with [`FacetCount::Auto`] where each gathers light from all others: a
/// gather of as many took 2.4 s on llvmpipe with two busy cores.
const MOST_GATHERED: u64 = 4096;
/// The same where each is lit by itself. Scenes of weather have up to 100,000 particles, each with
/// its facet.
const MOST_ALONE: u64 = 1 << 18;

impl FacetCount {
    /// Returns the number of facets of a cloud of `n` particles.
    pub fn of(self, n: u64, mode: LightingMode) -> u64 {
        n.min(match self {
            FacetCount::Every => n,
            FacetCount::AtMost(most) => u64::from(most.max(1)),
            FacetCount::Auto if mode == LightingMode::TwoReflection => MOST_GATHERED,
            FacetCount::Auto => MOST_ALONE,
        })
    }
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
    /// Number of facets of each cloud.
    pub facets_per_cloud: FacetCount,
    /// Layers of the grid's cells; `None`: by the clouds and their blobs.
    pub layers: Option<u32>,
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
    /// Budget of "auto".
    pub budget: LightBudget,
}

impl Lighting {
    /// Returns the settings with those of a rung.
    pub fn on(&self, rung: &Rung) -> Lighting {
        let Rung { mode, grid, bounces, bounce_cells, .. } = *rung;
        let diffusion = DiffusionSettings { bounces, bounce_cells, ..self.diffusion };
        Lighting { mode, grid, diffusion, ..*self }
    }

    /// Returns whether the light changes inside of each blob.
    pub fn has_slopes(&self) -> bool {
        self.mode == LightingMode::Diffusion && self.diffusion.slopes
    }

    /// Returns the order up to which diffuse light has the phase function: without bounces the
    /// first.
    pub fn order(&self) -> i32 {
        if self.has_bounces() { self.diffusion.bounce_order as i32 } else { 1 }
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

/// Greatest order up to which bounces have the phase function.
pub const MAX_BOUNCE_ORDER: u32 = 2;

/// Greatest edge of the cells that bounces lead between, in cells of the grid.
pub const MAX_BOUNCE_CELLS: u32 = 8;

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_cloud_has_more_facets_than_particles_or_than_its_mode_lights() {
        let [first, second] = [LightingMode::First, LightingMode::TwoReflection];
        for n in [0, 1, 4096, 4097, 1 << 18, (1 << 18) + 1, 10_000_000] {
            assert_eq!(FacetCount::Every.of(n, second), n);
            assert_eq!(FacetCount::AtMost(0).of(n, first), n.min(1));
            assert_eq!(FacetCount::AtMost(300).of(n, second), n.min(300));
            assert_eq!(FacetCount::Auto.of(n, second), n.min(4096));
            assert_eq!(FacetCount::Auto.of(n, first), n.min(262_144));
        }
    }

    #[test]
    fn in_slices_each_rung_is_nearer_to_transport_than_the_one_before() {
        for pair in RUNGS.windows(2) {
            assert!(pair[1].errors[1] < pair[0].errors[1], "{pair:?}");
            assert!(pair[1].slice.is_some() >= pair[0].slice.is_some());
        }
        assert!(RUNGS.iter().all(|rung| rung.mode.is_medium()));
    }
}
