//! The reference pictures that a device's picture can be compared with.

use std::fmt;
use std::str::FromStr;

use crate::model::cutoff::Cutoff;
use crate::model::edge::{FARTHEST, Reach};
use crate::model::overlap::SLICE;
use crate::model::resolution::Resolution;
use crate::model::scene::{Chunks, Cull, Draw, DrawPath, Impostors, LightingMode, Overlap, Scene};
use crate::model::sort_bits::SortBits;

/// A reference picture, as `--against thin|slices|volume|model|reflections=K|transport` names it.
/// Each kind drops an approximation that the kind before it still shares with the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReferenceKind {
    /// The scene's lighting method in f64 with areas integrated, drawn as sorted thin sprites
    /// without cutoff.
    Thin,
    /// The same light; the same blobs composed by slices of `draw.slice`.
    Slices,
    /// The same light; the integral over the overlapping blobs.
    Volume,
    /// The model's own light without density grid or grouped facets, the integral over the
    /// overlapping blobs, and surfaces lit at every pixel.
    Model,
    /// The model with this many reflections instead of the scene's.
    Reflections(u32),
    /// Radiative transfer in the blobs as a medium, by random paths (transport.md).
    Transport,
}

/// Greatest number of reflections. At an albedo of 0.9 the next one is 10⁻³ of the first.
const MAX_REFLECTIONS: u32 = 64;

impl FromStr for ReferenceKind {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<ReferenceKind, String> {
        let reflections = || {
            let k = text.strip_prefix("reflections=")?.parse().ok()?;
            (1..=MAX_REFLECTIONS).contains(&k).then_some(ReferenceKind::Reflections(k))
        };
        match text {
            "thin" => Ok(ReferenceKind::Thin),
            "slices" => Ok(ReferenceKind::Slices),
            "volume" => Ok(ReferenceKind::Volume),
            "model" => Ok(ReferenceKind::Model),
            "transport" => Ok(ReferenceKind::Transport),
            _ => reflections().ok_or_else(|| {
                format!(
                    "expected thin, slices, volume, model, reflections=K with K from 1 to \
                     {MAX_REFLECTIONS}, or transport, found \"{text}\""
                )
            }),
        }
    }
}

impl fmt::Display for ReferenceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ReferenceKind::Thin => f.write_str("thin"),
            ReferenceKind::Slices => f.write_str("slices"),
            ReferenceKind::Volume => f.write_str("volume"),
            ReferenceKind::Model => f.write_str("model"),
            ReferenceKind::Reflections(k) => write!(f, "reflections={k}"),
            ReferenceKind::Transport => f.write_str("transport"),
        }
    }
}

impl ReferenceKind {
    /// Returns the kind that composes overlapping blobs as `scene`, in which nothing is "auto".
    pub fn drawn_by(scene: &Scene) -> ReferenceKind {
        match scene.draw.overlap {
            Overlap::Slices => ReferenceKind::Slices,
            Overlap::Thin | Overlap::Auto => ReferenceKind::Thin,
        }
    }

    /// Returns `scene` with every approximation of its drawing switched off, but for this kind's
    /// way of composing overlapping blobs: all particles, full size, out to 8 σ.
    pub fn without_approximations(self, scene: &Scene) -> Scene {
        let (path, overlap, slice) = match self {
            ReferenceKind::Slices => (DrawPath::Tiles, Overlap::Slices, scene.draw.slice),
            _ => (DrawPath::Sprites, Overlap::Thin, SLICE),
        };
        let draw = Draw {
            path,
            overlap,
            slice,
            impostors: Impostors::Off,
            resolution: Resolution::Full,
            chunks: Chunks::Of(0),
            cutoff: Reach::Sigmas(FARTHEST),
            threshold: Cutoff::NONE,
            cull: Cull::On,
            smallest: Cutoff::NONE,
            lod: 0.0,
            sort_bits: SortBits::Wide,
            count: None,
            ..scene.draw
        };
        Scene { draw, ..scene.clone() }
    }

    /// Returns whether every sample is a random path: a single one then tells nothing of its error.
    pub fn is_random(self) -> bool {
        self == ReferenceKind::Transport
    }

    /// Returns the number of samples of a pixel where nothing says how many.
    pub fn usual_samples(self) -> u32 {
        if self.is_random() { 64 } else { 1 }
    }

    /// Returns the number of reflections that the picture of a scene has.
    pub(super) fn n_reflections(self, scene: &Scene) -> u32 {
        if let ReferenceKind::Reflections(k) = self { k } else { n_reflections(scene) }
    }

    /// Describes what the estimate of this reference's own error consists of, for a mean of
    /// `n_samples` samples.
    pub fn accuracy_text(self, scene: &Scene, n_samples: u32) -> String {
        if self.is_random() {
            return format!("{n_samples} random paths a pixel: one standard error");
        }
        let mut parts = vec![match self {
            ReferenceKind::Thin => "sprites composed in f64: rounding",
            ReferenceKind::Slices => "slices composed in f64: rounding",
            _ => "the volume's quadrature: its error estimate",
        }];
        let k = self.n_reflections(scene);
        if k >= 2 {
            parts.push("areas integrated: |degree 8 - degree 5| of every cell");
        }
        if k >= 3 {
            parts.push("random paths: one standard error");
        }
        let mean = format!("mean of {n_samples} samples: one standard error, were they random");
        parts.extend((n_samples > 1).then_some(mean.as_str()));
        parts.join("; ")
    }
}

/// Returns the number of reflections that the scene's lighting mode computes. A medium reflects
/// once, as surfaces and ground in it do.
pub fn n_reflections(scene: &Scene) -> u32 {
    match scene.lighting.mode {
        LightingMode::None => 0,
        LightingMode::TwoReflection => 2,
        _ => 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_parse_and_print_alike_and_others_are_refused() {
        for text in
            ["thin", "slices", "volume", "model", "reflections=1", "reflections=64", "transport"]
        {
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
