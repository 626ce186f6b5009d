//! Table `[draw]`.

use super::key::{Keys, keys, read_table};
use super::spec::{Spec, choice, flag, integer, number, one_of};
use crate::error::Result;
use crate::io::bounds::{Bounds, DIVISOR};
use crate::io::document::section::Section;
use crate::model::count::Count;
use crate::model::cutoff::Cutoff;
use crate::model::edge::{FARTHEST, Reach};
use crate::model::overlap::SLICE;
use crate::model::resolution::Resolution;
use crate::model::scene::{Chunks, Cull, Draw, DrawPath, Impostors, MAX_CHUNKS, Overlap};
use crate::model::sort_bits::SortBits;

fn cutoff(bounds: Bounds) -> Spec<Cutoff> {
    one_of(0.0, [("auto".into(), Cutoff::Auto)], Some(number(0.0, bounds).map(Cutoff::At)))
}

fn reach() -> Spec<Reach> {
    let numbers = number(0.0, Bounds::Within(0.5, FARTHEST)).map(Reach::Sigmas);
    one_of("auto", [("auto".into(), Reach::Auto)], Some(numbers))
}

fn chunks() -> Spec<Chunks> {
    let numbers = integer(0, 0, MAX_CHUNKS).map(Chunks::Of);
    one_of(0u32, [("auto".into(), Chunks::Auto)], Some(numbers))
}

fn sort_bits() -> Spec<SortBits> {
    use SortBits::{Auto, Narrow, Wide};
    one_of("auto", [(16u32.into(), Narrow), (32u32.into(), Wide), ("auto".into(), Auto)], None)
}

fn resolution() -> Spec<Resolution> {
    let [full, half, quarter] = Resolution::ALL.map(|(size, of)| (size.into(), of));
    one_of(1.0, [full, half, quarter, ("auto".into(), Resolution::Auto)], None)
}

keys! { DRAW: fn draw(s) -> Draw { Draw;
    /// How particles are drawn: as sprites in the graphics pipeline, as tiles of pixels in compute,
    /// or whichever is faster at the first frame.
    path: choice("tiles", &DrawPath::NAMES);
    /// Whether distant particles are shown again from a picture of them.
    impostors: choice("off", &Impostors::NAMES);
    /// Greatest predicted error of an impostor.
    impostor_error: number(0.5, Bounds::Within(0.01, 100.0)), "px";
    /// Distance from its centre at which a particle ends. With "auto" it ends where its own optical
    /// depth falls under 0.0005, and at 3 σ at the nearest.
    cutoff: reach(), "σ";
    /// Chunks that sprites are drawn in, near to far; after each, pixels that are opaque are left
    /// out. With 0 all sprites are drawn far to near.
    chunks: chunks();
    /// Optical depth below which a particle ends.
    threshold: cutoff(Bounds::From(0.0, 1.0));
    /// How particles that overlap are composed: one after the other, as if each were thin; by
    /// slices, of which each particle has its own share, on the path "tiles"; or, on that path,
    /// whichever is faster at the first frame within `error` of the slices.
    overlap: choice("thin", &Overlap::NAMES);
    /// Thickness of a slice, in mean σ of the particles. Thicker slices are faster: a particle is
    /// dealt among four of them, from 1.75 on among three, and from 2.75 on among two.
    slice: number(SLICE, Bounds::Within(0.1, 10.0)), "σ";
    /// Whether particles that show in no pixel are left out before the sort. No pixel changes.
    cull: choice("on", &Cull::NAMES);
    /// With `cull`, σ on the screen below which a particle is left out.
    smallest: cutoff(Bounds::Within(0.0, 1000.0)), "px";
    /// Edge of cells, over σ: in each of them one particle is drawn for all of about its size. With
    /// 0 every particle is drawn. Light is that of all particles. Particles with a texture and
    /// those that are no balls stay.
    lod: number(0.0, Bounds::Within(0.0, 2.0)), "σ";
    /// Bits of the depth keys that particles are sorted by.
    sort_bits: sort_bits();
    /// Pixels of the picture that particles are drawn into, along a side, for each of the film's.
    resolution: resolution();
    /// Greatest root mean square error that all settings "auto" may cause together.
    error: number(1.0 / 1020.0, Bounds::From(0.0, 1.0));
    /// Whether the number of particles drawn falls with a cloud's distance, C (4)–(6).
    count: choice("all", &[("all", false), ("distance", true)]) => |is_by_distance| {
        let is_by_distance = is_by_distance.take(s, "count")?;
        Ok(Some(count(s)?).filter(|_| is_by_distance))
    };
    /// Particles of all clouds made from boxes together; 0: as many as their files say.
    n_particles ["particles"]: integer(0, 0, u32::MAX);
    /// Seed of the pool of textures.
    texture_seed: integer(1, 0, u32::MAX);
}}

keys! { COUNT: fn count(s) -> Count { Count;
    /// Constant a of C (5): the count falls by 1/e over a distance of a d₀.
    a ["count_a"]: number(280.0, DIVISOR);
    /// Distance d₀ of C (5).
    d0 ["count_d0"]: number(1.0, DIVISOR), "unit";
    /// Whether the count at d₀ is that of the file, as C says, or e^(−1/a) of it, as C's formula
    /// gives.
    normalised ["count_normalised"]: flag(false);
    /// Whether κ grows as the count falls.
    conserve ["count_conserve"]: flag(true);
}}

/// Keys of `[draw]`.
pub const KEYS: [Keys; 2] = [DRAW, COUNT];

/// Reads `[draw]`.
pub fn read_draw(root: &mut Section) -> Result<Draw> {
    read_table(root, "draw", &KEYS, |s| {
        let draw = draw(s)?;
        if draw.path == DrawPath::Tiles && !matches!(draw.chunks, Chunks::Of(0) | Chunks::Auto) {
            let what = "expected 0 where draw.path is \"tiles\", the default: only \"sprites\" are \
                        drawn in chunks";
            return Err(s.fault("chunks", what));
        }
        if draw.path == DrawPath::Sprites && draw.overlap == Overlap::Slices {
            let what = "expected \"thin\" where draw.path is \"sprites\": only \"tiles\", the \
                        default, are composed by slices";
            return Err(s.fault("overlap", what));
        }
        let has_smallest = draw.smallest != Cutoff::NONE;
        if has_smallest && draw.cull == Cull::Off {
            let found = match draw.smallest {
                Cutoff::At(bound) => bound.to_string(),
                Cutoff::Auto => "\"auto\"".to_owned(),
            };
            let what = format!("expected 0 where cull = \"off\", found {found}");
            return Err(s.fault("smallest", what));
        }
        if draw.lod > 0.0 && draw.count.is_some() {
            let what = "expected 0 where count = \"distance\", which draws a part of the particles";
            return Err(s.fault("lod", what));
        }
        let is_full = draw.resolution == Resolution::Full;
        if draw.impostors != Impostors::Off && (has_smallest || !is_full) {
            let what = "expected \"off\", or draw.resolution = 1 and draw.smallest = 0";
            return Err(s.fault("impostors", what));
        }
        Ok(draw)
    })
}
