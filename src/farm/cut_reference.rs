//! Division of a reference picture into tiles and ranges of samples, and of those into shards.

use super::calibration::FileModel;
use super::cost::{Amounts, PieceAmounts, Workload};
use super::cut::{Cut, CutOptions, ShardSize};
use super::work::{AnyWork, ReferenceWork, Work};
use crate::error::Result;
use crate::io::console::say;
use crate::io::image::ImageKind;
use crate::io::scene_file::LoadedScene;
use crate::reference::picture::ReferenceKind;

/// The side of a tile without a model, pixels.
const USUAL_TILE: u32 = 256;
/// The samples of a range without a model.
const USUAL_RANGE: u32 = 16;
/// The least side of a tile by a model, pixels. Smaller tiles spend more on what all tiles share.
const LEAST_TILE: u32 = 16;
/// Pieces are halved where that shortens the longest one to this share at least. Otherwise halves
/// mostly repeat the light that each piece computes for itself.
const WORTH: f64 = 0.8;

/// A reference picture to be divided.
#[derive(Debug, Clone)]
pub struct ReferenceDivision {
    /// The kind of reference.
    pub of: ReferenceKind,
    /// The frame of the scene.
    pub i_frame: u32,
    /// Samples of every pixel.
    pub n_samples: u32,
    /// The size of tiles, where it was asked for, pixels.
    pub tile: Option<(u32, u32)>,
    /// The samples of a range, where they were asked for: a power of two.
    pub range: Option<u32>,
    /// The format of the merged picture.
    pub format: ImageKind,
}

impl ReferenceDivision {
    /// Divides the picture. With a model pieces are halved until they are short enough, and short
    /// ones are put together; without one every piece is a shard.
    ///
    /// # Errors
    /// When the scene does not fit the reference, or the model does not fit the work.
    pub fn cut(&self, loaded: &LoadedScene, options: &CutOptions) -> Result<Cut> {
        let film = loaded.clone().at_frame(self.i_frame).film;
        let all_samples = self.n_samples.next_power_of_two();
        let (tile, range) = match options.model {
            Some(_) => ((film.width, film.height), all_samples),
            None => ((USUAL_TILE, USUAL_TILE), USUAL_RANGE.min(all_samples)),
        };
        let tile = self.tile.unwrap_or(tile);
        let mut work = ReferenceWork {
            of: self.of.to_string(),
            frame: self.i_frame,
            width: film.width,
            height: film.height,
            tile: [tile.0.min(film.width), tile.1.min(film.height)],
            n_samples: self.n_samples,
            range: self.range.unwrap_or(range),
            format: self.format,
        };
        work.check_scene(loaded)?;
        let amounts = PieceAmounts::new(&work, loaded)?;
        if let Some(model) = &options.model {
            model.check(&work)?;
            work = self.halved(work, &amounts, model, options)?;
        }
        let workload = Workload { items: amounts.each(&work), per_shard: Amounts::default() };
        let size = ShardSize { asked: None, usual: 1 };
        Cut::new(AnyWork::Reference(work), &workload, size, options)
    }

    /// Halves pieces until the longest is short enough and every node has one, as far as that is
    /// worth it.
    fn halved(
        &self,
        mut work: ReferenceWork,
        amounts: &PieceAmounts,
        model: &FileModel,
        options: &CutOptions,
    ) -> Result<ReferenceWork> {
        let longest_s = |work: &ReferenceWork| {
            let pieces = amounts.each(work);
            let seconds = pieces.iter().map(|piece| model.seconds(1.0, piece));
            Ok(seconds.collect::<Result<Vec<f64>>>()?.into_iter().fold(0.0, f64::max))
        };
        let ((least_s, most_s), n_nodes) = (options.shard_seconds, options.n_nodes as u64);
        let mut now_s = longest_s(&work)?;
        while now_s > most_s || (now_s >= 2.0 * least_s && work.n_pieces() < n_nodes) {
            let mut next = None;
            for half in self.halves(&work) {
                let half_s = longest_s(&half)?;
                if half_s < WORTH * now_s {
                    next = Some((half, half_s));
                    break;
                }
            }
            let Some(found) = next else { break };
            (work, now_s) = found;
        }
        if now_s > most_s {
            say!(
                "note: the longest piece takes {now_s:.0} s, more than {most_s:.0}: light that \
                 every piece computes for itself"
            );
        }
        Ok(work)
    }

    /// Returns the same picture with ranges half as long, and with tiles half as large, except for
    /// what was asked for. Ranges come first: they repeat only a set-up and what all samples share.
    fn halves(&self, work: &ReferenceWork) -> Vec<ReferenceWork> {
        let longer = usize::from(work.tile[0] < work.tile[1]);
        let mut found = Vec::new();
        if self.range.is_none() && work.range > 1 {
            found.push(ReferenceWork { range: work.range / 2, ..work.clone() });
        }
        if self.tile.is_none() && work.tile[longer] >= 2 * LEAST_TILE {
            let mut tile = work.tile;
            tile[longer] = tile[longer].div_ceil(2);
            found.push(ReferenceWork { tile, ..work.clone() });
        }
        found.retain(|half| half.check().is_ok());
        found
    }
}
