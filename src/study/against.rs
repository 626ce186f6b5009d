//! What pictures are measured by: `--against thin|volume|model|reflections=K`. Each takes away what the one before it still
//! shares with the device's picture.

use std::fmt;
use std::str::FromStr;
use std::sync::OnceLock;
use std::time::Instant;

use glam::{DVec2, DVec3};

use super::model_light::{Lit, Met, ModelLight, reflections_of};
use super::picture::{self, Drawing, Listener, Work};
use super::pixels::Pixels;
use super::truth::Truth;
use crate::error::{Error, Result};
use crate::model::least::Least;
use crate::model::resolution::Resolution;
use crate::model::scene::{Chunks, Cull, Draw, DrawPath, Impostors, LightingMode, Scene};
use crate::model::sort_bits::SortBits;
use crate::model::surface::Surface;
use crate::reference::area::mean::each;
use crate::reference::sprites::{self, Behind, Factor, Layers, View};
use crate::reference::surfaces;
use crate::reference::volume::{Pixel, Volume};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Against {
    /// Light as the scene has it computed, but in f64 and with areas integrated; sorted thin sprites, all of them and uncut.
    Thin,
    /// The same light; the integral over the overlapping blobs.
    Volume,
    /// Light by the model itself ([`super::model_light`]); the integral over the overlapping blobs, and surfaces lit pixel by
    /// pixel.
    Model,
    /// The model with this many reflections in place of the scene's.
    Reflections(u32),
}

/// A path of this many reflections has forgotten where it began.
const MOST_REFLECTIONS: u32 = 64;

impl FromStr for Against {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Against, String> {
        let wrong = || {
            format!(
                "expected thin, volume, model or reflections=K with K from 1 to {MOST_REFLECTIONS}, found \"{text}\""
            )
        };
        match text {
            "thin" => Ok(Against::Thin),
            "volume" => Ok(Against::Volume),
            "model" => Ok(Against::Model),
            _ => {
                let k = text.strip_prefix("reflections=").and_then(|k| k.parse().ok());
                k.filter(|k| (1..=MOST_REFLECTIONS).contains(k)).map(Against::Reflections).ok_or_else(wrong)
            }
        }
    }
}

impl fmt::Display for Against {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Against::Thin => f.write_str("thin"),
            Against::Volume => f.write_str("volume"),
            Against::Model => f.write_str("model"),
            Against::Reflections(k) => write!(f, "reflections={k}"),
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

impl Against {
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
            threshold: Least::Of(0.0),
            cull: Cull::On,
            smallest: Least::Of(0.0),
            sort_bits: SortBits::Wide,
            count: None,
            ..scene.draw
        };
        Scene { draw, ..scene.clone() }
    }

    /// Refuses a scene that this reference does not know.
    pub fn check(self, scene: &Scene, time_s: f64) -> Result<()> {
        let drawing = if self == Against::Thin { Drawing::Thin } else { Drawing::Volume };
        picture::check(scene, time_s, drawing)?;
        if matches!(self, Against::Reflections(_)) && scene.lighting.mode == LightingMode::None {
            return Err(Error::usage(format!(
                "--against {self}: nothing reflects where lighting.mode is \"none\"; expected thin, volume or model"
            )));
        }
        Ok(())
    }

    /// The picture of `scene` at `time_s`, at `pixels`.
    pub fn reference(self, scene: &Scene, time_s: f64, pixels: &Pixels, listener: Listener) -> Result<Reference> {
        let begin = Instant::now();
        self.check(scene, time_s)?;
        let scene = &Against::of_scene(scene);
        let drawing_since = OnceLock::new();
        let listener: Listener = &|work, n| {
            if work == Work::Drawing {
                drawing_since.get_or_init(Instant::now);
            }
            listener(work, n);
        };
        let drawn = match self {
            Against::Thin | Against::Volume => {
                let truth = Truth::of_with_listener(scene, time_s, &|n| listener(Work::Lighting, n))?;
                let drawing = if self == Against::Thin { Drawing::Thin } else { Drawing::Volume };
                of_scene_light(scene, &truth, drawing, pixels, listener)
            }
            Against::Model => of_model(scene, time_s, None, false, pixels, listener)?,
            Against::Reflections(k) => of_model(scene, time_s, Some(k), false, pixels, listener)?,
        };
        let own_error = drawn.own_error();
        Ok(Reference {
            rgba: drawn.rgba,
            own_error,
            accuracy: self.accuracy(scene),
            seconds: begin.elapsed().as_secs_f64(),
            pixels_s: drawing_since.get().map_or(0.0, |since| since.elapsed().as_secs_f64()),
        })
    }

    fn accuracy(self, scene: &Scene) -> String {
        let mut of = vec![match self {
            Against::Thin => "sprites composed in f64: rounding",
            _ => "the volume's quadrature: its error estimate",
        }];
        let k = if let Against::Reflections(k) = self { k } else { reflections_of(scene) };
        if k >= 2 {
            of.push("areas integrated: |degree 8 - degree 5| of every cell");
        }
        if k >= 3 {
            of.push("random paths: one standard error");
        }
        of.join("; ")
    }
}

/// A picture at the pixels of a sample.
pub(super) struct Drawn {
    pub rgba: Vec<[f64; 4]>,
    /// Estimates of what each may be off.
    errors: Vec<f64>,
}

impl Drawn {
    /// Their root mean square.
    pub fn own_error(&self) -> f64 {
        root_mean_square(self.errors.iter().copied())
    }
}

/// Rounding of what is composed in f64, of the greatest value: some thousand layers.
const ROUNDING: f64 = 1e-12;

/// `scene` in the light of `truth`.
pub(super) fn of_scene_light(
    scene: &Scene,
    truth: &Truth,
    drawing: Drawing,
    pixels: &Pixels,
    listener: Listener,
) -> Drawn {
    let of_light = root_mean_square(truth.second_error.iter().copied());
    let view = picture::view(scene, truth);
    let behind = pixels.pick(&picture::behind(scene, truth, &view));
    let radiance = truth.particle_radiance(scene);
    if drawing == Drawing::Thin {
        let brightest = radiance.iter().map(|l| l.abs().max_element()).fold(0.0, f64::max);
        let errors = vec![of_light + ROUNDING * brightest; pixels.at.len()];
        return Drawn { rgba: thin(scene, truth, &view, (&behind, &radiance), pixels, listener), errors };
    }
    let found = volume(&Volume::new(&view, &truth.blobs, &radiance), pixels, &behind, listener);
    let errors = found.iter().map(|p| p.error + of_light).collect();
    Drawn { rgba: found.into_iter().map(|p| p.color).collect(), errors }
}

/// Thin sprites of such radiance at `pixels`, over what is `behind` in each.
fn thin(
    scene: &Scene,
    truth: &Truth,
    view: &View,
    (behind, radiance): (&[Behind], &[DVec3]),
    pixels: &Pixels,
    listener: Listener,
) -> Vec<[f64; 4]> {
    let (blobs, order) = picture::drawn(scene, truth);
    let textured = picture::sheets(scene, truth, view);
    let factor = |j: usize, delta: DVec2| textured.as_ref().map_or(1.0, |(pool, sheets)| sheets[j].factor(pool, delta));
    let factor: Option<Factor> = if textured.is_some() { Some(&factor) } else { None };
    let layers = Layers { blobs: &blobs, radiance, order: &order, factor };
    let on_row = |n: usize| listener(Work::Drawing, n);
    sprites::render_at(view, (pixels.cell, &pixels.at), behind, &layers, &on_row)
}

/// `scene` in the model's light, of `n` reflections where they are not the scene's. `by_facet`: surfaces are lit where the scene
/// has facets, and between them as it is drawn; else at every pixel.
pub(super) fn of_model(
    scene: &Scene,
    time_s: f64,
    n: Option<u32>,
    by_facet: bool,
    pixels: &Pixels,
    listener: Listener,
) -> Result<Drawn> {
    if scene.lighting.mode == LightingMode::None {
        let truth = Truth::unlit(scene, time_s)?;
        return Ok(of_scene_light(scene, &truth, Drawing::Volume, pixels, listener));
    }
    let truth = Truth::unlit(scene, time_s)?;
    let view = picture::view(scene, &truth);
    let met = Met::of(scene, &truth);
    let light = ModelLight::new(scene, &met, &truth, n);
    let facets: Vec<(usize, DVec3)> = match by_facet {
        true => met
            .surfaces
            .iter()
            .enumerate()
            .flat_map(|(i, s)| (0..s.n_facets() as u32).map(move |k| (i, s.facet_center(k))))
            .collect(),
        false => Vec::new(),
    };
    let n_lit_pixels = if by_facet { 0 } else { pixels.at.len() };
    let n_parts = met.n_discs() + facets.len() + n_lit_pixels;
    let discs = each(met.n_discs(), |i| {
        let lit = light.of_disc(i);
        listener(Work::Lighting, n_parts);
        lit
    });
    let lit_facets = each(facets.len(), |k| {
        let lit = light.of_surface(facets[k].0, facets[k].1, met.n_discs() + k);
        listener(Work::Lighting, n_parts);
        lit
    });
    let behind = match by_facet {
        true => between(&view, &met.surfaces, &lit_facets, pixels),
        false => each(pixels.at.len(), |k| {
            let seen = seen(&view, &met.surfaces, &light, pixels.at[k], met.n_discs() + k);
            listener(Work::Lighting, n_parts);
            seen
        }),
    };
    let (ground, discs) = discs.split_at(met.n_ground());
    let behind = over(behind, scene, &truth, &view, ground, pixels);
    let radiance: Vec<DVec3> = discs.iter().map(|lit| lit.radiance).collect();
    let of_discs = root_mean_square(discs.iter().map(|lit| lit.error));
    let places: Vec<Behind> = behind.iter().map(|(b, _)| *b).collect();
    let found = volume(&Volume::new(&view, &truth.blobs, &radiance), pixels, &places, listener);
    // Of a surface or ground all may show, of particles as much as they hold back.
    let error = |(p, (behind, e)): (&Pixel, &(Behind, f64))| {
        let through = if behind.color[3] > 0.0 { 1.0 } else { 0.0 };
        p.error + e * through + of_discs * p.color[3]
    };
    let errors = found.iter().zip(&behind).map(error).collect();
    Ok(Drawn { rgba: found.into_iter().map(|p| p.color).collect(), errors })
}

/// The surfaces in the pixels as they are drawn from the light of their facets.
fn between(view: &View, placed: &[Surface], facets: &[Lit], pixels: &Pixels) -> Vec<(Behind, f64)> {
    let radiance: Vec<DVec3> = facets.iter().map(|lit| lit.radiance).collect();
    let error = root_mean_square(facets.iter().map(|lit| lit.error));
    pixels.pick(&surfaces::render(view, placed, &radiance)).into_iter().map(|behind| (behind, error)).collect()
}

/// `behind`, and over it what is nearer of the ground, as it is drawn from the light of its points.
fn over(
    behind: Vec<(Behind, f64)>,
    scene: &Scene,
    truth: &Truth,
    view: &View,
    ground: &[Lit],
    pixels: &Pixels,
) -> Vec<(Behind, f64)> {
    if ground.is_empty() {
        return behind;
    }
    let radiance: Vec<DVec3> = ground.iter().map(|lit| lit.radiance).collect();
    let error = root_mean_square(ground.iter().map(|lit| lit.error));
    let mut picture = vec![Behind::NOTHING; view.width as usize * view.height as usize];
    picture::ground_over(&mut picture, scene, truth.setting.light_origin, view, &radiance);
    let nearer =
        |(other, seen): ((Behind, f64), Behind)| if seen.depth < other.0.depth { (seen, error) } else { other };
    behind.into_iter().zip(pixels.pick(&picture)).map(nearer).collect()
}

/// The surface in a pixel, and what its radiance may be off; black from behind.
fn seen(view: &View, placed: &[Surface], light: &ModelLight<'_>, [i, j]: [u32; 2], number: usize) -> (Behind, f64) {
    let ray = view.ray(i, j);
    let Some((i_surface, hit)) = surfaces::seen(view, placed, ray) else { return (Behind::NOTHING, 0.0) };
    let lit = match hit.is_front {
        true => light.of_surface(i_surface, view.pose.position + hit.depth * ray, number),
        false => Lit { radiance: DVec3::ZERO, error: 0.0 },
    };
    (Behind { color: lit.radiance.extend(1.0).to_array(), depth: hit.depth, ..Behind::NOTHING }, lit.error)
}

/// The volume at `pixels`, whose surfaces are `behind`.
fn volume(volume: &Volume<'_>, pixels: &Pixels, behind: &[Behind], listener: Listener) -> Vec<Pixel> {
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
    let mut found: Vec<(usize, Pixel)> = order.iter().copied().zip(of_rows.into_iter().flatten()).collect();
    found.sort_by_key(|(k, _)| *k);
    found.into_iter().map(|(_, pixel)| pixel).collect()
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0u64, 0.0), |(n, sum), v| (n + 1, sum + v * v));
    if n == 0 { 0.0 } else { (sum / n as f64).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_can_be_asked_for() {
        for text in ["thin", "volume", "model", "reflections=1", "reflections=64"] {
            assert_eq!(text.parse::<Against>().unwrap().to_string(), text);
        }
        for text in ["", "Thin", "reflections", "reflections=", "reflections=0", "reflections=65", "reflections=-1"] {
            let error = text.parse::<Against>().unwrap_err();
            assert!(error.contains("reflections=K") && error.ends_with(&format!("found \"{text}\"")), "{error}");
        }
    }
}
