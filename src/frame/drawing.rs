//! What draws a frame's picture, and into what: surfaces and ground first, over them the blobs, in
//! one of two ways.

use super::buffers::Buffers;
use super::chunks::{self, Chunks};
use super::feed::IN_FLIGHT;
use super::impostors::Impostors;
use super::packet::Packet;
use super::plan::{Pass, Plan, pass};
use super::scenery::Scenery;
use super::settings::Settings;
use super::shrunk::Shrunk;
use super::tiling::Tiling;
use crate::error::{Error, Result};
use crate::gpu::TargetFormat;
use crate::gpu::{Buffer, Compiler, Device, Image, LoadOp, Recorder, Target};
use crate::layout::frame::CameraRecord;
use crate::model::resolution::Resolution;
use crate::model::scene::{
    Chunks as ChunkMode, DrawPath, Impostors as ImpostorMode, LightingMode, Scene,
};
use crate::passes::sprites::Sprites;
use crate::passes::tiles::View;

use super::grouping::is_grouped;

pub(super) struct Drawing {
    /// Far to near; None where chunks draw them, or only tiles.
    sprites: Option<Sprites>,
    /// Near to far.
    chunks: Option<Chunks>,
    /// None where only sprites draw.
    tiling: Option<Tiling>,
    /// A frame that changes the picture draws into the one that the frame before has not. None
    /// where nothing is drawn by the graphics pipeline.
    targets: Option<[Image; IN_FLIGHT]>,
    /// What hides the blobs; none where nothing does.
    scenery: Option<Scenery>,
    /// What is far, shown from a picture of it.
    impostors: Option<Impostors>,
    /// The smaller picture that the blobs are drawn into; None where it is the full one.
    shrunk: Option<Box<Shrunk>>,
    /// Which of two pictures the last submitted frame draws.
    i_picture: usize,
}

impl Drawing {
    /// What `scene`, in which nothing is "auto", is drawn with.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
        format: TargetFormat,
    ) -> Result<Drawing> {
        let mut drawing = Drawing::of_size(device, compiler, scene, format, false)?;
        if scene.draw.resolution != Resolution::Full {
            drawing.shrunk = Some(Box::new(Shrunk::new(device, compiler, scene, format)?));
        }
        Ok(drawing)
    }

    /// The same of surfaces that are drawn as depth alone, of the scene's film whatever its
    /// resolution.
    pub fn without_colors(
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
        format: TargetFormat,
    ) -> Result<Drawing> {
        Drawing::of_size(device, compiler, scene, format, true)
    }

    fn of_size(
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
        format: TargetFormat,
        depth_only: bool,
    ) -> Result<Drawing> {
        let (path, film) = (scene.draw.path, &scene.film);
        let lit = scene.lighting.mode != LightingMode::None;
        let has_blobs = scene.draw.resolution == Resolution::Full;
        let has_tiles = has_blobs && path == DrawPath::Tiles;
        let behind = scene.has_solids();
        let counted = scene.draw.count.is_some();
        let [textured, threshold, ellipsoids] =
            [scene.is_textured(), scene.draw.threshold.is_active(), scene.has_ellipsoids()];
        let variant = [behind, is_grouped(scene), counted, textured, threshold, ellipsoids];
        let shells = scene.draw.impostors != ImpostorMode::Off;
        let [_, of_shells @ ..] = variant;
        let impostors = || Impostors::new(device, compiler, scene, format, (lit, of_shells));
        let has_sprites = has_blobs && path != DrawPath::Tiles;
        let n_chunks = match scene.draw.chunks {
            ChunkMode::Of(n) if has_sprites => n,
            _ => 0,
        };
        let chunks = || {
            let [grouped, counted, textured, threshold, ellipsoids] = of_shells;
            let (size, n) = ([film.width, film.height], [scene.n_particles() as u32, n_chunks]);
            Chunks::new(
                device,
                compiler,
                size,
                format,
                n,
                [lit, grouped, counted, textured, threshold, ellipsoids],
            )
        };
        let target = |name| Image::color_target(device, name, film.width, film.height, format);
        let scenery = || Scenery::new(device, compiler, scene, format, depth_only);
        Ok(Drawing {
            sprites: (has_sprites && n_chunks == 0)
                .then(|| Sprites::new(device, compiler, format, lit, variant))
                .transpose()?,
            chunks: (n_chunks > 0).then(chunks).transpose()?,
            tiling: has_tiles
                .then(|| Tiling::of_scene(device, compiler, scene, format))
                .transpose()?,
            targets: match has_sprites || behind || shells {
                true => Some([target("picture.even")?, target("picture.odd")?]),
                false => None,
            },
            scenery: behind.then(scenery).transpose()?,
            impostors: shells.then(impostors).transpose()?,
            shrunk: None,
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

    /// What sees the blobs, and the columns and rows of the picture that they are drawn into.
    pub fn seen(&self, camera: &CameraRecord, s: &Settings) -> (CameraRecord, [u32; 2]) {
        match &self.shrunk {
            Some(shrunk) => (shrunk.camera(camera), shrunk.size()),
            None => (*camera, s.size),
        }
    }

    /// `plan` with what becomes of the impostors.
    pub fn decide(&mut self, plan: Plan, packet: &Packet) -> Plan {
        match &mut self.impostors {
            Some(impostors) => impostors.decide(plan, packet),
            None => plan,
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
        let path = if plan.runs(Pass::Tiles) { DrawPath::Tiles } else { DrawPath::Sprites };
        for solids in [Pass::Surfaces, Pass::Terrain] {
            pass(rec, plan, solids, |rec| self.record_behind(rec, solids, b, packet, s))?;
        }
        pass(rec, plan, Pass::Impostors, |rec| self.record_impostors(rec, path, b, packet, s))?;
        for (of, path) in [(Pass::Sprites, DrawPath::Sprites), (Pass::Tiles, DrawPath::Tiles)] {
            pass(rec, plan, of, |rec| self.record_over(rec, path, b, packet, s))?;
        }
        pass(rec, plan, Pass::Upsample, |rec| self.record_upsample(rec, path))
    }

    fn record_impostors(
        &mut self,
        rec: &mut Recorder<'_>,
        path: DrawPath,
        b: &Buffers,
        packet: &Packet,
        s: &Settings,
    ) -> Result<()> {
        let (Some(impostors), Some(targets)) = (&mut self.impostors, &mut self.targets) else {
            return Ok(());
        };
        let depth = self.scenery.as_mut().map(|scenery| &mut scenery.depth);
        let target = Target { color: &mut targets[self.i_picture], depth };
        impostors.record(rec, path, b, target, packet, s)
    }

    /// The whole picture by `path`.
    pub fn record_all(
        &mut self,
        rec: &mut Recorder<'_>,
        path: DrawPath,
        b: &Buffers,
        packet: &Packet,
        s: &Settings,
    ) -> Result<()> {
        for solids in [Pass::Surfaces, Pass::Terrain] {
            self.record_behind(rec, solids, b, packet, s)?;
        }
        self.record_over(rec, path, b, packet, s)?;
        self.record_upsample(rec, path)
    }

    /// What one of the passes draws that hide blobs, and what the blobs' picture needs of it.
    fn record_behind(
        &mut self,
        rec: &mut Recorder<'_>,
        solids: Pass,
        b: &Buffers,
        packet: &Packet,
        s: &Settings,
    ) -> Result<()> {
        let is_drawn = self.record_solids(rec, solids, b, &packet.camera, s)?;
        match &mut self.shrunk {
            Some(shrunk) if is_drawn => shrunk.record_solids(rec, solids, b, packet, s),
            _ => Ok(()),
        }
    }

    /// Draws what is sorted, in one of the ways that there are.
    pub fn record_over(
        &mut self,
        rec: &mut Recorder<'_>,
        path: DrawPath,
        b: &Buffers,
        packet: &Packet,
        s: &Settings,
    ) -> Result<()> {
        match &mut self.shrunk {
            Some(shrunk) => shrunk.record_blobs(rec, path, b, packet, s),
            None => self.record_blobs(rec, path, b, (packet.n_drawn, &packet.camera), s),
        }
    }

    fn record_upsample(&mut self, rec: &mut Recorder<'_>, path: DrawPath) -> Result<()> {
        let (i, depth) = (self.i_picture, self.scenery.as_mut().map(|scenery| &mut scenery.depth));
        let under = self.targets.as_mut().map(|targets| Target { color: &mut targets[i], depth });
        match &mut self.shrunk {
            Some(shrunk) => {
                shrunk.record(rec, path, i, under.filter(|under| under.depth.is_some()))
            }
            None => Ok(()),
        }
    }

    /// And whether there was anything to draw.
    pub fn record_solids(
        &mut self,
        rec: &mut Recorder<'_>,
        solids: Pass,
        b: &Buffers,
        camera: &CameraRecord,
        s: &Settings,
    ) -> Result<bool> {
        let (Some(scenery), Some(targets)) = (&mut self.scenery, &mut self.targets) else {
            return Ok(false);
        };
        scenery.record(rec, solids, b, &mut targets[self.i_picture], camera, s)
    }

    /// Draws the first `n_drawn` of what is sorted into the picture itself, over the shell where
    /// there is one.
    pub fn record_blobs(
        &mut self,
        rec: &mut Recorder<'_>,
        path: DrawPath,
        b: &Buffers,
        (n_drawn, camera): (u32, &CameraRecord),
        s: &Settings,
    ) -> Result<()> {
        let counts = (b.amount(n_drawn), s.n_solid_facets);
        let near = self.impostors.as_ref().and_then(Impostors::near);
        let buffers = near.map_or(b.of_sprites(), |near| b.of_sprites_from(near));
        let (i, depth) = (self.i_picture, self.scenery.as_mut().map(|scenery| &mut scenery.depth));
        let target = self.targets.as_mut().map(|targets| Target { color: &mut targets[i], depth });
        match path {
            DrawPath::Tiles => {
                let Some(tiling) = &self.tiling else {
                    return Err(Error::usage("no tiles were made"));
                };
                let Settings { cutoff, threshold, saturated, .. } = *s;
                let view = View { camera, cutoff, threshold, saturated };
                let under = target.filter(|target| target.depth.is_some() || near.is_some());
                tiling.record(rec, i, under, buffers, &view, counts)
            }
            _ => {
                let Some(target) = target else { return Err(no_sprites()) };
                let is_under = target.depth.is_some() || near.is_some();
                let start = if is_under { LoadOp::Load } else { LoadOp::Clear };
                let cuts = [s.cutoff, s.threshold];
                match (&self.sprites, &mut self.chunks) {
                    (Some(sprites), _) => {
                        sprites.record_from(rec, buffers, (target, start), camera, cuts, counts)
                    }
                    (_, Some(chunks)) => {
                        let view = chunks::View { camera, cuts, saturated: s.saturated };
                        chunks.record(rec, buffers, (target, start), &view, counts)
                    }
                    _ => Err(no_sprites()),
                }
            }
        }
    }

    /// Copies picture `i` as `path` has drawn it.
    pub fn record_read(&mut self, rec: &mut Recorder<'_>, path: DrawPath, i: usize, to: &Buffer) {
        match (&self.shrunk, path, &self.tiling, &mut self.targets) {
            (Some(shrunk), ..) => rec.copy(&shrunk.pictures[i], to),
            (_, DrawPath::Tiles, Some(tiling), _) => rec.copy(&tiling.pictures[i], to),
            (.., Some(targets)) => rec.copy_image(&mut targets[i], to),
            _ => {}
        }
    }

    /// The buffer that picture `i` lies in; none where it is an image.
    pub fn picture(&self, path: DrawPath, i: usize) -> Option<&Buffer> {
        match (&self.shrunk, path, &self.tiling) {
            (Some(shrunk), ..) => Some(&shrunk.pictures[i]),
            (_, DrawPath::Tiles, Some(tiling)) => Some(&tiling.pictures[i]),
            _ => None,
        }
    }

    /// Copies the blobs that `path` has drawn into this picture.
    pub fn record_copy(&mut self, rec: &mut Recorder<'_>, path: DrawPath, to: &Buffer) {
        self.record_read(rec, path, self.i_picture, to);
    }

    /// Copies the depth of what hides blobs.
    pub fn record_copy_depth(&mut self, rec: &mut Recorder<'_>, to: &Buffer) {
        if let Some(scenery) = &mut self.scenery {
            rec.copy_image(&mut scenery.depth, to);
        }
    }
}

fn no_sprites() -> Error {
    Error::usage("no sprites were made")
}
