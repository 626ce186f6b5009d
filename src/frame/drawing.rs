//! What draws a frame's picture, and into what: surfaces first, over them the blobs, in one of two ways.

use super::buffers::Buffers;
use super::feed::IN_FLIGHT;
use super::packet::Packet;
use super::plan::{Pass, Plan, pass};
use super::settings::Settings;
use super::tiling::Tiling;
use crate::error::{Error, Result};
use crate::gpu::memory::TargetFormat;
use crate::gpu::{Buffer, Compiler, Device, Image, Recorder, Target};
use crate::model::scene::{DrawPath, LightingMode, Scene};
use crate::passes::sprites::Sprites;
use crate::passes::surfaces::Surfaces;
use crate::passes::tiles::View;

use super::grouping::is_grouped;

pub(super) struct Drawing {
    /// None where only tiles draw.
    sprites: Option<Sprites>,
    /// None where only sprites draw.
    tiling: Option<Tiling>,
    /// A frame that changes the picture draws into the one that the frame before has not. None where nothing is drawn by
    /// the graphics pipeline.
    targets: Option<[Image; IN_FLIGHT]>,
    /// What draws the surfaces, and their depth; none where there are none.
    scenery: Option<(Surfaces, Image)>,
    /// Which of two pictures the last submitted frame draws.
    i_picture: usize,
}

impl Drawing {
    /// What `scene` is drawn with. With path "auto" both ways, where tiles can draw it on this device.
    pub fn new(device: &Device, compiler: &Compiler, scene: &Scene, format: TargetFormat) -> Result<Drawing> {
        let (path, film) = (scene.draw.path, &scene.film);
        let lit = scene.lighting.mode != LightingMode::None;
        let tiling = match path {
            DrawPath::Sprites => None,
            DrawPath::Tiles => Some(Tiling::of_scene(device, compiler, scene, format)?),
            DrawPath::Auto => match Tiling::of_scene(device, compiler, scene, format) {
                // What is too large for them sprites will draw.
                Err(Error::Limit { .. }) => None,
                tiling => Some(tiling?),
            },
        };
        let behind = !scene.surfaces.is_empty();
        let counted = scene.draw.count.is_some();
        let variant = [behind, is_grouped(scene), counted, scene.is_textured(), scene.draw.threshold > 0.0];
        let has_sprites = path != DrawPath::Tiles;
        let target = |name| Image::color_target(device, name, film.width, film.height, format);
        let scenery = || -> Result<(Surfaces, Image)> {
            let depth = Image::depth(device, "surfaces.depth", film.width, film.height)?;
            Ok((Surfaces::new(device, compiler, format)?, depth))
        };
        Ok(Drawing {
            sprites: has_sprites.then(|| Sprites::new(device, compiler, format, lit, variant)).transpose()?,
            tiling,
            targets: match has_sprites || behind {
                true => Some([target("picture.even")?, target("picture.odd")?]),
                false => None,
            },
            scenery: behind.then(scenery).transpose()?,
            i_picture: 0,
        })
    }

    /// Where the next frame's picture goes.
    pub fn turn(&mut self) {
        self.i_picture = (self.i_picture + 1) % IN_FLIGHT;
    }

    /// Which picture is drawn.
    pub fn i_picture(&self) -> usize {
        self.i_picture
    }

    /// Whether tiles can draw.
    pub fn has_tiles(&self) -> bool {
        self.tiling.is_some()
    }

    /// Gives back what the other way needs.
    pub fn keep_only(&mut self, path: DrawPath) {
        match path {
            DrawPath::Tiles => {
                self.sprites = None;
                if self.scenery.is_none() {
                    self.targets = None;
                }
            }
            _ => self.tiling = None,
        }
    }

    /// The drawing passes that `plan` runs.
    pub fn record(
        &mut self,
        rec: &mut Recorder<'_>,
        plan: &Plan,
        b: &Buffers,
        packet: &Packet,
        s: &Settings,
    ) -> Result<()> {
        pass(rec, plan, Pass::Surfaces, |rec| self.record_surfaces(rec, b, packet, s))?;
        pass(rec, plan, Pass::Sprites, |rec| self.record_blobs(rec, DrawPath::Sprites, b, packet, s))?;
        pass(rec, plan, Pass::Tiles, |rec| self.record_blobs(rec, DrawPath::Tiles, b, packet, s))
    }

    fn record_surfaces(&mut self, rec: &mut Recorder<'_>, b: &Buffers, packet: &Packet, s: &Settings) -> Result<()> {
        let (Some((surfaces, depth)), Some(targets)) = (&mut self.scenery, &mut self.targets) else { return Ok(()) };
        let target = Target { color: &mut targets[self.i_picture], depth: Some(depth) };
        surfaces.record(rec, [&b.regions.buffer, &b.lit], target, &packet.camera, s.n_surfaces)
    }

    /// Draws what is sorted, in one of the ways that there are.
    pub fn record_blobs(
        &mut self,
        rec: &mut Recorder<'_>,
        path: DrawPath,
        b: &Buffers,
        packet: &Packet,
        s: &Settings,
    ) -> Result<()> {
        let (n, i_first_facet) = (b.amount(packet.n_drawn), s.n_surface_facets);
        let (i, depth) = (self.i_picture, self.scenery.as_mut().map(|(_, depth)| depth));
        let target = self.targets.as_mut().map(|targets| Target { color: &mut targets[i], depth });
        match path {
            DrawPath::Tiles => {
                let Some(tiling) = &self.tiling else { return Err(Error::usage("tiles were given back")) };
                let Settings { cutoff, threshold, saturated, .. } = *s;
                let view = View { camera: &packet.camera, cutoff, threshold, saturated };
                let under = target.filter(|target| target.depth.is_some());
                tiling.record(rec, i, under, b.of_sprites(), &view, n, i_first_facet)
            }
            _ => {
                let (Some(sprites), Some(target)) = (&self.sprites, target) else {
                    return Err(Error::usage("sprites were given back"));
                };
                sprites.record(rec, b.of_sprites(), target, &packet.camera, [s.cutoff, s.threshold], n, i_first_facet)
            }
        }
    }

    /// Copies picture `i` as `path` has drawn it.
    pub fn record_copy(&mut self, rec: &mut Recorder<'_>, path: DrawPath, i: usize, to: &Buffer) {
        match (path, &self.tiling, &mut self.targets) {
            (DrawPath::Tiles, Some(tiling), _) => rec.copy(&tiling.pictures[i], to),
            (_, _, Some(targets)) => rec.copy_image(&mut targets[i], to),
            _ => {}
        }
    }
}
