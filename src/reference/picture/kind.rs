//! What pictures are measured by: `--against thin|volume|model|reflections=K`. Each takes away what
//! the one before it still shares with the device's picture.

use std::fmt;
use std::str::FromStr;
use std::sync::OnceLock;
use std::time::Instant;

use glam::{DVec2, DVec3};

use crate::error::{Error, Result};
use crate::model::cutoff::Cutoff;
use crate::model::resolution::Resolution;
use crate::model::scene::{Chunks, Cull, Draw, DrawPath, Impostors, LightingMode, Scene};
use crate::model::sort_bits::SortBits;
use crate::reference::area::mean::each;
use crate::reference::picture::model_light::{Doubt, reflections_of, root_mean_square};
use crate::reference::picture::model_picture::of_model;
use crate::reference::picture::pixels::Pixels;
use crate::reference::picture::stages::FrameReference;
use crate::reference::picture::whole::{self, Drawing, Listener, Work};
use crate::reference::sprites::{self, Factor, Layers, OpaquePixel, Raster, View};
use crate::reference::volume::{Pixel, Volume};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReferenceKind {
    /// Light as the scene has it computed, but in f64 and with areas integrated; sorted thin
    /// sprites, all of them and uncut.
    Thin,
    /// The same light; the integral over the overlapping blobs.
    Volume,
    /// Light by the model itself ([`crate::reference::picture::model_light`]); the integral over the overlapping blobs,
    /// and surfaces lit pixel by pixel.
    Model,
    /// The model with this many reflections in place of the scene's.
    Reflections(u32),
}

/// A path of this many reflections has forgotten where it began.
const MOST_REFLECTIONS: u32 = 64;

impl FromStr for ReferenceKind {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<ReferenceKind, String> {
        let wrong = || {
            format!(
                "expected thin, volume, model or reflections=K with K from 1 to \
                 {MOST_REFLECTIONS}, found \"{text}\""
            )
        };
        match text {
            "thin" => Ok(ReferenceKind::Thin),
            "volume" => Ok(ReferenceKind::Volume),
            "model" => Ok(ReferenceKind::Model),
            _ => {
                let k = text.strip_prefix("reflections=").and_then(|k| k.parse().ok());
                k.filter(|k| (1..=MOST_REFLECTIONS).contains(k))
                    .map(ReferenceKind::Reflections)
                    .ok_or_else(wrong)
            }
        }
    }
}

impl fmt::Display for ReferenceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ReferenceKind::Thin => f.write_str("thin"),
            ReferenceKind::Volume => f.write_str("volume"),
            ReferenceKind::Model => f.write_str("model"),
            ReferenceKind::Reflections(k) => write!(f, "reflections={k}"),
        }
    }
}

/// A picture in f64, premultiplied linear RGBA, and how exact it is itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// By pixel of the sample.
    pub rgba: Vec<[f64; 4]>,
    /// Root mean square of the estimates of what each pixel may be off.
    pub own_error: f64,
    /// What that estimate is, in words.
    pub accuracy: String,
    /// What computing it took.
    pub seconds: f64,
    /// What of that grows with the number of pixels.
    pub pixels_s: f64,
}

impl ReferenceKind {
    /// What of `scene` no approximation of a drawing changes: all particles, uncut, in full size.
    pub fn of_scene(scene: &Scene) -> Scene {
        /// Greatest that a scene may say; e^{−32} of a blob's depth is left there.
        const UNCUT: f64 = 8.0;
        let draw = Draw {
            path: DrawPath::Sprites,
            impostors: Impostors::Off,
            resolution: Resolution::Full,
            chunks: Chunks::Of(0),
            cutoff: UNCUT,
            threshold: Cutoff::At(0.0),
            cull: Cull::On,
            smallest: Cutoff::At(0.0),
            sort_bits: SortBits::Wide,
            count: None,
            ..scene.draw
        };
        Scene { draw, ..scene.clone() }
    }

    /// Refuses a scene that this reference does not know.
    pub fn check(self, scene: &Scene, time_s: f64) -> Result<()> {
        let drawing = if self == ReferenceKind::Thin { Drawing::Thin } else { Drawing::Volume };
        whole::check(scene, time_s, drawing)?;
        if matches!(self, ReferenceKind::Reflections(_))
            && scene.lighting.mode == LightingMode::None
        {
            return Err(Error::usage(format!(
                "{self}: nothing reflects where lighting.mode is \"none\"; expected thin, \
                 volume or model"
            )));
        }
        Ok(())
    }

    /// The picture of `scene` at `time_s`, at `pixels`.
    pub fn reference(
        self,
        scene: &Scene,
        time_s: f64,
        pixels: &Pixels,
        listener: Listener,
    ) -> Result<Reference> {
        let begin = Instant::now();
        self.check(scene, time_s)?;
        let scene = &ReferenceKind::of_scene(scene);
        let drawing_since = OnceLock::new();
        let listener: Listener = &|work, n| {
            if work == Work::Drawing {
                drawing_since.get_or_init(Instant::now);
            }
            listener(work, n);
        };
        let drawn = match self {
            ReferenceKind::Thin | ReferenceKind::Volume => {
                let truth = FrameReference::of_with_listener(scene, time_s, &|n| {
                    listener(Work::Lighting, n)
                })?;
                let drawing =
                    if self == ReferenceKind::Thin { Drawing::Thin } else { Drawing::Volume };
                of_scene_light(scene, &truth, drawing, pixels, Sample::CENTER, listener)
            }
            ReferenceKind::Model => of_model(scene, time_s, None, false, pixels, listener)?,
            ReferenceKind::Reflections(k) => {
                of_model(scene, time_s, Some(k), false, pixels, listener)?
            }
        };
        let own_error = drawn.own_error();
        Ok(Reference {
            rgba: drawn.rgba,
            own_error,
            accuracy: self.accuracy_of(scene, 1),
            seconds: begin.elapsed().as_secs_f64(),
            pixels_s: drawing_since.get().map_or(0.0, |since| since.elapsed().as_secs_f64()),
        })
    }

    /// What the estimate of its own error is, in words.
    pub fn accuracy_of(self, scene: &Scene, n_samples: u32) -> String {
        let mut of = vec![match self {
            ReferenceKind::Thin => "sprites composed in f64: rounding",
            _ => "the volume's quadrature: its error estimate",
        }];
        let k = if let ReferenceKind::Reflections(k) = self { k } else { reflections_of(scene) };
        if k >= 2 {
            of.push("areas integrated: |degree 8 - degree 5| of every cell");
        }
        if k >= 3 {
            of.push("random paths: one standard error");
        }
        let mean = format!("mean of {n_samples} samples: one standard error, were they random");
        of.extend((n_samples > 1).then_some(mean.as_str()));
        of.join("; ")
    }
}

/// A picture at some pixels.
pub(crate) struct Drawn {
    pub rgba: Vec<[f64; 4]>,
    /// Estimates of what each may be off.
    pub doubts: Vec<Doubt>,
}

impl Drawn {
    /// Their root mean square.
    pub fn own_error(&self) -> f64 {
        root_mean_square(self.doubts.iter().map(|doubt| doubt.sum()))
    }
}

/// One of several pictures whose mean is meant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sample {
    pub i: u32,
    /// Where in a pixel rays go through, off its centre.
    pub shift: DVec2,
}

impl Sample {
    pub const CENTER: Sample = Sample { i: 0, shift: DVec2::ZERO };
}

/// Rounding of what is composed in f64, of the greatest value: some thousand layers.
const ROUNDING: f64 = 1e-12;

/// `scene` in the light of `truth`.
pub(crate) fn of_scene_light(
    scene: &Scene,
    truth: &FrameReference,
    drawing: Drawing,
    pixels: &Pixels,
    sample: Sample,
    listener: Listener,
) -> Drawn {
    let of_light = root_mean_square(truth.second_error.iter().copied());
    let view = View { shift: sample.shift, ..whole::view(scene, truth) };
    let behind = whole::behind_at(scene, truth, &view, pixels);
    let of_quadrature = |quadrature: f64| Doubt { quadrature, chance: 0.0 };
    let radiance = truth.particle_radiance(scene);
    if drawing == Drawing::Thin {
        let brightest = radiance.iter().map(|l| l.abs().max_element()).fold(0.0, f64::max);
        let doubts = vec![of_quadrature(of_light + ROUNDING * brightest); pixels.at.len()];
        return Drawn {
            rgba: thin(scene, truth, &view, (&behind, &radiance), pixels, listener),
            doubts,
        };
    }
    let found = volume(&Volume::new(&view, &truth.blobs, &radiance), pixels, &behind, listener);
    let doubts = found.iter().map(|p| of_quadrature(p.error + of_light)).collect();
    Drawn { rgba: found.into_iter().map(|p| p.color).collect(), doubts }
}

/// Thin sprites of such radiance at `pixels`, over what is `behind` in each.
fn thin(
    scene: &Scene,
    truth: &FrameReference,
    view: &View,
    (behind, radiance): (&[OpaquePixel], &[DVec3]),
    pixels: &Pixels,
    listener: Listener,
) -> Vec<[f64; 4]> {
    let (blobs, order) = whole::drawn(scene, truth);
    let textured = whole::sheets(scene, truth, view);
    let factor = |j: usize, delta: DVec2| {
        textured.as_ref().map_or(1.0, |(pool, sheets)| sheets[j].factor(pool, delta))
    };
    let factor: Option<Factor> = if textured.is_some() { Some(&factor) } else { None };
    let layers = Layers { blobs: &blobs, radiance, order: &order, factor };
    let on_row = |n: usize| listener(Work::Drawing, n);
    let Pixels { tile, cell, ref at, .. } = *pixels;
    let raster = Raster { first: [tile.left, tile.top], n_columns: pixels.n_columns(), cell, at };
    sprites::render_at(view, &raster, behind, &layers, &on_row)
}

/// The volume at `pixels`, whose surfaces are `behind`.
pub(crate) fn volume(
    volume: &Volume<'_>,
    pixels: &Pixels,
    behind: &[OpaquePixel],
    listener: Listener,
) -> Vec<Pixel> {
    // Pixels of a row share what they look through.
    let mut order: Vec<usize> = (0..pixels.at.len()).collect();
    order.sort_by_key(|&k| pixels.at[k][1]);
    let rows: Vec<&[usize]> = order.chunk_by(|&a, &b| pixels.at[a][1] == pixels.at[b][1]).collect();
    let of_rows = each(rows.len(), |r| {
        let j = pixels.at[rows[r][0]][1];
        let row = volume.of_row(j, rows[r].iter().map(|&k| (pixels.at[k][0], behind[k])));
        listener(Work::Drawing, rows.len());
        row
    });
    let mut found: Vec<(usize, Pixel)> =
        order.iter().copied().zip(of_rows.into_iter().flatten()).collect();
    found.sort_by_key(|(k, _)| *k);
    found.into_iter().map(|(_, pixel)| pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_can_be_asked_for() {
        for text in ["thin", "volume", "model", "reflections=1", "reflections=64"] {
            assert_eq!(text.parse::<ReferenceKind>().unwrap().to_string(), text);
        }
        for text in [
            "",
            "Thin",
            "reflections",
            "reflections=",
            "reflections=0",
            "reflections=65",
            "reflections=-1",
        ] {
            let error = text.parse::<ReferenceKind>().unwrap_err();
            assert!(
                error.contains("reflections=K") && error.ends_with(&format!("found \"{text}\"")),
                "{error}"
            );
        }
    }
}
