//! The discs that particles come from, at a frame's time (docs/model.md §2).

use glam::DVec3;

use crate::layout::record;
use crate::model::cloud::Group;
use crate::model::disc::{Cycle, Disc};

record! {
    /// The law of a disc's particles, in lengths that a whole period makes of speeds, and the time.
    pub struct DiscRecord {
        /// The group's centre relative to the disc's.
        center: [f32; 3],
        radius: f32,
        /// Wind · L.
        drift: [f32; 3],
        /// Greatest v T: what outflow covers in the end.
        outflow: f32,
        sigma: f32,
        sigma_spread: f32,
        /// b θ̄ T: what a particle of mean warmth rises in the end.
        rise: f32,
        warmth_spread: f32,
        core: f32,
        life_spread: f32,
        /// L/T.
        cooling: f32,
        /// Growth of σ by rise.
        growth: f32,
        kappa: f32,
        /// One over the shares of a life.
        inv_fade_in: f32,
        inv_fade_out: f32,
        base: f32,
        /// One over the height in which particles condense; 0: they always have.
        inv_over: f32,
        /// How much higher a particle of mean warmth condenses at birth.
        lift: f32,
        /// k of κ ∝ σ^−k: 0, 1 or 3.
        dilution: u32,
        /// Philox key.
        seed: u32,
        /// The disc's first particle in the buffer.
        i_first: u32,
        n_particles: u32,
        /// Time: (generation + phase/2³²) L.
        generation: u32,
        phase: u32,
    }
}

impl DiscRecord {
    /// `group`: the disc's, of a cloud of `seed` in `wind`.
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
