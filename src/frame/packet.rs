//! All that the render step needs to know of one frame, and the only thing that crosses from game
//! to render thread.

use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;

use crate::layout::disc::DiscRecord;
use crate::layout::facet::{RegionBoundsRecord, RegionRecord};
use crate::layout::frame::{CameraRecord, GridRecord, LightRecord};
use crate::layout::particle::{DrawnRecord, GroupRecord, ModeRecord, ParticleRecord, PlacedRecord};

#[derive(Debug, Clone)]
pub struct Packet {
    pub i_frame: u32,
    pub time_s: f64,
    /// When the game step began.
    pub begin: Instant,
    /// How long it took.
    pub game_ms: f64,
    pub camera: CameraRecord,
    pub groups: Vec<GroupRecord>,
    /// What of each group is drawn.
    pub drawn: Vec<DrawnRecord>,
    /// Particles that are drawn.
    pub n_drawn: u32,
    /// Gusts of all clouds, one after the other; none where the game thread moves the particles.
    pub modes: Vec<ModeRecord>,
    /// Discs at this time; none where the game thread moves the particles.
    pub discs: Vec<DiscRecord>,
    /// Every particle relative to its group, where the game thread moves the particles and some are
    /// of discs.
    pub lived: Option<Vec<ParticleRecord>>,
    /// Every particle's place, where the game thread moves the particles.
    pub placed: Option<Vec<PlacedRecord>>,
    /// Where each region's Morton cells lie.
    pub bounds: Vec<RegionBoundsRecord>,
    /// Surfaces, then clouds, with their materials at this time.
    pub regions: Vec<RegionRecord>,
    /// The lobe of every material at this time as the basis has it, then the basis' vectors;
    /// N_NODES numbers each.
    pub table: Arc<Vec<f32>>,
    /// C of every column of the tensors at this time; empty where no material is edited.
    pub coefficients: Vec<[f32; 4]>,
    pub lights: Vec<LightRecord>,
    pub grid: GridRecord,
    /// Bounds every blob's mass κ (2π)^{3/2} σ³.
    pub heaviest: f64,
    /// Bounds |view depth| relative to the lighting origin.
    pub radius: f64,
    /// Of the sort's keys: 16 or 32.
    pub sort_bits: u32,
    /// Where each group's particles are, where what is far may be shown from a picture of it; else
    /// none.
    pub extents: Vec<Extent>,
}

/// Where a group's particles are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Relative to the lighting origin; their centres are within ± half of it.
    pub center: DVec3,
    pub half: DVec3,
    /// In the direction that they are widest in; and the mean of the narrowest.
    pub sigma_max: f64,
    pub sigma_mean: f64,
    pub n_particles: u32,
}
