//! Readback between frames: pictures, particles, facets.

use tracing::info_span;

use super::buffers::SceneBuffers;
use super::renderer::Renderer;
use super::staging::download;
use crate::error::Result;
use crate::gpu::{Buffer, Device, Recorder, TargetFormat};
use crate::layout::facet::{FacetRecord, LitRecord, SlopeRecord};
use crate::layout::particle::{ParticleRecord, PlacedRecord};
use crate::model::boxes::MAX_ATTEMPTS;

/// Facets and the light that arrives at them, relative to the lighting origin.
#[derive(Debug, Clone, Default)]
pub struct LitFacets {
    /// The facets.
    pub facets: Vec<FacetRecord>,
    /// Transmittance `[facet][light]`.
    pub transmittance: Vec<f32>,
}

impl LitFacets {
    /// Returns the transmittance from light `i` to each facet.
    pub fn transmittance_to(&self, i: usize) -> impl Iterator<Item = f32> {
        let n_lights = self.transmittance.len() / self.facets.len().max(1);
        self.transmittance.iter().skip(i).step_by(n_lights.max(1)).copied()
    }
}

/// Returns the numbers of a picture from its bytes in a target.
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
    /// Returns the last frame's pixels: premultiplied linear RGBA, rows from the top.
    ///
    /// # Errors
    /// Fails if the device is lost.
    pub fn image(&mut self) -> Result<Vec<f32>> {
        Ok(floats(self.passes.constants.format, self.image_bytes()?))
    }

    /// Returns the last frame's bytes in the target, the measure of "same bytes".
    ///
    /// # Errors
    /// Fails if the device is lost.
    pub fn image_bytes(&mut self) -> Result<Vec<u8>> {
        self.bytes_of_picture(self.i_ended_picture)
    }

    /// Returns the bytes of one of the pictures.
    pub(super) fn bytes_of_picture(&mut self, i: usize) -> Result<Vec<u8>> {
        let _zone = info_span!("read back").entered();
        let Renderer { host, passes, readback, .. } = self;
        host.run(|rec| {
            passes.picture.record_copy(rec, i, readback);
            Ok(())
        })?;
        readback.read(passes.constants.n_bytes() as usize)
    }

    /// Copies the last ended frame's picture: premultiplied linear RGBA in the target's format,
    /// rows from the top.
    pub fn record_picture(&mut self, rec: &mut Recorder<'_>, to: &Buffer) {
        self.passes.picture.record_copy(rec, self.i_ended_picture, to);
    }

    /// Returns the buffer that holds the last ended frame's picture, valid until the second frame
    /// from now begins; `None` if an image holds it.
    pub fn picture(&self) -> Option<&Buffer> {
        self.passes.picture.buffer(self.i_ended_picture)
    }

    /// Returns the format of a picture and its bytes.
    pub fn picture_format(&self) -> (TargetFormat, u64) {
        (self.passes.constants.format, self.passes.constants.n_bytes())
    }

    /// Runs `generate` alone and returns the particles relative to their groups, and the status of
    /// each.
    ///
    /// # Errors
    /// Fails if the device is lost.
    pub fn generate_now(&mut self, device: &Device) -> Result<(Vec<ParticleRecord>, Vec<u32>)> {
        let (passes, n) = (&self.passes, self.passes.constants.n_particles);
        let (b, generate) = (&passes.buffers, &passes.generate);
        if passes.features.has_boxes {
            let buffers = [&b.boxes, &b.i_group, &b.particles, &b.status];
            self.host.run(|rec| generate.record(rec, buffers, [0, n], MAX_ATTEMPTS))?;
        }
        let particles = download(device, &mut self.host, &b.particles, n)?;
        Ok((particles, download(device, &mut self.host, &b.status, n)?))
    }

    /// Returns a number of records of a shared buffer.
    fn read<T: bytemuck::Pod>(
        &mut self,
        device: &Device,
        buffer: fn(&SceneBuffers) -> &Buffer,
        n: u32,
    ) -> Result<Vec<T>> {
        self.check_idle()?;
        download(device, &mut self.host, buffer(&self.passes.buffers), n)
    }

    /// Returns each particle's status after `generate`; 0 for particles that come from no box.
    ///
    /// # Errors
    /// Fails if a frame is in flight or the device is lost.
    pub fn status(&mut self, device: &Device) -> Result<Vec<u32>> {
        self.read(device, |b| &b.status, self.passes.constants.n_particles)
    }

    /// Returns every particle relative to its group.
    ///
    /// # Errors
    /// Fails if a frame is in flight or the device is lost.
    pub fn particles(&mut self, device: &Device) -> Result<Vec<ParticleRecord>> {
        self.read(device, |b| &b.particles, self.passes.constants.n_particles)
    }

    /// Returns every particle's place in the last frame, relative to its lighting origin.
    ///
    /// # Errors
    /// Fails if a frame is in flight or the device is lost.
    pub fn placed(&mut self, device: &Device) -> Result<Vec<PlacedRecord>> {
        self.read(device, |b| &b.placed, self.passes.constants.n_particles)
    }

    /// Returns the last frame's facets and their light, which is meaningful only in a lit scene.
    ///
    /// # Errors
    /// Fails if a frame is in flight or the device is lost.
    pub fn facets(&mut self, device: &Device) -> Result<(Vec<FacetRecord>, Vec<LitRecord>)> {
        let n = self.passes.constants.march.n_facets;
        Ok((self.read(device, |b| &b.facets, n)?, self.read(device, |b| &b.lit, n)?))
    }

    /// Returns the light of the last frame's facets behind the air, all of it as the first
    /// reflection; none where no air lies before them.
    ///
    /// # Errors
    /// Fails if a frame is in flight or the device is lost.
    pub fn hazed(&mut self, device: &Device) -> Result<Vec<LitRecord>> {
        let has_haze = self.passes.features.has_haze;
        let n = if has_haze { self.passes.constants.march.n_facets } else { 0 };
        self.read(device, |b| &b.hazed, n)
    }

    /// Returns the slopes of the last frame's light inside of blobs, by facet, as they are drawn.
    /// The slopes of surfaces and ground have no meaning. None where the light does not change
    /// there.
    ///
    /// # Errors
    /// Fails if a frame is in flight or the device is lost.
    pub fn slopes(&mut self, device: &Device) -> Result<Vec<SlopeRecord>> {
        let n = self.passes.constants.march.n_facets;
        let n = if self.passes.constants.has_slopes { n } else { 0 };
        match self.passes.features.has_haze {
            true => self.read(device, |b| &b.hazed_slopes, n),
            false => self.read(device, |b| &b.slopes, n),
        }
    }

    /// Returns the last frame's transmittance from each light to each facet, `[facet][light]`,
    /// which is meaningful only in a lit scene.
    ///
    /// # Errors
    /// Fails if a frame is in flight or the device is lost.
    pub fn transmittance(&mut self, device: &Device) -> Result<Vec<f32>> {
        let march = &self.passes.constants.march;
        let n = march.n_facets * march.n_lights;
        self.read(device, |b| &b.transmittance, n)
    }

    /// Returns the median duration that the device measures for an empty pass, in ns; `None`
    /// without timestamps.
    ///
    /// # Errors
    /// Fails if the device is lost.
    pub fn empty_scope_ns(&mut self) -> Result<Option<f64>> {
        const N_SCOPES: usize = 15;
        let scopes =
            self.host.run(|rec| (0..N_SCOPES).try_for_each(|_| rec.scope("empty", |_| Ok(()))))?;
        let mut ns: Vec<f64> = scopes.iter().map(|s| s.end_ns - s.begin_ns).collect();
        ns.sort_by(f64::total_cmp);
        Ok(ns.get(ns.len() / 2).copied())
    }
}
