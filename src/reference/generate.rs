//! Particles from boxes: P (1)–(11) and Fig. 1 in both forms, as in model.md §1 and passes.md
//! "generate".
//!
//! In: a box, its index within its cloud, the cloud's seed. Out: positions relative to the box's
//! centre (scene units), radii before `radius_scale`, σ and κ after it. `rounding.rs` bounds what
//! an f32 evaluation may differ.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

use crate::model::boxes::{BoxLaw, CloudBox, Form, MAX_ATTEMPTS, radius_factor, radius_shape};
use crate::model::cloud::{SIGMA_PER_RADIUS, Shape, box_kappa};
use crate::model::philox::{philox4x32_10, uniform};

/// A particle relative to its group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Generated {
    /// Position relative to the group's origin: the box's centre, or the centre of a particle
    /// list's bounds.
    pub position: DVec3,
    /// R of P (11), before `radius_scale`.
    pub radius: f64,
    /// σ along the first axis of its shape.
    pub sigma: f64,
    /// Its shape.
    pub shape: Shape,
    /// Peak extinction per unit length.
    pub kappa: f64,
    /// Number of attempts, the accepted one included; 0 for a particle that was given.
    pub n_attempts: u32,
    /// Whether all attempts failed and the last was folded into the box.
    pub folded: bool,
    /// Least [`decision_margin`] over the attempts; infinite without attempts.
    pub margin: f64,
}

impl Generated {
    /// A particle that no box generates, `position` relative to its group's centre.
    pub(super) fn given(position: DVec3, sigma: f64, shape: Shape, kappa: f64) -> Generated {
        Generated {
            position,
            radius: sigma / SIGMA_PER_RADIUS,
            sigma,
            shape,
            kappa,
            n_attempts: 0,
            folded: false,
            margin: f64::INFINITY,
        }
    }
}

/// Acceptance counts over some particles, model.md §1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Acceptance {
    /// Number of attempts.
    pub n_attempts: u64,
    /// Number of particles whose last attempt lay inside the box.
    pub n_accepted: u64,
    /// Number of particles that were folded.
    pub n_folded: u64,
}

impl Acceptance {
    /// Counts the attempts of `particles`.
    pub fn of(particles: &[Generated]) -> Acceptance {
        let n_attempts = particles.iter().map(|p| u64::from(p.n_attempts)).sum();
        let n_folded = particles.iter().filter(|p| p.folded).count() as u64;
        let n_made = particles.iter().filter(|p| p.n_attempts > 0).count() as u64;
        Acceptance { n_attempts, n_accepted: n_made - n_folded, n_folded }
    }

    /// Returns accepted over all attempts; `None` without attempts.
    pub fn rate(&self) -> Option<f64> {
        (self.n_attempts > 0).then(|| self.n_accepted as f64 / self.n_attempts as f64)
    }
}

/// Returns u₁…u₄ of one attempt: the words of Philox(key = (seed, box), counter = (particle,
/// attempt, 0, 0)).
pub fn uniforms(seed: u32, i_box: u32, i_particle: u32, attempt: u32) -> [f64; 4] {
    philox4x32_10([seed, i_box], [i_particle, attempt, 0, 0]).map(uniform)
}

/// Returns the offset from the box's centre that one attempt proposes, scene units. *Source*: P
/// (1)–(7).
pub fn offset(extent: DVec3, form: Form, u: [f64; 3]) -> DVec3 {
    // P (1)–(3).
    let spread = |u: f64, length: f64| match form {
        Form::Printed => u * length,
        Form::Centred => (2.0 * u - 1.0) * length,
    };
    let (x, y, z) = (spread(u[0], extent.x), spread(u[1], extent.y), spread(u[2], extent.z));
    // P (4): x takes Y and y takes X.
    let mut p_x = FRAC_PI_2 * (0.5 * y).sin();
    let mut p_y = FRAC_PI_2 * (0.5 * x).sin();
    let p_z = FRAC_PI_2 * (0.5 * z).sin();
    // P (5), in this order: the second line reads the new P_x.
    p_x += PI * (0.5 * p_x * z).sin();
    p_y += PI * (0.5 * p_x * z).sin();
    // P (6)–(7).
    let shifted = DVec3::new(x + p_x, y + p_y, z + p_z);
    0.5 * match form {
        Form::Printed => DVec3::new(shifted.x, shifted.z, shifted.z),
        Form::Centred => shifted,
    }
}

/// Returns whether `v` lies inside the box, faces included. *Source*: P, Fig. 1.
pub fn is_inside(v: DVec3, half: DVec3) -> bool {
    v.abs().cmple(half).all()
}

/// Returns how far the decision on offset `v` is from its opposite. Inside it is the distance to
/// the nearest face; outside it is the greatest excess of an axis, since all axes that exceed would
/// have to move in.
pub fn decision_margin(v: DVec3, half: DVec3) -> f64 {
    let out = v.abs() - half;
    // The same expression serves both: inside, every entry is negative and the greatest is the
    // nearest face.
    out.max_element().abs()
}

/// Mirrors `v` at ±`half` until it lies between (passes.md "generate").
pub fn fold(v: f64, half: f64) -> f64 {
    if half <= 0.0 {
        return 0.0;
    }
    let w = (v + half).rem_euclid(4.0 * half);
    if w <= 2.0 * half { w - half } else { 3.0 * half - w }
}

/// Returns the radius of a particle from its u₄, before `radius_scale`. *Source*: P (8)–(11).
pub fn radius(form: Form, radius_max: f64, u: f64) -> f64 {
    radius_factor(form, radius_max) * radius_shape(u * radius_max)
}

/// Generates particle `i_particle` of box `i_box`, the box's index within its cloud.
pub fn generate_particle(
    b: &CloudBox,
    i_box: u32,
    seed: u32,
    law: &BoxLaw,
    i_particle: u32,
) -> Generated {
    let half = 0.5 * b.extent;
    let (mut position, mut u4) = (DVec3::ZERO, 0.0);
    let (mut n_attempts, mut folded, mut margin) = (0, true, f64::INFINITY);
    while folded && n_attempts < MAX_ATTEMPTS {
        let [u1, u2, u3, u] = uniforms(seed, i_box, i_particle, n_attempts);
        (position, u4) = (offset(b.extent, law.form, [u1, u2, u3]), u);
        margin = margin.min(decision_margin(position, half));
        folded = !is_inside(position, half);
        n_attempts += 1;
    }
    if folded {
        let along = |i: usize| fold(position[i], half[i]);
        position = DVec3::new(along(0), along(1), along(2));
    }
    let radius = radius(law.form, b.radius_max, u4);
    Generated {
        position,
        radius,
        sigma: radius * law.radius_scale * SIGMA_PER_RADIUS,
        shape: Shape::BALL,
        kappa: box_kappa(b, law),
        n_attempts,
        folded,
        margin,
    }
}

/// Generates all particles of a box.
pub fn generate_box(b: &CloudBox, i_box: u32, seed: u32, law: &BoxLaw) -> Vec<Generated> {
    (0..b.n_particles).map(|i| generate_particle(b, i_box, seed, law, i)).collect()
}
