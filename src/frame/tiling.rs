//! What draws where `draw.path` is "tiles": splats, their pairs sorted by bin, and the picture.

use super::feed::IN_FLIGHT;
use super::grouping::is_grouped;
use crate::error::{Error, Result};
use crate::gpu::TargetFormat;
use crate::gpu::{Buffer, Compiler, Device, MemoryUsage, RecordCount, Recorder, Target};
use crate::model::cloud::{Group, SQRT_TAU};
use crate::model::film::FilmFormat;
use crate::model::scene::{Impostors, LightingMode, Scene};
use crate::passes::sort::{Counts, Sort, TILE};
use crate::passes::tiles::{Division, THIN, Tiles, Variant, View, invocations};

pub struct Tiling {
    tiles: Tiles,
    sort: Sort,
    /// One is drawn while the other is read.
    pub pictures: [Buffer; IN_FLIGHT],
}

impl Tiling {
    /// For pictures of `division` with at most `n_max` particles.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        division: Division,
        n_max: u32,
        variant: &Variant,
    ) -> Result<Tiling> {
        let tiles = Tiles::new(device, compiler, division, n_max, variant)?;
        let bytes = u64::from(division.width)
            * u64::from(division.height)
            * variant.format.bytes_per_pixel();
        let picture = |name| Buffer::new::<u8>(device, name, bytes, MemoryUsage::Device);
        let sort = Sort::for_bits(device, compiler, tiles.capacity(), division.n_bits())?;
        Ok(Tiling { sort, tiles, pictures: [picture("tiles.even")?, picture("tiles.odd")?] })
    }

    /// For the pictures of `scene`.
    pub fn of_scene(
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
        format: TargetFormat,
    ) -> Result<Tiling> {
        let behind = scene.has_solids() || scene.draw.impostors != Impostors::Off;
        Tiling::of_size(
            device,
            compiler,
            scene,
            [scene.film.width, scene.film.height],
            (format, behind),
        )
    }

    /// For pictures of the scene of another size; `behind`: over what has been drawn.
    pub fn of_size(
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
        [width, height]: [u32; 2],
        (format, behind): (TargetFormat, bool),
    ) -> Result<Tiling> {
        // A particle is three texels, the light of a facet four.
        let n_texels = (3 * scene.n_particles()).max(4 * scene.n_facets());
        if n_texels > device.limits().max_texels {
            return Err(Error::limit(format!(
                "draw.path = \"tiles\": {n_texels} texels of particles or facets are wanted, this \
                 device takes {} at most \
                 (maxTexelBufferElements); expected \"sprites\"",
                device.limits().max_texels
            )));
        }
        let division = Division::of(width, height, invocations(device.limits()))?;
        let variant = Variant { behind, ..variant(scene, format) };
        Tiling::new(device, compiler, division, scene.n_particles() as u32, &variant)
    }

    /// Draws the first `n` of the sorted entries, the particles' facets from `i_first_facet` on,
    /// into picture `i`, over the drawn surfaces where there are any. `buffers` as in `sprites`.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        i: usize,
        under: Option<Target<'_>>,
        buffers: [&Buffer; 9],
        view: &View<'_>,
        (n, i_first_facet): (RecordCount<'_>, u32),
    ) -> Result<()> {
        let (tiles, picture) = (&self.tiles, &self.pictures[i]);
        match under {
            Some(under) => tiles.record_under(rec, under, picture),
            None => tiles.record_nothing(rec, picture),
        }
        if matches!(n, RecordCount::Known(0)) {
            return Ok(());
        }
        tiles.record_splats(rec, buffers, view, n, [i_first_facet, TILE])?;
        for i_round in 0..tiles.n_rounds {
            tiles.record_pairs(rec, i_round, n, view)?;
            let [i_count, i_groups] = Tiles::i_extent(i_round);
            let pairs = Counts { buffer: &tiles.round, i_count, i_groups };
            let sorted =
                self.sort.record_counted(rec, &tiles.entries, tiles.division.n_bits(), pairs)?;
            tiles.record_compose(rec, i_round, [sorted, picture, buffers[8]], view)?;
        }
        Ok(())
    }
}

/// How a scene is drawn.
fn variant(scene: &Scene, format: TargetFormat) -> Variant {
    Variant {
        textured: scene.is_textured(),
        ellipsoids: scene.has_ellipsoids(),
        threshold: scene.draw.threshold.is_active(),
        lit: scene.lighting.mode != LightingMode::None,
        grouped: is_grouped(scene),
        weighted: scene.draw.count.is_some(),
        format,
        behind: scene.has_solids(),
        tau_most: tau_most(scene),
        portable: false,
        most_pairs: None,
        most_tiles: None,
    }
}

/// Whether the tiles' shaders take all of the scene's blobs for thin.
pub fn is_thin(scene: &Scene) -> bool {
    tau_most(scene) <= THIN
}

/// What may be left out behind a pixel: half a step of the format below 1, where a target shows no
/// less.
pub fn saturated(format: FilmFormat) -> f64 {
    0.5 * format.unit_roundoff()
}

/// No blob of the scene has a greater optical depth at any time.
fn tau_most(scene: &Scene) -> f64 {
    if scene.is_animated() {
        return f64::INFINITY;
    }
    let of = |g: &Group| {
        let growth = scene.clouds[g.i_cloud].growth.to.max(1.0);
        // One particle stands for all of its group at most.
        let denser = if scene.draw.count.is_some_and(|c| c.conserve) {
            f64::from(g.n_particles)
        } else {
            1.0
        };
        SQRT_TAU * g.kappa_max * g.sigma_widest() * growth * denser
    };
    scene.groups().iter().map(of).fold(0.0, f64::max)
}
