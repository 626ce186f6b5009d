//! sprites: the particles as thin Gaussian sprites, blended far to near.
//!
//! In: sorted entries, placed particles, particles (κ, colour), lit facets. Out: premultiplied linear RGBA in the film's
//! format. Law: α = 1 − exp(−√(2π) κ σ e^{−b²/2σ²}), b the distance to the pixel's ray. Source: P §Rendering, docs/model.md
//! §9, §11. Error: α to a few 1e-6 relative, and the target's rounding at each layer.

use crate::error::Result;
use crate::gpu::memory::TargetFormat;
use crate::gpu::{Buffer, Compiler, Device, DrawPipeline, Image, Recorder};
use crate::layout::frame::CameraRecord;
use crate::layout::record;

record! {
    pub struct Push { camera: CameraRecord, pixel: [f32; 2], cutoff: f32, i_first_facet: u32 }
}

pub struct Sprites {
    pipeline: DrawPipeline,
}

impl Sprites {
    /// `lit`: colours come from the facets' radiance; else from the particles. `grouped`: facets stand for several
    /// particles.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        format: TargetFormat,
        lit: bool,
        grouped: bool,
    ) -> Result<Sprites> {
        let constants = [(0, u32::from(lit)), (1, u32::from(grouped))];
        Ok(Sprites { pipeline: DrawPipeline::over(device, compiler, "sprites", Push::FIELDS, &constants, format)? })
    }

    /// `entries`: [key, particle]; `placed`: PlacedRecord; `particles`: ParticleRecord; `lit`: LitRecord;
    /// `i_facet`: u32 by particle, read where facets are grouped; else particle i has facet `i_first_facet` + i.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 5],
        target: &mut Image,
        camera: &CameraRecord,
        cutoff: f64,
        n_particles: u32,
        i_first_facet: u32,
    ) -> Result<()> {
        let (width, height) = target.size();
        let pixel = [2.0 * camera.tan_x / width as f32, 2.0 * camera.tan_y / height as f32];
        let push = Push { camera: *camera, pixel, cutoff: cutoff as f32, i_first_facet };
        rec.draw(&self.pipeline, target, &buffers, &push, n_particles)
    }
}
