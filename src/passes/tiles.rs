//! tiles: composes the blobs in compute shaders, a tile of pixels a workgroup.
//!
//! In: drawn particles far to near, their places, the facets' light. Out: the picture in a buffer,
//! rows from the top, in the film's format. Law: that of `sprites` (model.md §9, passes.md
//! "sprites", "tiles"), composed near to far in f32 and rounded once. Error: f32 rounding in each
//! layer, one rounding to the format, and the light behind pixels whose transmittance is below
//! `saturated`.

mod division;
mod push;
mod rounds;

use super::blobs::{BlobBuffers, BlobCount, BlobVariant, BlobView};
use crate::error::Result;
use crate::gpu::{
    Buffer, Compiler, Device, DeviceCount, Kernel, RecordCount, Recorder, Target, TargetFormat,
    buffers, has_depth24,
};
use crate::layout::cull::KeptRecord;
use crate::layout::particle::Shapes;
use crate::layout::tiles::{RoundRecord, SplatRecord, SplatTextureRecord};

pub use division::{Division, RUN, TILES_ACROSS, invocations};
use push::in_powers_of_two;
pub use push::{ClearPush, PairsPush, Push, RangesPush, RoundsPush, SplatPush};
pub use rounds::{BLOCK, MAX_SLICES};
use rounds::{Form, Rounds};

/// The way in which the invocations of a tile share the splats that they have found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sharing {
    /// In registers, by subgroup operations.
    Registers,
    /// In shared memory, by subgroup operations.
    Subgroup,
    /// In shared memory, by barriers. A device whose workgroups are not one subgroup has no other.
    Barriers,
}

/// Words of a round.
const ROUND_WORDS: u32 = (size_of::<RoundRecord>() / 4) as u32;

/// The properties of a scene and picture that the kernels are compiled for.
#[derive(Debug, Clone, Copy)]
pub struct Variant {
    /// Properties of the blobs.
    pub blobs: BlobVariant,
    /// Format of the picture.
    pub format: TargetFormat,
    /// The blobs are composed over a picture of surfaces or of an impostor layer.
    pub has_under: bool,
    /// Slices among which an overlapping blob is dealt; 0: blobs are composed one after the other.
    /// Views have a slice where it is above 0.
    pub slices: u32,
    /// The way in which invocations share splats; by default as suits the device.
    pub sharing: Option<Sharing>,
    /// Bound of the pairs held at once; by default as many as suit the device.
    pub max_pairs: Option<u64>,
    /// Bound of the tiles that a workgroup draws, up to all of a bin; by default as suits the
    /// device.
    pub max_tiles: Option<u32>,
}

buffers! {
    /// Scratch of the pass.
    struct Scratch(n_max: u64, division: Division, rounds: Rounds, variant: Variant) {
        /// Number of splats (`KeptRecord`) where the host knows it.
        known: Buffer => KeptRecord, 1, "tiles.known";
        splats: Buffer => SplatRecord, n_max, "tiles.splats", TexelStores;
        /// Texture coordinates of splats.
        sheets: Buffer => SplatTextureRecord, one_unless(variant.blobs.textured, n_max),
            "tiles.sheets", TexelStores;
        /// Shapes of ellipsoids.
        conics: Buffer => [u32; 4], n_conics(variant.blobs.shapes, n_max), "tiles.conics",
            TexelStores;
        /// Changes of the light of shaded splats.
        shades: Buffer => [u32; 4], one_unless(variant.blobs.shaded, n_max), "tiles.shades",
            TexelStores;
        reaches: Buffer => [u32; 2], n_max, "tiles.reaches";
        before: Buffer => u32, n_max, "tiles.before";
        blocks: Buffer => u32, rounds.n_blocks.into(), "tiles.blocks";
        round: Buffer => RoundRecord, rounds.n.into(), "tiles.rounds";
        /// Pairs: bin and splat.
        entries: Buffer => [u32; 2], rounds.capacity, "tiles.entries";
        ranges: Buffer => [u32; 4], division.n_tiles(), "tiles.ranges";
        /// State of pixels between rounds.
        state: Buffer => [u32; 4], one_unless(rounds.n > 1, n_state(&division, variant.slices)),
            "tiles.state";
        /// The picture beneath the blobs, words of pixels.
        under: Buffer => u32,
            one_unless(variant.has_under, division.n_pixels()) * pixel_words(variant.format),
            "tiles.under";
        depths: Buffer => u32, one_unless(variant.has_under, division.n_pixels()), "tiles.depths";
    }
}

fn one_unless(is_used: bool, n: u64) -> u64 {
    if is_used { n } else { 1 }
}

/// Returns the number of fours of the shapes of `n` splats.
fn n_conics(shapes: Shapes, n: u64) -> u64 {
    (n * shapes as u64).max(1)
}

/// Returns the number of fours of the state of all pixels.
fn n_state(division: &Division, slices: u32) -> u64 {
    rounds::state_fours(slices) * division.n_pixels()
}

fn pixel_words(format: TargetFormat) -> u64 {
    format.bytes_per_pixel() / 4
}

/// The pipelines and scratch buffers of the pass.
pub struct Tiles {
    splat: Kernel,
    rounds: Kernel,
    clear: Kernel,
    pairs: Kernel,
    ranges: Kernel,
    /// Composes the only round of a frame.
    alone: Kernel,
    /// Composes one of several rounds.
    compose: Option<Kernel>,
    division: Division,
    n_compose_bindings: usize,
    rounds_spec: Rounds,
    slices: u32,
    max_groups: u32,
    max_tiles: u32,
    scratch: Scratch,
}

/// Returns the most tiles that a workgroup draws where they have few pairs. A CPU runs few
/// workgroups at once, and starting one costs it as much as a tile; a GPU needs all of them.
fn default_max_tiles(device: &Device) -> u32 {
    if device.info().kind == "cpu" { TILES_ACROSS * TILES_ACROSS } else { 1 }
}

impl Tiles {
    /// Creates the pipelines, and scratch buffers for `n_max` splats on a divided picture.
    ///
    /// # Errors
    /// Fails if there are too many splats or pixels for the device, or a shader does not compile.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        division: Division,
        n_max: u32,
        variant: &Variant,
    ) -> Result<Tiles> {
        let Variant { blobs, format, has_under, slices, .. } = *variant;
        let limits = device.limits();
        let sharing = match variant.sharing {
            _ if !limits.is_one_subgroup(division.invocations) => Sharing::Barriers,
            Some(sharing) => sharing,
            // llvmpipe reads and writes shared memory for one invocation after the other.
            None if device.info().kind == "cpu" => Sharing::Registers,
            None => Sharing::Subgroup,
        };
        let is_one_subgroup = sharing != Sharing::Barriers;
        let form = Form { is_one_subgroup, slices };
        let rounds = Rounds::new(n_max, &division, limits, variant.max_pairs, form)?;
        let constants = blobs.constants();
        let pixel_words = pixel_words(format) as u32;
        let together = 4 / pixel_words;
        let macros = [
            ("INVOCATIONS", division.invocations),
            ("ROWS", division.tile[1]),
            ("ONE_SUBGROUP", u32::from(is_one_subgroup)),
            ("THIN", u32::from(blobs.thin)),
            ("TEXTURED", u32::from(blobs.textured)),
            ("ELLIPSOIDS", blobs.shapes as u32),
            ("SHADED", u32::from(blobs.shaded)),
            ("CELLS", u32::from(blobs.in_cells)),
            ("THRESHOLD", u32::from(blobs.threshold)),
            ("SLICES", slices),
            ("QUEUE", u32::from(sharing == Sharing::Registers)),
            ("PIXEL_WORDS", pixel_words),
            ("TOGETHER", if division.width.is_multiple_of(together) { together } else { 1 }),
            ("WORDS_64", u32::from(limits.has_int64)),
            ("BEHIND", if has_under { 1 + u32::from(has_depth24(device)) } else { 0 }),
        ];
        let for_splats = [&macros[..3], &[("CELLS", u32::from(blobs.in_cells))]].concat();
        let kernel = |name, fields, constants: &[_], macros: &[_]| {
            Kernel::with_macros(device, compiler, name, fields, constants, macros)
        };
        let compose = |is_one_of_several: u32| {
            let macros = [&macros[..], &[("ROUNDS", is_one_of_several)]].concat();
            kernel("tiles", Push::FIELDS, &[], &macros)
        };
        Ok(Tiles {
            splat: kernel("tiles.splat", SplatPush::FIELDS, &constants, &for_splats)?,
            rounds: kernel("tiles.rounds", RoundsPush::FIELDS, &[], &macros[..3])?,
            clear: kernel("tiles.clear", ClearPush::FIELDS, &[], &[])?,
            pairs: kernel("tiles.pairs", PairsPush::FIELDS, &constants, &[])?,
            ranges: kernel("tiles.ranges", RangesPush::FIELDS, &[], &[])?,
            alone: compose(0)?,
            compose: (rounds.n > 1).then(|| compose(1)).transpose()?,
            division,
            n_compose_bindings: match blobs {
                BlobVariant { in_cells: true, .. } => 13,
                BlobVariant { shaded: true, .. } => 12,
                BlobVariant { shapes, .. } if shapes > Shapes::Balls => 11,
                BlobVariant { textured: true, .. } => 10,
                _ if has_under => 8,
                _ => 6,
            },
            rounds_spec: rounds,
            slices,
            max_groups: limits.max_workgroups_x,
            max_tiles: variant.max_tiles.unwrap_or(default_max_tiles(device)),
            scratch: Scratch::new(device, n_max.into(), division, rounds, *variant)?,
        })
    }

    /// Returns the most pairs of a round.
    pub fn capacity(&self) -> u32 {
        self.rounds_spec.capacity as u32
    }

    /// Returns the most rounds of a frame with this view.
    pub fn n_rounds(&self, view: &BlobView<'_>) -> u32 {
        self.rounds_spec.of_frame(&self.division, view)
    }

    fn kept<'a>(&'a self, n: RecordCount<'a>) -> &'a Buffer {
        match n {
            RecordCount::Known(_) => &self.scratch.known,
            RecordCount::Indirect(kept) => kept,
        }
    }

    /// Makes splats of the first `count` entries and divides them among rounds. `sort_tile` is the
    /// number of pairs that a workgroup of the sort takes.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record_splats(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &BlobBuffers<'_>,
        view: &BlobView<'_>,
        BlobCount { n, i_first_facet }: BlobCount<'_>,
        sort_tile: u32,
    ) -> Result<()> {
        let Division { width, height, tile, n_bins, .. } = self.division;
        let Scratch {
            known, splats, sheets, conics, shades, reaches, before, blocks, round, ..
        } = &self.scratch;
        let push = SplatPush {
            camera: *view.camera,
            pixel: self.pixel(view),
            cutoff: view.cutoff as f32,
            i_first_facet,
            width,
            height,
            tile_width: tile[0],
            tile_height: tile[1],
            inv_threshold: view.inv_threshold(),
            least_cut: view.least_cut() as f32,
        };
        if let RecordCount::Known(n) = n {
            rec.update(known, &KeptRecord::of(n, BLOCK));
        }
        let kept = self.kept(n);
        let BlobBuffers {
            entries,
            placed,
            particles,
            lit,
            i_facet,
            i_group,
            drawn,
            textured,
            slopes,
            ..
        } = *buffers;
        let all = [
            entries, placed, particles, lit, i_facet, i_group, drawn, textured, splats, reaches,
            before, blocks, sheets, kept, conics, slopes, shades,
        ];
        rec.dispatch_indirect(&self.splat, &all, &push, (kept, KeptRecord::I_SPLAT))?;
        let push = RoundsPush {
            n_rounds: self.rounds_spec.n,
            capacity: self.capacity(),
            most_blocks: self.rounds_spec.most_blocks,
            sort_tile,
            bin_groups: n_bins.div_ceil(self.ranges.local_size_x()),
        };
        rec.dispatch_groups(&self.rounds, &[blocks, round, kept], &push, 1)?;
        if self.rounds_spec.n == 1 {
            return Ok(());
        }
        let n_fours = n_state(&self.division, self.slices) as u32;
        let push = ClearPush { n_fours, unused: 0 };
        rec.dispatch(&self.clear, &[round, &self.scratch.state], &push, n_fours)
    }

    /// Starts `picture` with the colors of `under`, or with zeros; its depth hides blobs.
    pub fn record_start(
        &self,
        rec: &mut Recorder<'_>,
        under: Option<Target<'_>>,
        picture: &Buffer,
    ) {
        let Scratch { under: colors, depths, .. } = &self.scratch;
        let Some(Target { color, depth }) = under else {
            [colors, depths, picture].into_iter().for_each(|buffer| rec.fill(buffer, 0));
            return;
        };
        rec.copy_image(color, colors);
        match depth {
            Some(depth) => rec.copy_image(depth, depths),
            // 0 is infinitely far.
            None => rec.fill(depths, 0),
        }
        rec.copy(colors, picture);
    }

    /// Writes the pairs of round `i_round`. Returns them (`[u32; 2]`: bin and splat) and their
    /// number, with the workgroups that sort them.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record_pairs(
        &self,
        rec: &mut Recorder<'_>,
        i_round: u32,
        n: RecordCount<'_>,
        view: &BlobView<'_>,
    ) -> Result<(&Buffer, DeviceCount<'_>)> {
        let Division { n_bins_x, tile, .. } = self.division;
        let Scratch { splats, reaches, before, blocks, round, entries, .. } = &self.scratch;
        let pixel = self.pixel(view);
        let push = PairsPush {
            tangents: [view.camera.tan_x, view.camera.tan_y],
            tile: [pixel[0] * tile[0] as f32, pixel[1] * tile[1] as f32],
            n_bins_x,
            i_round,
            cut: in_powers_of_two(0.5 * view.cutoff * view.cutoff),
            inv_threshold: view.inv_threshold(),
            least_cut: in_powers_of_two(view.least_cut()),
        };
        let buffers = [reaches, before, blocks, round, entries, splats, self.kept(n)];
        let i_first = ROUND_WORDS * i_round;
        rec.dispatch_indirect(&self.pairs, &buffers, &push, (round, i_first + 4))?;
        Ok((entries, DeviceCount { buffer: round, i_count: i_first + 3, i_groups: i_first }))
    }

    /// Composes `sorted`, the pairs of round `i_round` by bin, into `picture`; `pool` holds the
    /// textures, and `seen` the light of cells.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record_compose(
        &self,
        rec: &mut Recorder<'_>,
        i_round: u32,
        [sorted, picture, pool, seen]: [&Buffer; 4],
        view: &BlobView<'_>,
    ) -> Result<()> {
        let n_bins = self.division.n_bins;
        let Scratch { splats, sheets, conics, shades, round, ranges, state, under, depths, .. } =
            &self.scratch;
        let (max_groups, most_tiles) = (self.max_groups, self.max_tiles);
        let push = RangesPush { n_bins, i_round, max_groups, most_tiles };
        let i_first = ROUND_WORDS * i_round;
        rec.dispatch_indirect(&self.ranges, &[sorted, round, ranges], &push, (round, i_first + 8))?;
        let push = Push::new(view, &self.division, i_round);
        let buffers = [
            splats, sorted, round, ranges, state, picture, under, depths, sheets, pool, conics,
            shades, seen,
        ];
        let buffers = &buffers[..self.n_compose_bindings];
        if i_round == 0 {
            rec.dispatch_indirect(&self.alone, buffers, &push, (round, 16))?;
        }
        match &self.compose {
            Some(compose) => rec.dispatch_indirect(compose, buffers, &push, (round, i_first + 12)),
            None => Ok(()),
        }
    }

    fn pixel(&self, view: &BlobView<'_>) -> [f32; 2] {
        view.camera.pixel_slopes(self.division.width, self.division.height)
    }
}
