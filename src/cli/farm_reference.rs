//! `nimbus farm plan --reference`: how a picture is cut into tiles and ranges of samples.

use super::args::{FormatArg, PlanArgs};
use super::farm_cut::{self, Amounts, Cut, Model};
use crate::error::Result;
use crate::farm::cost::Work as Counted;
use crate::farm::plan::{PictureFormat, Work};
use crate::farm::reference;
use crate::io::scene_file::LoadedScene;
use crate::reference::picture::ReferenceKind;

/// Pixels along a side of a tile, and samples of a range, where nothing is known of what they take.
const USUAL_TILE: u32 = 256;
const USUAL_RANGE: u32 = 16;

pub(super) fn cut(args: &PlanArgs, of: ReferenceKind, loaded: &LoadedScene) -> Result<Cut> {
    let model = args.model.as_deref().map(Model::read).transpose()?;
    let film = loaded.clone().at_frame(args.frame).film;
    let (n_samples, whole) = (args.samples, [film.width, film.height]);
    let format = match args.format {
        Some(FormatArg::Png) => PictureFormat::Png,
        Some(FormatArg::Exr) | None => PictureFormat::Exr,
    };
    let usual_range = USUAL_RANGE.min(n_samples.next_power_of_two());
    let (tile, range) = match &model {
        Some(_) => (
            args.tile.map_or(whole, Into::into),
            args.shard_samples.unwrap_or(n_samples.next_power_of_two()),
        ),
        None => (
            args.tile.map_or([USUAL_TILE; 2], Into::into),
            args.shard_samples.unwrap_or(usual_range),
        ),
    };
    let tile = [tile[0].min(whole[0]), tile[1].min(whole[1])];
    let mut cut = reference::Cut {
        of: of.to_string(),
        frame: args.frame,
        width: whole[0],
        height: whole[1],
        tile,
        n_samples,
        range,
        format,
    };
    reference::check(&cut, loaded)?;
    let seen = cut.seen(loaded)?;
    if let Some(model) = &model {
        model.check(&Work::Reference(cut.clone()))?;
        cut = shortened(args, cut, |cut| longest(cut, loaded, &seen, model))?;
    }
    let amounts = Amounts { items: cut.work(loaded, &seen)?, of_shard: Counted::default() };
    // Without a model every piece is a shard; with one neighbours go together as far as they are
    // short.
    farm_cut::cut(args, Work::Reference(cut), &amounts, (None, 1))
}

/// The longest piece, s, and how many there are.
fn longest(
    cut: &reference::Cut,
    loaded: &LoadedScene,
    seen: &reference::Seen,
    model: &Model<'_>,
) -> Result<(f64, usize)> {
    let work = cut.work(loaded, seen)?;
    let seconds =
        work.iter().map(|piece| model.seconds(1.0, piece)).collect::<Result<Vec<f64>>>()?;
    Ok((seconds.iter().copied().fold(0.0, f64::max), seconds.len()))
}

/// Halved until the longest piece is short enough and there is one for every node, as far as that
/// makes it shorter; ranges first, as they cost no more than a set-up and what of the light all
/// samples share.
fn shortened(
    args: &PlanArgs,
    mut cut: reference::Cut,
    longest: impl Fn(&reference::Cut) -> Result<(f64, usize)>,
) -> Result<reference::Cut> {
    /// What does not make a piece this much shorter only adds the light that every piece pays anew.
    const WORTH: f64 = 0.8;
    let (least, most) = args.lengths();
    let (mut now, mut n) = longest(&cut)?;
    while now > most || (now >= 2.0 * least && n < args.n_nodes()) {
        let mut next = None;
        for half in halves(args, &cut) {
            let (then, n) = longest(&half)?;
            if then < WORTH * now {
                next = Some((half, then, n));
                break;
            }
        }
        let Some(found) = next else { break };
        (cut, now, n) = found;
    }
    if now > most {
        eprintln!(
            "note: the longest piece takes {now:.0} s, more than {most:.0}: light that every piece \
             computes anew"
        );
    }
    Ok(cut)
}

/// The same with pieces half as large, in ranges or in tiles, as far as they may be.
fn halves(args: &PlanArgs, cut: &reference::Cut) -> Vec<reference::Cut> {
    /// Smaller ones spend more on what all tiles share.
    const LEAST_TILE: u32 = 16;
    let longer = if cut.tile[0] >= cut.tile[1] { 0 } else { 1 };
    let mut found = Vec::new();
    if args.shard_samples.is_none() && cut.range > 1 {
        found.push(reference::Cut { range: cut.range / 2, ..cut.clone() });
    }
    if args.tile.is_none() && cut.tile[longer] >= 2 * LEAST_TILE {
        let mut tile = cut.tile;
        tile[longer] = tile[longer].div_ceil(2);
        found.push(reference::Cut { tile, ..cut.clone() });
    }
    found.retain(|half| half.check().is_ok());
    found
}
