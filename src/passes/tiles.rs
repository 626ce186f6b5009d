//! tiles: the blobs as splats, composed in compute, a tile of pixels a workgroup.
//!
//! In: drawn particles far to near, their places, facets' light. Out: the picture in a buffer, rows
//! from the top, in the film's format. Law: that of `sprites` (docs/model.md §9, §11 "sprites",
//! "tiles"), composed near to far in f32 and rounded once. Error: f32's in each layer and the
//! format's once; what lies behind a pixel that lets less than `saturated` through is left out.

mod division;

use crate::error::{Error, Result};
use crate::gpu::Limits;
use crate::gpu::{Buffer, Compiler, Device, Kernel, MemoryUsage, RecordCount, Recorder, Target};
use crate::gpu::{TargetFormat, has_depth24};
use crate::layout::tiles::{RoundRecord, SplatRecord, SplatTextureRecord};
use crate::layout::{cull::KeptRecord, frame::CameraRecord, record};

pub use division::{Division, RUN, TILES_ACROSS, invocations};

record! {
    pub struct SplatPush {
        camera: CameraRecord,
        pixel: [f32; 2],
        cutoff: f32,
        i_first_facet: u32,
        width: u32,
        height: u32,
        tile_width: u32,
        tile_height: u32,
        inv_threshold: f32,
    }
}

record! {
    pub struct RoundsPush {
        n_rounds: u32,
        capacity: u32,
        most_blocks: u32,
        sort_tile: u32,
        bin_groups: u32,
    }
}

record! {
    pub struct ClearPush { n_pixels: u32, unused: u32 }
}

record! {
    pub struct PairsPush {
        tangents: [f32; 2],
        tile: [f32; 2],
        n_bins_x: u32,
        i_round: u32,
        cut: f32,
        inv_threshold: f32,
    }
}

record! {
    pub struct RangesPush { n_bins: u32, i_round: u32, max_groups: u32, most_tiles: u32 }
}

record! {
    pub struct Push {
        tangents: [f32; 2],
        pixel: [f32; 2],
        width: u32,
        height: u32,
        n_bins_x: u32,
        i_round: u32,
        cut: f32,
        saturated: f32,
        inv_threshold: f32,
        /// The scene's y along right, up and forward.
        y_right: f32,
        y_up: f32,
        y_forward: f32,
    }
}

/// Splats of a block; the shaders' BLOCK.
pub const BLOCK: u32 = 256;
/// Blocks of a round. A tile's loops take up to 0.8 turns a splat, and llvmpipe ends all loops of
/// an invocation after 65 535.
const MOST_BLOCKS: u32 = 256;
/// Words of a round.
const ROUND_WORDS: u32 = (size_of::<RoundRecord>() / 4) as u32;
/// Blocks: workgroups along x that every device has.
const MOST: u32 = 65_535;
/// Most pairs that there is room for at once; the sort goes through its tiles of 1024 twice in one
/// invocation, and llvmpipe's loops take 65 535 turns.
const MOST_PAIRS: u64 = 1 << 24;
pub const THIN: f64 = 0.125; // The optical depth of a thin scene's deepest blob, at most.

/// How a scene is drawn, constant over a run.
#[derive(Debug, Clone, Copy)]
pub struct Variant {
    pub lit: bool,
    pub grouped: bool,
    /// Some splats have textures.
    pub textured: bool,
    /// Not all blobs are balls.
    pub ellipsoids: bool,
    pub weighted: bool,
    pub format: TargetFormat,
    /// Surfaces are drawn, too, or what is far.
    pub behind: bool,
    /// Splats end where their optical depth falls under a threshold.
    pub threshold: bool,
    /// No blob's optical depth is greater.
    pub tau_most: f64,
    /// Without what subgroups can do.
    pub portable: bool,
    /// Room for no more pairs at once.
    pub most_pairs: Option<u64>,
    /// Tiles that a workgroup draws at most, up to all of a bin; else as suits the device.
    pub most_tiles: Option<u32>,
}

/// What is drawn.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    pub camera: &'a CameraRecord,
    /// Sprites end at this many σ.
    pub cutoff: f64,
    /// And where their optical depth falls under this.
    pub threshold: f64,
    /// What lies behind a pixel that lets less than this through is left out.
    pub saturated: f64,
}

pub struct Tiles {
    splat: Kernel,
    rounds: Kernel,
    clear: Kernel,
    pairs: Kernel,
    ranges: Kernel,
    /// Composes the only round of a frame; and one of several.
    alone: Kernel,
    compose: Option<Kernel>,
    pub division: Division,
    /// Of the compose kernel.
    n_bindings: usize,
    capacity: u32,
    pub n_rounds: u32,
    max_groups: u32,
    most_tiles: u32,
    /// What the host knows of the number of splats, where it does (KeptRecord).
    known: Buffer,
    splats: Buffer,
    /// What of them is textured.
    sheets: Buffer,
    /// What of them is an ellipsoid.
    conics: Buffer,
    before: Buffer,
    reaches: Buffer,
    blocks: Buffer,
    /// Of each round what its dispatches need.
    pub round: Buffer,
    /// [bin, splat].
    pub entries: Buffer,
    found: Buffer,
    state: Buffer,
    /// What is composed over, and its depth.
    under: Buffer,
    depths: Buffer,
}

/// Pairs of a bin and a splat that there is room for at once: of most scenes all. Never less than
/// two blocks may have.
fn capacity(n_splats: u32, division: &Division, limits: &Limits, most: Option<u64>) -> u64 {
    let two_blocks = 2 * u64::from(BLOCK) * u64::from(division.n_bins);
    let all = u64::from(n_splats) * u64::from(division.n_bins);
    let room = limits.max_storage_buffer_bytes.min(limits.device_memory_bytes / 16) / 8;
    let most = most.unwrap_or(MOST_PAIRS);
    // All of them, where there is no room for what one round hands to the next.
    let least =
        if has_room_between_rounds(division, limits) { (all / 4).max(1 << 20) } else { all };
    least.min(all).min(room).min(most).max(two_blocks)
}

/// Four floats a pixel.
fn has_room_between_rounds(division: &Division, limits: &Limits) -> bool {
    16 * division.n_pixels() <= limits.max_storage_buffer_bytes
}

/// Tiles that a workgroup draws where they have few pairs. A processor has few workgroups at once,
/// and beginning one costs it as much as a tile; a GPU wants them all.
fn most_tiles(device: &Device) -> u32 {
    if device.info().kind == "cpu" { TILES_ACROSS * TILES_ACROSS } else { 1 }
}

impl Tiles {
    /// Room for `n_max` splats on a picture divided as `division` says.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        division: Division,
        n_max: u32,
        variant: &Variant,
    ) -> Result<Tiles> {
        let n_blocks = n_max.div_ceil(BLOCK);
        if n_blocks > MOST {
            let most = u64::from(MOST) * u64::from(BLOCK);
            return Err(Error::limit(format!(
                "draw.path = \"tiles\" draws {most} particles at most, the scene has {n_max}; \
                 expected \"sprites\""
            )));
        }
        let capacity = capacity(n_max, &division, device.limits(), variant.most_pairs);
        // Every round but the last has less room left than a block may need, or as many blocks as a
        // round may have.
        let worst = u64::from(n_max) * u64::from(division.n_bins);
        let by_pairs =
            worst.div_ceil(capacity - u64::from(BLOCK) * u64::from(division.n_bins)) as u32;
        let n_rounds =
            if worst <= capacity { 1 } else { by_pairs } + n_blocks.div_ceil(MOST_BLOCKS) - 1;
        if n_rounds > 1 && !has_room_between_rounds(&division, device.limits()) {
            return Err(Error::limit(format!(
                "draw.path = \"tiles\", the default: a picture of {}×{} is drawn in rounds where \
                 the scene has {n_max} particles, and 16 bytes a \
                 pixel between them are more than this device's {} (maxStorageBufferRange); \
                 expected draw.path = \"sprites\"",
                division.width,
                division.height,
                device.limits().max_storage_buffer_bytes
            )));
        }
        let constants =
            [(0, variant.lit), (2, variant.grouped), (3, variant.weighted), (4, variant.textured)]
                .map(|(k, v)| (k, u32::from(v)));
        let threshold = u32::from(variant.threshold);
        let of_pairs = [(5, threshold), (6, u32::from(variant.ellipsoids))];
        let of_splat = [&constants[..], &of_pairs].concat();
        let behind = if variant.behind { 1 + u32::from(has_depth24(device)) } else { 0 };
        let pixel_words = (variant.format.bytes_per_pixel() / 4) as u32;
        let together =
            if division.width.is_multiple_of(4 / pixel_words) { 4 / pixel_words } else { 1 };
        let macros = [
            ("INVOCATIONS", division.invocations),
            ("ROWS", division.tile[1]),
            (
                "ONE_SUBGROUP",
                u32::from(
                    !variant.portable && device.limits().is_one_subgroup(division.invocations),
                ),
            ),
            ("THIN", u32::from(variant.tau_most <= THIN && !variant.textured)),
            ("TEXTURED", u32::from(variant.textured)),
            ("ELLIPSOIDS", u32::from(variant.ellipsoids)),
            ("THRESHOLD", threshold),
            ("PIXEL_WORDS", pixel_words),
            ("TOGETHER", together),
            ("WORDS_64", u32::from(device.limits().has_int64)),
            ("BEHIND", behind),
        ];
        let compose = |rounds: u32| {
            let macros = [&macros[..], &[("ROUNDS", rounds)]].concat();
            Kernel::with_macros(device, compiler, "tiles", Push::FIELDS, &[], &macros)
        };
        let buffer = |name, n: u64, words: u64| {
            Buffer::new::<u32>(device, name, n * words, MemoryUsage::Device)
        };
        let n_state = if n_rounds > 1 { division.n_pixels() } else { 1 };
        let [n_sheets, n_conics] = [variant.textured, variant.ellipsoids]
            .map(|are| if are { u64::from(n_max) } else { 1 });
        let n_under = if variant.behind { division.n_pixels() } else { 1 };
        Ok(Tiles {
            splat: Kernel::with_macros(
                device,
                compiler,
                "tiles.splat",
                SplatPush::FIELDS,
                &of_splat,
                &macros[..3],
            )?,
            rounds: Kernel::new(device, compiler, "tiles.rounds", RoundsPush::FIELDS, &[])?,
            clear: Kernel::new(device, compiler, "tiles.clear", ClearPush::FIELDS, &[])?,
            pairs: Kernel::new(device, compiler, "tiles.pairs", PairsPush::FIELDS, &of_pairs)?,
            ranges: Kernel::new(device, compiler, "tiles.ranges", RangesPush::FIELDS, &[])?,
            alone: compose(0)?,
            compose: if n_rounds > 1 { Some(compose(1)?) } else { None },
            division,
            n_bindings: if variant.ellipsoids {
                11
            } else if variant.textured {
                10
            } else if variant.behind {
                8
            } else {
                6
            },
            capacity: capacity as u32,
            n_rounds,
            max_groups: device.limits().max_workgroups_x,
            most_tiles: variant.most_tiles.unwrap_or(most_tiles(device)),
            known: Buffer::new::<KeptRecord>(device, "tiles.known", 1, MemoryUsage::Device)?,
            splats: Buffer::new::<SplatRecord>(
                device,
                "tiles.splats",
                u64::from(n_max),
                MemoryUsage::Device,
            )?,
            sheets: Buffer::new::<SplatTextureRecord>(
                device,
                "tiles.sheets",
                n_sheets,
                MemoryUsage::Device,
            )?,
            conics: buffer("tiles.conics", n_conics, 4)?,
            reaches: buffer("tiles.reaches", n_max.into(), 2)?,
            before: buffer("tiles.before", n_max.into(), 1)?,
            blocks: buffer("tiles.blocks", n_blocks.into(), 1)?,
            round: Buffer::new::<RoundRecord>(
                device,
                "tiles.rounds",
                n_rounds.into(),
                MemoryUsage::Device,
            )?,
            entries: buffer("tiles.entries", capacity, 2)?,
            found: buffer("tiles.ranges", division.n_tiles(), 4)?,
            state: buffer("tiles.state", n_state, 4)?,
            under: buffer("tiles.under", n_under, variant.format.bytes_per_pixel() / 4)?,
            depths: buffer("tiles.depths", n_under, 1)?,
        })
    }

    /// Room for the pairs of a round.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Where the device has the number of splats.
    fn kept<'a>(&'a self, n_splats: RecordCount<'a>) -> &'a Buffer {
        match n_splats {
            RecordCount::Known(_) => &self.known,
            RecordCount::Indirect(kept) => kept,
        }
    }

    /// The splats of the first `n_splats` of the sorted entries, and the rounds they are drawn in;
    /// `sort_tile`: entries that a workgroup of the sort takes. `buffers` as in `sprites`; the
    /// device's count is a KeptRecord.
    pub fn record_splats(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 9],
        view: &View<'_>,
        n_splats: RecordCount<'_>,
        [i_first_facet, sort_tile]: [u32; 2],
    ) -> Result<()> {
        let Division { width, height, tile, .. } = self.division;
        let (camera, pixel, cutoff) = (*view.camera, self.pixel(view.camera), view.cutoff as f32);
        let push = SplatPush {
            camera,
            pixel,
            cutoff,
            i_first_facet,
            width,
            height,
            tile_width: tile[0],
            tile_height: tile[1],
            inv_threshold: inverse(view.threshold),
        };
        let [entries, placed, particles, lit, i_facet, i_group, drawn, textured, _] = buffers;
        if let RecordCount::Known(n) = n_splats {
            rec.update(&self.known, &KeptRecord::of(n, BLOCK));
        }
        let kept = self.kept(n_splats);
        let Tiles { splats, reaches, before, blocks, sheets, conics, .. } = self;
        let from = [entries, placed, particles, lit, i_facet, i_group, drawn, textured];
        let buffers =
            [&from[..], &[splats, reaches, before, blocks, sheets, kept, conics]].concat();
        rec.dispatch_indirect(&self.splat, &buffers, &push, (kept, KeptRecord::I_SPLAT))?;
        let push = RoundsPush {
            n_rounds: self.n_rounds,
            capacity: self.capacity,
            most_blocks: MOST_BLOCKS,
            sort_tile,
            bin_groups: self.division.n_bins.div_ceil(self.ranges.local_size_x()),
        };
        rec.dispatch_groups(&self.rounds, &[&self.blocks, &self.round, kept], &push, 1)?;
        if self.n_rounds == 1 {
            return Ok(());
        }
        let push = ClearPush { n_pixels: self.division.n_pixels() as u32, unused: 0 };
        rec.dispatch(&self.clear, &[&self.round, &self.state], &push, push.n_pixels)
    }

    /// Fetches the drawn surfaces to compose over, and begins `picture` with them.
    pub fn record_under(&self, rec: &mut Recorder<'_>, target: Target<'_>, picture: &Buffer) {
        rec.copy_image(target.color, &self.under);
        match target.depth {
            Some(depth) => rec.copy_image(depth, &self.depths),
            // Infinitely far.
            None => rec.fill(&self.depths, 0),
        }
        rec.copy(&self.under, picture);
    }

    /// Begins `picture` with nothing to compose over.
    pub fn record_nothing(&self, rec: &mut Recorder<'_>, picture: &Buffer) {
        [&self.under, &self.depths, picture].into_iter().for_each(|of| rec.fill(of, 0));
    }

    /// The pairs of round `i`; [`Tiles::i_extent`] says where `round` has their number.
    pub fn record_pairs(
        &self,
        rec: &mut Recorder<'_>,
        i_round: u32,
        n_splats: RecordCount<'_>,
        view: &View<'_>,
    ) -> Result<()> {
        let Division { n_bins_x, tile, .. } = self.division;
        let pixel = self.pixel(view.camera);
        let tile = [pixel[0] * tile[0] as f32, pixel[1] * tile[1] as f32];
        let tangents = [view.camera.tan_x, view.camera.tan_y];
        let (cut, inv_threshold) = (cut(view.cutoff), inverse(view.threshold));
        let push = PairsPush { tangents, tile, n_bins_x, i_round, cut, inv_threshold };
        let buffers = [
            &self.reaches,
            &self.before,
            &self.blocks,
            &self.round,
            &self.entries,
            &self.splats,
            self.kept(n_splats),
        ];
        rec.dispatch_indirect(
            &self.pairs,
            &buffers,
            &push,
            (&self.round, ROUND_WORDS * i_round + 4),
        )
    }

    /// The words of `round` that hold round `i`'s number of pairs, and, three of them, workgroups
    /// that sort them.
    pub fn i_extent(i_round: u32) -> [u32; 2] {
        [ROUND_WORDS * i_round + 3, ROUND_WORDS * i_round]
    }

    /// Composes what `sorted`, round `i`'s pairs by bin, names into `picture`; `pool`: the
    /// textures.
    pub fn record_compose(
        &self,
        rec: &mut Recorder<'_>,
        i_round: u32,
        [sorted, picture, pool]: [&Buffer; 3],
        view: &View<'_>,
    ) -> Result<()> {
        let Division { width, height, n_bins_x, n_bins, .. } = self.division;
        let push = RangesPush {
            n_bins,
            i_round,
            max_groups: self.max_groups,
            most_tiles: self.most_tiles,
        };
        let bins = (&self.round, ROUND_WORDS * i_round + 8);
        rec.dispatch_indirect(&self.ranges, &[sorted, &self.round, &self.found], &push, bins)?;
        let push = Push {
            tangents: [view.camera.tan_x, view.camera.tan_y],
            pixel: self.pixel(view.camera),
            width,
            height,
            n_bins_x,
            i_round,
            cut: cut(view.cutoff),
            saturated: view.saturated as f32,
            inv_threshold: inverse(view.threshold),
            y_right: view.camera.right[1],
            y_up: view.camera.up[1],
            y_forward: view.camera.forward[1],
        };
        let buffers = [
            &self.splats,
            sorted,
            &self.round,
            &self.found,
            &self.state,
            picture,
            &self.under,
            &self.depths,
            &self.sheets,
            pool,
            &self.conics,
        ];
        let buffers = &buffers[..self.n_bindings];
        if i_round == 0 {
            rec.dispatch_indirect(&self.alone, buffers, &push, (&self.round, 16))?;
        }
        match &self.compose {
            Some(compose) => rec.dispatch_indirect(
                compose,
                buffers,
                &push,
                (&self.round, ROUND_WORDS * i_round + 12),
            ),
            None => Ok(()),
        }
    }

    /// Slopes of a pixel's sides.
    fn pixel(&self, camera: &CameraRecord) -> [f32; 2] {
        [
            2.0 * camera.tan_x / self.division.width as f32,
            2.0 * camera.tan_y / self.division.height as f32,
        ]
    }
}

/// b²/(2 σ²) at the cutoff, in powers of two: at most 46, at 8 σ; the shader's power of two goes to
/// 125.
fn cut(cutoff: f64) -> f32 {
    (0.5 * cutoff * cutoff * std::f64::consts::LOG2_E) as f32
}

/// Of a threshold so small that f32 has no inverse of it, infinity: it cuts nothing.
fn inverse(threshold: f64) -> f32 {
    (1.0 / threshold) as f32
}
