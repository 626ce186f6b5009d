//! The particles of a frame, as rows and as a list, from the device or from the reference in f64.

use glam::{DVec3, Vec3};
use serde::Serialize;

use super::stages::{cloud_of, draw};
use crate::error::Result;
use crate::frame::Stage;
use crate::layout::particle::{ParticleRecord, PlacedRecord};
use crate::model::cloud::{Particle, SIGMA_PER_RADIUS};
use crate::model::scene::Scene;
use crate::reference::Blob;
use crate::reference::picture::FrameReference;

/// A particle, in scene coordinates.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParticleRow {
    /// Number of the particle.
    pub index: usize,
    /// Number of its cloud.
    pub cloud: usize,
    /// Centre, x.
    pub x: f64,
    /// Centre, y.
    pub y: f64,
    /// Centre, z.
    pub z: f64,
    /// Radius.
    pub radius: f64,
    /// Standard deviation σ of its density.
    pub sigma: f64,
    /// Extinction at its centre.
    pub kappa: f64,
    /// Colour, red.
    pub r: f64,
    /// Colour, green.
    pub g: f64,
    /// Colour, blue.
    pub b: f64,
}

/// Returns the particles of a frame from the device, in scene coordinates.
///
/// # Errors
/// Fails if drawing the frame fails.
pub fn list(stage: &mut Stage, i_frame: u32) -> Result<Vec<Particle>> {
    let origin = draw(stage, i_frame)?.light_origin;
    let placed = stage.renderer.placed(&stage.device)?;
    let records = stage.renderer.generate_now(&stage.device)?.0;
    let of = |(p, r): (&PlacedRecord, &ParticleRecord)| Particle {
        position: Vec3::from(p.position).as_dvec3() + origin,
        sigma: f64::from(p.sigma),
        shape: r.shape(),
        kappa: f64::from(r.kappa),
        color: Vec3::from(r.color).as_dvec3(),
    };
    Ok(placed.iter().zip(&records).map(of).collect())
}

/// Returns the same from the reference.
///
/// # Errors
/// Fails if the scene has no such reference.
pub fn list_reference(scene: &Scene, i_frame: u32) -> Result<Vec<Particle>> {
    let truth = FrameReference::unlit(scene, scene.time.at(i_frame))?;
    let of = |(b, color): (&Blob, DVec3)| Particle {
        position: b.position + truth.state.light_origin,
        sigma: b.sigma,
        shape: b.shape,
        kappa: b.kappa,
        color,
    };
    Ok(truth.blobs.iter().zip(truth.colors.iter().copied()).map(of).collect())
}

/// Returns a row for each particle of a scene.
pub fn rows(scene: &Scene, particles: &[Particle]) -> Vec<ParticleRow> {
    let groups = scene.groups();
    let row = |(index, p): (usize, &Particle)| ParticleRow {
        index,
        cloud: cloud_of(&groups, index),
        x: p.position.x,
        y: p.position.y,
        z: p.position.z,
        radius: p.sigma / SIGMA_PER_RADIUS,
        sigma: p.sigma,
        kappa: p.kappa,
        r: p.color.x,
        g: p.color.y,
        b: p.color.z,
    };
    particles.iter().enumerate().map(row).collect()
}
