//! sprites: the particles as thin Gaussian sprites, blended far to near.
//!
//! In: sorted entries, placed particles, particles (κ, colour), lit facets, what is drawn of each
//! group, its texture, the pool of textures, the depth of surfaces drawn before. Out: premultiplied
//! linear RGBA in the film's format. Of groups that are drawn in part, what is drawn of them, and
//! weights on κ. Law: α = 1 − exp(−√(2π) κ σ e^{−b²/2σ²}), b the distance to the pixel's ray.
//! Source: P §Rendering, docs/model.md §9, §11. Error: α to a few 1e-6 relative, and the target's
//! rounding at each layer.

use crate::error::Result;
use crate::gpu::TargetFormat;
use crate::gpu::{
    BlendMode, Buffer, Compiler, Device, DrawPipeline, InstanceCount, LoadOp, RecordCount,
    Recorder, Target,
};
use crate::layout::cull::KeptRecord;
use crate::layout::frame::CameraRecord;
use crate::layout::record;

record! {
    pub struct Push { camera: CameraRecord, pixel: [f32; 2], cutoff: f32, i_first_facet: u32, inv_threshold: f32, i_first: u32 }
}

pub struct Sprites {
    pipeline: DrawPipeline,
}

/// A part of the entries: so many, from the first one on; and the particles' first facet.
#[derive(Clone, Copy)]
pub struct Chunk<'a> {
    pub instances: InstanceCount<'a>,
    pub i_first: u32,
    pub i_first_facet: u32,
}

impl Sprites {
    /// `lit`: colours come from the facets' radiance; else from the particles. `behind`: surfaces
    /// have been drawn, with depth; else the target is cleared. `grouped`: facets stand for several
    /// particles. `weighted`: κ has factors. `textured`: some groups have textures. `threshold`:
    /// there is one. `ellipsoids`: not all are balls.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        format: TargetFormat,
        lit: bool,
        [behind, grouped, weighted, textured, threshold, ellipsoids]: [bool; 6],
    ) -> Result<Sprites> {
        let constants =
            constants([lit, behind, grouped, weighted, textured, threshold, ellipsoids]);
        let meet = if behind { BlendMode::OverTested } else { BlendMode::Over };
        let pipeline = DrawPipeline::new(
            device,
            compiler,
            "sprites",
            Push::FIELDS,
            &constants,
            (format, meet),
        )?;
        Ok(Sprites { pipeline })
    }

    /// The same blended under what is nearer, near to far, into a target with depth.
    pub fn under(
        device: &Device,
        compiler: &Compiler,
        format: TargetFormat,
        [lit, grouped, weighted, textured, threshold, ellipsoids]: [bool; 6],
    ) -> Result<Sprites> {
        let constants = constants([lit, true, grouped, weighted, textured, threshold, ellipsoids]);
        let pipeline = DrawPipeline::new(
            device,
            compiler,
            "sprites",
            Push::FIELDS,
            &constants,
            (format, BlendMode::UnderTested),
        )?;
        Ok(Sprites { pipeline })
    }

    /// `entries`: [key, particle]; `placed`: PlacedRecord; `particles`: ParticleRecord; `lit`:
    /// LitRecord, the particles' from `i_first_facet` on; `i_facet`: u32 by particle, read where
    /// facets are grouped; `i_group`: u32 by particle, and `drawn`: DrawnRecord, read where κ has
    /// factors; `textured`: TexturedRecord, and `pool`: [u32; 4], read where some have textures. A
    /// sprite ends at `cutoff` σ, and where its optical depth falls under `threshold`. `target` has
    /// depth where surfaces have been drawn. `n_drawn`: entries; the device's count is a
    /// KeptRecord.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 9],
        target: Target<'_>,
        camera: &CameraRecord,
        [cutoff, threshold]: [f64; 2],
        counts: (RecordCount<'_>, u32),
    ) -> Result<()> {
        let start = if target.depth.is_some() { LoadOp::Load } else { LoadOp::Clear };
        self.record_from(rec, buffers, (target, start), camera, [cutoff, threshold], counts)
    }

    /// The same over what the target holds where `start` says so.
    pub fn record_from(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 9],
        (target, start): (Target<'_>, LoadOp),
        camera: &CameraRecord,
        [cutoff, threshold]: [f64; 2],
        (n_drawn, i_first_facet): (RecordCount<'_>, u32),
    ) -> Result<()> {
        let instances = match n_drawn {
            RecordCount::Known(n) => InstanceCount::Known(n),
            RecordCount::Indirect(kept) => InstanceCount::Indirect(kept, KeptRecord::I_DRAW),
        };
        let all = Chunk { instances, i_first: 0, i_first_facet };
        self.record_chunk(rec, buffers, (target, start), camera, [cutoff, threshold], all)
    }

    /// The same of a part of the entries.
    pub fn record_chunk(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 9],
        (target, start): (Target<'_>, LoadOp),
        camera: &CameraRecord,
        [cutoff, threshold]: [f64; 2],
        Chunk { instances, i_first, i_first_facet }: Chunk<'_>,
    ) -> Result<()> {
        let (width, height) = target.color.size();
        let pixel = [2.0 * camera.tan_x / width as f32, 2.0 * camera.tan_y / height as f32];
        let inv_threshold = (1.0 / threshold) as f32;
        let push = Push {
            camera: *camera,
            pixel,
            cutoff: cutoff as f32,
            i_first_facet,
            inv_threshold,
            i_first,
        };
        rec.draw(&self.pipeline, target, start, &buffers, &push, instances)
    }
}

fn constants(of: [bool; 7]) -> Vec<(u32, u32)> {
    (0..).zip(of.map(u32::from)).collect()
}
