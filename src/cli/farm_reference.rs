//! `nimbus farm plan --reference`: how a picture is cut into tiles and ranges of samples.

use super::args::{FormatArg, PlanArgs};
use super::farm_cut::{Cut, Model};
use crate::error::{Error, Result};
use crate::farm::plan::{PictureFormat, Work};
use crate::farm::reference;
use crate::io::scene_file::LoadedScene;
use crate::study::against::Against;

/// Pixels along a side of a tile, and samples of a range, where nothing is known of what they take.
const USUAL_TILE: u32 = 256;
const USUAL_RANGE: u32 = 16;

pub(super) fn cut(args: &PlanArgs, of: Against, loaded: &LoadedScene) -> Result<Cut> {
    let model = args.model.as_deref().map(Model::read).transpose()?;
    let film = loaded.clone().at_frame(args.frame).film;
    let (n_samples, whole) = (args.samples, [film.width, film.height]);
    let format = match args.format {
        Some(FormatArg::Png) => PictureFormat::Png,
        Some(FormatArg::Exr) | None => PictureFormat::Exr,
    };
    let usual_range = USUAL_RANGE.min(n_samples.next_power_of_two());
    let (tile, range) = match &model {
        Some(_) => (args.tile.map_or(whole, Into::into), args.shard_samples.unwrap_or(n_samples.next_power_of_two())),
        None => (args.tile.map_or([USUAL_TILE; 2], Into::into), args.shard_samples.unwrap_or(usual_range)),
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
    let Some(model) = model else { return planned(cut, loaded, None) };
    // Halved until the longest piece is short enough, and there is one for every node; ranges first, as they cost no more
    // than a set-up, and what of the light all samples share.
    let (least, most) = args.lengths();
    model.check(&Work::Reference(cut.clone()))?;
    loop {
        let counted = cut.work(loaded)?;
        let seconds = counted.iter().map(|piece| model.seconds(1.0, piece)).collect::<Result<Vec<f64>>>()?;
        let longest = seconds.iter().copied().fold(0.0, f64::max);
        let is_short = longest <= most && (longest < 2.0 * least || seconds.len() >= args.n_nodes());
        let halves = halves(args, &cut);
        let Some(next) = halves.filter(|_| !is_short) else { return planned(cut, loaded, Some(seconds)) };
        cut = next;
    }
}

/// The same with pieces half as large; none where they are as small as they may be.
fn halves(args: &PlanArgs, cut: &reference::Cut) -> Option<reference::Cut> {
    /// Smaller ones spend more on what all tiles share.
    const LEAST_TILE: u32 = 16;
    let mut half = cut.clone();
    let longer = if cut.tile[0] >= cut.tile[1] { 0 } else { 1 };
    match () {
        () if args.shard_samples.is_none() && cut.range > 1 => half.range /= 2,
        () if args.tile.is_none() && cut.tile[longer] >= 2 * LEAST_TILE => {
            half.tile[longer] = cut.tile[longer].div_ceil(2);
        }
        () => return None,
    }
    half.check().ok().map(|()| half)
}

fn planned(cut: reference::Cut, loaded: &LoadedScene, predicted_s: Option<Vec<f64>>) -> Result<Cut> {
    let counted = cut.work(loaded)?;
    let n = u32::try_from(counted.len()).map_err(|_| Error::usage("more pieces than a plan can have"))?;
    Ok(Cut { work: Work::Reference(cut), sizes: vec![1; n as usize], counted, predicted_s })
}
