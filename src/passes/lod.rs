//! lod: one blob in place of many that lie close together.
//!
//! In: placed particles. Out: places and particles to draw. Of each run of blobs of
//! about one size in one cell, a member has mass, mean place and mean variance of all, and the
//! others have no extinction and no other numbers. Law, and the error of the picture: passes.md
//! "lod". Error of the pass: a few roundings; a blob within rounding of a border of cells may
//! belong to either side.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::record;

record! {
    /// Push constants of `lod_key.comp`.
    pub struct KeyPush {
        /// Number of particles.
        n_particles: u32,
        /// Class of the greatest σ.
        first_class: i32,
        /// Edge of a cell over the least σ of its class.
        lod: f32,
    }
}

record! {
    /// Push constants of `lod_merge.comp`.
    pub struct MergePush {
        /// Number of particles.
        n_particles: u32,
    }
}

bindings! {
    /// The buffers that the pass reads.
    pub struct LodInput {
        /// `PlacedRecord` by particle.
        placed,
        /// `ParticleRecord` by particle.
        particles,
        /// `u32` group by particle.
        i_group,
        /// `GroupRecord` by group.
        groups,
        /// `TexturedRecord` by group; read where some particles have textures.
        textured,
    }
}

/// Places of the order that a workgroup merges at a time; the shaders' RUN.
pub const RUN: u32 = 256;

/// The pipelines of the pass.
pub struct Lod {
    key: Kernel,
    merge: Kernel,
}

impl Lod {
    /// Creates the pipelines, for particles of several regions if `has_regions`, some of them with
    /// textures if `is_textured`.
    ///
    /// # Errors
    /// Fails if a shader does not compile or a pipeline cannot be created.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        has_regions: bool,
        is_textured: bool,
    ) -> Result<Lod> {
        let kernel = |name, fields, macros: &[_]| {
            Kernel::with_macros(device, compiler, name, fields, &[], macros)
        };
        let invocations = device.limits().subgroup_size.clamp(8, 64);
        let is_one_subgroup = device.limits().is_one_subgroup(invocations);
        let of_merge = [
            ("REGIONS", u32::from(has_regions)),
            ("WORKGROUP", invocations),
            ("ONE_SUBGROUP", u32::from(is_one_subgroup)),
        ];
        let textured = ("TEXTURED", u32::from(is_textured));
        Ok(Lod {
            key: kernel("lod.key", KeyPush::FIELDS, &[textured])?,
            merge: kernel("lod.merge", MergePush::FIELDS, &of_merge)?,
        })
    }

    /// Writes `entries`, `[u32; 2]` of key and particle, of `n_particles`. `first_class` is that of
    /// the greatest σ, `lod` the edge of a cell over the least σ of its class.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record_keys(
        &self,
        rec: &mut Recorder<'_>,
        input: &LodInput<'_>,
        entries: &Buffer,
        n_particles: u32,
        (first_class, lod): (i32, f64),
    ) -> Result<()> {
        let LodInput { placed, particles, i_group, textured, .. } = *input;
        let push = KeyPush { n_particles, first_class, lod: lod as f32 };
        let all = [placed, particles, i_group, textured, entries];
        rec.dispatch(&self.key, &all, &push, n_particles)
    }

    /// Merges the blobs of `sorted` entries. Writes `PlacedRecord` and `ParticleRecord` by
    /// particle.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record_merge(
        &self,
        rec: &mut Recorder<'_>,
        input: &LodInput<'_>,
        [sorted, to_placed, to_particles]: [&Buffer; 3],
        n_particles: u32,
    ) -> Result<()> {
        let LodInput { placed, particles, i_group, groups, .. } = *input;
        let all = [sorted, placed, particles, i_group, groups, to_placed, to_particles];
        let n_blocks = n_particles.div_ceil(RUN);
        rec.dispatch_groups(&self.merge, &all, &MergePush { n_particles }, n_blocks)
    }
}
