//! The configurations of a study: each value of each knob alone, or all combinations; then the
//! worthwhile values combined. And the best configuration for a budget.

use super::blocks::TimeKind;
use super::front::Metric;
use super::records::{Best, Budget, Configuration};
use crate::measure::figure::Figure;
use crate::timing::names::Setting;
use crate::timing::sweep::{Axis, points};

/// How the values of knobs are combined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Design {
    /// Each value of each knob with all others as they stand; then those that save time, one on top
    /// of the other.
    Alone,
    /// All combinations.
    Grid,
}

/// Least share of the time that a setting must surely save to be combined with others. By chance
/// one in forty settings that save nothing has an interval below 1, but hardly by this much.
const LEAST_SAVING: f64 = 0.02;

/// Returns the settings of all configurations but the unchanged scene; some can result in the
/// same scene as it.
pub fn settings(axes: &[Axis], design: Design) -> Vec<Vec<Setting>> {
    match design {
        Design::Grid => points(axes).into_iter().filter(|point| !point.is_empty()).collect(),
        Design::Alone => axes.iter().flat_map(|axis| points(std::slice::from_ref(axis))).collect(),
    }
}

/// Returns combinations of the single settings that save time: first the one with the least added
/// error for the time that it saves, then the next on top of it, and so on.
///
/// If two settings have the same key, the later one replaces the earlier if it saves more. Squared
/// errors are assumed to add up, because the errors of different settings are independent.
pub fn combinations(measured: &[Configuration], metric: Metric) -> Vec<Vec<Setting>> {
    let error = |c: &Configuration| Some(metric.of(&c.error?)?.value);
    let Some(base) = measured.first().and_then(error) else { return Vec::new() };
    let mut worth: Vec<(f64, f64, &Setting)> = Vec::new();
    for c in &measured[1..] {
        let ([setting], Some(ratio), Some(error)) = (&c.settings[..], c.by_base, error(c)) else {
            continue;
        };
        if ratio.high.is_some_and(|high| high < 1.0 - LEAST_SAVING) && error.is_finite() {
            let added = (error.powi(2) - base.powi(2)).max(0.0);
            worth.push((added / (1.0 - ratio.value), ratio.value, setting));
        }
    }
    worth.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut taken, mut all): (Vec<(f64, &Setting)>, Vec<Vec<Setting>>) = (Vec::new(), Vec::new());
    for (_, ratio, setting) in worth {
        match taken.iter_mut().find(|(_, t)| t.key == setting.key) {
            Some((before, _)) if *before <= ratio => continue,
            Some(place) => *place = (ratio, setting),
            None => taken.push((ratio, setting)),
        }
        if taken.len() > 1 {
            all.push(taken.iter().map(|(_, setting)| (*setting).clone()).collect());
        }
    }
    all
}

/// Returns the configuration with the least error within a time of `value` ms, or the least time
/// within an error of `value`; of equal ones the better in the other quantity.
pub fn best_within(
    configurations: &[Configuration],
    metric: Metric,
    time: TimeKind,
    budget: Budget,
    value: f64,
) -> Best {
    let limited_and_free = |c: &Configuration| {
        let figures = [c.ms(time)?, metric.of(&c.error?)?].map(|f: Figure| f.value);
        Some(if budget == Budget::Ms { figures } else { [figures[1], figures[0]] })
    };
    let all = configurations.iter().enumerate();
    let within = all.filter_map(|(i, c)| Some((i, limited_and_free(c)?)));
    let best = within
        .filter(|(_, [limited, _])| *limited <= value)
        .min_by(|(_, a), (_, b)| a[1].total_cmp(&b[1]).then(a[0].total_cmp(&b[0])));
    Best { budget, value, configuration: best.map(|(i, _)| i) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::error::records::name_of;
    use crate::studies::picture_error::PictureError;

    fn setting(text: &str) -> Setting {
        let (key, value) = text.split_once('=').unwrap();
        Setting { key: key.to_owned(), value: value.to_owned() }
    }

    /// A setting that surely takes `ratio` of the scene's time, with RMSE `error`.
    fn measured(text: &str, ratio: f64, error: f64) -> Configuration {
        let figure = |value: f64, spread: f64| Figure {
            value,
            low: Some(value - spread),
            high: Some(value + spread),
        };
        let settings: Vec<Setting> = if text.is_empty() { vec![] } else { vec![setting(text)] };
        let error = PictureError {
            rmse: figure(error, 0.0),
            max: error,
            relmse: error,
            is_resolved: true,
            cloud: None,
        };
        Configuration {
            by_base: Some(figure(ratio, 0.05)),
            error: Some(error),
            ..Configuration::new(settings, String::new())
        }
    }

    #[test]
    fn settings_are_each_value_alone_or_all_combinations() {
        let axes = ["a=1,2", "b=3,4,5"].map(|text| Axis::parse("--knob", text).unwrap());
        let alone: Vec<String> =
            settings(&axes, Design::Alone).iter().map(|s| name_of(s)).collect();
        assert_eq!(alone, ["a=1", "a=2", "b=3", "b=4", "b=5"]);
        assert_eq!(settings(&axes, Design::Grid).len(), 6);
        assert!(settings(&[], Design::Grid).is_empty() && settings(&[], Design::Alone).is_empty());
        assert_eq!(name_of(&[]), "as it stands");
    }

    #[test]
    fn the_setting_with_the_least_error_for_its_saving_comes_first() {
        // Added squares by saved shares: a 3e-4/0.4, b=1 0/0.1, b=2 8e-4/0.5; c is not surely
        // faster, d is slower.
        let all = [
            measured("", 1.0, 0.1),
            measured("a=1", 0.6, (0.01f64 + 3e-4).sqrt()),
            measured("b=1", 0.9, 0.1),
            measured("b=2", 0.5, (0.01f64 + 8e-4).sqrt()),
            measured("c=1", 0.97, 0.1),
            measured("d=1", 1.5, 0.01),
        ];
        let names: Vec<String> =
            combinations(&all, Metric::Rmse).iter().map(|s| name_of(s)).collect();
        assert_eq!(names, ["b=1, a=1", "b=2, a=1"]);
        // A value that saves less than another value of its knob that was taken is left out.
        let all = [
            measured("", 1.0, 0.1),
            measured("b=2", 0.5, 0.1),
            measured("b=1", 0.9, 0.2),
            measured("a=1", 0.5, 0.3),
        ];
        let names: Vec<String> =
            combinations(&all, Metric::Rmse).iter().map(|s| name_of(s)).collect();
        assert_eq!(names, ["b=2, a=1"]);
        assert!(
            combinations(&all[..2], Metric::Rmse).is_empty()
                && combinations(&[], Metric::Rmse).is_empty()
        );
    }
}
