//! sprites: the particles as thin Gaussian sprites, blended far to near.
//!
//! In: sorted entries, placed particles, particles (κ, colour), lit facets, the depth of surfaces drawn before. Out:
//! premultiplied linear RGBA in the film's format. Law: α = 1 − exp(−√(2π) κ σ e^{−b²/2σ²}), b the distance to the pixel's ray. Source: P §Rendering, docs/model.md
//! §9, §11. Error: α to a few 1e-6 relative, and the target's rounding at each layer.

use crate::error::Result;
use crate::gpu::memory::TargetFormat;
use crate::gpu::{Buffer, Compiler, Device, DrawPipeline, Recorder, Start, Target};
use crate::layout::frame::CameraRecord;
use crate::layout::record;

record! {
    pub struct Push { camera: CameraRecord, pixel: [f32; 2], cutoff: f32, i_first_facet: u32 }
}

pub struct Sprites {
    pipeline: DrawPipeline,
}

impl Sprites {
    /// `lit`: colours come from the facets' radiance; else from the particles. `behind`: surfaces have been drawn, with
    /// depth; else the target is cleared. `grouped`: facets stand for several particles.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        format: TargetFormat,
        lit: bool,
        [behind, grouped]: [bool; 2],
    ) -> Result<Sprites> {
        let constants = [(0, u32::from(lit)), (1, u32::from(behind)), (2, u32::from(grouped))];
        let pipeline = DrawPipeline::over(device, compiler, "sprites", Push::FIELDS, &constants, format, behind)?;
        Ok(Sprites { pipeline })
    }

    /// `entries`: [key, particle]; `placed`: PlacedRecord; `particles`: ParticleRecord; `lit`: LitRecord, the particles'
    /// from `i_first_facet` on; `i_facet`: u32 by particle, read where facets are grouped. `target` has depth where surfaces have been drawn.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 5],
        target: Target<'_>,
        camera: &CameraRecord,
        cutoff: f64,
        [n_particles, i_first_facet]: [u32; 2],
    ) -> Result<()> {
        let (width, height) = target.color.size();
        let pixel = [2.0 * camera.tan_x / width as f32, 2.0 * camera.tan_y / height as f32];
        let push = Push { camera: *camera, pixel, cutoff: cutoff as f32, i_first_facet };
        let start = if target.depth.is_some() { Start::Load } else { Start::Clear };
        rec.draw(&self.pipeline, target, start, &buffers, &push, n_particles)
    }
}
