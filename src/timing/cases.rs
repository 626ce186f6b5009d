//! What a bench times: a scene in each of its phases, at each point of a sweep.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::io::scene_file::{LoadedScene, Phase};
use crate::model::scene::{Scene, Threading};
use crate::timing::records::{Setting, case_name};

/// A way of running frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Loop {
    pub threading: Threading,
    /// Frames leave out what they do not need.
    pub skip: bool,
}

impl Loop {
    pub fn name(self) -> &'static str {
        match (self.threading, self.skip) {
            (Threading::Serial, true) => "serial",
            (Threading::Parallel, true) => "parallel",
            (Threading::Serial, false) => "serial no-skip",
            (Threading::Parallel, false) => "parallel no-skip",
        }
    }
}

/// A scene with one setting of all that a run varies.
#[derive(Debug, Clone)]
pub struct Case {
    pub phase: Option<String>,
    pub sweep: Vec<Setting>,
    pub scene: Arc<Scene>,
    /// Of the scene at this point of the sweep, with all its phases and files.
    pub scene_hash: String,
    /// First timed frame. Those of the phases follow each other without a gap.
    pub i_first: u32,
    /// Timed frames of a block.
    pub n_frames: u32,
    /// In the order of the first round.
    pub loops: Vec<Loop>,
}

impl Case {
    /// Its phase and sweep in words; empty where there is neither.
    pub fn name(&self) -> String {
        case_name(self.phase.as_deref().unwrap_or_default(), &sweep_text(&self.sweep))
    }
}

/// "key=value, key=value".
pub fn sweep_text(sweep: &[Setting]) -> String {
    sweep.iter().map(|s| format!("{}={}", s.key, s.value)).collect::<Vec<_>>().join(", ")
}

/// Values of one key, as `--sweep` has them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Axis {
    pub key: String,
    pub values: Vec<String>,
}

/// Sets width and height at once.
pub const SIZE_KEY: &str = "size";

impl Axis {
    /// "key=v1,v2,…". Commas within brackets or quotes part nothing.
    pub fn parse(text: &str) -> Result<Axis> {
        Axis::parse_as("--sweep", text)
    }

    /// The same, as the argument `name` has it.
    pub fn parse_as(name: &str, text: &str) -> Result<Axis> {
        let wrong = |what: &str| {
            // A study compares pictures of one size.
            let or_size = if name == "--sweep" { " or size=800x600,1024x768" } else { "" };
            let expected = "expected KEY=VALUE,VALUE,… such as draw.cutoff=2,3,4";
            Error::usage(format!("{name} {text}: {what}; {expected}{or_size}"))
        };
        let (key, list) = text.split_once('=').ok_or_else(|| wrong("no `=`"))?;
        let values = split(list);
        if key.trim().is_empty() || values.iter().any(String::is_empty) {
            return Err(wrong(if key.trim().is_empty() { "no key" } else { "an empty value" }));
        }
        if let Some((_, twice)) = values.iter().enumerate().find(|(i, v)| values[..*i].contains(v))
        {
            return Err(wrong(&format!("{twice} twice")));
        }
        Ok(Axis { key: key.trim().to_owned(), values })
    }
}

/// A point's settings as `--set` would have them.
pub fn overrides(point: &[Setting]) -> Result<Vec<String>> {
    let mut all = Vec::new();
    for Setting { key, value } in point {
        if key != SIZE_KEY {
            all.push(format!("{key}={value}"));
            continue;
        }
        let sides =
            value.split_once('x').filter(|(w, h)| [w, h].iter().all(|n| n.parse::<u32>().is_ok()));
        let (width, height) = sides.ok_or_else(|| {
            Error::usage(format!(
                "--sweep size: expected WIDTHxHEIGHT such as 800x600, found \"{value}\""
            ))
        })?;
        all.extend([format!("film.width={width}"), format!("film.height={height}")]);
    }
    Ok(all)
}

/// Every point of the sweep, the last axis varying fastest; one point without settings where there
/// is no axis.
pub fn points(axes: &[Axis]) -> Vec<Vec<Setting>> {
    let mut points = vec![vec![]];
    for axis in axes {
        let with = |point: &Vec<Setting>| {
            let point = point.clone();
            axis.values.iter().map(move |value| {
                let setting = Setting { key: axis.key.clone(), value: value.clone() };
                [&point[..], &[setting]].concat()
            })
        };
        points = points.iter().flat_map(with).collect();
    }
    points
}

/// A case for each phase of `loaded`, which is the scene at `sweep`. `n_frames`: in place of those
/// of scene and phases. A phase, or point of a sweep, that says `threads.mode` is run in that loop
/// and no other; where `saved` frames that skip nothing are timed as well.
pub fn cases(
    loaded: LoadedScene,
    sweep: &[Setting],
    modes: &[Threading],
    n_frames: Option<u32>,
    [skip, saved]: [bool; 2],
) -> Vec<Case> {
    let loops = |scene: &Scene, own: bool| {
        let modes = if own { vec![scene.threads.mode] } else { modes.to_vec() };
        let mut loops: Vec<Loop> =
            modes.iter().map(|&threading| Loop { threading, skip }).collect();
        if skip && saved {
            // Of the first one's kind, so that nothing but skipping differs.
            loops.push(Loop { skip: false, ..loops[0] });
        }
        loops
    };
    let swept = sweep.iter().any(|s| s.key == "threads.mode");
    let LoadedScene { scene, phases, hash: scene_hash, .. } = loaded;
    if phases.is_empty() {
        let (n_frames, loops) = (n_frames.unwrap_or(scene.time.n_frames), loops(&scene, swept));
        return vec![Case {
            phase: None,
            sweep: sweep.to_vec(),
            scene: scene.into(),
            scene_hash,
            i_first: 0,
            n_frames,
            loops,
        }];
    }
    let mut i_first = 0u32;
    let of_phase = |phase: Phase| {
        let n_frames = n_frames.unwrap_or(phase.n_frames);
        let loops = loops(&phase.scene, swept || phase.sets_mode);
        let case = Case {
            phase: Some(phase.name),
            sweep: sweep.to_vec(),
            scene: phase.scene.into(),
            i_first,
            n_frames,
            scene_hash: scene_hash.clone(),
            loops,
        };
        // The frames of all phases together fit.
        i_first = i_first.saturating_add(phase.n_frames);
        case
    };
    phases.into_iter().map(of_phase).collect()
}

/// Parts of a list between its commas, trimmed.
fn split(list: &str) -> Vec<String> {
    let (mut parts, mut depth, mut quote) = (vec![String::new()], 0u32, None);
    for c in list.chars() {
        match (c, quote) {
            (',', None) if depth == 0 => {
                parts.push(String::new());
                continue;
            }
            (c, Some(open)) if c == open => quote = None,
            ('"' | '\'', None) => quote = Some(c),
            ('[' | '{', None) => depth += 1,
            (']' | '}', None) => depth = depth.saturating_sub(1),
            _ => {}
        }
        if let Some(last) = parts.last_mut() {
            last.push(c);
        }
    }
    parts.into_iter().map(|part| part.trim().to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_is_a_key_and_values() {
        let axis = |text: &str| Axis::parse(text).map(|a| (a.key, a.values.join("|")));
        let is = |key: &str, values: &str| Ok((key.to_owned(), values.to_owned()));
        assert_eq!(axis("draw.cutoff=2, 3"), is("draw.cutoff", "2|3"));
        assert_eq!(axis("size=800x600,1024x768"), is("size", "800x600|1024x768"));
        assert_eq!(axis("cloud.0.wind=[1,0,0],[2,0,0]"), is("cloud.0.wind", "[1,0,0]|[2,0,0]"));
        assert_eq!(axis("title='a,b',\"c]\""), is("title", "'a,b'|\"c]\""));
        for (wrong, what) in
            [("a", "no `=`"), ("=1", "no key"), ("a=1,", "an empty value"), ("a=1,1", "1 twice")]
        {
            assert!(axis(wrong).unwrap_err().to_string().contains(what), "{wrong}");
        }
    }

    #[test]
    fn points_are_all_combinations() {
        let axes = ["a=1,2", "size=3x4,5x6,7x8"].map(|t| Axis::parse(t).unwrap());
        let all = points(&axes);
        assert_eq!((all.len(), points(&[]).len()), (6, 1));
        assert_eq!(sweep_text(&all[1]), "a=1, size=5x6");
        assert_eq!(overrides(&all[1]).unwrap(), ["a=1", "film.width=5", "film.height=6"]);
        let wrong = Setting { key: SIZE_KEY.to_owned(), value: "8".to_owned() };
        assert!(overrides(&[wrong]).unwrap_err().to_string().contains("found \"8\""));
    }
}
