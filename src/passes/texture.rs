//! texture: makes the pool of fields that textured blobs are drawn with.
//!
//! In: a seed. Out: the pool: for each field, level and texel the noise at the texel's four
//! corners, of its level and of the next coarser one, 16 bits each. Law: waves of random phase,
//! |F| ∝ |k|^−1.7, by an inverse fast Fourier transform. Source: P's pool of textures,
//! model.md §9, and "texture" of passes.md. Error: at most 1.3e-3 of the noise's unit
//! root mean square, 2e-5 root mean square, and half a quantum of 2⁻¹².

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder, buffers};
use crate::layout::record;

record! {
    /// Push constants of `texture_transform.comp`.
    pub struct TransformPush {
        /// Seed of the pool.
        seed: u32,
        /// 0: along rows; 1: along columns.
        along_columns: u32,
    }
}

record! {
    /// Push constants of `texture_pack.comp`.
    pub struct PackPush {
        /// Texels of the pool.
        n_texels: u32,
    }
}

/// Texels of all levels of a field; the shaders' FIELD_TEXELS.
pub const FIELD_TEXELS: u32 = 87_360;
/// Fields of the pool.
pub const N_FIELDS: u32 = 8;
/// Texels of the pool, 16 bytes each.
pub const POOL_TEXELS: u32 = N_FIELDS * FIELD_TEXELS;
/// Rows of all levels of a field, and columns; two fields are transformed at once.
const N_ROWS: u32 = 504;

buffers! {
    /// Scratch of the pass.
    pub struct Scratch() {
        /// The transforms' values: a complex number for a texel of two fields.
        work: Buffer => [f32; 2], u64::from(POOL_TEXELS / 2), "texture.work";
    }
}

/// The pipelines and scratch buffers of the pass.
pub struct Texture {
    transform: Kernel,
    pack: Kernel,
    scratch: Scratch,
}

impl Texture {
    /// Creates the pipelines and scratch buffers.
    ///
    /// # Errors
    /// Fails if a shader does not compile or the device cannot hold the buffers.
    pub fn new(device: &Device, compiler: &Compiler) -> Result<Texture> {
        // A workgroup of one subgroup does not wait at its barriers.
        let macros = [("WORKGROUP", device.limits().subgroup_size.clamp(8, 64))];
        let (name, fields) = ("texture.transform", TransformPush::FIELDS);
        Ok(Texture {
            transform: Kernel::with_macros(device, compiler, name, fields, &[], &macros)?,
            pack: Kernel::new(device, compiler, "texture.pack", PackPush::FIELDS)?,
            scratch: Scratch::new(device)?,
        })
    }

    /// Fills `pool` (`[u32; 4]` by texel) from `seed`.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record(&self, rec: &mut Recorder<'_>, pool: &Buffer, seed: u32) -> Result<()> {
        let work = &self.scratch.work;
        for along_columns in [0, 1] {
            let push = TransformPush { seed, along_columns };
            rec.dispatch_groups(&self.transform, &[work], &push, N_FIELDS / 2 * N_ROWS)?;
        }
        let push = PackPush { n_texels: POOL_TEXELS };
        rec.dispatch(&self.pack, &[work, pool], &push, POOL_TEXELS)
    }
}
