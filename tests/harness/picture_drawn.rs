//! Rendering of a test picture by every drawing path of the device.

use glam::DVec3;
use half::f16;
use nimbus::error::Result;
use nimbus::frame::{ChunkCount, ChunkedSprites, Tiling};
use nimbus::gpu::TargetFormat;
use nimbus::gpu::{
    BlendMode, Buffer, Compiler, Image, LoadOp, MemoryUsage, Primitives, RecordCount, Recorder,
    Target,
};
use nimbus::layout::facet::SlopeRecord;
use nimbus::layout::frame::CameraRecord;
use nimbus::model::edge::Edge;
use nimbus::model::film::{Film, FilmFormat, ToneMap};
use nimbus::passes::blobs::{BlobBuffers, BlobCount, BlobVariant, BlobView, Extent, THIN};
use nimbus::passes::sprites::Sprites;
use nimbus::passes::surfaces::Surfaces;
use nimbus::passes::tiles::{Division, Sharing, Variant};
use nimbus::reference::Blob;
use nimbus::reference::texture::{Level, Pool, QUANTUM};

use super::Picture;
use crate::bounded::U;
use crate::harness::Gpu;

/// Parameters of the tile path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tiled {
    pub invocations: u32,
    /// By default as suits the device.
    pub sharing: Option<Sharing>,
    pub max_pairs: Option<u64>,
    pub max_tiles: Option<u32>,
    pub saturated: f64,
}

/// A drawing path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    /// As quads.
    Sprites,
    /// As points, where none is too large for the device.
    Points,
    Tiles(Tiled),
    /// Number of chunks, and the saturation beyond which layers are left out.
    Chunks(u32, f64),
}

/// Input buffers of the passes.
struct Uploaded {
    n_entries: u32,
    n_surface_facets: u32,
    /// Buffers of the sprite path; the fourth holds the facets' light.
    of_sprites: [Buffer; 11],
    regions: Buffer,
    n_regions: u32,
}

/// The passes.
enum Made {
    Sprites(Box<Sprites>),
    Tiles(Box<Tiling>, f64),
    Chunks(Box<ChunkedSprites>, f64),
}

impl Picture {
    /// Draws the picture as sprites and returns four numbers per pixel. Without particles only
    /// rectangles are drawn. Quads and points must have the same pixels; a mutated shader draws
    /// quads alone.
    pub fn draw(
        &self,
        gpu: &mut Gpu,
        compiler: Option<&Compiler>,
        format: TargetFormat,
    ) -> Vec<f64> {
        let quads = self.draw_by(gpu, compiler, format, Way::Sprites);
        if compiler.is_none() {
            assert_eq!(self.draw_by(gpu, None, format, Way::Points), quads, "points and quads");
        }
        quads
    }

    /// Returns whether sprites are drawn as points.
    pub fn has_points(&self, gpu: &Gpu) -> bool {
        let made = self.make(gpu, &gpu.compiler, TargetFormat::Rgba8, Way::Points);
        let (camera, extents) = (self.camera_record(), self.extents());
        let view = self.blob_view(&camera, Some(&extents), 0.0);
        let size = [self.view.width, self.view.height];
        let is_points = |s: &Sprites| s.primitives(&view, size) == Primitives::Points;
        matches!(made, Made::Sprites(sprites) if is_points(&sprites))
    }

    /// Returns the extents of the blobs, each one's alone.
    fn extents(&self) -> Vec<Extent> {
        let of = |blob: &Blob| Extent {
            center: blob.position,
            half: DVec3::ZERO,
            sigma_max: blob.widest(),
            sigma_mean: blob.sigma,
            reach: self.view.edge.radius,
            n_particles: 1,
        };
        self.blobs().iter().map(of).collect()
    }

    fn blob_view<'a>(
        &'a self,
        camera: &'a CameraRecord,
        extents: Option<&'a [Extent]>,
        saturated: f64,
    ) -> BlobView<'a> {
        let Edge { radius: cutoff, tau: threshold, least } = self.view.edge;
        let slice = self.view.slice;
        let cells = self.cells.as_ref().map(|(grid, _)| grid);
        BlobView { camera, cutoff, threshold, least, saturated, slice, extents, cells }
    }

    /// Draws the picture by the given path.
    pub fn draw_by(
        &self,
        gpu: &mut Gpu,
        compiler: Option<&Compiler>,
        format: TargetFormat,
        way: Way,
    ) -> Vec<f64> {
        let compiler = compiler.unwrap_or(&gpu.compiler);
        let mut made = self.make(gpu, compiler, format, way);
        let under = self
            .scenery
            .is_some()
            .then(|| Surfaces::new(&gpu.device, compiler, format, false).expect("surfaces"));
        let uploaded = self.upload(gpu);
        let (width, height) = (self.view.width, self.view.height);
        let mut target = Image::color_target(&gpu.device, "test.target", width, height, format)
            .expect("a target");
        let mut depth = under
            .is_some()
            .then(|| Image::depth(&gpu.device, "test.depth", width, height).expect("depth"));
        let camera = self.camera_record();
        let n_pixels = u64::from(width) * u64::from(height);
        let (n_numbers, bytes) = (4 * n_pixels as usize, n_pixels * format.bytes_per_pixel());
        let readback = Buffer::new::<u8>(&gpu.device, "test.pixels", bytes, MemoryUsage::Readback)
            .expect("readback");
        gpu.run(|rec| {
            if let Some(under) = &under {
                let target = Target { color: &mut target, depth: depth.as_mut() };
                under.record(
                    rec,
                    [&uploaded.regions, &uploaded.of_sprites[3]],
                    target,
                    &camera,
                    uploaded.n_regions,
                )?;
            }
            if under.is_none() || uploaded.n_entries > 0 {
                let target = Target { color: &mut target, depth: depth.as_mut() };
                self.record(rec, &mut made, &uploaded, target, &camera)?;
            }
            match &made {
                Made::Tiles(tiling, _) if under.is_none() || uploaded.n_entries > 0 => {
                    rec.copy(&tiling.pictures[0], &readback)
                }
                _ => rec.copy_image(&mut target, &readback),
            }
            Ok(())
        });
        match format {
            TargetFormat::Rgba8 | TargetFormat::Bgra8 => readback
                .read::<u8>(n_numbers)
                .expect("read")
                .into_iter()
                .map(|v| f64::from(v) / 255.0)
                .collect(),
            TargetFormat::Rgba16f => {
                readback.read::<f16>(n_numbers).expect("read").iter().map(|v| v.to_f64()).collect()
            }
            TargetFormat::Rgba32f => {
                readback.read::<f32>(n_numbers).expect("read").into_iter().map(f64::from).collect()
            }
        }
    }

    pub fn camera_record(&self) -> CameraRecord {
        let film = Film {
            width: self.view.width,
            height: self.view.height,
            format: FilmFormat::Rgba16f,
            background: DVec3::ZERO,
            exposure: 1.0,
            tone_map: ToneMap::Clip,
        };
        CameraRecord::new(&self.camera, &self.view.pose, &film, DVec3::ZERO)
    }

    fn make(&self, gpu: &Gpu, compiler: &Compiler, format: TargetFormat, way: Way) -> Made {
        let variant = self.variant();
        match way {
            Way::Sprites | Way::Points => {
                let blend =
                    if self.scenery.is_some() { BlendMode::OverTested } else { BlendMode::Over };
                let primitives = match way {
                    Way::Points => Primitives::Points,
                    _ => Primitives::Strips,
                };
                let way = (blend, primitives);
                let made = Sprites::new(&gpu.device, compiler, format, variant, way);
                Made::Sprites(Box::new(made.expect("sprites")))
            }
            Way::Tiles(tiled) => {
                Made::Tiles(Box::new(self.tiling(gpu, compiler, format, &tiled)), tiled.saturated)
            }
            Way::Chunks(n_chunks, saturated) => {
                // Capacity for more particles than there are, as after culling.
                let count = ChunkCount { n_max: self.placed.len() as u32 + 37, n_chunks };
                let size = [self.view.width, self.view.height];
                let chunks =
                    ChunkedSprites::new(&gpu.device, compiler, size, format, count, variant);
                Made::Chunks(Box::new(chunks.expect("chunks")), saturated)
            }
        }
    }

    fn upload(&self, gpu: &mut Gpu) -> Uploaded {
        let scenery = self.scenery.clone().unwrap_or_default();
        let entries: Vec<[u32; 2]> = self.order().into_iter().map(|i| [0, i]).collect();
        // Facets of surfaces precede those of particles.
        let facets = [&scenery.lit, self.lit.as_deref().unwrap_or(&[])].concat();
        let none = vec![SlopeRecord::default(); scenery.lit.len()];
        let slopes = [none, self.slopes.clone().unwrap_or_default()].concat();
        // Facet indices count the surfaces' facets as well.
        let n_before = scenery.lit.len() as u32;
        let named: Vec<u32> = self.i_facet.iter().flatten().map(|i| i + n_before).collect();
        let (of_drawn, of_groups) = self.drawn.clone().unwrap_or_default();
        let (of_textured, textures, words) = match &self.textured {
            Some((i_group, textures, pool)) => (i_group.clone(), textures.clone(), words(pool)),
            None => Default::default(),
        };
        assert!(
            of_drawn.is_empty() || of_textured.is_empty() || of_drawn == of_textured,
            "a particle has one group"
        );
        let i_group = if of_drawn.is_empty() { &of_textured } else { &of_drawn };
        Uploaded {
            n_entries: entries.len() as u32,
            n_surface_facets: n_before,
            of_sprites: [
                gpu.upload(&entries),
                gpu.upload(&self.placed),
                gpu.upload(&self.particles),
                gpu.upload(&facets),
                gpu.upload(&named),
                gpu.upload(i_group),
                gpu.upload(&of_groups),
                gpu.upload(&textures),
                gpu.upload(&words),
                gpu.upload(&slopes),
                gpu.upload(self.cells.as_ref().map_or(&[][..], |(_, cells)| cells)),
            ],
            regions: gpu.upload(&scenery.regions),
            n_regions: scenery.regions.len() as u32,
        }
    }

    fn record(
        &self,
        rec: &mut Recorder<'_>,
        made: &mut Made,
        uploaded: &Uploaded,
        target: Target<'_>,
        camera: &CameraRecord,
    ) -> Result<()> {
        let [
            entries,
            placed,
            particles,
            lit,
            i_facet,
            i_group,
            drawn,
            textured,
            pool,
            slopes,
            seen,
        ] = uploaded.of_sprites.each_ref();
        let from = BlobBuffers {
            entries,
            placed,
            particles,
            lit,
            i_facet,
            i_group,
            drawn,
            textured,
            pool,
            slopes,
            seen,
        };
        let i_first_facet = uploaded.n_surface_facets;
        let n = BlobCount { n: RecordCount::Known(uploaded.n_entries), i_first_facet };
        let view = |saturated: f64| self.blob_view(camera, None, saturated);
        let extents = self.extents();
        let start = if self.scenery.is_some() { LoadOp::Load } else { LoadOp::Clear };
        match made {
            Made::Sprites(sprites) => {
                let view = self.blob_view(camera, Some(&extents), 0.0);
                sprites.record(rec, &from, (target, start), &view, n)
            }
            Made::Tiles(tiling, saturated) => {
                let under = self.scenery.is_some().then_some(target);
                tiling.record(rec, 0, under, &from, &view(*saturated), n)
            }
            Made::Chunks(chunks, saturated) => {
                chunks.record(rec, &from, (target, start), &view(*saturated), n)
            }
        }
    }

    fn tiling(
        &self,
        gpu: &Gpu,
        compiler: &Compiler,
        format: TargetFormat,
        tiled: &Tiled,
    ) -> Tiling {
        let division = Division::new(self.view.width, self.view.height, tiled.invocations)
            .expect("a division");
        let blobs = self.blobs();
        let variant = Variant {
            blobs: self.variant(),
            format,
            has_under: self.scenery.is_some(),
            slices: if self.view.slice > 0.0 { self.view.n_parts } else { 0 },
            sharing: tiled.sharing,
            max_pairs: tiled.max_pairs,
            max_tiles: tiled.max_tiles,
        };
        Tiling::new(&gpu.device, compiler, division, blobs.len().max(1) as u32, 1, &variant)
            .expect("tiles")
    }

    fn variant(&self) -> BlobVariant {
        let of = |b: &Blob| b.deepest();
        // Some roundings above the blobs' own numbers in f32.
        let tau_max = (1.0 + 8.0 * U) * self.blobs().iter().map(of).fold(0.0, f64::max);
        BlobVariant {
            lit: self.lit.is_some(),
            grouped: self.i_facet.is_some(),
            weighted: self.drawn.is_some(),
            textured: self.textured.is_some(),
            threshold: self.view.edge.has_threshold(),
            shapes: self.shapes(),
            thin: self.textured.is_none() && tau_max <= THIN,
            shaded: self.slopes.is_some(),
            in_cells: self.cells.is_some(),
        }
    }
}

/// Returns the pool as shaders read it: for every field, level and texel the four corners, n_l in
/// the first two words, n_{l+1} in the others, each in 16 bits.
fn words(pool: &Pool) -> Vec<[u32; 4]> {
    let quanta = |n: f64| (n / QUANTUM) as i16 as u16;
    let both = |a: f64, b: f64| u32::from(quanta(a)) | u32::from(quanta(b)) << 16;
    let texel = |level: &Level, i: usize, j: usize| {
        let of = |n: &[f64]| {
            let at = |i: usize, j: usize| n[i % level.side + level.side * (j % level.side)];
            [both(at(i, j), at(i + 1, j)), both(at(i, j + 1), at(i + 1, j + 1))]
        };
        let ([a, b], [c, d]) = (of(&level.own), of(&level.above));
        [a, b, c, d]
    };
    let of_level = |level: &Level| -> Vec<[u32; 4]> {
        (0..level.side)
            .flat_map(|j| (0..level.side).map(move |i| (i, j)))
            .map(|(i, j)| texel(level, i, j))
            .collect()
    };
    pool.rounded().0.iter().flatten().flat_map(of_level).collect()
}
