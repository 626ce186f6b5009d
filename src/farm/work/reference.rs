//! A reference picture in pieces: sums over a range of samples in a tile. All pieces together are
//! the picture that `nimbus render --reference` draws, to the byte.

use std::collections::BTreeSet;
use std::ops::Range;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::task::{Merge, Merged, ShardResult, Task, Work};
use crate::error::{Error, Result};
use crate::farm::transient::io_error;
use crate::io::atomic;
use crate::io::image::{ImageKind, encoded, image_hash};
use crate::io::input_file;
use crate::io::result_folder::ResultFolder;
use crate::io::scene_file::LoadedScene;
use crate::model::backdrop::Backdrop;
use crate::model::scene::Scene;
use crate::reference::picture::{
    self, MAX_SAMPLES, N_VALUES, PairwiseSum, Pixels, ReferenceKind, ReferenceRequest, SampleSums,
    Tile, check_memory,
};
use crate::timing::machine::{self, Device};

/// The greatest number of pieces. A plan with as many shards is about as large as a plan may be.
const MOST_PIECES: u64 = 40_000;
/// Most pixels of a picture, whose sums are merged in memory: 4096 x 2048.
const MOST_MERGED_PIXELS: u64 = 1 << 23;
/// Largest file of a piece: the sums of a tile of the largest picture.
const LARGEST_SUMS: u64 = 512 << 20;
/// The description of the merged picture and of its error.
const ABOUT_FILE: &str = "reference.json";

/// A picture in f64, cut into tiles row by row, and the samples of each tile into ranges. Piece k
/// belongs to tile k / n_ranges.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferenceWork {
    /// The reference, as [`ReferenceKind`] is written.
    pub of: String,
    /// The frame of the scene.
    pub frame: u32,
    /// The picture's width, pixels.
    pub width: u32,
    /// The picture's height, pixels.
    pub height: u32,
    /// Width and height of a tile that no edge cuts, pixels.
    pub tile: [u32; 2],
    /// Samples of every pixel.
    pub n_samples: u32,
    /// Samples of a range: a power of two, so that sums of ranges add up to the bits of one
    /// machine's sum ([`PairwiseSum`]).
    pub range: u32,
    /// The format of the merged picture.
    pub format: ImageKind,
}

impl ReferenceWork {
    /// Returns the kind of reference.
    ///
    /// # Errors
    /// When `of` names none.
    pub fn reference(&self) -> Result<ReferenceKind> {
        self.of.parse().map_err(Error::usage)
    }

    /// Returns the scene as the picture's frame has it.
    pub fn scene(&self, loaded: &LoadedScene) -> Scene {
        loaded.clone().at_frame(self.frame)
    }

    /// Returns the number of sample ranges of a tile.
    pub fn n_ranges(&self) -> u32 {
        self.n_samples.div_ceil(self.range)
    }

    /// Returns the number of pieces.
    pub fn n_pieces(&self) -> u64 {
        let n_rows = self.height.div_ceil(self.tile[1]);
        u64::from(self.n_columns()) * u64::from(n_rows) * u64::from(self.n_ranges())
    }

    /// Returns tile and samples of piece `k`.
    pub fn piece(&self, k: u32) -> (Tile, Range<u32>) {
        let (i_tile, i_range) = (k / self.n_ranges(), k % self.n_ranges());
        let left = i_tile % self.n_columns() * self.tile[0];
        let top = i_tile / self.n_columns() * self.tile[1];
        let (width, height) =
            (self.tile[0].min(self.width - left), self.tile[1].min(self.height - top));
        let first = i_range * self.range;
        let end = self.n_samples.min(first.saturating_add(self.range));
        (Tile { left, top, width, height }, first..end)
    }

    fn n_columns(&self) -> u32 {
        self.width.div_ceil(self.tile[0])
    }

    fn pixels(&self, tile: Tile) -> Pixels {
        Pixels::tile(self.width, self.height, tile)
    }

    /// Adds the sums of all pieces: ranges of samples as a tree of pairs, in the order of their
    /// shards, and tiles by copying.
    fn total(&self, results: &[ShardResult]) -> Result<SampleSums> {
        let whole = Pixels::all(self.width, self.height);
        let mut values = vec![0.0; N_VALUES * whole.at.len()];
        let mut pairs = PairwiseSum::default();
        let pieces =
            results.iter().flat_map(|result| result.items.clone().map(move |k| (result, k)));
        for (result, k) in pieces {
            let path = result.folder.join(sums_file(k));
            let bytes = input_file::read(&path, LARGEST_SUMS).map_err(io_error(&path))?;
            let (tile, samples) = self.piece(k);
            let pixels = self.pixels(tile);
            let Some(sums) = SampleSums::from_bytes(&bytes, pixels.at.len(), samples.len() as u32)
            else {
                return Err(Error::io(&path, "its length does not fit the piece's pixels"));
            };
            pairs.push(sums);
            if samples.end < self.n_samples {
                continue;
            }
            let Some(of_tile) = std::mem::take(&mut pairs).total() else { continue };
            let found = of_tile.values.chunks_exact(N_VALUES);
            for (at, found) in pixels.at.iter().zip(found) {
                let first = N_VALUES * whole.index(*at);
                values[first..][..N_VALUES].copy_from_slice(found);
            }
        }
        Ok(SampleSums { n_samples: self.n_samples, values })
    }
}

impl Work for ReferenceWork {
    fn kind(&self) -> String {
        format!("reference {}", self.of)
    }

    fn noun(&self) -> &'static str {
        "pieces"
    }

    fn items(&self) -> Range<u64> {
        0..self.n_pieces()
    }

    fn identity(&self) -> Value {
        json!({"kind": "reference", "work": self})
    }

    fn outputs(&self, items: Range<u32>) -> Vec<String> {
        items.map(sums_file).collect()
    }

    fn needs_device(&self) -> bool {
        false
    }

    fn check(&self) -> std::result::Result<(), String> {
        self.of.parse::<ReferenceKind>()?;
        let ReferenceWork { width, height, tile, n_samples, range, .. } = self;
        if [*width, *height, tile[0], tile[1]].contains(&0) {
            return Err("a picture or a tile without pixels".into());
        }
        let n_pixels = u64::from(*width) * u64::from(*height);
        if n_pixels > MOST_MERGED_PIXELS {
            return Err(format!("{n_pixels} pixels, expected at most {MOST_MERGED_PIXELS}"));
        }
        if !(1..=MAX_SAMPLES).contains(n_samples) {
            return Err(format!("{n_samples} samples, expected 1 to {MAX_SAMPLES}"));
        }
        if !range.is_power_of_two() {
            return Err(format!("ranges of {range} samples, expected a power of two"));
        }
        let n = self.n_pieces();
        if n > MOST_PIECES {
            return Err(format!(
                "{n} pieces, expected up to {MOST_PIECES}: larger tiles, or more samples in each"
            ));
        }
        Ok(())
    }

    fn check_scene(&self, loaded: &LoadedScene) -> Result<()> {
        self.check().map_err(Error::usage)?;
        let scene = self.scene(loaded);
        let n_pixels =
            u64::from(self.tile[0].min(self.width)) * u64::from(self.tile[1].min(self.height));
        check_memory(n_pixels, self.range, scene.n_particles())?;
        if (self.width, self.height) != (scene.film.width, scene.film.height) {
            return Err(Error::usage("the picture has another size than the scene's film"));
        }
        self.reference()?.check(&scene, scene.time.at(self.frame))
    }

    /// Sums are made by the processor, whose kind may determine their last digits.
    fn run(&self, task: &mut Task<'_>) -> Result<Device> {
        let scene = self.scene(task.loaded);
        let time_s = scene.time.at(self.frame);
        let subject = ReferenceRequest { kind: self.reference()?, scene: &scene, time_s };
        let device = Device {
            name: machine::cpu().model,
            driver: "f64 on the processor".into(),
            api: "not used".into(),
            kind: "cpu".into(),
            uuid: String::new(),
        };
        task.workplace.resume(&device)?;
        let stop = task.stop;
        task.make_files(sums_file, |k| {
            let (tile, samples) = self.piece(k);
            let pixels = self.pixels(tile);
            Ok(picture::sums(&subject, &pixels, samples, stop, &|_, _| ())?.bytes())
        })?;
        Ok(device)
    }

    fn merge(&self, merge: &Merge<'_>) -> Result<Merged> {
        let scene = self.scene(&(merge.load)()?);
        let mean = self.total(merge.results)?.mean();
        let rgba = picture::to_f32(&mean.rgba);
        let backdrop = Backdrop::of(&scene, scene.time.at(self.frame));
        let picture = encoded(self.format, &backdrop, self.width, self.height, &rgba)?;
        let file = format!("reference.{}", self.format.extension());
        let manifests = || merge.results.iter().map(|result| &result.manifest);
        let nodes: BTreeSet<&str> = manifests().map(|m| m.node.as_str()).collect();
        let processors: BTreeSet<&str> = manifests().map(|m| m.cpu.model.as_str()).collect();
        let [nimbus, revision, code] = merge.build;
        let about = json!({
            "schema": 1, "reference": self.of, "frame": self.frame,
            "time_s": scene.time.at(self.frame),
            "width": self.width, "height": self.height, "samples": self.n_samples,
            "own_error": mean.own_error,
            "accuracy": self.reference()?.accuracy_text(&scene, self.n_samples), "file": file,
            "scene_file": merge.scene.file.display().to_string(), "scene_hash": merge.scene.hash,
            "set": merge.scene.set, "seed": merge.scene.seed,
            "nimbus": nimbus, "revision": revision, "code": code,
            "image_hash": image_hash(&rgba),
            "not_finite": rgba.iter().filter(|v| !v.is_finite()).count(),
            "nodes": nodes, "processors": processors,
            "seconds": manifests().map(|m| m.seconds).sum::<f64>(),
        });
        let planned = [file.clone(), ABOUT_FILE.to_owned()];
        let mut folder = ResultFolder::open(merge.out, "reference", merge.existing, &planned)?;
        let written = folder.finish(&[&file, ABOUT_FILE], |staged| {
            atomic::write_synced(&staged.join(&file), &picture)?;
            atomic::write_synced(&staged.join(ABOUT_FILE), format!("{about:#}\n").as_bytes())
        });
        Ok(Merged { n: self.n_pieces() as usize, summary: String::new(), written })
    }
}

/// Returns the name of a piece's file, which holds [`SampleSums::bytes`]. Names sort as the pieces
/// do.
fn sums_file(k: u32) -> String {
    format!("sums-{k:08}.f64")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_cover_every_sample_of_every_pixel_once() {
        let work = ReferenceWork {
            of: "thin".into(),
            frame: 0,
            width: 10,
            height: 7,
            tile: [4, 3],
            n_samples: 11,
            range: 4,
            format: ImageKind::Exr,
        };
        work.check().unwrap();
        // 3 by 3 tiles, 3 ranges each.
        assert_eq!(work.n_pieces(), 27);
        let mut counts = vec![0; 10 * 7 * 11];
        for k in 0..27 {
            let (tile, samples) = work.piece(k);
            for [i, j] in work.pixels(tile).at {
                samples.clone().for_each(|s| counts[((j * 10 + i) * 11 + s) as usize] += 1);
            }
        }
        assert!(counts.iter().all(|n| *n == 1));
        assert_eq!(work.piece(26), (Tile { left: 8, top: 6, width: 2, height: 1 }, 8..11));
    }

    #[test]
    fn impossible_pieces_are_refused() {
        let good = ReferenceWork {
            of: "thin".into(),
            frame: 0,
            width: 10,
            height: 7,
            tile: [4, 3],
            n_samples: 11,
            range: 4,
            format: ImageKind::Exr,
        };
        for (work, message) in [
            (ReferenceWork { range: 3, ..good.clone() }, "power of two"),
            (ReferenceWork { range: 0, ..good.clone() }, "power of two"),
            (ReferenceWork { tile: [0, 3], ..good.clone() }, "without pixels"),
            (ReferenceWork { n_samples: 0, ..good.clone() }, "expected 1 to"),
            (ReferenceWork { of: "thick".into(), ..good }, "expected thin"),
        ] {
            assert!(work.check().unwrap_err().contains(message), "{message}");
        }
    }
}
