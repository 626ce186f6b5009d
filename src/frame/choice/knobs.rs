//! The knobs that can be "auto", in the order in which they are settled.

use super::rule::Tried;
use crate::model::cutoff::Cutoff;
use crate::model::resolution::Resolution;
use crate::model::scene::{Chunks, Cull, Draw, DrawPath, Impostors};

/// What a knob's values make other than the time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Changes {
    /// Every value draws the same law and rounds otherwise: the picture of the one that is taken is
    /// the exact one.
    Rounding,
    /// Nothing, but for what rounds of `tiles` and several chunks may round.
    Nothing,
    /// The picture, by as much as `draw.error` allows.
    Picture,
}

pub struct Knob {
    /// As scene files have it.
    pub key: &'static str,
    pub changes: Changes,
    pub is_auto: fn(&Draw) -> bool,
    /// What may be taken where the other knobs are as they are, to begin with what changes nothing,
    /// then in order of what they may change.
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
        values: |draw| {
            [DrawPath::Sprites, DrawPath::Tiles].map(|path| Draw { path, ..*draw }).to_vec()
        },
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
        name: |draw| {
            if let Chunks::Of(n) = draw.chunks { n.to_string() } else { "\"auto\"".to_owned() }
        },
    },
    Knob {
        key: "cull",
        changes: Changes::Nothing,
        // Who is in a shell must not depend on the view: none is left out.
        is_auto: |draw| draw.cull == Cull::Auto && draw.impostors == Impostors::Off,
        values: |draw| [Cull::On, Cull::Off].map(|cull| Draw { cull, ..*draw }).to_vec(),
        name: |draw| named(&Cull::NAMES, draw.cull),
    },
    // Before what saves less by as much of the error.
    Knob {
        key: "resolution",
        changes: Changes::Picture,
        is_auto: |draw| draw.resolution == Resolution::Auto,
        values: |draw| Resolution::ALL.map(|(_, resolution)| Draw { resolution, ..*draw }).to_vec(),
        name: |draw| draw.resolution.name().to_owned(),
    },
    Knob {
        key: "threshold",
        changes: Changes::Picture,
        is_auto: |draw| draw.threshold == Cutoff::Auto,
        values: |draw| THRESHOLDS.map(|t| Draw { threshold: Cutoff::At(t), ..*draw }).to_vec(),
        name: |draw| draw.threshold.bound().to_string(),
    },
    Knob {
        key: "smallest",
        changes: Changes::Picture,
        is_auto: |draw| draw.smallest == Cutoff::Auto,
        // Who culls leaves them out.
        values: |draw| {
            let cull = |pixels: f64| if pixels > 0.0 { Cull::On } else { draw.cull };
            SMALLEST.map(|w| Draw { smallest: Cutoff::At(w), cull: cull(w), ..*draw }).to_vec()
        },
        name: |draw| draw.smallest.bound().to_string(),
    },
];

impl Knob {
    /// Whether what was tried is near enough to the exact picture. Without an error nothing is
    /// taken that might change another frame.
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
pub fn named<T: PartialEq>(names: &[(&str, T)], value: T) -> String {
    let name = names.iter().find(|(_, of)| *of == value).map_or("", |(name, _)| name);
    format!("\"{name}\"")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::sort_bits::SortBits;

    /// Everything that can be "auto" is.
    const ASKED: Draw = Draw {
        path: DrawPath::Auto,
        impostors: Impostors::Off,
        impostor_error: 0.5,
        resolution: Resolution::Auto,
        error: 1e-3,
        chunks: Chunks::Auto,
        cutoff: 3.0,
        threshold: Cutoff::Auto,
        cull: Cull::Auto,
        smallest: Cutoff::Auto,
        sort_bits: SortBits::Wide,
        count: None,
        texture_seed: 1,
        n_particles: 0,
    };

    #[test]
    fn every_knob_begins_with_what_changes_nothing_and_names_its_values() {
        let exact = ASKED.exact();
        for knob in &KNOBS {
            assert!((knob.is_auto)(&ASKED) && !(knob.is_auto)(&exact), "{}", knob.key);
            let values = (knob.values)(&exact);
            assert_eq!(values[0], exact, "{}", knob.key);
            let mut names: Vec<String> = values.iter().map(|v| knob.told(v, &exact)).collect();
            assert!(
                names.iter().all(|name| !name.contains("auto") && !name.contains("with")),
                "{names:?}"
            );
            names.sort();
            names.dedup();
            assert_eq!(names.len(), values.len(), "{names:?}");
        }
    }

    #[test]
    fn who_leaves_small_ones_out_culls_and_says_so() {
        let off = Draw { cull: Cull::Off, ..ASKED.exact() };
        let Some(knob) = KNOBS.iter().find(|k| k.key == "smallest") else { panic!("no such knob") };
        let values = (knob.values)(&off);
        assert_eq!([values[0].cull, values[1].cull], [Cull::Off, Cull::On]);
        assert_eq!(knob.told(&values[1], &off), "0.25 with draw.cull = \"on\"");
    }

    #[test]
    fn without_an_error_nothing_is_allowed_that_may_change_a_picture() {
        let tried =
            |is_first, rmse| Tried { value: String::new(), is_first, times_ms: vec![1.0], rmse };
        let of = |changes| KNOBS.iter().find(|k| k.changes == changes).expect("one");
        let [rounding, nothing, picture] =
            [Changes::Rounding, Changes::Nothing, Changes::Picture].map(of);
        let equal = tried(false, Some(0.0));
        assert!(
            nothing.allows(&equal, 0.0)
                && !picture.allows(&equal, 0.0)
                && picture.allows(&equal, 1e-9)
        );
        assert!(picture.allows(&tried(true, Some(0.0)), 0.0));
        let off = tried(false, Some(0.1));
        assert!(
            rounding.allows(&off, 0.0)
                && !nothing.allows(&off, 0.01)
                && !picture.allows(&off, 0.01)
        );
        assert!(!rounding.allows(&tried(false, None), 1.0));
    }
}
