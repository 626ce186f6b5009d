//! The arguments that `sprites`, `chunks`, `tiles` and `cull` share: buffers, variant and view of
//! the blobs that they draw or select.

use crate::gpu::RecordCount;
use crate::layout::frame::CameraRecord;

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
    }
}

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
    /// Some blobs are not spheres.
    pub ellipsoids: bool,
}

impl BlobVariant {
    /// Returns the specialization constants that the blob shaders share, by id.
    pub(super) fn constants(self) -> [(u32, u32); 6] {
        let BlobVariant { lit, grouped, weighted, textured, threshold, ellipsoids } = self;
        [(0, lit), (2, grouped), (3, weighted), (4, textured), (5, threshold), (6, ellipsoids)]
            .map(|(id, is_on)| (id, u32::from(is_on)))
    }
}

/// The camera of a picture of blobs, and the bounds below which parts of it are left out.
#[derive(Debug, Clone, Copy)]
pub struct BlobView<'a> {
    /// The camera of the picture.
    pub camera: &'a CameraRecord,
    /// Radius of a blob's footprint, in σ.
    pub cutoff: f64,
    /// Optical depth below which a blob ends; 0 cuts nothing.
    pub threshold: f64,
    /// Transmittance below which a pixel hides everything behind it.
    pub saturated: f64,
}

impl BlobView<'_> {
    /// Returns 1 / threshold; infinity, which cuts nothing, where f32 cannot hold the inverse.
    pub(super) fn inv_threshold(&self) -> f32 {
        (1.0 / self.threshold) as f32
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

/// Returns the factor from view depths within ± `radius` to 16-bit sort keys.
pub(super) fn steps_per_depth(radius: f64) -> f32 {
    // A scene without extent has one depth: any finite factor gives one key.
    if radius > 0.0 { (65536.0 / (2.0 * radius)) as f32 } else { 0.0 }
}
