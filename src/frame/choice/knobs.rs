//! The knobs that can be "auto", in the order in which they are settled.

use super::rule::Tried;
use crate::model::least::Least;
use crate::model::resolution::Resolution;
use crate::model::scene::{Chunks, Cull, Draw, DrawPath, Impostors};

/// What a knob's values make other than the time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Changes {
    /// Every value draws the same law and rounds otherwise: the picture of the one that is taken is the exact one.
    Rounding,
    /// Nothing, but for what rounds of `tiles` may round.
    Nothing,
    /// The picture, by as much as `draw.error` allows.
    Picture,
}

pub struct Knob {
    /// As scene files have it.
    pub key: &'static str,
    pub changes: Changes,
    pub is_auto: fn(&Draw) -> bool,
    /// What may be taken where the other knobs are as they are, to begin with what changes nothing, then in order of what they
    /// may change.
    pub values: fn(&Draw) -> Vec<Draw>,
    /// A value as scene files have it.
    pub name: fn(&Draw) -> String,
}

/// Chunks; in more the pixels that are full are looked for more often.
const CHUNKS: [u32; 4] = [0, 4, 16, 64];
/// Optical depths; a quarter of a step of 8 bits is 0.001.
const THRESHOLDS: [f64; 4] = [0.0, 1e-5, 1e-4, 1e-3];
/// Pixels.
const SMALLEST: [f64; 4] = [0.0, 0.25, 0.5, 1.0];

pub const KNOBS: [Knob; 6] = [
    Knob {
        key: "path",
        changes: Changes::Rounding,
        is_auto: |draw| draw.path == DrawPath::Auto,
        values: |draw| [DrawPath::Sprites, DrawPath::Tiles].map(|path| Draw { path, ..*draw }).to_vec(),
        name: |draw| named(&DrawPath::NAMES, draw.path),
    },
    Knob {
        key: "chunks",
        changes: Changes::Rounding,
        is_auto: |draw| draw.chunks == Chunks::Auto,
        values: |draw| match draw.path {
            DrawPath::Tiles => vec![*draw],
            _ => CHUNKS.map(|n| Draw { chunks: Chunks::Of(n), ..*draw }).to_vec(),
        },
        name: |draw| if let Chunks::Of(n) = draw.chunks { n.to_string() } else { "\"auto\"".to_owned() },
    },
    Knob {
        key: "cull",
        changes: Changes::Nothing,
        // Who is in a shell must not depend on the view: none is left out.
        is_auto: |draw| draw.cull == Cull::Auto && draw.impostors == Impostors::Off,
        values: |draw| [Cull::On, Cull::Off].map(|cull| Draw { cull, ..*draw }).to_vec(),
        name: |draw| named(&Cull::NAMES, draw.cull),
    },
    Knob {
        key: "threshold",
        changes: Changes::Picture,
        is_auto: |draw| draw.threshold == Least::Auto,
        values: |draw| THRESHOLDS.map(|t| Draw { threshold: Least::Of(t), ..*draw }).to_vec(),
        name: |draw| draw.threshold.bound().to_string(),
    },
    Knob {
        key: "smallest",
        changes: Changes::Picture,
        is_auto: |draw| draw.smallest == Least::Auto,
        // Who culls leaves them out.
        values: |draw| {
            let cull = |pixels: f64| if pixels > 0.0 { Cull::On } else { draw.cull };
            SMALLEST.map(|w| Draw { smallest: Least::Of(w), cull: cull(w), ..*draw }).to_vec()
        },
        name: |draw| draw.smallest.bound().to_string(),
    },
    Knob {
        key: "resolution",
        changes: Changes::Picture,
        is_auto: |draw| draw.resolution == Resolution::Auto,
        values: |draw| Resolution::ALL.map(|(_, resolution)| Draw { resolution, ..*draw }).to_vec(),
        name: |draw| draw.resolution.name().to_owned(),
    },
];

impl Knob {
    /// Whether what was tried is near enough to the exact picture. Without an error nothing is taken that might change another
    /// frame.
    pub fn allows(&self, tried: &Tried, error: f64) -> bool {
        match (self.changes, tried.rmse) {
            (_, None) => false,
            (Changes::Rounding, Some(_)) => true,
            (Changes::Nothing, Some(rmse)) => rmse <= error,
            (Changes::Picture, Some(rmse)) => rmse <= error && (error > 0.0 || tried.is_first),
        }
    }

    /// `value` as users are told, `first` being what changes nothing.
    pub fn told(&self, value: &Draw, first: &Draw) -> String {
        let name = (self.name)(value);
        match self.key != "cull" && value.cull != first.cull {
            true => format!("{name} with draw.cull = {}", named(&Cull::NAMES, value.cull)),
            false => name,
        }
    }
}

/// The name of a value, as a string of TOML.
fn named<T: PartialEq>(names: &[(&str, T)], value: T) -> String {
    let name = names.iter().find(|(_, of)| *of == value).map_or("", |(name, _)| name);
    format!("\"{name}\"")
}
