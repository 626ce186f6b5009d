//! Keys of a `[[cloud]]` whose particles come from a disc (model.md §2).

use super::air::{BASE, Base, read_base};
use super::key::{Keys, keys};
use super::motion::read_position;
use super::spec::{choice, integer, number};
use crate::error::Result;
use crate::io::bounds::{AMOUNT, Bounds, DIVISOR, SHARE};
use crate::io::document::section::Section;
use crate::model::air::Air;
use crate::model::disc::{Condensation, Dilution, Disc, MAX_SPREAD, MIN_FADE};

const SPREAD: Bounds = Bounds::Within(0.0, MAX_SPREAD);
const FADE: Bounds = Bounds::Within(MIN_FADE, 1.0);

/// Keys of a disc beside those of every cloud.
pub const DISC_KEYS: [Keys; 3] = [DISC, CONDENSATION, BASE];

keys! { DISC: pub fn read_disc(s, air: &Air) -> Disc { Disc;
    /// Particles at a time.
    n_particles ["particles"]: integer(1000, 0, u32::MAX);
    /// Radius of the disc.
    radius: number(1.0, AMOUNT), "unit";
    /// Period after which a new particle takes the place of each one.
    period_s ["lifetime_s"]: number(20.0, DIVISOR), "s";
    /// Share of the period by which lifetimes may be shorter.
    life_spread ["lifetime_spread"]: number(0.3, SPREAD);
    /// Mean σ at birth.
    sigma: number(0.3, DIVISOR), "unit";
    /// Share by which σ at birth varies on either side.
    sigma_spread: number(0.3, SPREAD);
    /// Optical depth through the centre of a particle of mean σ at birth.
    optical_depth: number(1.0, AMOUNT);
    /// Mean excess temperature at birth.
    warmth ["warmth_k"]: number(1.0, AMOUNT), "K";
    /// Share by which the excess temperature varies on either side.
    warmth_spread: number(0.3, SHARE);
    /// Share by which the rim of the disc is less warm than its centre.
    core ["warmth_core"]: number(0.5, SHARE);
    /// Speed of rise for each kelvin.
    buoyancy: number(0.5, AMOUNT), "unit/(s K)";
    /// Time in which excess temperature and speeds fall to 1/e.
    cooling_s: number(8.0, DIVISOR), "s";
    /// Greatest horizontal speed at birth.
    outflow: number(0.1, AMOUNT), "unit/s";
    /// Share α of the rise by which the radius of a particle grows.
    entrainment: number(0.2, AMOUNT);
    /// Quantity that a growing particle keeps: its mass, its optical depth, or its extinction.
    dilution: choice("mass", &Dilution::NAMES);
    /// Share of its life in which a particle fades in.
    fade_in: number(0.2, FADE);
    /// Share of its life in which a particle fades out.
    fade_out: number(0.4, FADE);
    condensation => condensation(s, air)?;
}}

struct Law {
    over: f64,
    base: Base,
    lift: f64,
}

keys! { CONDENSATION: fn law(s, air: &Air) -> Law { Law;
    /// Height over which a particle comes to its whole extinction.
    over ["base_over"]: number(0.5, DIVISOR), "unit";
    base => read_base(s)?;
    /// Height by which a particle condenses higher for each kelvin that it is warmer. Where `base`
    /// is "lcl", the default is the air's.
    lift ["base_lift"]: number(0.0, AMOUNT), "unit/K" => |lift| {
        let is_of_air = read_base(s)? == Base::Condensation;
        if is_of_air { lift.or(air.lift()) } else { lift }.take(s, "base_lift")
    };
}}

fn condensation(s: &mut Section, air: &Air) -> Result<Option<Condensation>> {
    let Law { over, base, lift } = law(s, air)?;
    // The base is a height of the scene; the law counts from the disc.
    let y = read_position(s)?.y;
    Ok(base.height(air).map(|base| Condensation { base: base - y, over, lift }))
}
