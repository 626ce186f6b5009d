//! The table of knobs that can be "auto", in the order in which they are settled.

use super::rule::Candidate;
use crate::model::cutoff::Cutoff;
use crate::model::resolution::Resolution;
use crate::model::scene::{Chunks, Cull, Draw, DrawPath, Impostors, Overlap};

/// The effect of a knob's values besides the time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Changes {
    /// The rounding: every value computes the same picture, and the chosen one's becomes the exact
    /// one.
    Rounding,
    /// Nothing, except for the rounding of several chunks or rounds of `tiles`.
    Nothing,
    /// The picture, within `draw.error`.
    Picture,
    /// The picture, within `draw.error` of the first value's, which becomes the exact one: it is
    /// nearer to the model than all before.
    Model,
}

/// A knob that can be "auto".
pub struct Knob {
    /// Key in the scene file's `draw`.
    pub key: &'static str,
    /// The effect of its values.
    pub changes: Changes,
    /// Returns whether the knob is "auto".
    pub is_auto: fn(&Draw) -> bool,
    /// Returns the candidates with the other knobs as they are: first the value that changes
    /// nothing, then by increasing change.
    pub values: fn(&Draw) -> Vec<Draw>,
    /// Returns a value as scene files write it.
    pub name: fn(&Draw) -> String,
}

/// Numbers of chunks; with more chunks, opaque pixels are found earlier.
const CHUNKS: [u32; 4] = [0, 4, 16, 64];
/// Optical depths; a quarter of a step of 8 bits is 0.001.
const THRESHOLDS: [f64; 4] = [0.0, 1e-5, 1e-4, 1e-3];
/// Pixels.
const SMALLEST: [f64; 4] = [0.0, 0.25, 0.5, 1.0];

pub const KNOBS: [Knob; 7] = [
    Knob {
        key: "path",
        changes: Changes::Rounding,
        is_auto: |draw| draw.path == DrawPath::Auto,
        values: |draw| match draw.overlap {
            Overlap::Slices => vec![*draw],
            _ => [DrawPath::Sprites, DrawPath::Tiles].map(|path| Draw { path, ..*draw }).to_vec(),
        },
        name: |draw| toml_name(&DrawPath::NAMES, draw.path),
    },
    Knob {
        key: "overlap",
        changes: Changes::Model,
        is_auto: |draw| draw.overlap == Overlap::Auto,
        values: |draw| match draw.path {
            DrawPath::Tiles => {
                [Overlap::Slices, Overlap::Thin].map(|overlap| Draw { overlap, ..*draw }).to_vec()
            }
            _ => vec![*draw],
        },
        name: |draw| toml_name(&Overlap::NAMES, draw.overlap),
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
        // Impostor layers include every particle, so that they stay valid when the camera turns.
        is_auto: |draw| draw.cull == Cull::Auto && draw.impostors == Impostors::Off,
        values: |draw| [Cull::On, Cull::Off].map(|cull| Draw { cull, ..*draw }).to_vec(),
        name: |draw| toml_name(&Cull::NAMES, draw.cull),
    },
    // Before the knobs that save less time for the same error.
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
        // Culling leaves small blobs out.
        values: |draw| {
            let cull = |pixels: f64| if pixels > 0.0 { Cull::On } else { draw.cull };
            SMALLEST.map(|w| Draw { smallest: Cutoff::At(w), cull: cull(w), ..*draw }).to_vec()
        },
        name: |draw| draw.smallest.bound().to_string(),
    },
];

impl Knob {
    /// Returns whether a candidate is near enough to the exact picture. If the error is 0, no value
    /// is allowed that might change another frame.
    pub fn allows(&self, candidate: &Candidate, error: f64) -> bool {
        match (self.changes, candidate.rmse) {
            (_, None) => false,
            (Changes::Rounding, Some(_)) => true,
            (Changes::Nothing, Some(rmse)) => rmse <= error,
            (Changes::Picture | Changes::Model, Some(rmse)) => {
                rmse <= error && (error > 0.0 || candidate.is_first)
            }
        }
    }

    /// Returns `value` as users read it; `first` is the value that changes nothing.
    pub fn label(&self, value: &Draw, first: &Draw) -> String {
        let name = (self.name)(value);
        match self.key != "cull" && value.cull != first.cull {
            true => format!("{name} with draw.cull = {}", toml_name(&Cull::NAMES, value.cull)),
            false => name,
        }
    }
}

/// Returns the name of a value as a TOML string.
pub fn toml_name<T: PartialEq>(names: &[(&str, T)], value: T) -> String {
    let name = names.iter().find(|(_, of)| *of == value).map_or("", |(name, _)| name);
    format!("\"{name}\"")
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::model::edge::Reach;
    use crate::model::overlap::SLICE;
    use crate::model::sort_bits::SortBits;

    /// A `draw` in which every knob of the table is "auto".
    pub const ASKED: Draw = Draw {
        path: DrawPath::Auto,
        impostors: Impostors::Off,
        impostor_error: 0.5,
        resolution: Resolution::Auto,
        error: 1e-3,
        chunks: Chunks::Auto,
        cutoff: Reach::Sigmas(3.0),
        threshold: Cutoff::Auto,
        overlap: Overlap::Auto,
        slice: SLICE,
        cull: Cull::Auto,
        smallest: Cutoff::Auto,
        sort_bits: SortBits::Wide,
        count: None,
        lod: 0.0,
        texture_seed: 1,
        n_particles: 0,
    };

    #[test]
    fn the_first_value_of_a_knob_changes_nothing_and_all_have_names() {
        let exact = ASKED.exact();
        for knob in &KNOBS {
            assert!((knob.is_auto)(&ASKED) && !(knob.is_auto)(&exact), "{}", knob.key);
            let values = (knob.values)(&exact);
            assert_eq!(values[0], exact, "{}", knob.key);
            let mut names: Vec<String> = values.iter().map(|v| knob.label(v, &exact)).collect();
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
    fn a_smallest_size_turns_culling_on_and_says_so() {
        let off = Draw { cull: Cull::Off, ..ASKED.exact() };
        let Some(knob) = KNOBS.iter().find(|k| k.key == "smallest") else { panic!("no such knob") };
        let values = (knob.values)(&off);
        assert_eq!([values[0].cull, values[1].cull], [Cull::Off, Cull::On]);
        assert_eq!(knob.label(&values[1], &off), "0.25 with draw.cull = \"on\"");
    }

    #[test]
    fn with_error_zero_no_value_is_allowed_that_may_change_a_picture() {
        let candidate = |is_first, rmse| Candidate {
            value: String::new(),
            is_first,
            times_ms: vec![1.0],
            rmse,
        };
        let of = |changes| KNOBS.iter().find(|k| k.changes == changes).expect("one");
        let [rounding, nothing, picture] =
            [Changes::Rounding, Changes::Nothing, Changes::Picture].map(of);
        let equal = candidate(false, Some(0.0));
        assert!(
            nothing.allows(&equal, 0.0)
                && !picture.allows(&equal, 0.0)
                && picture.allows(&equal, 1e-9)
        );
        assert!(picture.allows(&candidate(true, Some(0.0)), 0.0));
        let off = candidate(false, Some(0.1));
        assert!(
            rounding.allows(&off, 0.0)
                && !nothing.allows(&off, 0.01)
                && !picture.allows(&off, 0.01)
        );
        assert!(!rounding.allows(&candidate(false, None), 1.0));
    }
}
