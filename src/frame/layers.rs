//! The layers of the last frame: what its picture is made of, number by number.
//!
//! A picture is linear in the radiance of its facets. Each reflection is the picture drawn again
//! with the radiance of the other one taken away. Depth, optical depth and the number of particles
//! are sums over the layers of a pixel, which one draw call adds up by blending.

use super::features::{blob_variant, has_haze, has_second, is_lit};
use super::merging::drawn;
use super::packet::Packet;
use super::plan::{Pass, Plan};
use super::readback::floats;
use super::renderer::Renderer;
use super::staging::upload;
use crate::error::{Error, Result};
use crate::gpu::{
    Buffer, Compiler, Device, Image, LoadOp, MemoryUsage, RecordCount, Target, has_depth24,
};
use crate::layout::facet::LitRecord;
use crate::model::layers::Layers;
use crate::model::resolution::Resolution;
use crate::model::scene::{DrawPath, Impostors, Scene};
use crate::passes::blobs::{BlobBuffers, BlobCount};
use crate::passes::sprites::{SUMS_FORMAT, Sprites};

/// Greatest number of a 24-bit depth.
const MOST_DEPTH24: f32 = 16_777_215.0;

/// Returns the settings that leave out air, and a sea's mirror.
fn without_air(scene: &Scene) -> &'static str {
    match scene.has_sea() {
        true => "--set sky.haze=0 and no cover = \"sea\"",
        false => "--set sky.haze=0",
    }
}

/// Returns the scene as it is drawn for layers: without impostors, which a frame alone never shows,
/// and with "auto" for the resolution settled.
///
/// # Errors
/// Fails if reflections do not add up to the picture: in a smaller picture, because enlarging it
/// cuts off what is below 0, and behind air, which has light of its own.
pub fn scene_of_layers(mut scene: Scene) -> Result<Scene> {
    if has_haze(&scene) {
        return Err(Error::usage(format!(
            "--layers: the air between eye and scene adds light of its own, so that the \
             reflections do not add up; expected none, as {} sets it",
            without_air(&scene)
        )));
    }
    scene.draw.impostors = Impostors::Off;
    match scene.draw.resolution {
        Resolution::Full => {}
        Resolution::Auto => scene.draw.resolution = Resolution::Full,
        other => {
            return Err(Error::usage(format!(
                "--layers: draw.resolution = {} draws the particles into a smaller picture, whose \
                 reflections do not add up; expected 1, as --set draw.resolution=1 sets it",
                other.name()
            )));
        }
    }
    Ok(scene)
}

/// Sums over the layers of every pixel.
struct Sums {
    /// Optical depth, number, 0, greatest near/z.
    of_blobs: Vec<f32>,
    /// near/z of the surfaces; empty without any.
    of_solids: Vec<f32>,
}

impl Renderer {
    /// Draws the layers of the last frame, a frame of `scene` that [`scene_of_layers`] has made.
    /// The picture of the frame stays.
    ///
    /// # Errors
    /// Fails if no frame has ended, an earlier one has failed, blobs are drawn into a smaller
    /// picture, or the device is lost.
    pub fn layers(
        &mut self,
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
    ) -> Result<Layers> {
        self.check_idle()?;
        self.check_not_failed()?;
        let packet = self.last.clone().ok_or_else(|| Error::usage("no frame has been drawn"))?;
        let picture = &self.passes.picture;
        if picture.low_res.is_some() || picture.impostors.is_some() {
            return Err(Error::usage("layers are of full pictures without impostors"));
        }
        let beauty = self.image()?;
        let Sums { of_blobs, of_solids } = self.sums(device, compiler, scene, &packet)?;
        let colors = rgb(&beauty);
        let nothing = vec![0.0; colors.len()];
        let (first, second) = match (is_lit(scene), has_second(scene)) {
            (true, true) => self.reflections(device, &packet)?,
            _ => (colors, nothing),
        };
        let near = packet.camera.near;
        // near/z is 0 where nothing is, and near/0 is infinite.
        let depth = |(k, sums): (usize, &[f32])| {
            near / sums[3].max(of_solids.get(k).copied().unwrap_or(0.0))
        };
        let of = |k: usize| of_blobs.iter().skip(k).step_by(4).copied().collect::<Vec<f32>>();
        Ok(Layers {
            size: self.passes.constants.size,
            beauty,
            depth: of_blobs.chunks_exact(4).enumerate().map(depth).collect(),
            optical_depth: of(0),
            n_particles: of(1),
            first,
            second,
        })
    }

    /// Sums over the layers of every pixel.
    fn sums(
        &mut self,
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
        packet: &Packet,
    ) -> Result<Sums> {
        let Renderer { host, passes, .. } = self;
        let (c, b, picture) = (&passes.constants, &passes.buffers, &mut passes.picture);
        let [placed, particles] = drawn(&passes.merging, b);
        let blobs = BlobBuffers { placed, particles, ..b.of_blobs(false) };
        let [width, height] = c.size;
        let n_pixels = u64::from(width) * u64::from(height);
        let has_depth = scene.has_solids();
        let readback = |name, n| Buffer::new::<f32>(device, name, n, MemoryUsage::Readback);
        let of_blobs = readback("layers.sums", 4 * n_pixels)?;
        let of_solids = readback("layers.depth", if has_depth { n_pixels } else { 0 })?;
        let mut color = Image::color_target(device, "layers.sums", width, height, SUMS_FORMAT)?;
        let sprites = Sprites::sums(device, compiler, blob_variant(scene), has_depth)?;
        let n = match &passes.culling {
            Some(_) => RecordCount::Indirect(&b.kept),
            None => RecordCount::Known(packet.n_drawn),
        };
        let count = BlobCount { n, i_first_facet: c.n_solid_facets };
        let view = c.view(&packet.camera, packet);
        host.run(|rec| {
            let target = Target { color: &mut color, depth: picture.full.depth() };
            sprites.record(rec, &blobs, (target, LoadOp::ClearColor), &view, count)?;
            rec.copy_image(&mut color, &of_blobs);
            picture.full.record_copy_solids(rec, picture.i, None, &of_solids);
            Ok(())
        })?;
        let n = n_pixels as usize;
        let words: Vec<u32> = of_solids.read(if has_depth { n } else { 0 })?;
        let depth = |word: u32| match has_depth24(device) {
            true => (word & 0x00ff_ffff) as f32 / MOST_DEPTH24,
            false => f32::from_bits(word),
        };
        Ok(Sums {
            of_blobs: of_blobs.read(4 * n)?,
            of_solids: words.into_iter().map(depth).collect(),
        })
    }

    /// Draws the picture of each of the two reflections alone.
    fn reflections(&mut self, device: &Device, packet: &Packet) -> Result<(Vec<f32>, Vec<f32>)> {
        let (_, lit) = self.facets(device)?;
        // Drawn into the picture that the last frame does not show. An error leaves the light
        // changed.
        self.failed = true;
        self.passes.picture.flip();
        let first = lit.iter().map(|l| LitRecord { second: [0.0; 3], ..*l }).collect::<Vec<_>>();
        let first = self.picture_of(device, packet, &first)?;
        let second = lit.iter().map(|l| LitRecord { first: [0.0; 3], ..*l }).collect::<Vec<_>>();
        let second = self.picture_of(device, packet, &second)?;
        self.passes.picture.flip();
        upload(device, &mut self.host, &lit, &self.passes.buffers.lit)?;
        self.failed = false;
        Ok((first, second))
    }

    /// Draws the picture with the facets' light replaced by `lit`.
    fn picture_of(
        &mut self,
        device: &Device,
        packet: &Packet,
        lit: &[LitRecord],
    ) -> Result<Vec<f32>> {
        let Renderer { host, passes, .. } = self;
        upload(device, host, lit, &passes.buffers.lit)?;
        let blobs = match passes.features.path {
            DrawPath::Tiles => Pass::Tiles,
            _ => Pass::Sprites,
        };
        let plan = Plan::running(|pass| [Pass::Surfaces, Pass::Terrain, blobs].contains(&pass));
        host.run(|rec| passes.record_picture(rec, packet, &plan))?;
        let (i, format) = (passes.picture.i, passes.constants.format);
        Ok(rgb(&floats(format, self.bytes_of_picture(i)?)))
    }
}

/// Returns the colours of RGBA pixels.
fn rgb(rgba: &[f32]) -> Vec<f32> {
    rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
}
