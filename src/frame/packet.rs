//! The data of one frame that the game step hands to the render step. Nothing else crosses between
//! their threads.

use std::sync::Arc;
use std::time::Instant;

use crate::layout::diffusion::DiffusionParams;
use crate::layout::disc::DiscRecord;
use crate::layout::facet::{RegionBoundsRecord, RegionRecord};
use crate::layout::frame::{CameraRecord, GridRecord, LightRecord};
use crate::layout::medium::MediumRecord;
use crate::layout::particle::{DrawnRecord, GroupRecord, ModeRecord, ParticleRecord, PlacedRecord};
use crate::layout::sky::SkyRecord;
use crate::passes::blobs::Extent;

/// The state of a scene at a frame's time.
#[derive(Debug, Clone)]
pub struct Packet {
    /// Number of the frame.
    pub i_frame: u32,
    /// Time of the scene, in seconds.
    pub time_s: f64,
    /// Time at which the game step began.
    pub begin: Instant,
    /// Duration of the game step, in ms.
    pub game_ms: f64,
    /// The camera.
    pub camera: CameraRecord,
    /// The groups of particles.
    pub groups: Vec<GroupRecord>,
    /// The drawn part of each group.
    pub drawn: Vec<DrawnRecord>,
    /// Number of drawn particles.
    pub n_drawn: u32,
    /// Gusts of all clouds; empty if the game thread moves the particles.
    pub modes: Vec<ModeRecord>,
    /// The discs; empty if the game thread moves the particles.
    pub discs: Vec<DiscRecord>,
    /// Every particle relative to its group, if the game thread recomputes particles.
    pub live: Option<Vec<ParticleRecord>>,
    /// Every particle's place, if the game thread moves the particles.
    pub placed: Option<Vec<PlacedRecord>>,
    /// Bounds of the Morton cells of each region.
    pub bounds: Vec<RegionBoundsRecord>,
    /// Surfaces, terrains and clouds with their materials.
    pub regions: Vec<RegionRecord>,
    /// Medium of each cloud; empty in modes without.
    pub media: Vec<MediumRecord>,
    /// Numbers of the diffusion of light; `None` without.
    pub diffusion: Option<DiffusionParams>,
    /// The lobe of every material in the basis, then the basis' vectors; N_NODES numbers each.
    pub table: Arc<Vec<f32>>,
    /// C of every column of the tensors; empty if no material is edited.
    pub coefficients: Vec<[f32; 4]>,
    /// The lights.
    pub lights: Vec<LightRecord>,
    /// The sky as the eye sees it; `None` without.
    pub sky: Option<SkyRecord>,
    /// The density grid.
    pub grid: GridRecord,
    /// Bound of every blob's mass κ (2π)^{3/2} σ³.
    pub heaviest: f64,
    /// Bound of every particle's σ.
    pub sigma_max: f64,
    /// Number of grids that any blob may be deposited on ([`GridSpec::n_levels`]).
    ///
    /// [`GridSpec::n_levels`]: crate::model::grid::GridSpec::n_levels
    pub n_levels: u32,
    /// Most blurs that a blob needs ([`GridSpec::n_blurs`]).
    ///
    /// [`GridSpec::n_blurs`]: crate::model::grid::GridSpec::n_blurs
    pub n_blurs: u32,
    /// Bound of |view depth| relative to the lighting origin.
    pub radius: f64,
    /// Bits of a sort key: 16 or 32.
    pub sort_bits: u32,
    /// Thickness of a slice, where blobs are composed by slices.
    pub slice: f64,
    /// Extent of each group.
    pub extents: Vec<Extent>,
}
