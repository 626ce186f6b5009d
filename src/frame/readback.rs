//! What a renderer reads back for those who ask between frames: pictures, particles, facets.

use tracing::info_span;

use super::buffers::download;
use super::render::Renderer;
use crate::error::{Error, Result};
use crate::gpu::TargetFormat;
use crate::gpu::{Buffer, Device, Recorder};
use crate::layout::facet::{FacetRecord, LitRecord};
use crate::layout::particle::{ParticleRecord, PlacedRecord};
use crate::model::boxes::MAX_ATTEMPTS;

/// The numbers of a picture as it lies in a target.
pub(super) fn floats(format: TargetFormat, bytes: Vec<u8>) -> Vec<f32> {
    match format {
        TargetFormat::Rgba8 | TargetFormat::Bgra8 => {
            bytes.into_iter().map(|b| f32::from(b) / 255.0).collect()
        }
        TargetFormat::Rgba16f => {
            let halves: Vec<half::f16> = bytemuck::pod_collect_to_vec(&bytes);
            halves.into_iter().map(half::f16::to_f32).collect()
        }
        TargetFormat::Rgba32f => bytemuck::pod_collect_to_vec(&bytes),
    }
}

impl Renderer {
    /// The last frame's pixels: premultiplied linear RGBA, rows from the top.
    pub fn image(&mut self) -> Result<Vec<f32>> {
        Ok(floats(self.settings.format, self.image_bytes()?))
    }

    /// The last frame as it lies in the target: what "the same bytes" means.
    pub fn image_bytes(&mut self) -> Result<Vec<u8>> {
        let _zone = info_span!("read back").entered();
        let Renderer { host, drawing, readback, traits, i_ended_picture, settings, .. } = self;
        host.run(|rec| {
            drawing.record_read(rec, traits.path, *i_ended_picture, readback);
            Ok(())
        })?;
        readback.read(settings.n_bytes() as usize)
    }

    /// Copies the picture of the last frame that ended, as it lies in the target: premultiplied
    /// linear RGBA, rows from the top.
    pub fn record_picture(&mut self, rec: &mut Recorder<'_>, to: &Buffer) {
        self.drawing.record_read(rec, self.traits.path, self.i_ended_picture, to);
    }

    /// The buffer that holds it already, where one does: until the second frame from now begins.
    pub fn picture(&self) -> Option<&Buffer> {
        self.drawing.picture(self.traits.path, self.i_ended_picture)
    }

    /// Format of that, and its bytes.
    pub fn picture_format(&self) -> (TargetFormat, u64) {
        (self.settings.format, self.settings.n_bytes())
    }

    /// Runs `generate` alone and gives the particles relative to their groups, and each one's
    /// status.
    pub fn generate_now(&mut self, device: &Device) -> Result<(Vec<ParticleRecord>, Vec<u32>)> {
        let n = self.settings.n_particles;
        let (generate, b) = (&self.generate, &self.buffers);
        if self.traits.has_boxes {
            self.host.run(|rec| {
                generate.record(
                    rec,
                    [&b.boxes, &b.i_group, &b.particles, &b.status],
                    n,
                    MAX_ATTEMPTS,
                )
            })?;
        }
        let particles = download(device, &mut self.host, &self.buffers.particles, n)?;
        Ok((particles, download(device, &mut self.host, &self.buffers.status, n)?))
    }

    /// Each particle's status as `generate` left it; 0 where it is of no box. No frame may be in
    /// flight.
    pub fn status(&mut self, device: &Device) -> Result<Vec<u32>> {
        self.check_alone()?;
        download(device, &mut self.host, &self.buffers.status, self.settings.n_particles)
    }

    /// Every particle relative to its group, as it lies there. No frame may be in flight.
    pub fn particles(&mut self, device: &Device) -> Result<Vec<ParticleRecord>> {
        self.check_alone()?;
        download(device, &mut self.host, &self.buffers.particles, self.settings.n_particles)
    }

    /// What a pass that does nothing measures on the device, ns: median of several. None without
    /// timestamps.
    pub fn empty_scope_ns(&mut self) -> Result<Option<f64>> {
        const N_SCOPES: usize = 15;
        let scopes =
            self.host.run(|rec| (0..N_SCOPES).try_for_each(|_| rec.scope("empty", |_| Ok(()))))?;
        let mut ns: Vec<f64> = scopes.iter().map(|s| s.end_ns - s.begin_ns).collect();
        ns.sort_by(f64::total_cmp);
        Ok(ns.get(ns.len() / 2).copied())
    }

    /// Of frames in flight nobody knows which one's would be read.
    pub(super) fn check_alone(&self) -> Result<()> {
        if self.in_flight.is_empty() { Ok(()) } else { Err(Error::usage("frames are in flight")) }
    }

    /// Where the last frame had the particles, relative to its lighting origin. No frame may be in
    /// flight.
    pub fn placed(&mut self, device: &Device) -> Result<Vec<PlacedRecord>> {
        self.check_alone()?;
        download(device, &mut self.host, self.buffers.placed.buffer(), self.settings.n_particles)
    }

    /// The last frame's facets and their light; only meaningful where the scene is lit. No frame
    /// may be in flight.
    pub fn facets(&mut self, device: &Device) -> Result<(Vec<FacetRecord>, Vec<LitRecord>)> {
        self.check_alone()?;
        let n = self.settings.n_facets;
        let facets = download(device, &mut self.host, &self.buffers.facets, n)?;
        Ok((facets, download(device, &mut self.host, &self.buffers.lit, n)?))
    }
}
