//! The arguments that `sprites`, `chunks`, `tiles`, `cull` and `sort` share: buffers, variant, view
//! and depths of the blobs that they draw, select or sort.

use glam::DVec3;

use crate::gpu::RecordCount;
use crate::layout::frame::{CameraRecord, GridRecord};
use crate::layout::particle::Shapes;
use crate::layout::record;

bindings! {
    /// The buffers that blobs are drawn from.
    pub struct BlobBuffers {
        /// `[u32; 2]`: sort key and particle, far to near.
        entries,
        /// `PlacedRecord` by particle.
        placed,
        /// `ParticleRecord` by particle.
        particles,
        /// `LitRecord` by facet; read where the blobs are lit.
        lit,
        /// `u32` facet by particle; read where a facet stands for several particles.
        i_facet,
        /// `u32` group by particle; read where blobs are weighted or textured.
        i_group,
        /// `DrawnRecord` by group; read where blobs are weighted.
        drawn,
        /// `TexturedRecord` by group; read where blobs are textured.
        textured,
        /// `[u32; 4]` by texel: the pool of textures; read where blobs are textured.
        pool,
        /// `SlopeRecord` by facet; read where blobs are shaded.
        slopes,
        /// `[f32; 4]` by cell: radiance toward the eye; read where blobs have the light of cells.
        seen,
    }
}

/// The greatest optical depth of blobs that are thin: shaders compute their opacity by a
/// polynomial.
pub const THIN: f64 = 0.125;
/// Relative room for the rounding of slopes, and of a blob's own growth.
const SLACK: f64 = 1.01;

/// The properties of a scene's blobs that pipelines are specialized for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BlobVariant {
    /// Colors come from the facets' radiance instead of the particles.
    pub lit: bool,
    /// A facet stands for several particles.
    pub grouped: bool,
    /// Extinction is scaled group by group.
    pub weighted: bool,
    /// Some groups have textures.
    pub textured: bool,
    /// Blobs end where their optical depth falls below a threshold.
    pub threshold: bool,
    /// The blobs' shapes.
    pub shapes: Shapes,
    /// No blob's optical depth is above [`THIN`], and none has a texture.
    pub thin: bool,
    /// The light changes linearly across each blob.
    pub shaded: bool,
    /// Slices have the light of the cells where they are, and blobs only its colour.
    pub in_cells: bool,
}

impl BlobVariant {
    /// Returns the specialization constants that the blob shaders share, by id.
    pub(super) fn constants(self) -> [(u32, u32); 8] {
        let BlobVariant {
            lit, grouped, weighted, textured, threshold, shapes, thin, shaded, ..
        } = self;
        let ids = [0, 2, 3, 4, 5, 6, 9, 12];
        let [lit, grouped, weighted, textured] = [lit, grouped, weighted, textured].map(u32::from);
        let [threshold, thin, shaded] = [threshold, thin, shaded].map(u32::from);
        let values = [lit, grouped, weighted, textured, threshold, shapes as u32, thin, shaded];
        std::array::from_fn(|k| (ids[k], values[k]))
    }
}

/// The region of space that a group's particles are in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Center of the particles' positions, relative to the lighting origin.
    pub center: DVec3,
    /// The positions are within ± half of the center.
    pub half: DVec3,
    /// Greatest σ along any axis.
    pub sigma_max: f64,
    /// Mean σ along the shortest axis.
    pub sigma_mean: f64,
    /// Distance from its centre at which every blob has ended, σ.
    pub reach: f64,
    /// Number of particles.
    pub n_particles: u32,
}

impl Extent {
    /// Returns the distance from its centre at which every blob has ended.
    pub fn radius(&self) -> f64 {
        self.reach * self.sigma_max
    }
}

/// The camera of a picture of blobs, and the bounds below which parts of it are left out.
#[derive(Debug, Clone, Copy)]
pub struct BlobView<'a> {
    /// The camera of the picture.
    pub camera: &'a CameraRecord,
    /// Greatest distance from its centre at which a blob ends, σ.
    pub cutoff: f64,
    /// Optical depth below which a blob ends; 0 cuts nothing.
    pub threshold: f64,
    /// Least distance at which a blob ends, σ.
    pub least: f64,
    /// Transmittance below which a pixel hides everything behind it.
    pub saturated: f64,
    /// Thickness of a slice; 0 where blobs are composed one after the other.
    pub slice: f64,
    /// Where the blobs' centres are, relative to the lighting origin; `None` where this is unknown.
    pub extents: Option<&'a [Extent]>,
    /// The cells that blobs have the light of; `None` where they have their facets'.
    pub cells: Option<&'a GridRecord>,
}

impl BlobView<'_> {
    /// Returns 1 / threshold; infinity, which cuts nothing, where f32 cannot hold the inverse.
    pub(super) fn inv_threshold(&self) -> f32 {
        (1.0 / self.threshold) as f32
    }

    /// Returns the near plane's distance over the thickness of a slice; 0 without slices.
    pub(super) fn near_in_slices(&self) -> f32 {
        let near = f64::from(self.camera.near);
        if self.slice > 0.0 { (near / self.slice) as f32 } else { 0.0 }
    }

    /// Returns the least b²/2σ² at which a blob ends.
    pub(super) fn least_cut(&self) -> f64 {
        0.5 * self.least * self.least
    }

    /// Returns bounds of the slopes, along x and y, between the two sides of any blob in the
    /// picture; infinity where the places of the blobs are unknown.
    pub(super) fn widest(&self) -> [f64; 2] {
        let Some(extents) = self.extents else { return [f64::INFINITY; 2] };
        let wider = |a: [f64; 2], b: [f64; 2]| [a[0].max(b[0]), a[1].max(b[1])];
        extents.iter().map(|e| self.widest_of(e)).fold([0.0; 2], wider)
    }

    /// Returns the same of the blobs of `extent`: those of a ball at its least depth, wherever that
    /// is seen. They are 0 where no blob is in front of the near plane.
    ///
    /// A ball has radius R, depth z and distance x from the axis. Its slopes from the axis are
    /// (x z ± R √(x² + z² − R²)) / (z² − R²). It is in the picture if x < t z + R √(1 + t²); t is
    /// the slope at the picture's edge. The difference of its slopes grows with x and falls with z.
    pub(super) fn widest_of(&self, extent: &Extent) -> [f64; 2] {
        let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        let forward = vector(self.camera.forward);
        let middle = (extent.center - vector(self.camera.eye)).dot(forward);
        let reach = extent.half.dot(forward.abs());
        let radius = SLACK * extent.radius();
        let near = f64::from(self.camera.near);
        if SLACK * (middle + reach) < near {
            return [0.0; 2];
        }
        let z = (middle - reach).max(near) / SLACK;
        // Near the ball its slopes are unbounded.
        if z <= SLACK * radius || !z.is_finite() {
            return [f64::INFINITY; 2];
        }
        [self.camera.tan_x, self.camera.tan_y].map(|tangent| {
            let t = f64::from(tangent);
            let x = t * z + radius * (1.0 + t * t).sqrt();
            let square = z * z - radius * radius;
            SLACK * 2.0 * radius * (x * x + square).sqrt() / square
        })
    }
}

/// A number of sorted entries to draw.
#[derive(Clone, Copy)]
pub struct BlobCount<'a> {
    /// Number of entries; on the device, a `KeptRecord`.
    pub n: RecordCount<'a>,
    /// Facet of the first particle; the facets of surfaces and terrain come before it.
    pub i_first_facet: u32,
}

record! {
    /// Push constants of `sort_key.comp` and `cull_write.comp`.
    pub struct KeyPush {
        /// The camera's forward axis, or the eye.
        from: [f32; 3],
        /// Number of particles.
        n_particles: u32,
        /// Bound of |depth|.
        depth_high: f32,
        /// Steps of a 16-bit key per length.
        steps_per_depth: f32,
        /// Bits of a key: 16 or 32.
        n_bits: u32,
        /// Distance of the eye from the lighting origin; negative where depths are view depths.
        eye_distance: f32,
    }
}

/// The meaning of a blob's depth. Depths are relative to that of the lighting origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DepthFrom {
    /// The view depth, along the camera's forward axis.
    Plane([f32; 3]),
    /// The distance from the eye.
    Eye([f32; 3]),
}

/// The depths that sort keys are made of.
#[derive(Debug, Clone, Copy)]
pub struct Depths {
    /// The depth of a blob.
    pub from: DepthFrom,
    /// Bound of |depth|; the range of 16-bit keys.
    pub radius: f64,
    /// Bits of a key: 16 or 32.
    pub n_bits: u32,
}

impl Depths {
    /// Returns the push constants that make keys of `n_particles`.
    pub(super) fn push(&self, n_particles: u32) -> KeyPush {
        let Depths { from, radius, n_bits } = *self;
        // A scene without extent has one depth: any finite factor gives one key.
        let steps_per_depth = if radius > 0.0 { (65536.0 / (2.0 * radius)) as f32 } else { 0.0 };
        let (from, eye_distance) = match from {
            DepthFrom::Plane(forward) => (forward, -1.0),
            DepthFrom::Eye(eye) => (eye, DVec3::from(eye.map(f64::from)).length() as f32),
        };
        let depth_high = radius as f32;
        KeyPush { from, n_particles, depth_high, steps_per_depth, n_bits, eye_distance }
    }
}
