//! A cloud's keys where its particles come from a disc (docs/model.md §2).

use glam::DVec3;

use super::magnitude::{AMOUNT, COORDINATE, DIVISOR};
use super::scene_air::{Base, read_base};
use super::toml_section::{Bounds, Section};
use crate::error::Result;
use crate::model::air::Air;
use crate::model::disc::{Condensation, Dilution, Disc, MAX_SPREAD, MIN_FADE};

/// Without growth: the particles grow themselves.
pub const KEYS: &[&str] = &[
    "from",
    "particles",
    "radius",
    "lifetime_s",
    "lifetime_spread",
    "sigma",
    "sigma_spread",
    "optical_depth",
    "warmth_k",
    "warmth_spread",
    "warmth_core",
    "buoyancy",
    "cooling_s",
    "outflow",
    "entrainment",
    "dilution",
    "fade_in",
    "fade_out",
    "base",
    "base_over",
    "base_lift",
    "material",
    "facing",
    "texture",
    "texture_strength",
    "position",
    "wind",
    "gust",
    "gust_length",
    "gust_period_s",
    "gust_waves",
    "seed",
];

const SPREAD: Bounds = Bounds::Within(0.0, MAX_SPREAD);
const SHARE: Bounds = Bounds::Within(0.0, 1.0);
const FADE: Bounds = Bounds::Within(MIN_FADE, 1.0);

pub fn read_disc(s: &mut Section, air: &Air) -> Result<Disc> {
    Ok(Disc {
        n_particles: s.u32("particles", 1000, 0, u32::MAX)?,
        radius: s.f64("radius", 1.0, AMOUNT)?,
        period_s: s.f64("lifetime_s", 20.0, DIVISOR)?,
        life_spread: s.f64("lifetime_spread", 0.3, SPREAD)?,
        sigma: s.f64("sigma", 0.3, DIVISOR)?,
        sigma_spread: s.f64("sigma_spread", 0.3, SPREAD)?,
        optical_depth: s.f64("optical_depth", 1.0, AMOUNT)?,
        warmth: s.f64("warmth_k", 1.0, AMOUNT)?,
        warmth_spread: s.f64("warmth_spread", 0.3, SHARE)?,
        core: s.f64("warmth_core", 0.5, SHARE)?,
        buoyancy: s.f64("buoyancy", 0.5, AMOUNT)?,
        cooling_s: s.f64("cooling_s", 8.0, DIVISOR)?,
        outflow: s.f64("outflow", 0.1, AMOUNT)?,
        entrainment: s.f64("entrainment", 0.2, AMOUNT)?,
        dilution: s.choice("dilution", "mass", &Dilution::NAMES, &[])?,
        fade_in: s.f64("fade_in", 0.2, FADE)?,
        fade_out: s.f64("fade_out", 0.4, FADE)?,
        condensation: read_condensation(s, air)?,
    })
}

fn read_condensation(s: &mut Section, air: &Air) -> Result<Option<Condensation>> {
    let over = s.f64("base_over", 0.5, DIVISOR)?;
    let base = read_base(s)?;
    // Of clouds whose base is the air's the lift is, too.
    let lift =
        s.f64("base_lift", if base == Base::Condensation { air.lift() } else { 0.0 }, AMOUNT)?;
    // Of the scene; the law counts from the disc.
    let y = s.vec3("position", DVec3::ZERO, COORDINATE)?.y;
    Ok(base.height(air).map(|base| Condensation { base: base - y, over, lift }))
}
