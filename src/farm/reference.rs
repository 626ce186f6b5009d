//! The work of shards of a reference picture: sums over a range of samples in a tile, and all of
//! them as the picture that `nimbus render --reference` makes, to the byte.

use std::collections::BTreeSet;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::cost::Work as Counted;
use super::failing::of_io;
use super::plan::{PictureFormat, Plan, Shard};
use super::store::{Manifest, Store, Workplace};
use super::synced;
use crate::error::{Error, Result};
use crate::farm::cells::Visits;
use crate::farm::layers::Layers;
use crate::io::folder::replace_files;
use crate::io::image::{ImageKind, encoded, image_hash};
use crate::io::scene_file::LoadedScene;
use crate::model::scene::{LightingMode, Scene};
use crate::reference::picture::{
    self, FrameReference, MAX_SAMPLES, N_VALUES, PairwiseSum, Pixels, ReferenceKind,
    ReferenceRequest, SampleSums, Tile, n_reflections,
};
use crate::timing::machine::{self, Device};

/// Most pieces of a picture: a plan of as many shards is about as large as one can be.
const MOST_PIECES: u64 = 40_000;
/// What the picture is of, and how far it may be off.
pub const ABOUT_FILE: &str = "reference.json";

/// What is known of a picture before any of it is drawn.
pub struct Seen {
    layers: Layers,
    visits: Visits,
}

/// A picture in f64, cut into tiles, and the samples of each into ranges. Piece k has tile k /
/// n_ranges, tiles row by row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cut {
    /// As [`ReferenceKind`] is written.
    pub of: String,
    pub frame: u32,
    /// Of the picture, pixels.
    pub width: u32,
    pub height: u32,
    /// Of a tile that no edge cuts.
    pub tile: [u32; 2],
    pub n_samples: u32,
    /// Samples of a range: a power of two, so that the sums are those of the whole ([`PairwiseSum`]).
    pub range: u32,
    pub format: PictureFormat,
}

impl Cut {
    /// What is wrong with it.
    pub fn check(&self) -> std::result::Result<(), String> {
        self.of.parse::<ReferenceKind>()?;
        let Cut { width, height, tile, n_samples, range, .. } = self;
        if [*width, *height, tile[0], tile[1]].contains(&0) {
            return Err("a picture or a tile without pixels".into());
        }
        if !(1..=MAX_SAMPLES).contains(n_samples) {
            return Err(format!("{n_samples} samples, expected 1 to {MAX_SAMPLES}"));
        }
        if !range.is_power_of_two() {
            return Err(format!("ranges of {range} samples, expected a power of two"));
        }
        if self.n_pieces() > MOST_PIECES {
            let n = self.n_pieces();
            return Err(format!(
                "{n} pieces, expected up to {MOST_PIECES}: larger tiles, or more samples in each"
            ));
        }
        Ok(())
    }

    fn n_columns(&self) -> u32 {
        self.width.div_ceil(self.tile[0])
    }

    fn n_ranges(&self) -> u32 {
        self.n_samples.div_ceil(self.range)
    }

    pub fn n_pieces(&self) -> u64 {
        let n_tiles = u64::from(self.n_columns()) * u64::from(self.height.div_ceil(self.tile[1]));
        n_tiles * u64::from(self.n_ranges())
    }

    /// Its part of the picture, and which samples.
    pub fn piece(&self, k: u32) -> (Tile, Range<u32>) {
        let (i_tile, i_range) = (k / self.n_ranges(), k % self.n_ranges());
        let (left, top) =
            (i_tile % self.n_columns() * self.tile[0], i_tile / self.n_columns() * self.tile[1]);
        let (width, height) =
            (self.tile[0].min(self.width - left), self.tile[1].min(self.height - top));
        let first = i_range * self.range;
        (
            Tile { left, top, width, height },
            first..self.n_samples.min(first.saturating_add(self.range)),
        )
    }

    /// The file of piece `k`: [`SampleSums::bytes`] of its pixels. Names sort as the pieces do.
    pub fn sums_file(k: u32) -> String {
        format!("sums-{k:08}.f64")
    }

    /// The picture's file.
    pub fn file(&self) -> String {
        format!("reference.{}", self.format.extension())
    }

    fn pixels(&self, tile: Tile) -> Pixels {
        Pixels::tile(self.width, self.height, tile)
    }

    fn against(&self) -> Result<ReferenceKind> {
        self.of.parse().map_err(Error::usage)
    }

    /// Its layers, and the cells that its light visits.
    pub fn seen(&self, loaded: &LoadedScene) -> Result<Seen> {
        let scene = loaded.clone().at_frame(self.frame);
        // Where a blob has lost all but a thousandth of its depth; integrals end nowhere, and
        // little is left there.
        const REACH: f64 = 4.0;
        let (of, truth) =
            (self.against()?, FrameReference::unlit(&scene, scene.time.at(self.frame))?);
        let reach = if of == ReferenceKind::Thin { scene.draw.cutoff } else { REACH };
        // The others' light knows no grid.
        let by_grid = matches!(of, ReferenceKind::Thin | ReferenceKind::Volume);
        let visits = if by_grid { Visits::of(&scene, &truth) } else { Visits::default() };
        Ok(Seen { layers: Layers::of(&scene, &truth, reach), visits })
    }

    /// What each piece makes work of.
    pub fn work(&self, loaded: &LoadedScene, seen: &Seen) -> Result<Vec<Counted>> {
        let scene = loaded.clone().at_frame(self.frame);
        let of = self.against()?;
        let n_particles = scene.n_particles() as f64;
        let by_model = matches!(of, ReferenceKind::Model | ReferenceKind::Reflections(_));
        let n_facets = if by_model { n_particles } else { scene.n_facets() as f64 };
        // Light comes from particles' facets, and from surfaces' areas.
        let n_emitters = n_facets + scene.surfaces.len() as f64;
        let n_reflections =
            if let ReferenceKind::Reflections(k) = of { k } else { n_reflections(&scene) };
        let tile = |i: u32| self.piece(i * self.n_ranges()).0;
        let n_tiles = self.n_pieces() as u32 / self.n_ranges();
        let layers = &seen.layers;
        let of_tile = |tile| [layers.n_within(tile), layers.n_solid_within(tile)];
        let of_tiles: Vec<[f64; 2]> = (0..n_tiles).map(|i| of_tile(tile(i))).collect();
        let of_piece = |k: u32| {
            let (_, samples) = self.piece(k);
            let (n, n_lit) =
                (samples.len() as f64, if n_reflections >= 3 { samples.len() as f64 } else { 1.0 });
            let [n_layers, n_solid] = of_tiles[(k / self.n_ranges()) as usize];
            let receivers = n_lit * n_facets + if by_model { n * n_solid } else { 0.0 };
            Counted {
                steps: n,
                particle_steps: n_particles,
                cells: seen.visits.filled + seen.visits.marched,
                pixel_samples: n * n_layers,
                facet_pairs: if scene.lighting.mode == LightingMode::None {
                    0.0
                } else {
                    receivers * n_emitters
                },
                // The processor makes them once, a part of the set-up.
                textures: 0.0,
            }
        };
        Ok((0..self.n_pieces() as u32).map(of_piece).collect())
    }
}

/// Refuses what the reference does not know, or does not fit the scene.
pub fn check(cut: &Cut, loaded: &LoadedScene) -> Result<()> {
    cut.check().map_err(Error::usage)?;
    let scene = scene_of(cut, loaded);
    if (cut.width, cut.height) != (scene.film.width, scene.film.height) {
        return Err(Error::usage("the picture is not as large as its scene's film"));
    }
    cut.against()?.check(&scene, scene.time.at(cut.frame))
}

fn scene_of(cut: &Cut, loaded: &LoadedScene) -> Scene {
    loaded.clone().at_frame(cut.frame)
}

/// Does the pieces of `shard` that are not there yet; the device is the processor, whose last
/// digits another kind's mathematics may not share.
pub fn draw(
    (store, plan, shard, loaded): (&Store, &Plan, &Shard, &LoadedScene),
    cut: &Cut,
    workplace: &mut Workplace,
    stop: &AtomicBool,
    on_piece: &dyn Fn(),
) -> Result<Device> {
    let scene = scene_of(cut, loaded);
    let subject =
        ReferenceRequest { kind: cut.against()?, scene: &scene, time_s: scene.time.at(cut.frame) };
    let device = processor();
    store.resume(workplace, plan, shard, &device)?;
    for k in shard.items() {
        let name = Cut::sums_file(k);
        if !workplace.has(&name) {
            let (tile, samples) = cut.piece(k);
            let sums = picture::sums(&subject, &cut.pixels(tile), samples, stop, &|_, _| ())?;
            workplace.add(&name, &sums.bytes())?;
        }
        on_piece();
    }
    Ok(device)
}

/// The processor as the device that it is here.
fn processor() -> Device {
    Device {
        name: machine::cpu().model,
        driver: "f64 on the processor".into(),
        api: "not used".into(),
        kind: "cpu".into(),
        uuid: String::new(),
    }
}

/// All pieces as the picture, in `out`; how many pieces.
pub fn merge(plan: &Plan, cut: &Cut, parts: &[(PathBuf, Manifest)], out: &Path) -> Result<usize> {
    let loaded = plan.scene_as_planned()?;
    let sums = put_together(plan, cut, parts)?;
    let mean = sums.mean();
    let (scene, kind) = (scene_of(cut, &loaded), ImageKind::of(Path::new(&cut.file()))?);
    let rgba = picture::to_f32(&mean.rgba);
    let picture = encoded(kind, &scene.film, cut.width, cut.height, &rgba)?;
    let n_bad = rgba.iter().filter(|v| !v.is_finite()).count();
    let nodes: BTreeSet<&str> = parts.iter().map(|(_, manifest)| manifest.node.as_str()).collect();
    let processors: BTreeSet<&str> =
        parts.iter().map(|(_, manifest)| manifest.cpu.model.as_str()).collect();
    let about = json!({
        "schema": 1, "reference": cut.of, "frame": cut.frame, "time_s": scene.time.at(cut.frame),
        "width": cut.width, "height": cut.height, "samples": cut.n_samples, "own_error": mean.own_error,
        "accuracy": cut.against()?.accuracy_text(&scene, cut.n_samples), "file": cut.file(),
        "scene_file": plan.scene.file.display().to_string(), "scene_hash": plan.scene.hash, "set": plan.scene.set,
        "seed": plan.scene.seed, "nimbus": plan.nimbus, "revision": plan.revision, "code": plan.code,
        "image_hash": image_hash(&rgba), "not_finite": n_bad, "nodes": nodes, "processors": processors,
        "seconds": parts.iter().map(|(_, manifest)| manifest.seconds).sum::<f64>(),
    });
    let other = ["reference.png", "reference.exr"].into_iter().find(|name| *name != cut.file());
    let gone = other.filter(|name| out.join(name).exists());
    let files: Vec<String> =
        gone.map(str::to_owned).into_iter().chain([cut.file(), ABOUT_FILE.to_owned()]).collect();
    replace_files(out, &files.iter().map(String::as_str).collect::<Vec<_>>(), |staged| {
        synced::write(&staged.join(cut.file()), &picture)?;
        synced::write(&staged.join(ABOUT_FILE), format!("{about:#}\n").as_bytes())
    })?;
    Ok(cut.n_pieces() as usize)
}

/// The sums of the whole picture: tiles by copy, ranges of samples by their tree, in the order of
/// their shards.
fn put_together(plan: &Plan, cut: &Cut, parts: &[(PathBuf, Manifest)]) -> Result<SampleSums> {
    let whole = Pixels::all(cut.width, cut.height);
    let mut values = vec![0.0; N_VALUES * whole.at.len()];
    let mut pairs = PairwiseSum::default();
    for (shard, (folder, _)) in plan.shards.iter().zip(parts) {
        for k in shard.items() {
            let path = folder.join(Cut::sums_file(k));
            let bytes = fs::read(&path).map_err(|cause| of_io(&path, &cause))?;
            let (tile, samples) = cut.piece(k);
            let pixels = cut.pixels(tile);
            let is_last = samples.end == cut.n_samples;
            let sums = SampleSums::from_bytes(&bytes, pixels.at.len(), samples.len() as u32);
            pairs.push(
                sums.ok_or_else(|| {
                    Error::io(&path, "has other numbers than its piece has pixels")
                })?,
            );
            if !is_last {
                continue;
            }
            let Some(of_tile) = std::mem::take(&mut pairs).finish() else { continue };
            for (at, found) in pixels.at.iter().zip(of_tile.values.chunks_exact(N_VALUES)) {
                values[N_VALUES * whole.index(*at)..][..N_VALUES].copy_from_slice(found);
            }
        }
    }
    Ok(SampleSums { n_samples: cut.n_samples, values })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_cover_every_sample_of_every_pixel_once() {
        let cut = Cut {
            of: "thin".into(),
            frame: 0,
            width: 10,
            height: 7,
            tile: [4, 3],
            n_samples: 11,
            range: 4,
            format: PictureFormat::Exr,
        };
        cut.check().unwrap();
        // 3 by 3 tiles, 3 ranges each.
        assert_eq!(cut.n_pieces(), 27);
        let mut counts = vec![0; 10 * 7 * 11];
        for k in 0..27 {
            let (tile, samples) = cut.piece(k);
            for [i, j] in cut.pixels(tile).at {
                samples.clone().for_each(|s| counts[((j * 10 + i) * 11 + s) as usize] += 1);
            }
        }
        assert!(counts.iter().all(|n| *n == 1));
        assert_eq!(cut.piece(26), (Tile { left: 8, top: 6, width: 2, height: 1 }, 8..11));
        let wrong = |change: &dyn Fn(&mut Cut)| {
            let mut cut = cut.clone();
            change(&mut cut);
            cut.check().unwrap_err()
        };
        assert!(wrong(&|c| c.range = 3).contains("power of two"));
        assert!(wrong(&|c| c.range = 0).contains("power of two"));
        assert!(wrong(&|c| c.tile = [0, 3]).contains("without pixels"));
        assert!(wrong(&|c| c.n_samples = 0).contains("expected 1 to"));
        assert!(wrong(&|c| c.of = "thick".into()).contains("expected thin"));
    }
}
