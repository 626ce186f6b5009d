//! Which configurations a study has: each knob's values alone, all combinations, or what was worth
//! it put together.

use super::front::Metric;
use super::records::Configuration;
use crate::timing::names::Setting;
use crate::timing::names::sweep_text;
use crate::timing::sweep::{Axis, points};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Design {
    /// Each value of each knob, all others as they stand; then those that save time one on top of
    /// the other.
    Alone,
    /// All combinations.
    Grid,
}

/// What the scene as it stands is called.
pub const BASE: &str = "as it stands";

/// What does not surely save this share of the time is not put together with others: of thirty
/// settings that save nothing one in forty has an interval below 1 by chance, but hardly by so
/// much.
const LEAST_SAVING: f64 = 0.02;

/// "key=value, key=value".
pub fn name_of(settings: &[Setting]) -> String {
    if settings.is_empty() { BASE.to_owned() } else { sweep_text(settings) }
}

/// The settings of all configurations but the scene as it stands; some may come to the same as it.
pub fn settings(axes: &[Axis], design: Design) -> Vec<Vec<Setting>> {
    match design {
        Design::Grid => points(axes).into_iter().filter(|point| !point.is_empty()).collect(),
        Design::Alone => {
            let alone = |axis: &Axis| {
                let key = axis.key.clone();
                axis.values
                    .clone()
                    .into_iter()
                    .map(move |value| vec![Setting { key: key.clone(), value }])
            };
            axes.iter().flat_map(alone).collect()
        }
    }
}

/// Single settings that save time, put together: first the one that costs the least error for what
/// it saves, then the next on top of it. Where two are of one key the later one stands in place of
/// the earlier, if it saves more. Squares of errors are taken to add up: what one setting errs
/// knows nothing of what another does.
pub fn together(found: &[Configuration], metric: Metric) -> Vec<Vec<Setting>> {
    let Some(base) = found.first().and_then(|base| metric.of(base)) else { return Vec::new() };
    let least = base.value.powi(2);
    let mut worth: Vec<(f64, f64, &Setting)> = Vec::new();
    for configuration in &found[1..] {
        let ([setting], Some(ratio), Some(error)) =
            (&configuration.settings[..], configuration.by_base, metric.of(configuration))
        else {
            continue;
        };
        if ratio.high.is_some_and(|high| high < 1.0 - LEAST_SAVING) && error.value.is_finite() {
            let added = (error.value.powi(2) - least).max(0.0);
            worth.push((added / (1.0 - ratio.value), ratio.value, setting));
        }
    }
    worth.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut taken, mut all): (Vec<(f64, Setting)>, Vec<Vec<Setting>>) = (Vec::new(), Vec::new());
    for (_, ratio, setting) in worth {
        match taken.iter_mut().find(|(_, t)| t.key == setting.key) {
            Some((before, _)) if *before <= ratio => continue,
            Some(place) => *place = (ratio, setting.clone()),
            None => taken.push((ratio, setting.clone())),
        }
        if taken.len() > 1 {
            all.push(taken.iter().map(|(_, setting)| setting.clone()).collect());
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::super::records::{Front, PictureError};
    use super::*;
    use crate::studies::provenance::Figure;

    fn setting(text: &str) -> Setting {
        let (key, value) = text.split_once('=').unwrap();
        Setting { key: key.to_owned(), value: value.to_owned() }
    }

    /// A setting whose time is `ratio` of the scene's, surely so, with RMSE `error`.
    fn found(text: &str, ratio: f64, error: f64) -> Configuration {
        let figure = |value: f64, spread: f64| Figure {
            value,
            low: Some(value - spread),
            high: Some(value + spread),
        };
        let settings: Vec<Setting> = if text.is_empty() { vec![] } else { vec![setting(text)] };
        Configuration {
            name: name_of(&settings),
            settings,
            hash: String::new(),
            gpu_ms: None,
            frame_ms: None,
            by_base: Some(figure(ratio, 0.05)),
            n_turns: 8,
            error: Some(PictureError {
                rmse: figure(error, 0.0),
                max: error,
                relmse: error,
                is_resolved: true,
            }),
            front: Front::Unknown,
            failure: None,
            picture: None,
            error_map: None,
        }
    }

    #[test]
    fn alone_or_all_combinations() {
        let axes = ["a=1,2", "b=3,4,5"].map(|text| Axis::parse("--knob", text).unwrap());
        let alone: Vec<String> =
            settings(&axes, Design::Alone).iter().map(|s| name_of(s)).collect();
        assert_eq!(alone, ["a=1", "a=2", "b=3", "b=4", "b=5"]);
        assert_eq!(settings(&axes, Design::Grid).len(), 6);
        assert!(settings(&[], Design::Grid).is_empty() && settings(&[], Design::Alone).is_empty());
        assert_eq!(name_of(&[]), "as it stands");
    }

    #[test]
    fn what_costs_least_for_what_it_saves_comes_first() {
        // Added squares by saved shares: a 3e-4/0.4, b=1 0/0.1, b=2 8e-4/0.5; c is not surely
        // faster, d is slower.
        let all = [
            found("", 1.0, 0.1),
            found("a=1", 0.6, (0.01f64 + 3e-4).sqrt()),
            found("b=1", 0.9, 0.1),
            found("b=2", 0.5, (0.01f64 + 8e-4).sqrt()),
            found("c=1", 0.97, 0.1),
            found("d=1", 1.5, 0.01),
        ];
        let names: Vec<String> = together(&all, Metric::Rmse).iter().map(|s| name_of(s)).collect();
        assert_eq!(names, ["b=1, a=1", "b=2, a=1"]);
        // What saves less than the same knob's other value already taken is left out.
        let all = [
            found("", 1.0, 0.1),
            found("b=2", 0.5, 0.1),
            found("b=1", 0.9, 0.2),
            found("a=1", 0.5, 0.3),
        ];
        let names: Vec<String> = together(&all, Metric::Rmse).iter().map(|s| name_of(s)).collect();
        assert_eq!(names, ["b=2, a=1"]);
        assert!(
            together(&all[..2], Metric::Rmse).is_empty() && together(&[], Metric::Rmse).is_empty()
        );
    }
}
