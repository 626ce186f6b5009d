//! The record of a disc of particles at a frame's time (model.md §2).

use glam::DVec3;

use crate::layout::record;
use crate::model::cloud::Group;
use crate::model::disc::{Cycle, Disc};

record! {
    /// The law of a disc's particles, and the time. Speeds are lengths per period L of the disc.
    pub struct DiscRecord {
        /// The group's centre relative to the disc's, scene units.
        center: [f32; 3],
        /// Radius of the disc.
        radius: f32,
        /// Displacement by the wind in a period: wind · L.
        drift: [f32; 3],
        /// Greatest displacement by the outflow, v T.
        outflow: f32,
        /// Mean σ at birth.
        sigma: f32,
        /// Greatest relative deviation of σ at birth.
        sigma_spread: f32,
        /// Rise of a particle of mean warmth in the end, b θ̄ T.
        rise: f32,
        /// Greatest relative deviation of the warmth.
        warmth_spread: f32,
        /// Share of the warmth that particles at the rim lack.
        core: f32,
        /// Greatest share of the period by which a life is shorter.
        life_spread: f32,
        /// Period over cooling time, L/T.
        cooling: f32,
        /// Growth of σ per length of rise.
        growth: f32,
        /// κ at birth.
        kappa: f32,
        /// One over the share of a life in which a particle fades in.
        inv_fade_in: f32,
        /// One over the share of a life in which a particle fades out.
        inv_fade_out: f32,
        /// Height of the condensation level over the disc.
        base: f32,
        /// One over the height range of condensation; 0: all particles are condensed.
        inv_over: f32,
        /// Additional height at which a particle of mean warmth condenses at birth.
        lift: f32,
        /// Exponent k of κ ∝ σ^−k: 0, 1 or 3.
        dilution: u32,
        /// Philox key.
        seed: u32,
        /// The disc's first particle in the buffer.
        i_first: u32,
        /// Number of particles.
        n_particles: u32,
        /// Whole periods of the time, (generation + phase/2³²) L.
        generation: u32,
        /// Fraction of a period in 2⁻³².
        phase: u32,
    }
}

impl DiscRecord {
    /// Returns the record of `disc`, whose particles are `group`, in a cloud of `seed` and `wind`
    /// (scene units per second), at `turn`.
    pub fn new(disc: &Disc, group: &Group, seed: u32, wind: DVec3, turn: Cycle) -> Self {
        let condensation = disc.condensation;
        let of =
            |f: fn(&crate::model::disc::Condensation) -> f64| condensation.as_ref().map_or(0.0, f);
        DiscRecord {
            center: group.center.as_vec3().to_array(),
            radius: disc.radius as f32,
            drift: (wind * disc.period_s).as_vec3().to_array(),
            outflow: (disc.outflow * disc.cooling_s) as f32,
            sigma: disc.sigma as f32,
            sigma_spread: disc.sigma_spread as f32,
            rise: disc.rise() as f32,
            warmth_spread: disc.warmth_spread as f32,
            core: disc.core as f32,
            life_spread: disc.life_spread as f32,
            cooling: (disc.period_s / disc.cooling_s) as f32,
            growth: disc.growth() as f32,
            kappa: disc.kappa() as f32,
            inv_fade_in: (1.0 / disc.fade_in) as f32,
            inv_fade_out: (1.0 / disc.fade_out) as f32,
            base: of(|c| c.base) as f32,
            inv_over: of(|c| 1.0 / c.over) as f32,
            lift: (of(|c| c.lift) * disc.warmth) as f32,
            dilution: disc.dilution.exponent(),
            seed,
            i_first: group.i_first,
            n_particles: group.n_particles,
            generation: turn.generation,
            phase: turn.phase,
        }
    }
}
