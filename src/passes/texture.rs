//! texture: the pool of fields that textured sprites are drawn with.
//!
//! In: a seed. Out: the pool: by field, level and texel n at the texel's four corners, of its level
//! and of the one above, 16 bits each. Law: waves of random phase, |F| ∝ |k|^−1.7, by an inverse
//! fast Fourier transform. Source: P's pool of textures, docs/model.md §9, §11 "texture". Error:
//! 1.3e-3 of n's unit root mean square at the most, 2e-5 root mean square, and half a quantum of
//! 2⁻¹².

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, MemoryUsage, Recorder};
use crate::layout::record;

record! {
    pub struct TransformPush { seed: u32, along_columns: u32 }
}

record! {
    pub struct PackPush { n_texels: u32 }
}

/// Texels of all levels of a field; the shaders' FIELD_TEXELS.
pub const FIELD_TEXELS: u32 = 87_360;
pub const N_FIELDS: u32 = 8;
/// Texels of the pool, 16 bytes each.
pub const POOL_TEXELS: u32 = N_FIELDS * FIELD_TEXELS;
/// Rows of all levels of a field, and columns; two fields are transformed at once.
const N_ROWS: u32 = 504;

pub struct Texture {
    transform: Kernel,
    pack: Kernel,
    /// The transforms' values: a complex number for a texel of two fields.
    work: Buffer,
}

impl Texture {
    pub fn new(device: &Device, compiler: &Compiler) -> Result<Texture> {
        // A workgroup of one subgroup needs no waiting at its barriers.
        let macros = [("WORKGROUP", device.limits().subgroup_size.clamp(8, 64))];
        let name = "texture.transform";
        Ok(Texture {
            transform: Kernel::with_macros(
                device,
                compiler,
                name,
                TransformPush::FIELDS,
                &[],
                &macros,
            )?,
            pack: Kernel::new(device, compiler, "texture.pack", PackPush::FIELDS, &[])?,
            work: Buffer::new::<[f32; 2]>(
                device,
                "texture.work",
                u64::from(POOL_TEXELS / 2),
                MemoryUsage::Device,
            )?,
        })
    }

    /// `pool`: [u32; 4] by texel.
    pub fn record(&self, rec: &mut Recorder<'_>, pool: &Buffer, seed: u32) -> Result<()> {
        for along_columns in [0, 1] {
            let push = TransformPush { seed, along_columns };
            rec.dispatch_groups(&self.transform, &[&self.work], &push, N_FIELDS / 2 * N_ROWS)?;
        }
        rec.dispatch(
            &self.pack,
            &[&self.work, pool],
            &PackPush { n_texels: POOL_TEXELS },
            POOL_TEXELS,
        )
    }
}
