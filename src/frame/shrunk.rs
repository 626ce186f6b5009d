//! Blobs drawn into a smaller picture, and what puts it over the full one (docs/model.md §11
//! "upsample").

use super::buffers::Buffers;
use super::drawing::Drawing;
use super::feed::IN_FLIGHT;
use super::packet::Packet;
use super::plan::Pass;
use super::settings::Settings;
use crate::error::Result;
use crate::gpu::TargetFormat;
use crate::gpu::{Buffer, Compiler, Device, MemoryUsage, Recorder, Target};
use crate::layout::frame::CameraRecord;
use crate::model::film::Film;
use crate::model::resolution::{LowResLayout, Resolution};
use crate::model::scene::{Draw, DrawPath, Scene};
use crate::passes::upsample::{Extents, Upsample};

pub(super) struct Shrunk {
    small: LowResLayout,
    /// A picture of its own, smaller, whose surfaces are black, let nothing through and are nowhere
    /// in its alpha.
    pub drawing: Drawing,
    upsample: Upsample,
    /// The blobs alone.
    blobs: Buffer,
    /// The surfaces; near/z of what small and full pixels see.
    surfaces: Option<[Buffer; 3]>,
    /// One is drawn while the other is read.
    pub pictures: [Buffer; IN_FLIGHT],
}

impl Shrunk {
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
        format: TargetFormat,
    ) -> Result<Shrunk> {
        let full = [scene.film.width, scene.film.height];
        let small = LowResLayout::of(full, scene.draw.resolution.divisor());
        let film = Film { width: small.size[0], height: small.size[1], ..scene.film };
        let draw = Draw { resolution: Resolution::Full, ..scene.draw };
        let smaller = Scene { film, draw, ..scene.clone() };
        let behind = scene.has_solids();
        let extents = Extents { full, small: small.size, offsets: small.offsets(), n: small.n };
        let n_full = u64::from(full[0]) * u64::from(full[1]);
        // Whole texels.
        let texels = |name, n: u64, bytes: u64| {
            Buffer::new::<[u32; 4]>(device, name, (n * bytes).div_ceil(16), MemoryUsage::Device)
        };
        let pixel = format.bytes_per_pixel();
        let surfaces = || -> Result<[Buffer; 3]> {
            let under = texels("upsample.under", n_full, pixel)?;
            let small_depths = texels("upsample.small_depths", small.n_pixels(), 4)?;
            Ok([under, small_depths, texels("upsample.depths", n_full, 4)?])
        };
        let picture = |name| texels(name, n_full, pixel);
        Ok(Shrunk {
            small,
            drawing: Drawing::without_colors(device, compiler, &smaller, format)?,
            upsample: Upsample::new(device, compiler, &extents, format, behind)?,
            blobs: texels("upsample.blobs", small.n_pixels(), pixel)?,
            surfaces: behind.then(surfaces).transpose()?,
            pictures: [picture("upsample.even")?, picture("upsample.odd")?],
        })
    }

    /// As `camera`, so much wider.
    pub fn camera(&self, camera: &CameraRecord) -> CameraRecord {
        let by = self.small.widening();
        let wider = |tan: f32, by: f64| (f64::from(tan) * by) as f32;
        CameraRecord {
            tan_x: wider(camera.tan_x, by.x),
            tan_y: wider(camera.tan_y, by.y),
            ..*camera
        }
    }

    /// Columns and rows of the blobs' picture.
    pub fn size(&self) -> [u32; 2] {
        self.small.size
    }

    /// What the small pixels see of what one of the passes draws that hide blobs.
    pub fn record_solids(
        &mut self,
        rec: &mut Recorder<'_>,
        solids: Pass,
        b: &Buffers,
        packet: &Packet,
        s: &Settings,
    ) -> Result<()> {
        let camera = self.camera(&packet.camera);
        self.drawing.record_solids(rec, solids, b, &camera, s)?;
        // The blobs may spend it.
        if let Some([_, small_depths, _]) = &self.surfaces {
            self.drawing.record_copy_depth(rec, small_depths);
        }
        Ok(())
    }

    pub fn record_blobs(
        &mut self,
        rec: &mut Recorder<'_>,
        path: DrawPath,
        b: &Buffers,
        packet: &Packet,
        s: &Settings,
    ) -> Result<()> {
        let camera = self.camera(&packet.camera);
        self.drawing.record_blobs(rec, path, b, (packet.n_drawn, &camera), s)
    }

    /// Puts the blobs, as `path` has drawn them, into picture `i`, over the surfaces that were
    /// drawn on `under`.
    pub fn record(
        &mut self,
        rec: &mut Recorder<'_>,
        path: DrawPath,
        i: usize,
        under: Option<Target<'_>>,
    ) -> Result<()> {
        self.drawing.record_copy(rec, path, &self.blobs);
        if let (Some([picture, _, depths]), Some(under)) = (&self.surfaces, under) {
            rec.copy_image(under.color, picture);
            if let Some(depth) = under.depth {
                rec.copy_image(depth, depths);
            }
        }
        let surfaces = self.surfaces.as_ref().map(|s| [&s[0], &s[1], &s[2]]);
        self.upsample.record(rec, [&self.blobs, &self.pictures[i]], surfaces)
    }
}
