//! Table `[lighting]`.

use super::key::{Keys, keys, read_table};
use super::spec::{Spec, choice, flag, integer, number, one_of, pair};
use crate::error::Result;
use crate::io::bounds::{Bounds, GREATEST_EXPONENT, SHARE};
use crate::io::document::section::Section;
use crate::model::basis::{MAX_BASES, Sampling};
use crate::model::grid::{MAX_CELLS, MAX_MARCH_STEPS, min_step};
use crate::model::scene::{
    DiffusionSettings, FacetCount, Gather, LightBudget, Lighting, LightingMode, MAX_BOUNCE_CELLS,
    MAX_BOUNCE_ORDER, MAX_BOUNCES, MAX_CYCLES, MAX_OCTAVES, MAX_PAIR_LEVELS, Octaves, Pairs,
};
use crate::model::sums::{Precision, Summation, Sums};

/// Cutoff cells of the density grid: with fewer the margins leave next to no grid.
const MIN_CELLS: u32 = 8;

fn layers() -> Spec<Option<u32>> {
    let numbers = integer(MIN_CELLS, MIN_CELLS, MAX_CELLS).map(Some);
    one_of("auto", [("auto".into(), None)], Some(numbers))
}

fn facet_count() -> Spec<FacetCount> {
    let numbers = integer(0, 0, u32::MAX).map(|n| match n {
        0 => FacetCount::Every,
        n => FacetCount::AtMost(n),
    });
    one_of("auto", [("auto".into(), FacetCount::Auto)], Some(numbers))
}

keys! { LIGHTING: fn lighting(s, of_materials: &[f64]) -> Lighting { Lighting;
    /// How light is computed. "none": particles have their colours as given. "first": the first
    /// reflection, C (15); "two-reflection": and the second, C (16). In the others clouds are a
    /// medium (model.md, 18). Light is scattered once in "single", "similarity" (without what goes
    /// forward) and "octaves", and in "diffusion" many times. "auto" takes the mode, grid and
    /// bounces nearest to transport within budget_ms and budget_error. Without a budget these take
    /// no longer than "first" on this device.
    mode: choice("two-reflection", &LightingMode::NAMES);
    /// Cells along the longest axis of the density grid.
    grid: integer(64, MIN_CELLS, MAX_CELLS);
    /// Layers of the grid's cells, two at each end being margin: at most `grid`, odd where that is
    /// odd, else even. With "auto" balls have cubes. Other blobs have cells that are at most as
    /// high as wide and as flat as the blobs are, in 16 layers or more.
    layers: layers();
    /// Step of the march through the density grid toward a light.
    step: number(1.0, Bounds::Within(0.05, 16.0)), "cell";
    /// Share g of the optical depth that does not weaken light on its way through a cloud.
    forward: number(0.85, SHARE);
    /// Functions of the BRDF basis N_b: the diffuse one and N_b − 1 lobes.
    bases: integer(8, 1, MAX_BASES);
    /// Spacing of the exponents that the basis is made from.
    sampling: choice("log", &Sampling::NAMES);
    /// Range of exponents n_s that the basis is made for. Without it, the range is widened to the
    /// exponents of the materials.
    exponents: pair([1.0, 256.0], Bounds::Within(0.0, GREATEST_EXPONENT))
        => |range| exponents(s, range, of_materials);
    /// How the second reflection is gathered: from every facet, from a tree of clusters, or by
    /// whichever is faster at the number of facets.
    gather: choice("auto", &Gather::NAMES);
    /// Share of its distance above which the radius of a cluster opens it.
    theta: number(0.4, Bounds::Within(0.0, 2.0));
    /// Most facets of each cloud; 0: one for each particle. With "auto" a cloud has at most 4,096
    /// with mode "two-reflection", and 262,144 with the others.
    facets_per_cloud: facet_count();
    pairs => pairs(s)?;
    sums => sums(s)?;
    /// Angular radius of directional lights, for the reference "transport". The default is the
    /// sun's.
    sun_radius ["sun_radius_deg"]: number(0.27, Bounds::Within(0.01, 30.0)).map(f64::to_radians),
        "degree";
    octaves => octaves(s)?;
    diffusion => diffusion(s)?;
    budget => budget(s)?;
}}

keys! { OCTAVES: fn octaves(s) -> Octaves { Octaves;
    /// Terms of mode "octaves".
    n ["octaves"]: integer(8, 1, MAX_OCTAVES);
    /// Light of an octave over that of the one before.
    light ["octave_light"]: number(0.5, SHARE);
    /// Optical depth of an octave over that of the one before.
    depth ["octave_depth"]: number(0.7, SHARE);
    /// Mean cosine of an octave's phase function over that of the one before.
    phase ["octave_phase"]: number(0.5, SHARE);
}}

keys! { DIFFUSION: fn diffusion(s) -> DiffusionSettings { DiffusionSettings;
    /// Cycles of the multigrid solver of mode "diffusion". Each leaves about an eighth of the error
    /// of the one before.
    cycles ["diffusion_cycles"]: integer(2, 1, MAX_CYCLES);
    /// Number of bounces of mode "diffusion": times that cells gather light from all others, after
    /// diffusion.
    bounces: integer(0, 0, MAX_BOUNCES);
    /// Edge of the cells that bounces lead between, in cells of the grid. With twice the edge,
    /// light takes a sixteenth of the steps from cell to cell.
    bounce_cells: integer(2, 1, MAX_BOUNCE_CELLS);
    /// Order up to which bounces have the phase function. 2 is nearer to transport where cells are
    /// thin, and 1 where they are deep.
    bounce_order: integer(2, 1, MAX_BOUNCE_ORDER);
    /// Whether the light of mode "diffusion" changes inside of each blob, as it does in the clouds
    /// around it.
    slopes: flag(true);
}}

keys! { BUDGET: fn budget(s) -> LightBudget { LightBudget;
    /// Greatest device time of a frame with mode "auto"; 0: any.
    ms ["budget_ms"]: number(0.0, Bounds::Within(0.0, 1e9)).map(given), "ms";
    /// Greatest error of mode "auto" against transport, over pixels of cloud by their mean; 0: any.
    error ["budget_error"]: number(0.0, Bounds::Within(0.0, 1e3)).map(given);
}}

fn given(budget: f64) -> Option<f64> {
    Some(budget).filter(|budget| *budget > 0.0)
}

keys! { PAIRS: fn pairs(s) -> Pairs { Pairs;
    /// Share of its distance above which the width of an emitter quarters it.
    size ["pair_size"]: number(0.5, Bounds::Within(0.01, 100.0));
    /// Most times that an emitter is quartered.
    levels ["pair_levels"]: integer(6, 0, MAX_PAIR_LEVELS);
    /// Most steps of the march through the density grid between two facets.
    steps ["pair_steps"]: integer(16, 1, MAX_MARCH_STEPS);
}}

keys! { SUMS: fn sums(s) -> Sums { Sums;
    /// How the sums of the second reflection are added up.
    summation: choice("plain", &Summation::NAMES);
    /// Precision of these sums.
    precision: choice("f32", &Precision::NAMES);
}}

/// Keys of `[lighting]`.
pub const KEYS: [Keys; 6] = [LIGHTING, PAIRS, SUMS, OCTAVES, DIFFUSION, BUDGET];

/// Reads `[lighting]`. `of_materials` are the exponents n_s of the scene's materials.
pub fn read_lighting(root: &mut Section, of_materials: &[f64]) -> Result<Lighting> {
    read_table(root, "lighting", &KEYS, |s| {
        let lighting = lighting(s, of_materials)?;
        let (least, step, grid) = (min_step(lighting.grid), lighting.step, lighting.grid);
        if step >= least {
            return Ok(lighting);
        }
        let what = format!(
            "expected at least {least:.4} cells where grid = {grid} (a march takes \
             {MAX_MARCH_STEPS} steps at most), found {step}"
        );
        Err(s.fault("step", what))
    })
}

/// Reads the range of n_s. A range that is given must hold every material's exponent; the default
/// is widened to them.
fn exponents(s: &mut Section, range: Spec<[f64; 2]>, of_materials: &[f64]) -> Result<[f64; 2]> {
    let [low, high] = range.take(s, "exponents")?;
    if !s.has("exponents") {
        let low = of_materials.iter().copied().fold(low, f64::min);
        let high = of_materials.iter().copied().fold(high, f64::max);
        s.record("exponents", [low, high].into_iter().collect());
        return Ok([low, high]);
    }
    let outside = of_materials.iter().find(|ns| !(low..=high).contains(*ns));
    let what = match outside {
        _ if low > high => format!("expected [least, greatest], found [{low}, {high}]"),
        Some(ns) => format!("a material's ns = {ns} lies outside [{low}, {high}]"),
        None => return Ok([low, high]),
    };
    Err(s.fault("exponents", what))
}
