//! Reflection by a material, C (11): its value, and directions drawn as it reflects.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;

use crate::model::material::Brdf;

/// Returns f for light from the unit vector `from` reflected along `toward`; only its diffuse part
/// where either is behind. *Source*: C (11).
pub fn reflectance(brdf: &Brdf, normal: DVec3, from: DVec3, toward: DVec3) -> DVec3 {
    let diffuse = brdf.kd * FRAC_1_PI;
    if brdf.ks == DVec3::ZERO || normal.dot(from) <= 0.0 || normal.dot(toward) <= 0.0 {
        return diffuse;
    }
    // 1 − cos γ = |n − h|²/2 keeps its digits where γ is small.
    let w = 0.5 * (normal - (from + toward).normalize_or_zero()).length_squared();
    diffuse + brdf.ks * Brdf::lobe(brdf.ns, w)
}

/// Returns the share of directions drawn from the lobe; none for an eye behind. Such an eye sees no
/// lobe, and half vectors about the normal would give directions that `density` does not cover.
fn lobe_share(brdf: &Brdf, normal: DVec3, toward: DVec3) -> f64 {
    let (d, s) = (brdf.kd.max_element(), brdf.ks.max_element());
    if s > 0.0 && normal.dot(toward) > 0.0 { s / (d + s) } else { 0.0 }
}

/// Draws a direction about the normal by cos θ/π, or about the mirror direction by a half vector of
/// density (n_s+1)/2π cos^{n_s} γ.
pub fn direction(brdf: &Brdf, normal: DVec3, toward: DVec3, u: [f64; 4]) -> DVec3 {
    // 1 − u is never 0.
    let (x, phi) = (1.0 - u[0], TAU * u[1]);
    let glossy = u[2] < lobe_share(brdf, normal, toward);
    let power = if glossy { 1.0 / (brdf.ns + 1.0) } else { 0.5 };
    let log = power * x.ln();
    // cos γ = x^power; sin²γ = 1 − x^{2 power} without cancellation.
    let (cosine, sine) = (log.exp(), (-(2.0 * log).exp_m1()).max(0.0).sqrt());
    let (a, b) = normal.any_orthonormal_pair();
    let h = cosine * normal + sine * (phi.cos() * a + phi.sin() * b);
    if glossy { (2.0 * toward.dot(h) * h - toward).normalize_or_zero() } else { h }
}

/// Returns the probability density per solid angle of a drawn direction.
pub fn density(brdf: &Brdf, normal: DVec3, toward: DVec3, direction: DVec3) -> f64 {
    let share = lobe_share(brdf, normal, toward);
    let diffuse = (1.0 - share) * normal.dot(direction) * FRAC_1_PI;
    if share == 0.0 {
        return diffuse;
    }
    let h = (direction + toward).normalize_or_zero();
    let w = 0.5 * (normal - h).length_squared();
    let half = Brdf::lobe(brdf.ns, w) * (brdf.ns + 1.0) / (brdf.ns + 2.0);
    diffuse + share * half / (4.0 * toward.dot(h))
}
